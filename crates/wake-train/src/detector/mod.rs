//! The detector: trained on images made on the fly or read from a folder, scored on images whose wakes are known.
//!
//! ```text
//! recipe or data set ─► source of pairs ─► samples: images with their wakes ─► targets: maps ─► loss ─► network
//! ```

pub mod judging;

mod clear;
mod cluttered;
mod data;
mod draw;
mod hidden;
mod kind;
mod labelled;
mod painted;
mod recipes;
mod repeated;
mod sample;
mod sea;
mod targets;
mod training;

pub use kind::Kind;
pub use labelled::LabelledImages;
pub use painted::Painted;
pub use recipes::ImageRecipe;
pub use repeated::Repeated;
pub use sample::Sample;
pub use targets::FOUND;
pub use training::{DetectorBatch, DetectorTask, DetectorTraining, MadeImages, TrainingImages};
