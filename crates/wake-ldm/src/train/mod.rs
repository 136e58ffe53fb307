//! Training: gradients, optimizer, averaged weights, checkpoints, and what is learned.
//!
//! ```text
//! pairs ─► latents ─► loss ─► gradients of all workers, averaged, clipped ─► AdamW ─► weights ─► averaged weights
//! ```
//!
//! Every random number of a run is drawn from its seed and the number of the step, and every pair has a position, so
//! that a run continued from a checkpoint gives the same curve as one that never stopped.

mod adam;
mod average;
mod checkpoint;
mod expectation;
mod fine_tune;
mod flow;
mod latents;
mod loss;
mod metrics;
mod order;
mod rate;
mod restore;
mod run;
mod tensors;
mod trainer;
mod words;

pub use adam::{Adam, AdamOptions};
pub use average::Average;
pub use checkpoint::{Checkpoint, Tensors};
pub use expectation::PriorTask;
pub use fine_tune::{FineTune, FineTuneOptions, Frozen};
pub use flow::FlowTask;
pub use latents::{Example, LatentSet};
pub use loss::{min_snr_weights, noise_level};
pub use metrics::Metrics;
pub use rate::Rate;
pub use run::{Run, RunOptions, Task, Terms};
pub use tensors::{gradients, names, replaced, values};
pub use trainer::{StepReport, Trainer, TrainerOptions};
pub use words::WordsTask;

#[cfg(all(test, feature = "flex"))]
mod tests;
#[cfg(all(test, feature = "flex"))]
mod fine_tune_tests;
