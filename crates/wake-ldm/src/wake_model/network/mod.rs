//! The small wake model: a linear patch transform, a reader of prompts, mean and spread of the latents, and a flow.

mod config;
mod domain;
mod flow;
mod known;
mod model;
mod overlap;
mod patches;
mod prior;
mod prompt_parser;
mod sea;
mod windows;

pub use config::WakeModelConfig;
pub use domain::Domain;
pub use flow::{Flow, Prepared};
pub use known::{Foreseen, Known, expected_grey};
pub use known::{expected_greys, images_of, slope_of};
pub use model::WakeModel;
pub use patches::{PatchTransform, Shares};
pub use prior::{Expected, Prior};
pub use prompt_parser::PromptParser;
pub use prompt_parser::windows;
pub use sea::SeaFields;
pub use windows::ChannelWindows;
