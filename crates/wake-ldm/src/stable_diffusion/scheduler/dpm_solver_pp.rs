//! DPM-Solver and DPM-Solver++, multistep, of orders 1 to 3, and their stochastic variants.

use burn::tensor::Tensor;

use super::betas::{BetaCurve, DEFAULTS};
use super::integrator::IntegratorOptions;
use super::log_snr_path::{LogSnrPath, PathOptions};
use super::sigmas::{SigmaOptions, Spread, take_final_zero};
use super::spacing::{Spacing, Steps};
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, required};
use crate::options::Options;
use wake_nn::Result;

/// Runs shorter than this end with lower order.
const SHORT_RUN: usize = 15;

/// Options of [`DpmSolver`].
#[derive(Debug, Clone)]
pub(super) struct DpmSolverConfig {
    schedule: NoiseSchedule,
    path: PathOptions,
    shared: IntegratorOptions,
    /// Whether noise is added at every step.
    stochastic: bool,
    /// Whether the second-order slope follows the midpoint rule; otherwise it follows Heun's.
    midpoint: bool,
    euler_at_final: bool,
}

impl Method for DpmSolverConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, &DEFAULTS)?;
        let known = [
            Spread::Karras,
            Spread::Exponential,
            Spread::Lu,
            Spread::Flow,
        ];
        let path = PathOptions {
            steps: take_steps(options, &schedule)?,
            sigmas: SigmaOptions::take(options, &known)?,
            end_at_zero: take_final_zero(options)?,
            round_steps: *schedule.curve() != BetaCurve::SquaredCosine,
        };
        options.only(
            "variance_type",
            &["fixed_small", "fixed_small_log", "fixed_large"],
        )?;
        let [data, stochastic] = take_algorithm(options, path.end_at_zero)?;
        // The third order of diffusers with noise does not converge, so there is no reference to match.
        let most = if stochastic { 2 } else { 3 };
        Ok(Self {
            shared: IntegratorOptions::take(options, path.sigmas.spread, data, most)?,
            stochastic,
            midpoint: take_midpoint(options)?,
            euler_at_final: options.bool("euler_at_final", false)?,
            path,
            schedule,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        Ok(Box::new(DpmSolver {
            path: self.path.path(&self.schedule, n)?,
            config: self.clone(),
            history: Vec::new(),
        }))
    }
}

/// Reads the visited steps, of which the noisiest may be cut off at a signal-to-noise ratio.
fn take_steps(options: &mut Options, schedule: &NoiseSchedule) -> Result<Steps> {
    let clip = options.f64("lambda_min_clipped", f64::MIN)?;
    let clipped = schedule
        .sigmas()
        .iter()
        .filter(|&&sigma| -f64::from(sigma.ln()) < clip)
        .count();
    let steps = Steps::take(options, schedule.steps() - clipped, "linspace")?;
    if clipped > 0 && steps.spacing == Spacing::Trailing {
        let supported = "linspace or leading spacing";
        return Err(options.unsupported("lambda_min_clipped", &clip.into(), supported));
    }
    Ok(steps)
}

/// Reads whether the equation is solved in terms of the clean image (the "++"), and whether noise is added.
fn take_algorithm(options: &mut Options, end_at_zero: bool) -> Result<[bool; 2]> {
    let known = [
        ("dpmsolver++", [true, false]),
        ("sde-dpmsolver++", [true, true]),
        ("dpmsolver", [false, false]),
        ("sde-dpmsolver", [false, true]),
        ("deis", [true, false]),
    ];
    let algorithm = options.choice("algorithm_type", "dpmsolver++", &known)?;
    if end_at_zero && !algorithm[0] {
        let supported = "sigma_min with this algorithm_type";
        return Err(options.unsupported("final_sigmas_type", &"zero".into(), supported));
    }
    Ok(algorithm)
}

fn take_midpoint(options: &mut Options) -> Result<bool> {
    // The last three are UniPC's names, which diffusers replaces by its default here.
    let midpoint = ["midpoint", "logrho", "bh1", "bh2"].map(|name| (name, true));
    let known = [&[("heun", false)], &midpoint[..]].concat();
    options.choice("solver_type", "midpoint", &known)
}

/// An exponential integrator: the linear part of the equation is solved exactly in λ = ln(α/σ),
/// the rest by a polynomial through the last predictions.
///
/// | here | paper |
/// | --- | --- |
/// | `h` | hᵢ = λᵢ₊₁ − λᵢ |
/// | `slope`, `curvature` | D₁, D₂: divided differences of the predictions |
///
/// A level that is visited twice ends the history, because it would lead to a division by zero.
///
/// # References
///
/// Lu et al. (2022), "DPM-Solver", Eqs. 3.7 and B.2 to B.4. Lu et al. (2022), "DPM-Solver++",
/// algorithm 2, Eqs. 4.1 and 4.2, appendix (stochastic).
#[derive(Debug)]
struct DpmSolver {
    config: DpmSolverConfig,
    path: LogSnrPath,
    /// Clean images (or noises), newest first.
    history: Vec<Tensor<4>>,
}

