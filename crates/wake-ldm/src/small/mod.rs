//! The small wake model: a linear patch transform, a reader of prompts, mean and spread of the latents, and a flow.

mod config;
mod flow;
mod input;
mod model;
mod patches;
mod prior;
mod reader;
mod sea;
mod wake;

pub use config::WakeModelConfig;
pub use flow::{Flow, Prepared};
pub use input::Known;
#[cfg(feature = "train")]
pub(crate) use input::in_parallel;
pub use model::WakeModel;
pub use patches::{PatchTransform, Shares};
pub use prior::{Expected, Prior};
pub use reader::{Reader, windows};
pub use sea::{SeaNoise, sea_noise};
pub use wake::{expected_grey, expected_latents};
