//! The small wake model: a linear patch transform, a text transformer, and a conditional U-Net.

mod config;
mod input;
mod model;
mod patches;

pub use config::WakeModelConfig;
pub use input::{Known, ModelInput, Words};
pub use model::{Encoded, WakeModel};
pub use patches::{PatchTransform, Shares};
