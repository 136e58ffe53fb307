//! A linear multistep method in the noise level σ.

use burn::tensor::Tensor;

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::Prediction;
use super::sigma_sampler::{Call, SigmaConfig, SigmaMethod};
use super::sigmas::{SigmaOptions, Spread};
use crate::options::Options;
use wake_nn::{Result, check_range};

/// Multistep method that integrates a polynomial through the slopes of the last four levels.
///
/// ```text
/// x' = x + Σⱼ cⱼ dᵢ₋ⱼ        cⱼ = ∫ ∏_{k≠j} (σ − σᵢ₋ₖ)/(σᵢ₋ⱼ − σᵢ₋ₖ) dσ  from σᵢ to σᵢ₊₁
/// ```
///
/// The integrals are computed in closed form. A run started in the middle begins with first order again
/// (diffusers does not, and uses weights for slopes that it does not have).
///
/// # References
///
/// The Adams-Bashforth method on uneven steps, Hairer, Nørsett & Wanner (1993), "Solving Ordinary
/// Differential Equations I", section III.5.
#[derive(Debug, Clone)]
pub(super) struct Lms {
    order: usize,
    /// Slopes at the last levels, newest first.
    slopes: Vec<Tensor<4>>,
}

impl SigmaMethod for Lms {
    fn take(options: &mut Options) -> Result<SigmaConfig<Self>> {
        let defaults = ScheduleDefaults {
            rescaled: None,
            ..DEFAULTS
        };
        let order = options.usize("order", 4)?;
        check_range("order", order as f64, 1.0, 4.0)?;
        let method = Self {
            order,
            slopes: Vec::new(),
        };
        let mut config = SigmaConfig::take_common(options, &defaults, &Prediction::CURVED, method)?;
        config.sigmas = SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?;
        Ok(config)
    }

    fn advance(&mut self, call: Call<'_>) -> Tensor<4> {
        let (_, next) = call.ends();
        self.slopes.insert(0, call.slope);
        self.slopes.truncate(self.order);
        // A level visited twice adds nothing, and older slopes cannot be used.
        let nodes: Vec<f64> = (0..self.slopes.len())
            .map(|back| call.sigmas[call.index - back])
            .collect();
        let rising = nodes.windows(2).take_while(|pair| pair[1] > pair[0]);
        let usable = 1 + rising.count();
        let weights = interpolation_weights(&nodes[..usable], next);
        let weighted = self.slopes.iter().zip(weights);
        weighted.fold(call.sample, |sum, (slope, weight)| {
            sum + slope.clone() * weight
        })
    }
}

/// Integral of each Lagrange polynomial on the nodes, from the first node to `end`.
fn interpolation_weights(nodes: &[f64], end: f64) -> Vec<f64> {
    // Shifted to the first node and scaled to the step, so that powers stay of order one.
    let length = end - nodes[0];
    if length == 0.0 {
        return vec![0.0; nodes.len()];
    }
    let shifted: Vec<f64> = nodes
        .iter()
        .map(|node| (node - nodes[0]) / length)
        .collect();
    (0..nodes.len())
        .map(|j| length * unit_integral(&lagrange(&shifted, j)))
        .collect()
}

/// Coefficients, lowest first, of the polynomial that is 1 at node j and 0 at the others.
fn lagrange(nodes: &[f64], j: usize) -> Vec<f64> {
    let others = nodes.iter().enumerate().filter(|&(k, _)| k != j);
    others.fold(vec![1.0], |polynomial, (_, &node)| {
        let scale = 1.0 / (nodes[j] - node);
        let mut product = vec![0.0; polynomial.len() + 1];
        for (power, coefficient) in polynomial.iter().enumerate() {
            product[power + 1] += coefficient * scale;
            product[power] -= coefficient * scale * node;
        }
        product
    })
}

/// Integral of a polynomial from 0 to 1.
fn unit_integral(polynomial: &[f64]) -> f64 {
    polynomial
        .iter()
        .enumerate()
        .map(|(power, c)| c / (power + 1) as f64)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evenly spaced nodes give the textbook's Adams-Bashforth weights.
    #[test]
    fn even_nodes_give_adams_bashforth() {
        let weights = interpolation_weights(&[3.0, 2.0, 1.0, 0.0], 4.0);
        let expected = [55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0];
        for (weight, expected) in weights.iter().zip(expected) {
            assert!((weight - expected).abs() < 1e-13, "{weight} {expected}");
        }
    }

    /// The method integrates polynomials of degree below its order exactly, on any nodes.
    #[test]
    fn polynomials_of_lower_degree_are_integrated_exactly() {
        let nodes = [1.749, 3.169, 5.478, 9.103];
        let end: f64 = 0.914;
        let weights = interpolation_weights(&nodes, end);
        for degree in 0..4 {
            let sum: f64 = weights
                .iter()
                .zip(nodes)
                .map(|(w, x)| w * x.powi(degree))
                .sum();
            let exact = (end.powi(degree + 1) - nodes[0].powi(degree + 1)) / f64::from(degree + 1);
            assert!(
                (sum - exact).abs() < 1e-12 * exact.abs(),
                "{degree}: {sum} {exact}"
            );
        }
    }
}
