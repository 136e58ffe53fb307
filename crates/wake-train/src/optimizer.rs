//! Learning-rate schedule, `AdamW` and EMA.

use burn::tensor::Tensor;
use wake_nn::adamw::Step;

/// Learning-rate schedule: linear warm-up, then half a cosine down to a tenth of the peak.
///
/// ```text
/// η(s) = peak · (s + 1)/warmup                                       s < warmup
/// η(s) = peak · (0.1 + 0.9 · ½(1 + cos(π (s − warmup)/(steps − warmup))))    after
/// ```
///
/// # References
///
/// Loshchilov & Hutter (2017), "SGDR: Stochastic Gradient Descent with Warm Restarts", Eq. 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LrSchedule {
    /// Largest learning rate.
    pub peak: f64,
    /// Steps of the warm-up.
    pub warmup: usize,
    /// Steps of the run; the rate stays at its last value beyond.
    pub steps: usize,
}

impl LrSchedule {
    /// Learning rate of step number `step`, counted from 0.
    pub fn at(&self, step: usize) -> f64 {
        if step < self.warmup {
            return self.peak * (step + 1) as f64 / self.warmup as f64;
        }
        let length = self.steps.saturating_sub(self.warmup).max(1);
        let part = ((step - self.warmup) as f64 / length as f64).min(1.0);
        self.peak * (0.1 + 0.45 * (1.0 + (std::f64::consts::PI * part).cos()))
    }
}

/// Constants of `Adam`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamOptions {
    /// β₁, decay rate of the average of gradients.
    pub beta_1: f64,
    /// β₂, decay rate of the average of their squares.
    pub beta_2: f64,
    /// ε in the denominator.
    pub epsilon: f64,
    /// Weight decay λ.
    pub weight_decay: f64,
}

impl Default for AdamOptions {
    fn default() -> Self {
        Self {
            beta_1: 0.9,
            beta_2: 0.99,
            epsilon: 1e-8,
            weight_decay: 1e-2,
        }
    }
}

/// Moments of the gradient and averaged weights of every parameter.
///
/// ```text
/// d = min(decay, 1 − (1 + t)^(−2/3))
/// ```
///
/// The decay d of the averaged weights starts low, so that the initial weights are soon forgotten.
///
/// # References
///
/// Loshchilov & Hutter (2019), "Decoupled Weight Decay Regularization", algorithm 2. Karras et al. (2024), "Analyzing and
/// Improving the Training Dynamics of Diffusion Models", section 3; the start of the average follows diffusers' `EMAModel`.
#[derive(Debug, Clone)]
pub(super) struct Optimizer {
    options: AdamOptions,
    ema_decay: f64,
    /// m, v and the averaged weights of each parameter.
    states: Vec<[Tensor<1>; 3]>,
    /// Steps made, t.
    steps: usize,
}

impl Optimizer {
    /// Optimizer whose averaged weights begin with the given ones.
    pub(super) fn new(options: AdamOptions, ema_decay: f64, weights: Vec<Tensor<1>>) -> Self {
        let zero = |average: Tensor<1>| [average.zeros_like(), average.zeros_like(), average];
        Self {
            options,
            ema_decay,
            states: weights.into_iter().map(zero).collect(),
            steps: 0,
        }
    }

    /// Moments and averaged weights after `steps` steps: m, v and averages of all parameters.
    pub(super) fn resume(&mut self, [m, v, averages]: [Vec<Tensor<1>>; 3], steps: usize) {
        let all = m.into_iter().zip(v).zip(averages);
        self.states = all.map(|((m, v), average)| [m, v, average]).collect();
        self.steps = steps;
    }

    /// m, v and averaged weights of all parameters.
    pub(super) fn state(&self) -> [Vec<Tensor<1>>; 3] {
        [0, 1, 2].map(|k| self.states.iter().map(|state| state[k].clone()).collect())
    }

    /// The averaged weights.
    pub(super) fn averages(&self) -> Vec<Tensor<1>> {
        self.states.iter().map(|state| state[2].clone()).collect()
    }

    /// Steps made.
    pub(super) fn steps(&self) -> usize {
        self.steps
    }

    /// Returns the parameters' update for the next step, of learning rate `rate` on `gradients · scale`; it expects every
    /// parameter once, in order.
    pub(super) fn step(
        &mut self,
        gradients: Vec<Tensor<1>>,
        rate: f64,
        scale: f64,
    ) -> impl FnMut(Tensor<1>) -> Tensor<1> {
        self.steps += 1;
        let decay = self.decay();
        let AdamOptions {
            beta_1,
            beta_2,
            epsilon,
            weight_decay,
        } = self.options;
        let [beta_1, beta_2] = [beta_1, beta_2].map(|beta| beta as f32);
        let step = Step {
            beta_1,
            beta_2,
            epsilon: epsilon as f32,
            corrections: [beta_1, beta_2].map(|beta| 1.0 - beta.powi(self.steps as i32)),
            scale: scale as f32,
            rate: rate as f32,
            shrink: (1.0 - rate * f64::from(weight_decay as f32)) as f32,
            decay: [decay, 1.0 - decay].map(|d| d as f32),
        };
        let mut all = gradients.into_iter().zip(&mut self.states);
        move |weights| {
            let Some((gradient, state)) = all.next() else {
                return weights;
            };
            // Moved, not shared, so that they can be updated in place.
            let [m, v, average] = std::mem::replace(
                state,
                [0, 1, 2].map(|_| Tensor::empty([0], &weights.device())),
            );
            let [weights, m, v, average] = step.apply(gradient, [weights, m, v, average]);
            *state = [m, v, average];
            weights
        }
    }

