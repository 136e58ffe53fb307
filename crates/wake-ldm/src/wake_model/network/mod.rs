//! The small wake model: a linear patch transform, a reader of prompts, mean and spread of the latents, and a flow.

mod config;
mod flow;
mod known;
mod model;
mod overlap;
mod patches;
mod prior;
mod prompt_parser;
mod sea;

pub use config::WakeModelConfig;
pub use flow::{Flow, Prepared};
pub use known::{Known, expected_grey, expected_latents};
pub(crate) use known::{expected_greys, latents_of};
pub use model::WakeModel;
pub use patches::{PatchTransform, Shares};
pub use prior::{Expected, Prior};
pub use prompt_parser::PromptParser;
pub(crate) use prompt_parser::windows;
pub(crate) use sea::{ChannelWindows, SeaFields};