/// Factors of one update x' = a x + b₀ D₀ + b₁ D₁ + b₂ D₂ + c n.
#[derive(Debug)]
struct Factors {
    sample: f64,
    value: f64,
    slope: f64,
    curvature: f64,
    noise: f64,
}

impl DpmSolver {
    /// Order of a step: as high as the history, the end of the run and repeated levels allow.
    fn order(&self, index: usize) -> usize {
        let DpmSolverConfig {
            euler_at_final,
            ref path,
            ref shared,
            ..
        } = self.config;
        let left = self.path.len() - index;
        let short = shared.lower_order_final && self.path.len() < SHORT_RUN;
        let wanted = match left {
            1 if euler_at_final || short || path.end_at_zero => 1,
            2 if short => shared.order.min(2),
            _ => shared.order,
        };
        self.path.order(index, wanted, self.history.len())
    }

    /// The factors of Eqs. 4.1 and 4.2 (in terms of the clean image) or B.2 to B.4 (of the noise): the same
    /// functions of z = −h and z = h. With noise added, z is doubled for the clean image, the amplitude for the noise.
    fn factors(&self, index: usize, order: usize) -> Factors {
        let data = self.config.shared.data;
        let exact = self.path.exact_part(index, data);
        let (amplitude, z, sample, spread) = match (self.config.stochastic, data) {
            (false, _) => (exact.amplitude, exact.h, exact.sample, 0.0),
            (true, true) => {
                let z = 2.0 * exact.h;
                (exact.amplitude, z, exact.sample * exact.h.exp(), z)
            }
            (true, false) => (2.0 * exact.amplitude, exact.h, exact.sample, 2.0 * exact.h),
        };
        let value = z.exp_m1();
        let midpoint = self.config.midpoint && order < 3;
        let slope = if midpoint {
            0.5 * value
        } else {
            over(value, z) - 1.0
        };
        // Variance of the added noise: 1 − e^{−2h}, or e^{2h} − 1.
        let gathered = spread.exp_m1().abs();
        Factors {
            sample,
            value: -amplitude * value,
            slope: -amplitude * slope,
            curvature: -amplitude * (over(over(value - z, z), z) - 0.5),
            noise: self.path.level(index + 1).noise * gathered.sqrt(),
        }
    }

    /// Divided differences D₁ and D₂ of the history, as many as the order needs.
    fn differences(&self, index: usize, order: usize) -> Vec<Tensor<4>> {
        let lambda = |back: usize| self.path.log_snr(index - back);
        let h = self.path.length(index);
        let difference = |i: usize| {
            let ratio = (lambda(i) - lambda(i + 1)) / h;
            (self.history[i].clone() - self.history[i + 1].clone()) / ratio
        };
        match order {
            1 => vec![],
            2 => vec![difference(0)],
            _ => {
                let [r0, r1] = [0, 1].map(|i| (lambda(i) - lambda(i + 1)) / h);
                let newer = difference(0);
                let bend = newer.clone() - difference(1);
                vec![newer + bend.clone() * (r0 / (r0 + r1)), bend / (r0 + r1)]
            }
        }
    }
}

/// x/z, or 0 for a step of zero length.
fn over(x: f64, z: f64) -> f64 {
    if z == 0.0 { 0.0 } else { x / z }
}

impl Scheduler for DpmSolver {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn needs_noise(&self, _index: usize) -> bool {
        self.config.stochastic
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let index = input.index;
        // 1. The clean image, or the noise.
        let shared = &self.config.shared;
        let [denoised, kept] = shared.convert(self.path.level(index), &input);
        self.history.insert(0, kept.clone());
        self.history.truncate(shared.order);
        // 2. The exact part, and the polynomial as far as the history allows.
        let order = self.order(index);
        let factors = self.factors(index, order);
        let mut next = input.sample * factors.sample + kept * factors.value;
        let weights = [factors.slope, factors.curvature];
        for (difference, weight) in self.differences(index, order).into_iter().zip(weights) {
            next = next + difference * weight;
        }
        // 3. Fresh noise.
        if self.config.stochastic {
            next = next + required(input.noise) * factors.noise;
        }
        StepOutput {
            sample: next,
            denoised,
        }
    }
}