    /// Decay of the averaged weights at the step made last.
    fn decay(&self) -> f64 {
        self.ema_decay
            .min(1.0 - (1.0 + self.steps as f64).powf(-2.0 / 3.0))
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::optim::{AdamWConfig, Optimizer as _};
    use burn::tensor::Device;

    #[test]
    fn rises_to_the_peak_and_falls_to_a_tenth() {
        let rate = LrSchedule {
            peak: 2.0,
            warmup: 4,
            steps: 104,
        };
        for (step, expected) in [
            (0, 0.5),
            (3, 2.0),
            (4, 2.0),
            (54, 1.1),
            (104, 0.2),
            (9999, 0.2),
        ] {
            assert!(
                (rate.at(step) - expected).abs() < 1e-12,
                "{step}: {}",
                rate.at(step)
            );
        }
    }

    /// Runs steps on one parameter: weights after each step, and the optimizer.
    fn steps(options: AdamOptions, start: &[f64], gradients: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let device = Device::flex();
        let tensor = |x: &[f64]| Tensor::<1>::from_floats(x, &device);
        let mut weights = tensor(start);
        let mut optimizer = Optimizer::new(options, 0.9, vec![weights.clone()]);
        let all = gradients.iter().enumerate().map(|(t, gradient)| {
            let mut update = optimizer.step(vec![tensor(gradient)], rate(t), SCALE);
            weights = update(weights.clone());
            drop(update);
            // After three steps the optimizer is stored and restored.
            if t == 2 {
                let state = optimizer.state();
                optimizer = Optimizer::new(options, 0.9, vec![weights.zeros_like()]);
                optimizer.resume(state, 3);
            }
            weights.to_data().iter::<f64>().collect()
        });
        all.collect()
    }

    const SCALE: f64 = 0.5;

    fn rate(t: usize) -> f64 {
        1e-2 / (t + 1) as f64
    }

    const START: [f64; 4] = [1.0, -2.0, 0.5, 3.0];

    fn gradients() -> Vec<Vec<f64>> {
        let gradient = |t| {
            [0.3, -1e-3, 20.0, 0.0]
                .map(|g| g * f64::from(t - 2))
                .to_vec()
        };
        (1..=6).map(gradient).collect()
    }

    /// Compares with algorithm 2 in 64-bit numbers, also after a restart.
    #[test]
    fn steps_are_those_of_the_algorithm_also_after_a_restart() {
        let options = AdamOptions::default();
        let (b1, b2) = (options.beta_1, options.beta_2);
        let mut numbers = START.map(|w| [w, 0.0, 0.0]);
        let found = steps(options, &START, &gradients());
        for (t, gradient) in gradients().into_iter().enumerate() {
            for ([w, m, v], g) in numbers.iter_mut().zip(gradient) {
                let g = SCALE * g;
                *m = b1 * *m + (1.0 - b1) * g;
                *v = b2 * *v + (1.0 - b2) * g * g;
                let corrected = |x: f64, b: f64| x / (1.0 - b.powi(t as i32 + 1));
                let change = corrected(*m, b1) / (corrected(*v, b2).sqrt() + options.epsilon);
                *w = (1.0 - rate(t) * options.weight_decay) * *w - rate(t) * change;
            }
            for (a, [b, ..]) in found[t].iter().zip(&numbers) {
                // Six steps with a few f32 roundings each of numbers up to 3; 1 − β₂ᵗ is known to 1e-5 at t = 1.
                assert!(
                    (a - b).abs() < 6.0 * 4.0 * 3.0 * f64::from(f32::EPSILON) + 1e-7,
                    "{a} {b}"
                );
            }
        }
    }

    /// Weights equal the weights of burn's `AdamW`, bit by bit.
    #[test]
    fn steps_are_those_of_burn() {
        let options = AdamOptions::default();
        let rule = AdamWConfig::new()
            .with_beta_1(options.beta_1 as f32)
            .with_beta_2(options.beta_2 as f32)
            .with_epsilon(options.epsilon as f32)
            .with_weight_decay(options.weight_decay as f32)
            .build();
        let device = Device::flex();
        let (mut weights, mut state) = (Tensor::<1>::from_floats(START, &device), None);
        let found = steps(options, &START, &gradients());
        for (t, gradient) in gradients().into_iter().enumerate() {
            let gradient = Tensor::<1>::from_floats(gradient.as_slice(), &device) * SCALE;
            (weights, state) = rule.step(rate(t), weights, gradient, state);
            let expected: Vec<f64> = weights.to_data().iter().collect();
            assert_eq!(found[t], expected, "step {t}");
        }
    }

    #[test]
    fn the_average_of_a_ramp_is_the_closed_form() {
        let tensor = |x: f64| Tensor::<1>::from_floats([x as f32], &Device::flex());
        let still = AdamOptions {
            weight_decay: 0.0,
            ..AdamOptions::default()
        };
        let mut optimizer = Optimizer::new(still, 0.5, vec![tensor(0.0)]);
        // From step 2 on the decay is 1 − 3^(−2/3) = 0.519 or more, so 0.5: weights 0, 1, …, n leave the
        // lag d/(1 − d) = 1 once the start is forgotten. A gradient of zero changes no weight.
        for step in 1..=40 {
            let weights = optimizer.step(vec![tensor(0.0)], 1e-3, 1.0)(tensor(f64::from(step)));
            assert_eq!(
                weights.into_scalar::<f32>().to_bits(),
                (step as f32).to_bits()
            );
            if step == 1 {
                assert!(
                    (optimizer.decay() - 0.5f64.min(1.0 - 2f64.powf(-2.0 / 3.0))).abs() < 1e-15
                );
            }
        }
        let lag = 40.0 - optimizer.averages()[0].clone().into_scalar::<f32>();
        assert!((lag - 1.0).abs() < 1e-5, "{lag}");
    }
}
