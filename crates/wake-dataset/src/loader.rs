//! Pairs batch by batch, made on other threads.

use super::ordered::Ordered;
use super::pair::Pair;
use super::source::Source;
use crate::error::Result;

/// Makes the batches of a source on other threads, in order: `Loader::new(source).batch(16).threads(4).on(&device)`.
///
/// Step s holds the pairs at s·b up to (s + 1)·b, the same ones whatever the number of threads and wherever the first
/// step is.
#[derive(Debug)]
pub struct Loader<S> {
    source: S,
    batch: usize,
    threads: usize,
    start: u64,
}

impl<S: Source> Loader<S> {
    /// Batches of 16 from the first pair on, made on one thread.
    pub fn new(source: S) -> Self {
        Self {
            source,
            batch: 16,
            threads: 1,
            start: 0,
        }
    }

    /// Pairs of a batch, at least one.
    #[must_use]
    pub fn batch(self, batch: usize) -> Self {
        Self {
            batch: batch.max(1),
            ..self
        }
    }

    /// Threads that make batches, each at a batch of its own.
    #[must_use]
    pub fn threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// The first step: how many batches an interrupted run has seen.
    #[must_use]
    pub fn start(self, step: u64) -> Self {
        Self {
            start: step,
            ..self
        }
    }

    /// Starts the threads; each batch comes as its pairs, without end, for loops that make their own tensors.
    ///
    /// # Errors
    ///
    /// As [`on`](Self::on); each batch those of [`Source::items`].
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

    /// Whatever the number of threads, a batch holds the pairs of its step.
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
