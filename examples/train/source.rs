//! Pairs to learn from, on disk or simulated.

use std::error::Error;
use std::ops::Range;
use std::sync::Arc;

use serde_json::{Value, json};
use wake_ldm::dataset::{self, Folder, Manifest, Pair, Recipe, Simulated};
use wake_ldm::network::WakeModelConfig;
use wake_physics::Scene;

use super::options::Options;

/// The first `count` pairs of a source.
pub(crate) struct Source {
    pairs: Arc<dyn dataset::Source>,
    count: u64,
    set: Manifest,
}

impl Source {
    /// Pairs that a model can learn from: those of --data, of which every scene must fit it, or simulated ones.
    pub(crate) fn new(options: &Options, config: &WakeModelConfig) -> Result<Self, Box<dyn Error>> {
        let Some(path) = &options.data else {
            let mut recipe = Recipe::default();
            recipe.scene = Scene {
                model: recipe.scene.model,
                ..config.base_scene()
            };
            let set = Manifest::new(recipe.clone(), options.seed, options.count)?;
            return Ok(Self {
                pairs: Arc::new(Simulated::new(recipe, options.seed)?),
                count: options.count,
                set,
            });
        };
        let folder = Folder::open(path)?;
        if folder.is_empty() {
            return Err(format!("--data {}: no pair to learn from", path.display()).into());
        }
        for (number, scene) in folder.scenes().enumerate() {
            let told = |error| format!("--data {}: pair {number}: {error}", path.display());
            config.check_scene(scene).map_err(told)?;
        }
        Ok(Self {
            count: folder.len(),
            set: folder.manifest().clone(),
            pairs: Arc::new(folder),
        })
    }

    /// The pairs at some positions.
    pub(crate) fn items(&self, positions: Range<u64>) -> wake_ldm::Result<Vec<Pair>> {
        self.pairs.items(positions)
    }

    pub(crate) fn len(&self) -> u64 {
        self.count
    }

    /// What the pairs are, as a run notes it.
    pub(crate) fn identity(&self) -> Value {
        json!({"set": self.set, "shard": self.set.shard})
    }
}
