//! Pairs to learn from, on disk or simulated.

use std::error::Error;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use wake_ldm::dataset::{self, Folder, Manifest, Pair, Recipe, Simulated};
use wake_ldm::network::WakeModelConfig;

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
            let mut recipe = options.recipe()?;
            recipe.scene.grid.rows = config.image_size;
            recipe.scene.grid.columns = config.image_size;
            recipe.grey = config.grey;
            return Self::simulated(recipe, options.seed, options.count);
        };
        let folder = folder(path)?;
        let (found, grey) = (folder.manifest().grey, config.grey);
        if found != grey {
            return Err(format!(
                "--data {}: grey is {found:?}, but the model's is {grey:?}; make the set with the recipe's grey, or train \
                 another model in another --out",
                path.display()
            )
            .into());
        }
        for (number, scene) in folder.scenes().enumerate() {
            let told = |error| format!("--data {}: pair {number}: {error}", path.display());
            config.check_scene(scene).map_err(told)?;
        }
        Ok(Self::of(folder))
    }

    /// Pairs that any model can learn from: those of a folder, or simulated ones of a recipe.
    pub(crate) fn any(
        data: Option<&Path>,
        recipe: Recipe,
        seed: u64,
        count: u64,
    ) -> Result<Self, Box<dyn Error>> {
        match data {
            Some(path) => Ok(Self::of(folder(path)?)),
            None => Self::simulated(recipe, seed, count),
        }
    }

    fn simulated(recipe: Recipe, seed: u64, count: u64) -> Result<Self, Box<dyn Error>> {
        Ok(Self {
            set: Manifest::new(recipe.clone(), seed, count)?,
            pairs: Arc::new(Simulated::new(recipe, seed)?),
            count,
        })
    }

    fn of(folder: Folder) -> Self {
        Self {
            count: folder.len(),
            set: folder.manifest().clone(),
            pairs: Arc::new(folder),
        }
    }

    /// The first pairs, to be shown.
    pub(crate) fn first(&self, count: u64) -> wake_ldm::Result<Vec<Pair>> {
        self.items(0..self.count.min(count))
    }

    /// The pairs at some positions.
    pub(crate) fn items(&self, positions: Range<u64>) -> wake_ldm::Result<Vec<Pair>> {
        self.pairs.items(positions)
    }

    /// Where they come from.
    pub(crate) fn pairs(&self) -> &dyn dataset::Source {
        self.pairs.as_ref()
    }

    /// Number of pairs.
    pub(crate) fn len(&self) -> u64 {
        self.count
    }

    /// What the pairs are, as a run notes it.
    pub(crate) fn identity(&self) -> Value {
        json!({"set": self.set, "shard": self.set.shard})
    }
}

/// A folder with pairs in it.
fn folder(path: &Path) -> Result<Folder, Box<dyn Error>> {
    let folder = Folder::open(path)?;
    match folder.is_empty() {
        true => Err(format!("--data {}: no pair to learn from", path.display()).into()),
        false => Ok(folder),
    }
}
