//! UniPC: a predictor and a corrector of the same order, with one call per step.

use burn::tensor::Tensor;
use serde_json::Value;

use super::betas::DEFAULTS;
use super::integrator::IntegratorOptions;
use super::log_snr_path::{LogSnrPath, PathOptions};
use super::prediction::Clipping;
use super::sigmas::{SigmaOptions, Spread, take_final_zero};
use super::spacing::Steps;
use super::unipc_weights::{moments, solve};
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::options::{Options, count, list};
use wake_nn::Result;

/// Options of [`UniPc`].
#[derive(Debug, Clone)]
pub(super) struct UniPcConfig {
    schedule: NoiseSchedule,
    path: PathOptions,
    shared: IntegratorOptions,
    /// Whether B(h) = h; otherwise it is eʰ − 1.
    plain: bool,
    /// Steps that are not corrected.
    uncorrected: Vec<usize>,
}

impl Method for UniPcConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, &DEFAULTS)?;
        let known = [Spread::Karras, Spread::Exponential, Spread::Flow];
        let path = PathOptions {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            sigmas: SigmaOptions::take(options, &known)?,
            end_at_zero: take_final_zero(options)?,
            round_steps: true,
        };
        let data = options.bool("predict_x0", true)?;
        let mut shared = IntegratorOptions::take(options, path.sigmas.spread, data, 4)?;
        if !data {
            // Clipping is defined only for the clean image.
            shared.clipping = Clipping::Off;
        }
        let steps = |value: &Value| list(value, count);
        let uncorrected = options.read("disable_corrector", "a list of steps", steps)?;
        let config = Self {
            shared,
            plain: take_plain(options)?,
            uncorrected: uncorrected.unwrap_or_default(),
            path,
            schedule,
        };
        config.refuse_division_by_zero(options)?;
        Ok(config)
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        Ok(Box::new(UniPc {
            path: self.path.path(&self.schedule, n)?,
            config: self.clone(),
            history: Vec::new(),
            last: None,
        }))
    }
}

impl UniPcConfig {
    /// Rejects combinations that end in 0/0, for which diffusers gives NaN.
    fn refuse_division_by_zero(&self, options: &Options) -> Result<()> {
        let IntegratorOptions {
            data,
            order,
            lower_order_final,
            ..
        } = self.shared;
        let zero = self.path.end_at_zero;
        let spread = self.path.sigmas.spread != Spread::Steps;
        let ends: [(bool, &str, Value, &str); 4] = [
            (zero && self.plain, "solver_type", "bh1".into(), "bh2"),
            (zero && !data, "predict_x0", false.into(), "true"),
            (
                zero && !lower_order_final && order > 1,
                "lower_order_final",
                false.into(),
                "true",
            ),
            (
                !zero && spread,
                "final_sigmas_type",
                "sigma_min".into(),
                "zero with spread sigmas",
            ),
        ];
        match ends.into_iter().find(|(meets, ..)| *meets) {
            None => Ok(()),
            Some((_, option, value, supported)) => {
                let supported = match zero {
                    true => format!("{supported} with final_sigmas_type zero"),
                    false => supported.to_owned(),
                };
                Err(options.unsupported(option, &value, &supported))
            }
        }
    }
}

fn take_plain(options: &mut Options) -> Result<bool> {
    // The last three are DPM-Solver's names, which diffusers replaces by its default here.
    let others = ["bh2", "midpoint", "heun", "logrho"].map(|name| (name, false));
    let known = [&[("bh1", true)], &others[..]].concat();
    options.choice("solver_type", "bh2", &known)
}

/// Exponential integrator that corrects its last step once the next prediction is available.
///
/// | here | paper |
/// | --- | --- |
/// | `h` | hᵢ, negative in terms of the clean image |
/// | `ratios` | r₁ … r_{p−1}, and 1 |
/// | `moments` | h φₙ₊₁(h) n! / B(h) |
///
/// # References
///
/// Zhao et al. (2023), "UniPC: A Unified Predictor-Corrector Framework for Fast Sampling of
/// Diffusion Models", Eqs. 3 to 9, algorithms 5 to 8.
#[derive(Debug)]
struct UniPc {
    config: UniPcConfig,
    path: LogSnrPath,
    /// Clean images (or noises), newest first.
    history: Vec<Tensor<4>>,
    /// Sample and order of the last predictor step.
    last: Option<(Tensor<4>, usize)>,
}

