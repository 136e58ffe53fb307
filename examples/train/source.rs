//! Pairs to learn from, on disk or simulated.

use wake_ldm::dataset::{Folder, Pair, Recipe, Simulated};

use super::options::Options;

pub(crate) enum Source {
    Disk(Folder),
    Endless(Simulated, u64),
}

impl Source {
    pub(crate) fn new(options: &Options) -> wake_ldm::Result<Self> {
        Ok(match &options.data {
            Some(path) => Self::Disk(Folder::open(path)?),
            None => Self::Endless(
                Simulated::new(Recipe::default(), options.seed)?,
                options.count,
            ),
        })
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
}
