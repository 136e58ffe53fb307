//! Noise added by each training step, and its accumulation.

use super::betas::{BetaCurve, ScheduleDefaults, TerminalSnr};
use super::prediction::NoiseLevel;
use crate::options::Options;
use wake_nn::{Result, check_range};

/// Signal left after each training step.
///
/// ```text
/// ᾱₜ = ∏ₛ₌₀ᵗ (1 − βₛ)        xₜ = √ᾱₜ x₀ + √(1 − ᾱₜ) n
/// ```
///
/// Numbers are rounded to f32 where PyTorch rounds them, because the models were trained with
/// those; otherwise the last steps of a cosine schedule would differ in the fifth digit.
///
/// # References
///
/// Ho et al. (2020), "Denoising Diffusion Probabilistic Models", Eq. 4. Nichol & Dhariwal (2021),
/// "Improved Denoising Diffusion Probabilistic Models", Eq. 17 (cosine).
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseSchedule {
    curve: BetaCurve,
    betas: Vec<f32>,
    alphas_cumprod: Vec<f32>,
}

impl NoiseSchedule {
    /// Makes the schedule of a number of training steps.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`](wake_nn::Error::OutOfRange) for fewer than 2 or more than 100,000 steps, for a first or last β
    /// outside [1e-8, 0.9999], or for a β given one by one outside [0, 1] (0 is not allowed for the first).
    pub fn new(curve: &BetaCurve, steps: usize, terminal: TerminalSnr) -> Result<Self> {
        check_range("num_train_timesteps", steps as f64, 2.0, 1e5)?;
        let mut betas = curve.betas(steps)?;
        if terminal != TerminalSnr::Kept {
            betas = without_terminal_signal(&betas);
        }
        let mut alphas_cumprod = cumulative_product(betas.iter().map(|beta| 1.0 - beta));
        if terminal == TerminalSnr::AlmostZero
            && let Some(last) = alphas_cumprod.last_mut()
        {
            *last = f32::EPSILON / 2.0;
        }
        Ok(Self {
            curve: curve.clone(),
            betas,
            alphas_cumprod,
        })
    }

    /// Number of training steps T.
    pub fn steps(&self) -> usize {
        self.betas.len()
    }

    /// Shape of the noise added per step, before any stretching.
    pub fn curve(&self) -> &BetaCurve {
        &self.curve
    }

    /// Noise βₜ added by each step.
    pub fn betas(&self) -> &[f32] {
        &self.betas
    }

    /// Signal ᾱₜ left after each step (a variance).
    pub fn alphas_cumprod(&self) -> &[f32] {
        &self.alphas_cumprod
    }

    /// Signal ᾱₜ left after step `t`.
    ///
    /// # Panics
    ///
    /// When there are not that many steps.
    pub fn alpha_cumprod(&self, t: usize) -> f64 {
        f64::from(self.alphas_cumprod[t])
    }

    /// Signal left after step `t`; before the first step it is 1, or else that after the first step.
    pub(super) fn alpha_or_end(&self, t: i64, end_at_one: bool) -> f64 {
        match usize::try_from(t) {
            Ok(t) => self.alpha_cumprod(t),
            Err(_) if end_at_one => 1.0,
            Err(_) => self.alpha_cumprod(0),
        }
    }

    /// Noise level after step `t`: √ᾱₜ and √(1 − ᾱₜ).
    ///
    /// # Panics
    ///
    /// When there are not that many steps.
    pub fn noise_level(&self, t: usize) -> NoiseLevel {
        NoiseLevel::from_alpha_cumprod(self.alpha_cumprod(t))
    }

    /// Noise relative to the signal, σₜ = √((1 − ᾱₜ)/ᾱₜ), rising with t; infinite where no signal
    /// is left.
    pub fn sigmas(&self) -> Vec<f32> {
        self.alphas_cumprod
            .iter()
            .map(|alpha| ((1.0 - alpha) / alpha).sqrt())
            .collect()
    }
}

impl NoiseLevel {
    /// √ᾱ and √(1 − ᾱ).
    pub(super) fn from_alpha_cumprod(alpha_cumprod: f64) -> Self {
        Self {
            signal: alpha_cumprod.sqrt(),
            noise: (1.0 - alpha_cumprod).sqrt(),
        }
    }
}

impl NoiseSchedule {
    /// Reads the options that shape the schedule.
    pub(super) fn take(options: &mut Options, defaults: &ScheduleDefaults) -> Result<Self> {
        let steps = options.usize("num_train_timesteps", 1000)?;
        let curve = BetaCurve::take(options, defaults)?;
        let terminal = match defaults.rescaled {
            Some(terminal) if options.bool("rescale_betas_zero_snr", false)? => terminal,
            _ => TerminalSnr::Kept,
        };
        Self::new(&curve, steps, terminal)
    }
}

/// Variance of a reverse step from ᾱ to ᾱ', given the clean image.
///
/// ```text
/// β̃ = (1 − ᾱ')/(1 − ᾱ) (1 − ᾱ/ᾱ')
/// ```
///
/// # References
///
/// Ho et al. (2020), "Denoising Diffusion Probabilistic Models", Eq. 7.
pub(super) fn posterior_variance(now: f64, next: f64) -> f64 {
    (1.0 - next) / (1.0 - now) * (1.0 - now / next)
}

/// Cumulative products of the factors, accumulated in f64 and each rounded to f32.
fn cumulative_product(factors: impl Iterator<Item = f32>) -> Vec<f32> {
    let running = |product: &mut f64, factor: f32| {
        *product *= f64::from(factor);
        Some(*product as f32)
    };
    factors.scan(1.0, running).collect()
}

