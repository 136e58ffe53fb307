//! Noise schedulers: which noise levels a sampler visits, and how it moves from one to the next.
//!
//! A model is asked once per entry of [`Scheduler::timesteps`]; its answer and the current sample go
//! into [`Scheduler::step`]. A scheduler belongs to one run: it keeps what a multistep method
//! remembers.
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

/// One call of the model, and what a scheduler needs to move on.
#[derive(Debug)]
pub struct StepInput {
    /// Which entry of [`Scheduler::timesteps`] this is.
    pub index: usize,
    /// Prediction of the model, shaped like the sample.
    pub prediction: Tensor<4>,
    /// The noisy sample as it was before [`Scheduler::scale_model_input`].
    pub sample: Tensor<4>,
    /// Fresh standard normal noise where [`Scheduler::needs_noise`] asks for it.
    pub noise: Option<Tensor<4>>,
}

impl StepInput {
    /// The clean image that the prediction stands for, limited.
    fn denoised(&self, level: NoiseLevel, kind: Prediction, clipping: Clipping) -> Tensor<4> {
        clipping.apply(kind.denoised(level, self.sample.clone(), self.prediction.clone()))
    }

    /// The noise that the prediction stands for.
    fn direction(&self, level: NoiseLevel, kind: Prediction) -> Tensor<4> {
        kind.noise(level, self.sample.clone(), self.prediction.clone())
    }
}

/// Result of one step.
#[derive(Debug)]
pub struct StepOutput {
    /// The sample at the next noise level.
    pub sample: Tensor<4>,
    /// The clean image as the method sees it after this call of the model: a preview.
    pub denoised: Tensor<4>,
}

/// A method that turns noise into an image, step by step.
pub trait Scheduler: std::fmt::Debug + Send {
    /// The training steps that the model is asked at, one per call; may repeat or be fractions.
    fn timesteps(&self) -> &[f64];

    /// What standard normal noise is multiplied with to give the first sample.
    fn init_noise_sigma(&self) -> f64 {
        1.0
    }

    /// The noise level of the sample before step `index`.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep.
    fn noise_level(&self, index: usize) -> NoiseLevel;

    /// The sample as the model wants to see it.
    ///
    /// # Panics
    ///
    /// When `index` is not that of a timestep.
    fn scale_model_input(&self, sample: Tensor<4>, _index: usize) -> Tensor<4> {
        sample
    }

    /// Whether step `index` draws noise.
    fn needs_noise(&self, _index: usize) -> bool {
        false
    }

    /// How many calls of the model one step of the schedule takes, once it is under way.
    fn calls_per_step(&self) -> usize {
        1
    }

    /// A clean image brought to the noise level before step `index`, to start there.
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
    /// When `index` is not that of a timestep, or noise is missing where
    /// [`needs_noise`](Self::needs_noise) asks for it.
    fn step(&mut self, input: StepInput) -> StepOutput;
}

/// The options of a method, read and checked: what runs are started from.
trait Method: std::fmt::Debug + Send + Sync {
    /// Reads the method's options.
    fn take(options: &mut Options) -> Result<Self>
    where
        Self: Sized;

    /// The noise of the training steps; `None` for straight paths, which have none.
    fn schedule(&self) -> Option<&NoiseSchedule>;

    /// A scheduler for a run of n steps.
    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>>;
}

/// The noise of a step that must have some.
fn required(noise: Option<Tensor<4>>) -> Tensor<4> {
    noise.expect("`needs_noise` asked for noise, and none was given")
}
