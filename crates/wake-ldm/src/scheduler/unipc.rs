//! UniPC: a predictor and a corrector of the same order, for one call per step.

use burn::tensor::Tensor;
use serde_json::Value;

use super::multistep::{LogSnrPath, PathOptions};
use super::prediction::{Clipping, Prediction};
use super::schedule::DEFAULTS;
use super::sigmas::{SigmaOptions, Spread, take_final_zero};
use super::spacing::Steps;
use super::{NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::error::Result;
use crate::options::Options;

/// Options of [`UniPc`].
#[derive(Debug, Clone)]
pub(super) struct UniPcConfig {
    pub(super) schedule: NoiseSchedule,
    path: PathOptions,
    prediction: Prediction,
    clipping: Clipping,
    order: usize,
    /// In terms of the clean image, or else of the noise.
    data: bool,
    /// B(h) = h, or else eʰ − 1.
    plain: bool,
    lower_order_final: bool,
    /// Steps after which nothing is corrected.
    uncorrected: Vec<usize>,
}

impl UniPcConfig {
    pub(super) fn take(options: &mut Options) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, &DEFAULTS)?;
        let known = [Spread::Karras, Spread::Exponential, Spread::Flow];
        let path = PathOptions {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            sigmas: SigmaOptions::take(options, &known)?,
            end_at_zero: take_final_zero(options)?,
            round_steps: true,
        };
        options.only("use_dynamic_shifting", &[false])?;
        let data = options.bool("predict_x0", true)?;
        let config = Self {
            prediction: take_prediction(options, path.sigmas.spread, data)?,
            clipping: take_clipping(options, data)?,
            order: take_order(options)?,
            plain: take_plain(options)?,
            lower_order_final: options.bool("lower_order_final", true)?,
            uncorrected: take_uncorrected(options)?,
            path,
            data,
            schedule,
        };
        config.refuse_division_by_zero(options)?;
        Ok(config)
    }

    /// Combinations that end in 0/0: diffusers gives NaN for them.
    fn refuse_division_by_zero(&self, options: &Options) -> Result<()> {
        let zero = self.path.end_at_zero;
        let refuse = |option: &str, value: Value, supported: &str| {
            Err(options.unsupported(option, &value, supported))
        };
        if zero && self.plain {
            return refuse(
                "solver_type",
                "bh1".into(),
                "bh2 with final_sigmas_type zero",
            );
        }
        if zero && !self.data {
            return refuse(
                "predict_x0",
                false.into(),
                "true with final_sigmas_type zero",
            );
        }
        if zero && !self.lower_order_final && self.order > 1 {
            return refuse(
                "lower_order_final",
                false.into(),
                "true with final_sigmas_type zero",
            );
        }
        if !zero && self.path.sigmas.spread != Spread::Steps {
            return refuse(
                "final_sigmas_type",
                "sigma_min".into(),
                "zero with spread sigmas",
            );
        }
        Ok(())
    }

    pub(super) fn init(&self, n: usize) -> Result<UniPc> {
        let path = self.path.path(&self.schedule, n)?;
        Ok(UniPc {
            config: self.clone(),
            path,
            history: Vec::new(),
            last: None,
        })
    }
}

fn take_prediction(options: &mut Options, spread: Spread, data: bool) -> Result<Prediction> {
    if spread != Spread::Flow {
        let known = [
            Prediction::Epsilon,
            Prediction::Sample,
            Prediction::Velocity,
        ];
        return Prediction::take(options, &known);
    }
    if data {
        return Prediction::take(options, &[Prediction::Flow]);
    }
    Err(options.unsupported("predict_x0", &false.into(), "true with use_flow_sigmas"))
}

/// Limits are only known for the clean image.
fn take_clipping(options: &mut Options, data: bool) -> Result<Clipping> {
    let clipping = Clipping::take_dynamic(options)?;
    Ok(if data { clipping } else { Clipping::Off })
}

