//! Training on images that are made on the fly: painted, simulated, or drawn by the wake model.
//!
//! ```text
//! recipe ─► source of pairs ─► samples: images with their wakes ─► targets: maps ─► loss ─► network
//! ```

mod cluttered;
pub(crate) mod draw;
mod painted;
mod recipes;
mod repeated;
mod sample;
pub(crate) mod sea;
mod targets;
mod training;

pub use painted::Painted;
pub use recipes::Recipe;
pub use repeated::Repeated;
pub use sample::Sample;
pub use targets::FOUND;
pub use training::{Training, train};
