//! Two sources in turn.

use std::ops::Range;
use std::sync::Arc;

use wake_dataset::{Pair, Source};

/// Pairs of one source at even positions and of another, with images of the same size, at odd ones.
#[derive(Debug)]
pub(super) struct InTurn {
    even: Arc<dyn Source>,
    odd: Arc<dyn Source>,
}

impl InTurn {
    pub(super) fn new(even: Arc<dyn Source>, odd: Arc<dyn Source>) -> Self {
        Self { even, odd }
    }
}

impl Source for InTurn {
    fn size(&self) -> [usize; 2] {
        self.even.size()
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let Range { start, end } = positions;
        let mut even = self
            .even
            .items(start.div_ceil(2)..end.div_ceil(2))?
            .into_iter();
        let mut odd = self.odd.items(start / 2..end / 2)?.into_iter();
        let next = |position: u64| match position.is_multiple_of(2) {
            true => even.next(),
            false => odd.next(),
        };
        Ok((start..end).filter_map(next).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Painted;

    /// Wherever a batch begins and ends.
    #[test]
    fn pairs_are_those_of_both_sources() {
        let of = |seed| Painted { seed, size: 32 };
        let [a, b] = [1, 2].map(|seed| of(seed).items(0..4).unwrap());
        let both = InTurn::new(Arc::new(of(1)), Arc::new(of(2)));
        let all: Vec<Pair> = (0..4).flat_map(|n| [a[n].clone(), b[n].clone()]).collect();
        for (start, end) in [(0, 8), (0, 1), (1, 2), (1, 6), (2, 7), (3, 3)] {
            let expected = &all[start as usize..end as usize];
            assert_eq!(both.items(start..end).unwrap(), expected, "{start} {end}");
        }
    }
}