/// Stretches √ᾱ linearly so that the last becomes 0 and the first stays.
///
/// # References
///
/// Lin et al. (2024), algorithm 1.
fn without_terminal_signal(betas: &[f32]) -> Vec<f32> {
    let alphas_cumprod = cumulative_product(betas.iter().map(|beta| 1.0 - beta));
    let roots: Vec<f32> = alphas_cumprod.into_iter().map(f32::sqrt).collect();
    let (first, last) = (roots[0], roots[roots.len() - 1]);
    let stretch = first / (first - last);
    let squares: Vec<f32> = roots
        .iter()
        .map(|root| ((root - last) * stretch).powi(2))
        .collect();
    let ratios = squares.windows(2).map(|pair| pair[1] / pair[0]);
    std::iter::once(squares[0])
        .chain(ratios)
        .map(|alpha| 1.0 - alpha)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [BetaCurve; 5] = [
        BetaCurve::Linear(1e-4, 0.02),
        BetaCurve::ScaledLinear(0.00085, 0.012),
        BetaCurve::SquaredCosine,
        BetaCurve::Exponential,
        BetaCurve::Sigmoid(1e-4, 0.02),
    ];

    fn stable_diffusion(terminal: TerminalSnr) -> NoiseSchedule {
        NoiseSchedule::new(&BetaCurve::ScaledLinear(0.00085, 0.012), 1000, terminal).unwrap()
    }

    /// Published values of Stable Diffusion's schedule, in f32.
    #[test]
    fn stable_diffusion_schedule_has_its_known_values() {
        let schedule = stable_diffusion(TerminalSnr::Kept);
        let close = |t: usize, value: f64| {
            let relative = schedule.alpha_cumprod(t) / value - 1.0;
            // f32 rounding of 1000 betas and their complements: 1000 · 6e-8 / sqrt(1000), twice.
            assert!(relative.abs() < 4e-6, "{t}: {relative:e}");
        };
        close(0, 0.99915);
        close(500, 0.27633268);
        close(999, 0.00466010);
        assert!((f64::from(schedule.sigmas()[999]) / 14.6146412 - 1.0).abs() < 2e-6);
        assert!((f64::from(schedule.betas()[0]) - 0.00085).abs() < 1e-10);
        assert!((f64::from(schedule.betas()[999]) - 0.012).abs() < 1e-9);
    }

    #[test]
    fn signal_falls_and_noise_rises_for_every_curve_and_length() {
        for curve in &CURVES {
            for steps in [2, 3, 10, 999, 1000, 4000] {
                for terminal in [
                    TerminalSnr::Kept,
                    TerminalSnr::Zero,
                    TerminalSnr::AlmostZero,
                ] {
                    let schedule = NoiseSchedule::new(curve, steps, terminal).unwrap();
                    let alphas = schedule.alphas_cumprod();
                    // The 2⁻²⁴ at the end may exceed what stretching leaves just before it.
                    let compared = steps - usize::from(terminal == TerminalSnr::AlmostZero);
                    let falls = alphas[..compared].windows(2).all(|pair| pair[1] < pair[0]);
                    assert!(falls, "{curve:?} {steps} {terminal:?}");
                    assert!(alphas.iter().all(|alpha| (0.0..1.0).contains(alpha)));
                    let finite = schedule.sigmas().iter().all(|sigma| sigma.is_finite());
                    assert_eq!(finite, terminal != TerminalSnr::Zero);
                }
            }
        }
    }

    #[test]
    fn zero_terminal_snr_ends_at_zero_and_keeps_the_start() {
        let kept = stable_diffusion(TerminalSnr::Kept);
        let zero = stable_diffusion(TerminalSnr::Zero);
        assert!(zero.alpha_cumprod(999).abs() < f64::MIN_POSITIVE);
        assert!((zero.alpha_cumprod(0) - kept.alpha_cumprod(0)).abs() < 1e-6);
        let almost = stable_diffusion(TerminalSnr::AlmostZero);
        assert!((almost.alpha_cumprod(999) - 2f64.powi(-24)).abs() < 1e-20);
    }

    #[test]
    fn bad_numbers_are_refused_by_name() {
        let new = |curve, steps| NoiseSchedule::new(&curve, steps, TerminalSnr::Kept);
        assert!(new(BetaCurve::Linear(0.0, 0.02), 1000).is_err());
        assert!(new(BetaCurve::Linear(1e-4, 1.5), 1000).is_err());
        assert!(new(BetaCurve::Linear(f64::NAN, 0.02), 1000).is_err());
        assert!(new(BetaCurve::SquaredCosine, 1).is_err());
        assert!(new(BetaCurve::SquaredCosine, usize::MAX).is_err());
        let error = new(BetaCurve::Trained(vec![0.1]), 3)
            .unwrap_err()
            .to_string();
        assert_eq!(error, "length of trained_betas is 1, expected 3");
    }

    /// Variances of the linear schedule equal the published ones.
    #[test]
    fn variances_are_the_published_ones() {
        let curve = BetaCurve::Linear(1e-4, 0.02);
        let schedule = NoiseSchedule::new(&curve, 1000, TerminalSnr::Kept).unwrap();
        for (t, next, expected) in [
            (420, 400, 0.14771),
            (980, 960, 0.32460),
            (487, 486, 0.00979),
            (999, 998, 0.02),
        ] {
            let variance =
                posterior_variance(schedule.alpha_cumprod(t), schedule.alpha_cumprod(next));
            assert!((variance - expected).abs() < 1e-5, "{t}: {variance}");
        }
    }
}
