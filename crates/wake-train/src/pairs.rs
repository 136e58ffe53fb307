//! Training pairs, on disk or simulated.

use std::ops::Range;

use serde_json::{Value, json};
use wake_physics::Scene;

use crate::error::Result;
use wake_dataset::{Folder, Manifest, Pair, Recipe, Simulated, Source};
use wake_ldm::conditioning::Vocabulary;
use wake_ldm::network::{TrainingRanges, WakeModelConfig};

/// A number of pairs of a source, and their identity for the record of a run.
#[derive(Debug)]
pub struct TrainingPairs {
    pairs: Pairs,
    set: Manifest,
    count: u64,
}

#[derive(Debug)]
enum Pairs {
    Folder(Box<Folder>),
    Simulated(Box<Simulated>),
}

impl TrainingPairs {
    /// All pairs of a folder.
    #[must_use]
    pub fn folder(folder: Folder) -> Self {
        Self {
            count: folder.len(),
            set: folder.manifest().clone(),
            pairs: Pairs::Folder(Box::new(folder)),
        }
    }

    /// The first `count` pairs of a recipe and a seed, simulated on demand.
    ///
    /// # Errors
    ///
    /// As [`Recipe::validate`].
    pub fn simulated(recipe: Recipe, seed: u64, count: u64) -> Result<Self> {
        Ok(Self {
            set: Manifest::new(recipe.clone(), seed, count)?,
            pairs: Pairs::Simulated(Box::new(Simulated::new(recipe, seed)?)),
            count,
        })
    }

    /// Source of the pairs.
    pub fn source(&self) -> &dyn Source {
        match &self.pairs {
            Pairs::Folder(folder) => folder.as_ref(),
            Pairs::Simulated(simulated) => simulated.as_ref(),
        }
    }

    /// The pairs at some positions.
    ///
    /// # Errors
    ///
    /// As [`Source::items`].
    pub fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        Ok(self.source().items(positions)?)
    }

    /// The first pairs, `count` of them or fewer.
    ///
    /// # Errors
    ///
    /// As [`Source::items`].
    pub fn first(&self, count: u64) -> Result<Vec<Pair>> {
        self.items(0..self.count.min(count))
    }

    /// Number of pairs.
    pub fn len(&self) -> u64 {
        self.count
    }

    /// Whether there are no pairs.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Identity of the pairs, for the record of a run.
    #[must_use]
    pub fn identity(&self) -> Value {
        json!({"set": self.set, "shard": self.set.shard})
    }

    /// Configuration of a wake model of standard widths with the grey mapping, pixels and scene ranges of these pairs.
    ///
    /// # Errors
    ///
    /// As [`Simulated::scene`], [`TrainingRanges::of`] and [`Vocabulary::of_wordings`].
    pub fn model(&self) -> Result<WakeModelConfig> {
        let mut config = WakeModelConfig::standard(&Vocabulary::of_wordings()?);
        config.training_ranges = match &self.pairs {
            Pairs::Folder(folder) => TrainingRanges::of(folder.scenes())?,
            Pairs::Simulated(simulated) => {
                let scenes = (0..self.count).map(|index| simulated.scene(index));
                TrainingRanges::of(&scenes.collect::<wake_dataset::Result<Vec<Scene>>>()?)?
            }
        };
        config.scene = self.set.recipe.scene.clone();
        config.grey = self.set.recipe.grey;
        config.spacing = config.scene.grid.spacing;
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_has_the_pixels_and_the_grey_of_its_pairs() {
        let changes = ["scene.grid.spacing = 8.0", "grey.brightest_db = 4.0"];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        let pairs = TrainingPairs::simulated(recipe.clone(), 5, 3).unwrap();
        let model = pairs.model().unwrap();
        assert!((model.spacing - 8.0).abs() < 1e-12);
        assert_eq!(model.grey, recipe.grey);
        let simulated = Simulated::new(recipe, 5).unwrap();
        for number in 0..3 {
            let scene = simulated.scene(number).unwrap();
            model.training_ranges.check(&scene).unwrap();
        }
        assert_eq!(pairs.len(), 3);
        assert_eq!(pairs.identity()["set"]["seed"], 5);
    }
}
