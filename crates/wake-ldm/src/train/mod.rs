//! Training: gradients, optimizer, averaged weights, checkpoints, and what is learned.
//!
//! ```text
//! pairs ─► latents ─► loss ─► gradients of all workers, averaged, clipped ─► AdamW ─► weights ─► averaged weights
//! ```
//!
//! Every random number of a run is drawn from its seed and the number of the step, and every pair has a position, so
//! that a run continued from a checkpoint gives the same curve as one that never stopped.

// Loop.
mod checkpoint;
mod optimizer;
mod progress;
mod tensors;
mod trainer;

// What is learnt.
mod latents;
mod pairs;
mod run;
mod sea;
mod tasks;

// Runs in their folders.
mod fine_tune;
mod folder;
mod metrics;
mod sea_training;
mod sheet;
mod small_pipeline;
mod stage;
mod stage_options;
mod text_to_image;
mod wake_model;

// What can be told apart.
mod two_sample;

pub use checkpoint::{Checkpoint, Tensors};
pub use fine_tune::{FineTune, FineTuneOptions, FineTuning, Frozen, PromptedBatches};
pub use folder::RunFolder;
pub use latents::{Example, LatentSet, fit_patches};
pub use metrics::Metrics;
pub use optimizer::{AdamOptions, Rate};
pub use pairs::TrainingPairs;
pub use progress::Progress;
pub use run::{Run, RunOptions, Task, Terms};
pub use sea::{SeaPatches, SeaTask};
pub use sea_training::SeaTraining;
pub use small_pipeline::PipelineTraining;
pub use stage::Stage;
pub use stage_options::{StageOptions, Usual};
pub use tasks::{FlowTask, PriorTask, WordsTask};
pub use text_to_image::{
    AutoencoderTask, PromptedImages, PromptedLatents, TextToImage, TextToImageTask,
};
pub use trainer::{StepReport, Trainer, TrainerOptions};
pub use two_sample::{TwoSample, TwoSampleOptions, two_sample};
pub use wake_model::{WakeStage, WakeTraining};

#[cfg(all(test, feature = "flex"))]
mod tests;
