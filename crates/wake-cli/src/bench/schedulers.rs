//! Schedulers of Stable Diffusion: model calls against error, on a problem with a known answer.
//!
//! The model is exact. Each pixel x₀ is Gaussian with its own mean μ and standard deviation s, so the best prediction
//! of the noise in x = α x₀ + σ n is
//!
//! ```text
//! n̂ = σ (x − α μ)/(α² s² + σ²)
//! ```
//!
//! and the probability flow keeps (x − α μ)/√(α² s² + σ²) constant, so it ends at a known image. With several s the
//! solution is not a straight line for any parametrisation.

use std::path::Path;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use wake_ldm::scheduler::{NoiseLevel, SchedulerConfig, SchedulerOption, StepInput};
use wake_nn::burn::tensor::{Device, Tensor, TensorData};

use crate::exit::Outcome;

/// Deterministic methods, some also with the noise levels of Karras et al. (2022); the other schedulers add random
/// noise.
const METHODS: [(&str, bool); 9] = [
    ("ddim", false),
    ("pndm", false),
    ("euler", false),
    ("lms", false),
    ("heun", false),
    ("heun", true),
    ("dpm++", false),
    ("dpm++", true),
    ("unipc", false),
];
/// Steps of a run.
const STEPS: [usize; 7] = [5, 10, 20, 30, 50, 100, 200];
/// Steps of the reference.
const REFERENCE: usize = 1000;
/// Pixels along each side.
const SIDE: usize = 64;
/// Smallest and largest standard deviation of the pixels, which form a geometric series.
const SPREADS: [f64; 2] = [0.3, 2.0];

/// Error of one method with a number of steps.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct SchedulerRow {
    pub(crate) stage: &'static str,
    pub(crate) method: &'static str,
    /// Noise levels of Karras et al. (2022), Eq. 5.
    pub(crate) karras: bool,
    pub(crate) steps: usize,
    /// Number of model calls.
    pub(crate) calls: usize,
    /// Root mean square difference from the end of the exact flow, relative to the standard deviation of each pixel.
    pub(crate) rms_error: f64,
}

/// Number of calls of `done` in [`measure`].
pub(crate) const PARTS: usize = METHODS.len() * STEPS.len() + 1;

/// Measures all rows, the reference of many DDIM steps last, and calls `done` after each.
pub(crate) fn measure(done: impl Fn()) -> Outcome<Vec<SchedulerRow>> {
    let problem = Problem::new();
    let runs = METHODS
        .iter()
        .flat_map(|method| STEPS.map(|steps| (*method, steps)));
    let mut rows = Vec::new();
    for (method, steps) in runs.chain([(("ddim", false), REFERENCE)]) {
        rows.push(problem.row(method, steps)?);
        done();
    }
    Ok(rows)
}

/// Means and standard deviations of the pixels, and the initial noise of all runs.
struct Problem {
    mean: Tensor<4>,
    spread: Tensor<4>,
    noise: Tensor<4>,
}

impl Problem {
    fn new() -> Self {
        let mut random = StdRng::seed_from_u64(1);
        let count = SIDE * SIDE;
        let ratio = (SPREADS[1] / SPREADS[0]).ln() / (count - 1) as f64;
        // The sum of twelve uniform numbers has variance 1.
        let mut gaussian = || (0..12).map(|_| random.random_range(0.0..1.0)).sum::<f64>() - 6.0;
        let tensor = |values: Vec<f64>| {
            let data = TensorData::new(values, [1, 1, SIDE, SIDE]);
            Tensor::from_data(data, &Device::default())
        };
        Self {
            mean: tensor((0..count).map(|_| 0.5 * gaussian()).collect()),
            noise: tensor((0..count).map(|_| gaussian()).collect()),
            spread: tensor(
                (0..count)
                    .map(|n| SPREADS[0] * (ratio * n as f64).exp())
                    .collect(),
            ),
        }
    }

    /// √(α² s² + σ²).
    fn width(&self, level: NoiseLevel) -> Tensor<4> {
        let signal = self.spread.clone() * level.signal;
        (signal.clone() * signal + level.noise * level.noise).sqrt()
    }

    fn row(&self, (method, karras): (&'static str, bool), steps: usize) -> Outcome<SchedulerRow> {
        let mut options = SchedulerConfig::stable_diffusion(method)?.to_json();
        // The last step ends at the clean image, as in the methods that end without noise.
        options["set_alpha_to_one"] = true.into();
        if steps == REFERENCE {
            options["steps_offset"] = 0.into();
        }
        let path = Path::new("scheduler_config.json");
        let config = SchedulerConfig::from_json(&options.to_string(), path)?
            .with(SchedulerOption::KarrasSigmas(karras))?;
        let mut scheduler = config.scheduler(steps)?;
        let calls = scheduler.timesteps().len();
        let mut sample = self.noise.clone() * scheduler.init_noise_sigma();
        // Standardized deviation from the mean, which the exact flow keeps.
        let first = scheduler.noise_level(0);
        let off = (sample.clone() - self.mean.clone() * first.signal) / self.width(first);
        for index in 0..calls {
            let level = scheduler.noise_level(index);
            let width = self.width(level);
            let prediction = (sample.clone() - self.mean.clone() * level.signal)
                / (width.clone() * width)
                * level.noise;
            let input = StepInput {
                index,
                prediction,
                sample,
                noise: None,
            };
            sample = scheduler.step(input).sample;
        }
        let error = (sample - self.mean.clone()) / self.spread.clone() - off;
        let square: f32 = (error.clone() * error).mean().into_scalar();
        Ok(SchedulerRow {
            stage: "scheduler",
            method,
            karras,
            steps,
            calls,
            rms_error: f64::from(square).sqrt(),
        })
    }
}

/// Markdown table of the errors by method and steps.
pub(crate) fn table(rows: &[SchedulerRow]) -> String {
    let heads: Vec<String> = STEPS.iter().map(usize::to_string).collect();
    let mut text = format!(
        "| steps | {} |\n| --- |{}\n",
        heads.join(" | "),
        " --- |".repeat(STEPS.len())
    );
    for (method, karras) in METHODS {
        let is_of = |row: &&SchedulerRow| (row.method, row.karras) == (method, karras);
        let of = rows.iter().filter(is_of);
        let of: Vec<&SchedulerRow> = of.filter(|row| row.steps != REFERENCE).collect();
        let mut name = match method {
            "heun" => "heun (two calls a step)".to_owned(),
            "pndm" => "pndm (one more call)".to_owned(),
            _ => method.to_owned(),
        };
        if karras {
            name += ", Karras";
        }
        let errors: Vec<String> = of
            .iter()
            .map(|row| format!("{:.1e}", row.rms_error))
            .collect();
        text.push_str(&format!("| {name} | {} |\n", errors.join(" | ")));
    }
    if let Some(reference) = rows.iter().find(|row| row.steps == REFERENCE) {
        let error = reference.rms_error;
        text.push_str(&format!("\n{REFERENCE} DDIM steps: {error:.1e}.\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// DDIM's error falls with the number of steps; LMS, a method of fourth order, is far more accurate.
    #[test]
    fn methods_converge_with_their_orders() {
        let problem = Problem::new();
        let error = |method, steps| problem.row((method, false), steps).unwrap().rms_error;
        let gain = error("ddim", 10) / error("ddim", 100);
        assert!((5.0..12.0).contains(&gain), "{gain}");
        let gain = error("lms", 10) / error("lms", 20);
        assert!((8.0..32.0).contains(&gain), "{gain}");
        assert!(error("ddim", 20) > 10.0 * error("lms", 20));
    }
}
