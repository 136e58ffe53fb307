#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
pub mod streams;

// Images.
mod delivery;
mod grey;

// Choice of scenes.
mod distribution;
mod draws;
mod recipe;
mod sea;
mod shuffle;

mod scenes;

// Scene → pair.
mod ordered;
mod pair;

// Pairs ⇄ folder.
mod annotations;
mod layout;
mod metadata;

mod folder;
mod write;

mod card;
mod webdataset;

mod merge;

// Sources of pairs by position.
mod source;

mod mixture;

// Pairs → batches.
mod loader;

#[cfg(feature = "burn")]
mod batch;
#[cfg(feature = "burn")]
mod finite;

#[cfg(feature = "burn")]
pub use batch::{Batch, Batches, ToBatch};
pub use card::{CardOf, write_card};
pub use delivery::Delivery;
pub use draws::Draws;
pub use error::{Error, Result};
#[cfg(feature = "burn")]
pub use finite::Finite;
pub use folder::{Epochs, Folder};
pub use grey::Grey;
pub use layout::{Manifest, Shard};
pub use loader::Loader;
pub use merge::{merge, shard_folder};
pub use mixture::Mixture;
pub use pair::Pair;
pub use recipe::{Draw, Recipe};
pub use scenes::{PAPER_SCENES, Simulated};
pub use sea::Sea;
pub use shuffle::shuffled;
pub use source::Source;
pub use webdataset::{sample_files, write_webdataset};
pub use write::{Progress, write};

#[cfg(test)]
mod tests;
