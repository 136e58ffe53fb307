//! The small wake model: a linear patch transform, a prompt parser, mean and spread of the latents, and a flow.

mod config;
mod training_ranges;
mod flow;
mod inputs;
mod model;
mod overlap;
mod part;
mod patches;
mod prior;
mod prompt_parser;
mod sea;
mod windows;

pub use config::WakeModelConfig;
pub use flow::{CachedConditioning, Flow};
pub use inputs::{ConditioningInputs, PhysicsPrior, expected_grey};
pub use inputs::{expected_greys, images_of, slope_of};
pub use model::WakeModel;
pub use part::Part;
pub use patches::{ExplainedVariance, PatchTransform};
pub use prior::{Expected, Prior};
pub use prompt_parser::PromptParser;
pub use prompt_parser::windows;
pub use sea::SeaFields;
pub use training_ranges::TrainingRanges;
pub use windows::ChannelWindows;
