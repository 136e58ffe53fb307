//! Arguments of `wake dataset`.

use clap::Args;
use std::path::PathBuf;
use wake_dataset::Shard;

/// Simulate a labelled data set of ship wakes.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Recipe of the scenes: paper (the paper's 3,456 scenes), ranges (random scenes like the paper's), satellites,
    /// detector (satellite images as published), model, or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "ranges")]
    pub(crate) grid: String,
    /// Set one value of the recipe, such as speckle=true; may be repeated; keys: docs/dataset.md
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Number of images [default: 100; 3456 for the paper's grid]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) count: Option<u64>,
    /// Seed of the data set
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Share of validation images (0 to 1)
    #[arg(long, value_name = "SHARE", default_value_t = 0.1)]
    pub(crate) val_share: f64,
    /// Learnt sea for the scenes, from `wake train sea`
    #[cfg(feature = "generate")]
    #[arg(long, value_name = "FILE", conflicts_with = "merge")]
    pub(crate) sea: Option<PathBuf>,
    /// Make only shard I of N, in the folder shard-I
    #[arg(long, value_name = "I/N")]
    pub(crate) shard: Option<Shard>,
    /// Merge the shards in --out into one data set
    #[arg(long, conflicts_with_all = ["shard", "count", "set"])]
    pub(crate) merge: bool,
    /// Also write README.md, the data set card for Hugging Face, into the folder
    #[arg(long, conflicts_with = "shard")]
    pub(crate) card: bool,
    /// Licence of the images to state in the card, by its name on Hugging Face
    #[arg(long, value_name = "NAME", default_value = "cc0-1.0", value_parser = license)]
    pub(crate) license: String,
    /// Also write the set to this folder as tar files for the library webdataset (train-000000.tar, …); with --card
    /// also a card
    #[arg(long, value_name = "DIR", conflicts_with = "shard")]
    pub(crate) webdataset: Option<PathBuf>,
    /// Largest number of images per tar file
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) per_tar: u64,
    /// Images computed in parallel [default: one per core]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Folder of the data set, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/dataset")]
    pub(crate) out: PathBuf,
    /// Print a report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

/// Checks the name of a licence for a card.
fn license(name: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '+');
    match !name.is_empty() && name.chars().all(plain) {
        true => Ok(name.to_owned()),
        false => Err("give a name such as cc0-1.0, cc-by-4.0 or other".to_owned()),
    }
}