fn take_order(options: &mut Options) -> Result<usize> {
    let order = options.usize("solver_order", 2)?;
    if (1..=4).contains(&order) {
        return Ok(order);
    }
    Err(options.unsupported("solver_order", &order.into(), "1 to 4"))
}

fn take_plain(options: &mut Options) -> Result<bool> {
    let name = options.string("solver_type", "bh2")?;
    match name.as_str() {
        "bh1" => Ok(true),
        // DPM-Solver's names, which diffusers takes for its default here.
        "bh2" | "midpoint" | "heun" | "logrho" => Ok(false),
        other => Err(options.unsupported("solver_type", &other.into(), "bh1, bh2")),
    }
}

fn take_uncorrected(options: &mut Options) -> Result<Vec<usize>> {
    let Some(value) = options.take("disable_corrector") else {
        return Ok(vec![]);
    };
    let count = |entry: &Value| entry.as_u64().and_then(|count| usize::try_from(count).ok());
    let list = value
        .as_array()
        .and_then(|list| list.iter().map(count).collect());
    list.ok_or_else(|| options.unsupported("disable_corrector", &value, "a list of steps"))
}

/// An exponential integrator whose last step is corrected once the next prediction is known.
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
pub(super) struct UniPc {
    config: UniPcConfig,
    path: LogSnrPath,
    /// Clean images (or noises), newest first.
    history: Vec<Tensor<4>>,
    /// Sample and order of the last prediction.
    last: Option<(Tensor<4>, usize)>,
}

/// One step from a level to the next, in numbers.
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
    fn convert(
        &self,
        level: NoiseLevel,
        sample: &Tensor<4>,
        prediction: Tensor<4>,
    ) -> [Tensor<4>; 2] {
        let UniPcConfig {
            prediction: kind,
            clipping,
            data,
            ..
        } = self.config;
        let denoised = clipping.apply(kind.denoised(level, sample.clone(), prediction.clone()));
        let kept = if data {
            denoised.clone()
        } else {
            kind.noise(level, sample.clone(), prediction)
        };
        [denoised, kept]
    }

    /// The numbers of the step from level `from` to the next; `None` for a step of no length.
    fn update(&self, from: usize, order: usize) -> Option<Update> {
        let lambda = |i: usize| self.path.log_snr(i);
        let length = lambda(from + 1) - lambda(from);
        if length <= 0.0 {
            return None;
        }
        let (now, next) = (self.path.level(from), self.path.level(from + 1));
        let (h, amplitude, sample) = if self.config.data {
            (-length, next.signal, next.noise / now.noise)
        } else {
            (length, next.noise, next.signal / now.signal)
        };
        let base = if self.config.plain { h } else { h.exp_m1() };
        let ratio = |back: usize| (lambda(from - back) - lambda(from)) / length;
        Some(Update {
            sample,
            value: -amplitude * h.exp_m1(),
            correction: -amplitude * base,
            ratios: (1..order).map(ratio).chain(std::iter::once(1.0)).collect(),
            moments: moments(h, base, order),
        })
    }

    /// The sum over the differences of the history, weighted.
    fn differences(&self, update: &Update, weights: &[f64]) -> Option<Tensor<4>> {
        let newest = self.history.first()?;
        let terms = self.history.iter().skip(1).zip(&update.ratios).zip(weights);
        terms
            .map(|((older, ratio), weight)| (older.clone() - newest.clone()) * (weight / ratio))
            .reduce(|sum, term| sum + term)
    }

    /// The step to the next level from what is known at this one, Eq. 3.
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

    /// The last step again, now that its end is known, Eq. 9.
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

    /// As much as history, end of the run and repeated levels allow.
    fn order(&self, index: usize) -> usize {
        let left = self.path.len() - index;
        let most = self.config.order;
        let wanted = if self.config.lower_order_final {
            most.min(left)
        } else {
            most
        };
        1 + self
            .path
            .usable_before(index, wanted.min(self.history.len()) - 1)
    }
}

