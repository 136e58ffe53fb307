//! Gauss–Legendre and Gauss–Hermite quadrature, and the number of nodes for an oscillating integrand.

use super::search::root;
use std::f64::consts::PI;

/// Nodes and weights of Gauss–Legendre quadrature on [−1, 1].
///
/// ```text
/// ∫₋₁¹ f(t) dt ≈ Σᵢ wᵢ f(tᵢ),   exact for polynomials up to degree 2n − 1
/// ```
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GaussLegendre {
    /// Nodes tᵢ, in descending order.
    pub nodes: Vec<f64>,
    /// Weights wᵢ, above 0.
    pub weights: Vec<f64>,
}

impl GaussLegendre {
    /// Finds the `count` ≥ 1 nodes by Newton's method on the Legendre polynomial.
    #[must_use]
    pub(crate) fn new(count: usize) -> Self {
        let n = count.max(1);
        let (mut nodes, mut weights) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for i in 0..n {
            let mut t = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (value, derivative) = legendre(n, t);
                slope = derivative;
                t -= value / derivative;
            }
            nodes.push(t);
            weights.push(2.0 / ((1.0 - t * t) * slope * slope));
        }
        Self { nodes, weights }
    }

    /// Nodes and weights mapped to [from, to].
    pub(crate) fn on(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        self.nodes
            .iter()
            .zip(&self.weights)
            .map(move |(t, w)| (middle + half * t, half * w))
    }

    /// ∫ f over [from, to].
    pub(crate) fn integrate(&self, [from, to]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
        self.on(from, to).map(|(t, w)| w * f(t)).sum()
    }
}

/// Legendre polynomial Pₙ and its derivative at |t| < 1, by the three-term recurrence.
fn legendre(n: usize, t: f64) -> (f64, f64) {
    let (mut before, mut p) = (1.0, t);
    for j in 2..=n {
        let j = j as f64;
        (before, p) = (p, ((2.0 * j - 1.0) * t * p - (j - 1.0) * before) / j);
    }
    (p, n as f64 * (before - t * p) / (1.0 - t * t))
}

/// Largest phase that a panel of `count` Gauss–Legendre nodes may span for a given error.
///
/// The remainder of the rule for exp(iωt), t in [−1, 1], is bounded by
///
/// ```text
/// |E| ≤ 2^(2n+1) (n!)⁴ / ((2n+1) ((2n)!)³) · ω^(2n)
/// ```
///
/// - `count` n, nodes of the rule
/// - `error` |E|, above 0
/// - returns the phase 2ω \[rad\]
///
/// # References
///
/// Davis and Rabinowitz (1984), *Methods of Numerical Integration*, §2.7.
#[must_use]
pub(crate) fn largest_phase(count: usize, error: f64) -> f64 {
    let n = count as f64;
    let ln_factorial = |m: usize| (2..=m).map(|i| (i as f64).ln()).sum::<f64>();
    let ln_bound = (2.0 * n + 1.0) * 2f64.ln() + 4.0 * ln_factorial(count)
        - (2.0 * n + 1.0).ln()
        - 3.0 * ln_factorial(2 * count);
    2.0 * ((error.ln() - ln_bound) / (2.0 * n)).exp()
}

/// For each count, nodes and weights of the mean over a unit Gaussian, exact to degree 2·count − 1.
///
/// The nodes are the zeros of the Hermite polynomial, which interlace with those of the previous degree.
pub(crate) fn gauss_hermite(counts: &[usize]) -> Vec<Vec<[f64; 2]>> {
    let largest = counts.iter().copied().max().unwrap_or(0);
    let (mut zeros, mut rules) = (Vec::new(), Vec::new());
    for n in 1..=largest {
        let bound = 2.0 * (n as f64).sqrt() + 1.0;
        let ends = [&[-bound], &zeros[..], &[bound]].concat();
        let of = |pair: &[f64]| root(|x| hermite(n, x)[0], [pair[0], pair[1]], 56);
        zeros = ends.windows(2).map(of).collect::<Vec<f64>>();
        if counts.contains(&n) {
            let nodes = zeros.iter().map(|&z| [z, 1.0 / hermite(n, z)[1]]);
            rules.push(nodes.collect());
        }
    }
    rules
}

/// Hermite polynomial of degree `n` at x, with mean square 1 over a unit Gaussian, and the sum of squares of the lower
/// ones.
fn hermite(n: usize, x: f64) -> [f64; 2] {
    let (mut before, mut p, mut squares) = (0.0, 1.0, 0.0);
    for k in 0..n {
        let k = k as f64;
        squares += p * p;
        (before, p) = (p, (x * p - k.sqrt() * before) / (k + 1.0).sqrt());
    }
    [p, squares]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact up to degree 2n − 1, but not at degree 2n.
    #[test]
    fn degree_of_exactness() {
        for n in [1, 2, 5, 16] {
            let rule = GaussLegendre::new(n);
            for degree in 0..2 * n {
                let exact = if degree % 2 == 0 {
                    2.0 / (degree as f64 + 1.0)
                } else {
                    0.0
                };
                let sum = rule.integrate([-1.0, 1.0], |t| t.powi(degree as i32));
                assert!((sum - exact).abs() < 1e-14, "n {n} degree {degree}");
            }
        }
        let rule = GaussLegendre::new(2);
        assert!((rule.integrate([-1.0, 1.0], |t| t.powi(4)) - 0.4).abs() > 0.1);
    }

    #[test]
    fn nodes_of_order_three_are_known() {
        let rule = GaussLegendre::new(3);
        assert!((rule.nodes[0] - 0.6f64.sqrt()).abs() < 1e-15);
        assert!((rule.weights[1] - 8.0 / 9.0).abs() < 1e-15);
    }

    /// ∫ exp(iωt) = 2 sin ω/ω within the demanded error, at every level.
    #[test]
    fn phase_limit_keeps_the_error() {
        let rule = GaussLegendre::new(32);
        for error in [1e-2, 1e-5, 1e-8, 1e-11] {
            let largest = 0.5 * largest_phase(32, error);
            for part in [0.1, 0.5, 0.9, 1.0] {
                let omega = part * largest;
                let sum = rule.integrate([-1.0, 1.0], |t| (omega * t).cos());
                assert!((sum - 2.0 * omega.sin() / omega).abs() < error + 1e-14);
            }
        }
    }
}
