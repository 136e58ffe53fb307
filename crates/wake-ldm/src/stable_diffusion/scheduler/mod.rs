//! Noise schedulers, which choose the noise levels of a sampler and step from one level to the next.
//!
//! The model is called once per entry of [`Scheduler::timesteps`]; its prediction and the current sample
//! are passed to [`Scheduler::step`]. A scheduler belongs to one run, because it holds the history of a multistep method.
//!
//! ```text
//! x = init_noise_sigma · n
//! for i in 0 .. timesteps.len():
//!     prediction = model(scale_model_input(x, i), timesteps[i])
//!     x = step(prediction, x, i)
//! ```

mod betas;
mod config;
mod ddim;
mod ddpm;
mod dpm_solver_pp;
mod euler;
mod euler_ancestral;
mod flow_match_euler;
mod heun;
mod integrator;
mod known_options;
mod lcm;
mod lms;
mod log_snr_path;
mod option;
mod pndm;
mod prediction;
mod schedule;
mod sigma_sampler;
mod sigmas;
mod spacing;
mod unipc;
mod unipc_weights;
mod whole_path;

use burn::tensor::Tensor;

use crate::options::Options;
use wake_nn::Result;

pub use betas::{BetaCurve, TerminalSnr};
pub use config::SchedulerConfig;
pub use option::SchedulerOption;
pub use prediction::{Clipping, NoiseLevel, Prediction};
pub use schedule::NoiseSchedule;
pub use spacing::Spacing;

/// One call of the model, with the inputs of a scheduler's step.
#[derive(Debug)]
pub struct StepInput {
    /// Index of the call in [`Scheduler::timesteps`].
    pub index: usize,
    /// Prediction of the model, shaped like the sample.
    pub prediction: Tensor<4>,
    /// Noisy sample before [`Scheduler::scale_model_input`].
    pub sample: Tensor<4>,
    /// Fresh standard normal noise if [`Scheduler::needs_noise`].
    pub noise: Option<Tensor<4>>,
}

impl StepInput {
    /// Clean image of the prediction, clipped.
    fn denoised(&self, level: NoiseLevel, kind: Prediction, clipping: Clipping) -> Tensor<4> {
        clipping.apply(kind.denoised(level, self.sample.clone(), self.prediction.clone()))
    }

    /// Noise of the prediction.
    fn direction(&self, level: NoiseLevel, kind: Prediction) -> Tensor<4> {
        kind.noise(level, self.sample.clone(), self.prediction.clone())
    }
}

/// Result of one step.
#[derive(Debug)]
pub struct StepOutput {
    /// The sample at the next noise level.
    pub sample: Tensor<4>,
    /// Estimate of the clean image after this call of the model: a preview.
    pub denoised: Tensor<4>,
}

/// A method that turns noise into an image, step by step.
pub trait Scheduler: std::fmt::Debug + Send {
    /// Training steps at which the model is called, one per call; they may repeat or be fractions.
    fn timesteps(&self) -> &[f64];

    /// Factor of standard normal noise that gives the first sample.
    fn init_noise_sigma(&self) -> f64 {
        1.0
    }

    /// Noise level of the sample before step `index`.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep.
    fn noise_level(&self, index: usize) -> NoiseLevel;

    /// Sample scaled as input of the model.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep.
    fn scale_model_input(&self, sample: Tensor<4>, _index: usize) -> Tensor<4> {
        sample
    }

    /// Whether step `index` needs noise.
    fn needs_noise(&self, _index: usize) -> bool {
        false
    }

    /// Number of model calls per step of the schedule, except near the ends of a run.
    fn calls_per_step(&self) -> usize {
        1
    }

    /// Clean image brought to the noise level before step `index`, to start there.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep.
    fn add_noise(&self, clean: Tensor<4>, noise: Tensor<4>, index: usize) -> Tensor<4> {
        self.noise_level(index).mix(clean, noise)
    }

    /// Moves the sample to the next noise level.
    ///
    /// Steps must be taken in order, each once; the first may be any.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep, or noise is missing although
    /// [`needs_noise`](Self::needs_noise) is true.
    fn step(&mut self, input: StepInput) -> StepOutput;
}

/// Options of a method, read and checked, from which runs are started.
trait Method: std::fmt::Debug + Send + Sync {
    /// Reads the method's options.
    fn take(options: &mut Options) -> Result<Self>
    where
        Self: Sized;

    /// Noise of the training steps; `None` for straight paths, which have none.
    fn schedule(&self) -> Option<&NoiseSchedule>;

    /// Makes a scheduler for a run of n steps.
    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>>;
}

/// Noise of a step that needs some.
fn required(noise: Option<Tensor<4>>) -> Tensor<4> {
    noise.expect("`needs_noise` asked for noise, and none was given")
}
