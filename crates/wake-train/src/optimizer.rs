//! Learning-rate schedule, `AdamW` and EMA.

use burn::optim::{AdamW, AdamWConfig, AdamWState, AdaptiveMomentumState, Optimizer};
use burn::tensor::Tensor;

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

/// Adam with decoupled weight decay (burn's), with a state that can be stored beside the weights.
///
/// ```text
/// m ← β₁ m + (1 − β₁) g,    v ← β₂ v + (1 − β₂) g²
/// w ← (1 − η λ) w − η m̂/(√v̂ + ε),    m̂ = m/(1 − β₁ᵗ),  v̂ = v/(1 − β₂ᵗ)
/// ```
///
/// # References
///
/// Loshchilov & Hutter (2019), "Decoupled Weight Decay Regularization", algorithm 2.
#[derive(Clone)]
pub(super) struct Adam {
    rule: AdamW,
    /// m and v of each parameter, and t; `None` before the first step.
    states: Vec<Option<AdamWState<1>>>,
}

impl Adam {
    /// New optimizer of `parameters` parameters.
    pub(super) fn new(options: AdamOptions, parameters: usize) -> Self {
        let rule = AdamWConfig::new()
            .with_beta_1(options.beta_1 as f32)
            .with_beta_2(options.beta_2 as f32)
            .with_epsilon(options.epsilon as f32)
            .with_weight_decay(options.weight_decay as f32)
            .build();
        Self {
            rule,
            states: vec![None; parameters],
        }
    }

    /// Optimizer restored after `steps` steps from its averages m and v.
    pub(super) fn resumed(
        options: AdamOptions,
        [first, second]: [Vec<Tensor<1>>; 2],
        steps: usize,
    ) -> Self {
        let mut adam = Self::new(options, first.len());
        if steps > 0 {
            let averages = first.into_iter().zip(second);
            let state = |(m, v)| AdamWState::new(AdaptiveMomentumState::new(steps, m, v));
            adam.states = averages.map(|pair| Some(state(pair))).collect();
        }
        adam
    }

    /// The averages m and v, zero before the first step.
    pub(super) fn averages(&self, parameters: &[Tensor<1>]) -> [Vec<Tensor<1>>; 2] {
        let of = |choose: fn(&AdaptiveMomentumState<1>) -> &Tensor<1>| {
            let states = self.states.iter().zip(parameters);
            let one = |(state, like): (&Option<AdamWState<1>>, &Tensor<1>)| match state {
                Some(state) => choose(&state.momentum).clone(),
                None => like.zeros_like(),
            };
            states.map(one).collect()
        };
        [of(|state| &state.moment_1), of(|state| &state.moment_2)]
    }

    /// Returns the parameters after one step of learning rate `rate` on `gradients · scale`.
    pub(super) fn step(
        &mut self,
        parameters: Vec<Tensor<1>>,
        gradients: Vec<Tensor<1>>,
        rate: f64,
        scale: f64,
    ) -> Vec<Tensor<1>> {
        let all = parameters.into_iter().zip(gradients).zip(&mut self.states);
        let step = |((w, g), state): ((Tensor<1>, Tensor<1>), &mut Option<AdamWState<1>>)| {
            let (w, new) = self.rule.step(rate, w, g * scale, state.take());
            *state = new;
            w
        };
        all.map(step).collect()
    }
}

impl std::fmt::Debug for Adam {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Adam of {} parameters", self.states.len())
    }
}

/// An exponential moving average of the weights.
///
/// ```text
/// a ← d a + (1 − d) w,    d = min(decay, 1 − (1 + step)^(−2/3))
/// ```
///
/// The decay starts low, so that the initial weights are soon forgotten.
///
/// # References
///
/// Karras et al. (2024), "Analyzing and Improving the Training Dynamics of Diffusion Models", section 3. The start
/// follows diffusers' `EMAModel`.
#[derive(Debug, Clone)]
pub(super) struct Average {
    values: Vec<Tensor<1>>,
    decay: f64,
}

impl Average {
    /// An average that begins with the given weights.
    pub(super) fn new(values: Vec<Tensor<1>>, decay: f64) -> Self {
        Self { values, decay }
    }

    /// The averaged weights.
    pub(super) fn values(&self) -> &[Tensor<1>] {
        &self.values
    }

    /// The decay after `step` steps.
    pub(super) fn decay(&self, step: usize) -> f64 {
        self.decay.min(1.0 - (1.0 + step as f64).powf(-2.0 / 3.0))
    }

    /// Updates the average with the weights after step number `step`, counted from 1.
    pub(super) fn update(&mut self, weights: &[Tensor<1>], step: usize) {
        let decay = self.decay(step);
        for (average, weight) in self.values.iter_mut().zip(weights) {
            *average = average.clone() * decay + weight.clone() * (1.0 - decay);
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
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

    /// Compares with algorithm 2 in 64-bit numbers; after three steps the optimizer is stored and restored.
    #[test]
    fn steps_are_those_of_the_algorithm_also_after_a_restart() {
        let options = AdamOptions::default();
        let (b1, b2) = (options.beta_1, options.beta_2);
        let start = [1.0, -2.0, 0.5, 3.0];
        let mut numbers = start.map(|w| [w, 0.0, 0.0]);
        let device = Device::flex();
        let tensor = |x: [f64; 4]| Tensor::<1>::from_floats(x.map(|x| x as f32), &device);
        let mut weights = vec![tensor(start)];
        let mut adam = Adam::new(options, 1);
        for t in 1..=6 {
            let gradient = [0.3, -1e-3, 20.0, 0.0].map(|g| g * f64::from(t - 2));
            let rate = 1e-2 / f64::from(t);
            for ([w, m, v], g) in numbers.iter_mut().zip(gradient) {
                let g = 0.5 * g;
                *m = b1 * *m + (1.0 - b1) * g;
                *v = b2 * *v + (1.0 - b2) * g * g;
                let (first, second) = (*m / (1.0 - b1.powi(t)), *v / (1.0 - b2.powi(t)));
                let change = first / (second.sqrt() + options.epsilon);
                *w = (1.0 - rate * options.weight_decay) * *w - rate * change;
            }
            weights = adam.step(weights, vec![tensor(gradient)], rate, 0.5);
            if t == 3 {
                adam = Adam::resumed(options, adam.averages(&weights), 3);
            }
        }
        let found: Vec<f64> = weights[0].to_data().iter::<f64>().collect();
        for (a, [b, ..]) in found.iter().zip(&numbers) {
            // Six steps with a few f32 roundings each of numbers up to 3; 1 − β₂ᵗ is known to 1e-5 at t = 1.
            assert!(
                (a - b).abs() < 6.0 * 4.0 * 3.0 * f64::from(f32::EPSILON) + 1e-7,
                "{a} {b}"
            );
        }
    }

    #[test]
    fn the_average_of_a_ramp_is_the_closed_form() {
        let tensor = |x: f64| Tensor::<1>::from_floats([x as f32], &Device::flex());
        let mut average = Average::new(vec![tensor(0.0)], 0.5);
        // From step 2 on the decay is 1 − 3^(−2/3) = 0.519 or more, so 0.5: weights 0, 1, …, n leave the
        // lag d/(1 − d) = 1 once the start is forgotten.
        for step in 1..=40 {
            average.update(&[tensor(step as f64)], step);
        }
        let lag = 40.0 - average.values()[0].clone().into_scalar::<f32>();
        assert!((lag - 1.0).abs() < 1e-5, "{lag}");
        assert!((average.decay(1) - (1.0 - 2f64.powf(-2.0 / 3.0))).abs() < 1e-15);
    }
}
