//! The first images of a source, repeated.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use wake_dataset::{Pair, Source};

/// Source whose first pairs are made once, kept in memory and repeated endlessly.
#[derive(Debug)]
pub struct Repeated {
    source: Arc<dyn Source>,
    kept: Vec<OnceLock<Pair>>,
}

impl Repeated {
    /// The first `count` pairs, at least one.
    #[must_use]
    pub fn new(source: Arc<dyn Source>, count: usize) -> Self {
        let kept = (0..count.max(1)).map(|_| OnceLock::new()).collect();
        Self { source, kept }
    }
}

impl Source for Repeated {
    fn size(&self) -> [usize; 2] {
        self.source.size()
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let count = self.kept.len() as u64;
        let wanted: Vec<u64> = positions.map(|p| p % count).collect();
        let mut missing = wanted
            .iter()
            .filter(|&&p| self.kept[p as usize].get().is_none());
        if let Some(&first) = missing.next() {
            // Makes the missing pairs of a batch at once; those wrapped around to the start usually exist by then.
            let last = missing
                .copied()
                .filter(|&p| p > first)
                .max()
                .unwrap_or(first);
            for (pair, place) in self.source.items(first..last + 1)?.into_iter().zip(first..) {
                // Ignored if another thread has made the same pair.
                let _ = self.kept[place as usize].set(pair);
            }
        }
        let pair = |p: u64| match self.kept[p as usize].get() {
            Some(pair) => Ok(pair.clone()),
            None => Ok(self.source.items(p..p + 1)?.remove(0)),
        };
        wanted.into_iter().map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Painted;

    /// In any order, and across the end.
    #[test]
    fn pairs_are_those_of_the_source_and_come_again() {
        let source = Painted { seed: 3, size: 32 };
        let first = source.items(0..5).unwrap();
        let repeated = Repeated::new(Arc::new(source), 5);
        let expected: Vec<Pair> = [3, 4, 0, 1].map(|p: usize| first[p].clone()).to_vec();
        assert_eq!(repeated.items(3..7).unwrap(), expected);
        assert_eq!(repeated.items(10..15).unwrap(), first);
    }
}
