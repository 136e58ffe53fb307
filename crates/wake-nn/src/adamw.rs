//! `AdamW` with an exponential moving average of the weights.

use burn::tensor::Tensor;

/// Constants of one step of `AdamW` and of the average of the weights.
///
/// ```text
/// m ← β₁ m + (1 − β₁) s g,    v ← β₂ v + (1 − β₂) (s g)²
/// w ← (1 − η λ) w − η (m/c₁)/(√(v/c₂) + ε),    c = 1 − βᵗ
/// a ← d a + (1 − d) w
/// ```
///
/// # References
///
/// Loshchilov & Hutter (2019), "Decoupled Weight Decay Regularization", algorithm 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// β₁, decay of the average of gradients.
    pub beta_1: f32,
    /// β₂, decay of the average of their squares.
    pub beta_2: f32,
    /// ε in the denominator.
    pub epsilon: f32,
    /// c₁ = 1 − β₁ᵗ and c₂ = 1 − β₂ᵗ.
    pub corrections: [f32; 2],
    /// s, factor of the gradient.
    pub scale: f32,
    /// η, learning rate.
    pub rate: f32,
    /// 1 − ηλ, factor of the weights.
    pub shrink: f32,
    /// d and 1 − d of the average.
    pub decay: [f32; 2],
}

impl Step {
    /// Returns weights w, moments m and v, and averaged weights a after the step.
    ///
    /// On burn's CPU backend, unshared f32 tensors outside autodiff are updated in place, in one pass on all cores, with the same
    /// results bit by bit. Shared tensors are copied first.
    ///
    /// - `gradient`: `[n]`
    /// - `state`: w, m, v and a, each `[n]`; v at least 0
    #[must_use]
    pub fn apply(&self, gradient: Tensor<1>, state: [Tensor<1>; 4]) -> [Tensor<1>; 4] {
        #[cfg(feature = "flex")]
        let (gradient, state) = match native::apply(self, gradient, state) {
            Ok(state) => return state,
            Err(unchanged) => *unchanged,
        };
        let [w, m, v, a] = state;
        let g = gradient * self.scale;
        let m = m * self.beta_1 + g.clone() * (1.0 - self.beta_1);
        let v = v * self.beta_2 + g.square() * (1.0 - self.beta_2);
        let [first, second] = self.corrections;
        let change = (m.clone() / first) / ((v.clone() / second).sqrt() + self.epsilon);
        let w = w * self.shrink - change * self.rate;
        let a = a * self.decay[0] + w.clone() * self.decay[1];
        [w, m, v, a]
    }
}

#[cfg(feature = "flex")]
mod native {
    use rayon::prelude::*;

    use super::*;
    use crate::operation::{runs_here, tensor_of, unshared, values_of};

    /// Elements that one task updates, few enough for five slices to fit a cache of the second level.
    const CHUNK: usize = 1 << 14;

    /// Arguments that are returned unchanged unless all are f32 on burn's CPU backend, outside autodiff.
    type Unchanged = Box<(Tensor<1>, [Tensor<1>; 4])>;

    pub(super) fn apply(
        step: &Step,
        gradient: Tensor<1>,
        state: [Tensor<1>; 4],
    ) -> Result<[Tensor<1>; 4], Unchanged> {
        let here = |x: &Tensor<1>| !x.is_autodiff() && runs_here(&x.clone().into_dispatch());
        let length = gradient.dims();
        if !state
            .iter()
            .chain([&gradient])
            .all(|x| here(x) && x.dims() == length)
        {
            return Err(Box::new((gradient, state)));
        }
        let gradient = unshared(gradient.into_dispatch());
        let mut state = state.map(|x| unshared(x.into_dispatch()));
        let [w, m, v, a] = state
            .each_mut()
            .map(|x| x.storage_mut::<f32>().par_chunks_mut(CHUNK));
        let all = values_of(&gradient)
            .par_chunks(CHUNK)
            .zip(w.zip(a).zip(m.zip(v)));
        all.for_each(|(g, ((w, a), (m, v)))| update(step, g, [w, m, v, a]));
        Ok(state.map(tensor_of))
    }

    /// Rounds every operation as an operation on whole tensors would.
    fn update(step: &Step, g: &[f32], [w, m, v, a]: [&mut [f32]; 4]) {
        let [of_first, of_second] = [1.0 - step.beta_1, 1.0 - step.beta_2];
        let all = g.iter().zip(w).zip(m.iter_mut().zip(v).zip(a));
        for ((g, w), ((m, v), a)) in all {
            let g = g * step.scale;
            *m = *m * step.beta_1 + g * of_first;
            *v = *v * step.beta_2 + g * g * of_second;
            let [first, second] = [*m / step.corrections[0], *v / step.corrections[1]];
            *w = *w * step.shrink - first / (second.sqrt() + step.epsilon) * step.rate;
            *a = *a * step.decay[0] + *w * step.decay[1];
        }
    }
}

#[cfg(all(test, feature = "flex", feature = "ndarray"))]
mod tests {
    use super::*;
    use burn::tensor::Device;

    /// The one pass of burn's CPU backend gives the bits of the tensor operations of another backend, also for slices of a longer
    /// tensor and while somebody else holds the weights, who keeps the old ones.
    #[test]
    fn one_pass_gives_the_bits_of_tensor_operations() {
        let step = Step {
            beta_1: 0.9,
            beta_2: 0.99,
            epsilon: 1e-8,
            corrections: [0.271, 0.029_701],
            scale: 0.37,
            rate: 1e-2,
            shrink: 1.0 - 1e-4,
            decay: [0.63, 0.37],
        };
        let count = 40_000;
        let numbers = |seed: usize, least: f32| -> Vec<f32> {
            let next = |i: usize| ((i * 7919 + seed * 104_729) % 10_007) as f32 / 10_007.0;
            (0..count + 3).map(|i| (next(i) - 0.5).max(least)).collect()
        };
        let run = |device: &Device| {
            let tensor = |seed, least| {
                let numbers = numbers(seed, least);
                let whole = Tensor::<1>::from_floats(numbers.as_slice(), device);
                whole.narrow(0, 3, count)
            };
            let weights = tensor(1, -1.0);
            let state = [
                weights.clone(),
                tensor(2, -1.0),
                tensor(3, 0.0),
                tensor(4, -1.0),
            ];
            let before = weights.to_data();
            let after = step.apply(tensor(5, -1.0), state);
            assert_eq!(weights.to_data(), before);
            after.map(|x| x.into_data().try_to_vec::<f32>().expect("numbers"))
        };
        let ndarray = crate::device_named("ndarray").expect("a device");
        assert_eq!(run(&Device::flex()), run(&ndarray));
    }
}