/// Factors of one step from a level to the next.
#[derive(Debug)]
struct Update {
    /// Factor of the sample.
    sample: f64,
    /// Factor of the newest prediction.
    value: f64,
    /// Factor of the differences: the amplitude times B(h).
    correction: f64,
    ratios: Vec<f64>,
    moments: Vec<f64>,
}

impl UniPc {
    /// Factors of the step from level `from` to the next; `None` for a step of zero length.
    fn update(&self, from: usize, order: usize) -> Option<Update> {
        let length = self.path.length(from);
        if length <= 0.0 {
            return None;
        }
        let exact = self.path.exact_part(from, self.config.shared.data);
        let (h, amplitude) = (exact.h, exact.amplitude);
        let base = if self.config.plain { h } else { h.exp_m1() };
        let lambda = |i: usize| self.path.log_snr(i);
        let ratio = |back: usize| (lambda(from - back) - lambda(from)) / length;
        Some(Update {
            sample: exact.sample,
            value: -amplitude * h.exp_m1(),
            correction: -amplitude * base,
            ratios: (1..order).map(ratio).chain(std::iter::once(1.0)).collect(),
            moments: moments(h, base, order),
        })
    }

    /// Order of a step, which may be lower for the last ones.
    fn order(&self, index: usize) -> usize {
        let shared = &self.config.shared;
        let left = self.path.len() - index;
        let most = if shared.lower_order_final {
            left
        } else {
            shared.order
        };
        self.path
            .order(index, shared.order.min(most), self.history.len())
    }

    /// Weighted sum of the differences of the history.
    fn differences(&self, update: &Update, weights: &[f64]) -> Option<Tensor<4>> {
        let newest = self.history.first()?;
        let terms = self.history.iter().skip(1).zip(&update.ratios).zip(weights);
        terms
            .map(|((older, ratio), weight)| (older.clone() - newest.clone()) * (weight / ratio))
            .reduce(|sum, term| sum + term)
    }

    /// Predicts the step to the next level from this one, Eq. 3.
    fn predict(&self, index: usize, order: usize, sample: Tensor<4>) -> Tensor<4> {
        let Some(update) = self.update(index, order) else {
            return sample;
        };
        let newest = self.history[0].clone();
        let next = sample * update.sample + newest * update.value;
        let weights = match order {
            2 => vec![0.5],
            _ => solve(&update.ratios[..order - 1], &update.moments[..order - 1]),
        };
        match self.differences(&update, &weights) {
            Some(sum) if order > 1 => next + sum * update.correction,
            _ => next,
        }
    }

    /// Repeats the last step with the prediction at its end, Eq. 9.
    fn correct(&self, index: usize, sample: Tensor<4>, here: &Tensor<4>) -> Tensor<4> {
        let Some((start, order)) = self.last.clone() else {
            return sample;
        };
        let Some(update) = self.update(index - 1, order) else {
            return sample;
        };
        let newest = self.history[0].clone();
        let again = start * update.sample + newest.clone() * update.value;
        let weights = if order == 1 {
            vec![0.5]
        } else {
            solve(&update.ratios, &update.moments)
        };
        let change = (here.clone() - newest) * weights[order - 1];
        let change = match self.differences(&update, &weights[..order - 1]) {
            Some(sum) if order > 1 => change + sum,
            _ => change,
        };
        again + change * update.correction
    }
}

impl Scheduler for UniPc {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let index = input.index;
        // 1. The prediction at the predicted sample.
        let shared = &self.config.shared;
        let [denoised, kept] = shared.convert(self.path.level(index), &input);
        let mut sample = input.sample;
        // 2. The last step is corrected with it.
        let corrects = index
            .checked_sub(1)
            .is_some_and(|last| !self.config.uncorrected.contains(&last));
        if corrects {
            sample = self.correct(index, sample, &kept);
        }
        self.history.insert(0, kept);
        self.history.truncate(self.config.shared.order);
        // 3. The next step is predicted.
        let order = self.order(index);
        self.last = Some((sample.clone(), order));
        StepOutput {
            sample: self.predict(index, order, sample),
            denoised,
        }
    }
}
