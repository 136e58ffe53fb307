#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
mod streams;

// Training loop.
mod tensors;
mod self_check;
mod checkpoint;
mod optimizer;
mod progress;
mod log;

mod trainer;
mod folder;

// Training data and tasks.
mod latents;
mod pairs;
mod prompts;
mod run;
mod sea;
mod tasks;

// Training stages, each in a run folder.
mod fine_tune;
mod sheet;
mod stage;
mod stage_options;
mod text_to_image;
mod prompt_reading;
mod small_pipeline;
mod sea_training;
mod wake_model;

// Evaluation.
pub mod metrics;
mod two_sample;
pub mod evaluation;

pub mod detector;

pub use checkpoint::{Checkpoint, Tensors};
pub use error::{Error, Result};
pub use fine_tune::FineTuning;
pub use log::TrainLog;
pub use optimizer::{AdamOptions, LrSchedule};
pub use pairs::TrainingPairs;
pub use progress::Progress;
pub use run::{Run, RunOptions, Task, Terms};
pub use sea::SeaPatches;
pub use sea_training::SeaTraining;
pub use self_check::self_check;
pub use small_pipeline::{LatentShape, PipelineTraining};
pub use stage_options::StageOptions;
pub use trainer::{StepReport, TrainerOptions};
pub use two_sample::{TwoSample, TwoSampleOptions, classifier_two_sample_test};
pub use wake_model::WakeTraining;

#[cfg(all(test, feature = "flex"))]
mod tests;
