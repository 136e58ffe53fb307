//! Pairs to learn from, on disk or simulated.

use std::path::Path;

use wake_dataset::{Folder, Recipe};
use wake_ldm::network::WakeModelConfig;
use wake_physics::available_memory;
use wake_train::TrainingPairs;

use super::wake_model::Options;
use crate::exit::Outcome;

/// The pairs of --data, or those of --recipe.
pub(crate) fn pairs(options: &Options) -> Outcome<TrainingPairs> {
    if let Some(path) = &options.data {
        return Ok(TrainingPairs::folder(folder(path)?));
    }
    let recipe = Recipe::named_or_read(&options.recipe)?;
    Ok(TrainingPairs::simulated(
        recipe,
        options.place.seed,
        options.count,
    )?)
}

/// The same for a model: of --data every scene must fit it, and what is simulated has its size and grey.
pub(crate) fn fitting(options: &Options, config: &WakeModelConfig) -> Outcome<TrainingPairs> {
    let Some(path) = &options.data else {
        let mut recipe = Recipe::named_or_read(&options.recipe)?;
        recipe.scene.grid.rows = config.image_size;
        recipe.scene.grid.columns = config.image_size;
        recipe.grey = config.grey;
        let (seed, count) = (options.place.seed, options.count);
        return Ok(TrainingPairs::simulated(recipe, seed, count)?);
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
    Ok(TrainingPairs::folder(folder))
}

/// A folder with pairs in it.
pub(crate) fn folder(path: &Path) -> Outcome<Folder> {
    let folder = Folder::open(path)?;
    match folder.is_empty() {
        true => Err(format!("--data {}: no pair to learn from", path.display()).into()),
        false => Ok(folder),
    }
}

/// Refuses pairs that do not fit in memory.
pub(crate) fn check_memory(count: u64, needed: u64) -> Outcome<()> {
    let Some(free) = available_memory().filter(|&free| free < needed) else {
        return Ok(());
    };
    let [needed, free] = [needed, free].map(|bytes| bytes as f64 / (1u64 << 30) as f64);
    Err(format!(
        "{count} pairs need {needed:.1} GiB of memory, but {free:.1} GiB are free; lower --count, or take a \
         smaller --data"
    )
    .into())
}
