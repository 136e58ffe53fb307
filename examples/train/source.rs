//! Pairs to learn from, on disk or simulated.

use std::error::Error;

use serde_json::{Value, json};
use wake_ldm::dataset::{Folder, Manifest, Pair, Recipe, Simulated};
use wake_ldm::network::WakeModelConfig;
use wake_physics::Scene;

use super::options::Options;

pub(crate) enum Source {
    Disk(Folder),
    Endless(Simulated, u64),
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
            let simulated = Simulated::new(recipe, options.seed)?;
            return Ok(Self::Endless(simulated, options.count));
        };
        let folder = Folder::open(path)?;
        if folder.is_empty() {
            return Err(format!("--data {}: no pair to learn from", path.display()).into());
        }
        for (number, scene) in folder.scenes().enumerate() {
            let told = |error| format!("--data {}: pair {number}: {error}", path.display());
            config.check_scene(scene).map_err(told)?;
        }
        Ok(Self::Disk(folder))
    }

    pub(crate) fn pair(&self, index: u64) -> wake_ldm::Result<Pair> {
        match self {
            Self::Disk(folder) => folder.pair(index),
            Self::Endless(simulated, _) => simulated.pair(index),
        }
    }

    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Disk(folder) => folder.len(),
            Self::Endless(_, count) => *count,
        }
    }

    /// What the pairs are, as a run notes it.
    pub(crate) fn identity(&self) -> wake_ldm::Result<Value> {
        Ok(match self {
            Self::Disk(folder) => {
                json!({"set": folder.manifest(), "shard": folder.manifest().shard})
            }
            Self::Endless(simulated, count) => {
                let set = Manifest::new(simulated.recipe().clone(), simulated.seed(), *count)?;
                json!({"set": set, "shard": null})
            }
        })
    }
}
