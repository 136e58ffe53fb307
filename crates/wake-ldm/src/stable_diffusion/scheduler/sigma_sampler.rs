//! Options, path and slopes shared by the methods that follow dx/dσ = (x − x₀)/σ.

use burn::tensor::Tensor;

use super::betas::ScheduleDefaults;
use super::prediction::{Clipping, Prediction};
use super::sigmas::{SigmaOptions, SigmaPath};
use super::spacing::Steps;
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::options::Options;
use wake_nn::Result;

/// A method that moves along the slope.
pub(super) trait SigmaMethod: std::fmt::Debug + Clone + Send + Sync + 'static {
    /// Reads the method and its options.
    fn take(options: &mut Options) -> Result<SigmaConfig<Self>>;

    /// Path as this method visits it.
    fn visited(&self, path: SigmaPath) -> SigmaPath {
        path
    }

    fn needs_noise(&self) -> bool {
        false
    }

    fn calls_per_step(&self) -> usize {
        1
    }

    /// Returns the sample at the next level.
    fn advance(&mut self, call: Call<'_>) -> Tensor<4>;
}

/// Data available after a call of the model.
#[derive(Debug)]
pub(super) struct Call<'a> {
    pub(super) index: usize,
    /// All noise levels of the run.
    pub(super) sigmas: &'a [f64],
    pub(super) sample: Tensor<4>,
    /// dx/dσ at this level.
    pub(super) slope: Tensor<4>,
    pub(super) noise: Option<Tensor<4>>,
}

impl Call<'_> {
    /// This level and the next.
    pub(super) fn ends(&self) -> (f64, f64) {
        (self.sigmas[self.index], self.sigmas[self.index + 1])
    }
}

/// Options of every method in σ.
#[derive(Debug, Clone)]
pub(super) struct SigmaConfig<M> {
    pub(super) schedule: NoiseSchedule,
    pub(super) steps: Steps,
    pub(super) prediction: Prediction,
    pub(super) clipping: Clipping,
    pub(super) sigmas: SigmaOptions,
    pub(super) end_at_zero: bool,
    pub(super) method: M,
}

impl<M: SigmaMethod> SigmaConfig<M> {
    /// Reads schedule, spacing and prediction, and sets the rest as for most methods: no clipping, the levels
    /// of the visited steps, 0 at the end.
    pub(super) fn take_common(
        options: &mut Options,
        defaults: &ScheduleDefaults,
        known: &[Prediction],
        method: M,
    ) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, defaults)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            prediction: Prediction::take(options, known)?,
            clipping: Clipping::Off,
            sigmas: SigmaOptions::STEPS,
            end_at_zero: true,
            method,
            schedule,
        })
    }
}

impl<M: SigmaMethod> Method for SigmaConfig<M> {
    fn take(options: &mut Options) -> Result<Self> {
        M::take(options)
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        let end = self.end_at_zero;
        let path = SigmaPath::fractional(&self.schedule, self.steps, &self.sigmas, end, n)?;
        Ok(Box::new(SigmaSampler {
            path: self.method.visited(path),
            prediction: self.prediction,
            clipping: self.clipping,
            method: self.method.clone(),
        }))
    }
}

/// A run of a method in σ.
#[derive(Debug)]
struct SigmaSampler<M> {
    path: SigmaPath,
    prediction: Prediction,
    clipping: Clipping,
    method: M,
}

impl<M: SigmaMethod> Scheduler for SigmaSampler<M> {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn init_noise_sigma(&self) -> f64 {
        self.path.init_noise_sigma()
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn scale_model_input(&self, sample: Tensor<4>, index: usize) -> Tensor<4> {
        sample * self.path.input_scale(index)
    }

    fn needs_noise(&self, _index: usize) -> bool {
        self.method.needs_noise()
    }

    fn calls_per_step(&self) -> usize {
        self.method.calls_per_step()
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        // 1. The clean image, clipped.
        let level = self.path.level(input.index);
        let denoised = input.denoised(level, self.prediction, self.clipping);
        // 2. The slope away from it.
        let slope = (input.sample.clone() - denoised.clone()) / level.noise;
        // 3. The step along it, by the method.
        let sample = self.method.advance(Call {
            index: input.index,
            sigmas: &self.path.sigmas,
            sample: input.sample,
            slope,
            noise: input.noise,
        });
        StepOutput { sample, denoised }
    }
}
