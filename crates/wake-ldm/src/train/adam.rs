//! The optimizer.

use burn::tensor::Tensor;

/// Constants of [`Adam`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamOptions {
    /// β₁, how long gradients are remembered.
    pub beta_1: f64,
    /// β₂, how long their squares are.
    pub beta_2: f64,
    /// ε in the denominator.
    pub epsilon: f64,
    /// Decay λ of the weights.
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

/// Adam with decoupled weight decay, on flat tensors so that its state is as easy to store as the weights.
///
/// ```text
/// m ← β₁ m + (1 − β₁) g,    v ← β₂ v + (1 − β₂) g²
/// w ← (1 − η λ) w − η m̂/(√v̂ + ε),    m̂ = m/(1 − β₁ᵗ),  v̂ = v/(1 − β₂ᵗ)
/// ```
///
/// # References
///
/// Loshchilov & Hutter (2019), "Decoupled Weight Decay Regularization", algorithm 2.
#[derive(Debug, Clone)]
pub struct Adam {
    options: AdamOptions,
    first: Vec<Tensor<1>>,
    second: Vec<Tensor<1>>,
    steps: i32,
}

impl Adam {
    /// An optimizer of the given parameters that has not made a step.
    pub fn new(options: AdamOptions, parameters: &[Tensor<1>]) -> Self {
        let zeros: Vec<Tensor<1>> = parameters.iter().map(Tensor::zeros_like).collect();
        Self {
            options,
            first: zeros.clone(),
            second: zeros,
            steps: 0,
        }
    }

    /// An optimizer as it was after some steps.
    pub fn resumed(
        options: AdamOptions,
        [first, second]: [Vec<Tensor<1>>; 2],
        steps: usize,
    ) -> Self {
        Self {
            options,
            first,
            second,
            steps: i32::try_from(steps).unwrap_or(i32::MAX),
        }
    }

    /// The averages m and v.
    pub fn state(&self) -> [&[Tensor<1>]; 2] {
        [&self.first, &self.second]
    }

    /// The parameters after one step of size `rate` against `gradients · scale`.
    pub fn step(
        &mut self,
        parameters: Vec<Tensor<1>>,
        gradients: Vec<Tensor<1>>,
        rate: f64,
        scale: f64,
    ) -> Vec<Tensor<1>> {
        let AdamOptions {
            beta_1,
            beta_2,
            epsilon,
            weight_decay,
        } = self.options;
        self.steps += 1;
        let correction = |beta: f64| 1.0 - beta.powi(self.steps);
        let (first, second) = (correction(beta_1), correction(beta_2));
        let mut stepped = Vec::with_capacity(parameters.len());
        for (i, (w, g)) in parameters.into_iter().zip(gradients).enumerate() {
            let g = g * scale;
            let m = self.first[i].clone() * beta_1 + g.clone() * (1.0 - beta_1);
            let v = self.second[i].clone() * beta_2 + g.square() * (1.0 - beta_2);
            let change = m.clone() / ((v.clone() / second).sqrt() + epsilon);
            (self.first[i], self.second[i]) = (m, v);
            stepped.push(w * (1.0 - rate * weight_decay) - change * (rate / first));
        }
        stepped
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::optim::{AdamWConfig, Optimizer};
    use burn::tensor::Device;

    /// burn's own AdamW, an independent implementation, makes the same steps.
    #[test]
    fn steps_are_those_of_burns_adamw() {
        let device = Device::flex();
        let options = AdamOptions::default();
        let oracle = AdamWConfig::new()
            .with_beta_1(options.beta_1 as f32)
            .with_beta_2(options.beta_2 as f32)
            .with_epsilon(options.epsilon as f32)
            .with_weight_decay(options.weight_decay as f32)
            .build();
        let start = Tensor::<1>::from_floats([1.0, -2.0, 0.5, 3.0], &device);
        let (mut ours, mut theirs, mut state) = (vec![start.clone()], start.clone(), None);
        let mut adam = Adam::new(options, &ours);
        for step in 0..5 {
            let gradient =
                Tensor::<1>::from_floats([0.3, -1e-3, 20.0, 0.0], &device) * f64::from(step - 2);
            ours = adam.step(ours, vec![gradient.clone()], 1e-2, 1.0);
            (theirs, state) = oracle.step(1e-2, theirs, gradient, state);
        }
        let difference = (ours.remove(0) - theirs).abs().max().into_scalar::<f32>();
        // Five steps of a few roundings of f32 of numbers up to 3.
        assert!(difference < 5.0 * 4.0 * 3.0 * f32::EPSILON, "{difference}");
    }
}