/// h φₙ₊₁(h) n!/B(h) for n = 1 … order, with φ₁ = (eʰ − 1)/h and φₙ₊₁ = (φₙ − 1/n!)/h.
fn moments(h: f64, base: f64, order: usize) -> Vec<f64> {
    let mut phi = h.exp_m1() / h - 1.0;
    let mut factorial = 1.0;
    let mut moments = Vec::with_capacity(order);
    for n in 1..=order {
        moments.push(phi * factorial / base);
        factorial *= (n + 1) as f64;
        phi = phi / h - 1.0 / factorial;
    }
    moments
}

/// Weights w with Σⱼ rⱼ^{i} wⱼ = gᵢ for i = 0, 1, …, by Gauss-Jordan elimination with pivoting.
fn solve(ratios: &[f64], moments: &[f64]) -> Vec<f64> {
    let n = moments.len();
    let row = |i: usize| -> Vec<f64> {
        let powers = ratios.iter().map(|ratio| ratio.powi(i as i32));
        powers.chain(std::iter::once(moments[i])).collect()
    };
    let mut rows: Vec<Vec<f64>> = (0..n).map(row).collect();
    for column in 0..n {
        let largest =
            |&a: &usize, &b: &usize| rows[a][column].abs().total_cmp(&rows[b][column].abs());
        let pivot = (column..n).max_by(largest).unwrap_or(column);
        rows.swap(column, pivot);
        let pivot_row = rows[column].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = row[column] / pivot_row[column];
            for (entry, pivot) in row.iter_mut().zip(&pivot_row) {
                *entry = if i == column {
                    *pivot / pivot_row[column]
                } else {
                    *entry - factor * pivot
                };
            }
        }
    }
    rows.into_iter().map(|row| row[n]).collect()
}

impl Scheduler for UniPc {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            mut sample,
            ..
        } = input;
        // 1. What the prediction says at the predicted sample.
        let [denoised, kept] = self.convert(self.path.level(index), &sample, prediction);
        // 2. With it, the last step is corrected.
        let corrects = index
            .checked_sub(1)
            .is_some_and(|last| !self.config.uncorrected.contains(&last));
        if corrects {
            sample = self.correct(index, sample, &kept);
        }
        self.history.insert(0, kept);
        self.history.truncate(self.config.order);
        // 3. The next step is predicted.
        let order = self.order(index);
        self.last = Some((sample.clone(), order));
        StepOutput {
            sample: self.predict(index, order, sample),
            denoised,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_solve_their_vandermonde_system() {
        let (ratios, moments) = ([-1.3, -0.6, 1.0], [0.4, -0.7, 0.25]);
        let weights = solve(&ratios, &moments);
        for (i, moment) in moments.iter().enumerate() {
            let sum: f64 = weights
                .iter()
                .zip(ratios)
                .map(|(w, r)| w * r.powi(i as i32))
                .sum();
            assert!((sum - moment).abs() < 1e-13, "{i}: {sum} {moment}");
        }
    }

    /// The moments are h ∫₀¹ e^{(1−s)h} sⁿ ds / B(h): here by the trapezoidal rule.
    #[test]
    fn moments_are_integrals_of_the_exponential() {
        let h = -0.8_f64;
        for (i, moment) in moments(h, h.exp_m1(), 4).into_iter().enumerate() {
            let count = 20_000;
            let f = |s: f64| ((1.0 - s) * h).exp() * s.powi(i as i32 + 1);
            let sum: f64 = (1..count).map(|k| f(f64::from(k) / f64::from(count))).sum();
            let integral = (sum + 0.5 * (f(0.0) + f(1.0))) / f64::from(count);
            let expected = integral * h / h.exp_m1();
            // Error of the rule: f''/12 / count² ≈ 1e-9.
            assert!((moment - expected).abs() < 1e-8, "{i}: {moment} {expected}");
        }
    }
}
