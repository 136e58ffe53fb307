//! Simulated images with an increased share of clear wakes.

use std::ops::Range;

use rayon::prelude::*;
use wake_dataset::{Pair, Simulated, Source};
use wake_physics::labels_of;

use super::sample::wakes;

/// Number of candidate scenes per position; at every other position the first one with a clear wake is simulated.
const OF: u64 = 4;
/// Least signal-to-noise ratio of a clear wake's line.
const CLEAR: f32 = 8.0;

/// Images of a recipe; at even positions the first of four scenes that shows a clear wake.
#[derive(Debug)]
pub(crate) struct Clear {
    simulated: Simulated,
}

impl Clear {
    pub(crate) fn new(simulated: Simulated) -> Self {
        Self { simulated }
    }

    /// Whether a scene shows a clear wake, by its labels, which need no simulated image.
    fn is_clear(&self, index: u64) -> wake_dataset::Result<bool> {
        let scene = self.simulated.scene(index)?;
        let seen = wakes(&labels_of(&scene).objects(), &scene);
        Ok(seen.iter().any(|wake| wake.snr >= CLEAR))
    }

    /// Number of the scene at a position.
    fn chosen(&self, position: u64) -> wake_dataset::Result<u64> {
        let candidates = position * OF..(position + 1) * OF;
        if position.is_multiple_of(2) {
            for index in candidates.clone() {
                if self.is_clear(index)? {
                    return Ok(index);
                }
            }
        }
        Ok(candidates.start)
    }
}

impl Source for Clear {
    fn size(&self) -> [usize; 2] {
        self.simulated.size()
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let pair = |position| self.simulated.pair(self.chosen(position)?);
        positions.into_par_iter().map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_dataset::Recipe;

    /// At even positions a scene with a clear wake is chosen if one of the candidates has it, at odd ones the first candidate.
    #[test]
    fn clear_wakes_are_chosen() {
        let changes = ["scene.grid.rows = 96", "scene.grid.columns = 96"];
        let recipe = Recipe::detector().and_then(|recipe| recipe.with_assignments(&changes));
        let source = Clear::new(Simulated::new(recipe.expect("a recipe"), 5).expect("a source"));
        let clear = |index| source.is_clear(index).expect("a scene");
        let (mut chosen, mut first) = (0, 0);
        for position in 0..40 {
            let index = source.chosen(position).expect("a scene");
            let of = position * OF..(position + 1) * OF;
            if !position.is_multiple_of(2) {
                assert_eq!(index, of.start);
                continue;
            }
            let any = of.clone().any(clear);
            assert_eq!(clear(index), any);
            chosen += usize::from(any);
            first += usize::from(clear(of.start));
        }
        assert!(chosen > first, "{chosen} {first}");
        // Images are those of the chosen scenes.
        let pairs = source.items(0..2).expect("pairs");
        let [even, odd] = [0, 1].map(|position| source.chosen(position).expect("a scene"));
        assert_eq!(pairs[0], source.simulated.pair(even).expect("a pair"));
        assert_eq!(pairs[1], source.simulated.pair(odd).expect("a pair"));
    }
}
