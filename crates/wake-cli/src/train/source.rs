//! Training pairs, on disk or simulated.

use std::path::{Path, PathBuf};

use clap::Args;
use wake_dataset::{Folder, Recipe};
use wake_ldm::network::WakeModelConfig;
use wake_physics::available_memory;
use wake_physics::grey::{GreyScale, Mapping};
use wake_train::TrainingPairs;

use crate::exit::Outcome;

/// Source of training pairs.
#[derive(Args, Clone)]
pub(crate) struct Pairs {
    /// Folder of a data set of `wake dataset` [default: simulate pairs first]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Recipe of the pairs to simulate without --data: paper, ranges, satellites, detector, model, or a file
    #[arg(long, default_value = "model", conflicts_with = "data")]
    recipe: String,
    /// Number of pairs to simulate without --data
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(8..=10_000_000))]
    count: u64,
}

impl Pairs {
    /// The pairs of --data, or simulated pairs of --recipe.
    pub(crate) fn of(&self, seed: u64) -> Outcome<TrainingPairs> {
        match &self.data {
            Some(path) => Ok(TrainingPairs::folder(folder(path)?)),
            None => {
                let recipe = Recipe::named_or_read(&self.recipe)?;
                Ok(TrainingPairs::simulated(recipe, seed, self.count)?)
            }
        }
    }

    /// The pairs for a model: every scene of --data must fit it; simulated pairs get its size and grey.
    pub(crate) fn fitting(&self, config: &WakeModelConfig, seed: u64) -> Outcome<TrainingPairs> {
        let Some(path) = &self.data else {
            let mut recipe = Recipe::named_or_read(&self.recipe)?;
            recipe.scene.grid.rows = config.image_size;
            recipe.scene.grid.columns = config.image_size;
            recipe.grey = config.grey;
            return Ok(TrainingPairs::simulated(recipe, seed, self.count)?);
        };
        let folder = folder(path)?;
        let (found, grey) = (folder.manifest().grey, config.grey);
        if found != grey {
            return Err(format!(
                "--data {}: grey is {}, but the model's is {}; make the set with the model's grey, or train another model \
                 in another --out",
                path.display(),
                in_words(&found),
                in_words(&grey)
            )
            .into());
        }
        for (number, scene) in folder.scenes().enumerate() {
            let told = |error| format!("--data {}: pair {number}: {error}", path.display());
            config.check_scene(scene).map_err(told)?;
        }
        Ok(TrainingPairs::folder(folder))
    }
}

/// A grey scale in a message.
fn in_words(grey: &GreyScale) -> String {
    let mapping = match grey.mapping {
        Mapping::Decibel => "decibels",
        Mapping::Amplitude => "amplitude",
    };
    let [darkest, brightest] = [grey.darkest_db, grey.brightest_db];
    format!("linear in {mapping} from {darkest} to {brightest} dB")
}

/// Opens a data set that is not empty.
pub(crate) fn folder(path: &Path) -> Outcome<Folder> {
    let folder = Folder::open(path)?;
    match folder.is_empty() {
        true => Err(format!(
            "--data {}: it has no pair; make a larger data set",
            path.display()
        )
        .into()),
        false => Ok(folder),
    }
}

/// Rejects pairs that do not fit in memory.
pub(crate) fn check_memory(count: u64, needed: u64) -> Outcome<()> {
    let Some(free) = available_memory().filter(|&free| free < needed) else {
        return Ok(());
    };
    let [needed, free] = [needed, free].map(|bytes| bytes as f64 / (1u64 << 30) as f64);
    Err(format!(
        "{count} pairs need {needed:.1} GiB of memory, but {free:.1} GiB are free; lower --count, or give a \
         smaller --data"
    )
    .into())
}
