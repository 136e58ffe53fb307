//! Batches of pairs, made on other threads.

use super::ordered::Ordered;
use super::pair::Pair;
use super::source::Source;
use crate::error::Result;

/// Makes batches of a source on other threads, in order: `Loader::new(source).batch(16).threads(4).on(&device)`.
///
/// With batches of b pairs, step s holds the pairs from s·b to below (s + 1)·b, whatever the number of threads and the first
/// step.
#[derive(Debug)]
pub struct Loader<S> {
    source: S,
    batch: usize,
    threads: usize,
    start: u64,
}

impl<S: Source> Loader<S> {
    /// Batches of 16 from the first pair, made on one thread.
    pub fn new(source: S) -> Self {
        Self {
            source,
            batch: 16,
            threads: 1,
            start: 0,
        }
    }

    /// Sets the number of pairs per batch, at least one.
    #[must_use]
    pub fn batch(self, batch: usize) -> Self {
        Self {
            batch: batch.max(1),
            ..self
        }
    }

    /// Sets the number of threads; each makes a batch of its own.
    #[must_use]
    pub fn threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// Sets the first step: the number of batches that an interrupted run has used.
    #[must_use]
    pub fn start(self, step: u64) -> Self {
        Self {
            start: step,
            ..self
        }
    }

    /// Starts the threads and returns endless batches of pairs, for training loops that make their own tensors.
    ///
    /// # Errors
    ///
    /// As [`on`](Self::on); for each batch, the errors of [`Source::items`].
    pub fn pairs(self) -> Result<impl Iterator<Item = Result<Vec<Pair>>>> {
        self.ordered()
    }

    pub(super) fn ordered(self) -> Result<Ordered<Vec<Pair>>> {
        let (source, batch) = (self.source, self.batch as u64);
        let steps = self.start..u64::MAX / batch;
        Ordered::new(steps, self.threads, move |step| {
            source.items(step * batch..(step + 1) * batch)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Recipe, Simulated};

    /// A batch holds the pairs of its step, whatever the number of threads.
    #[test]
    fn pairs_come_in_order_from_any_step() {
        let size = ["scene.grid.rows = 16", "scene.grid.columns = 16"];
        let recipe = Recipe::default().with_assignments(&size).unwrap();
        let source = Simulated::new(recipe, 5).unwrap();
        let expected = source.items(2..6).unwrap();
        for threads in [1, 3] {
            let loader = Loader::new(source.clone()).batch(2).threads(threads);
            let batches = loader.start(1).pairs().unwrap().take(2);
            let pairs: Vec<Vec<Pair>> = batches.map(Result::unwrap).collect();
            assert_eq!(pairs.concat(), expected);
        }
    }
}
