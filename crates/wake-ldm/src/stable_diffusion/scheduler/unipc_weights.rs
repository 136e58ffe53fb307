//! Weights of UniPC, from moments of the exponential and a linear system.

/// Moments h φₙ₊₁(h) n!/B(h) for n = 1 … order, with φ₁ = (eʰ − 1)/h and φₙ₊₁ = (φₙ − 1/n!)/h.
pub(super) fn moments(h: f64, base: f64, order: usize) -> Vec<f64> {
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

/// Solves Σⱼ rⱼ^{i} wⱼ = gᵢ, i = 0, 1, …, for the weights w by Gauss-Jordan elimination with pivoting.
pub(super) fn solve(ratios: &[f64], moments: &[f64]) -> Vec<f64> {
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

    /// The moments are h ∫₀¹ e^{(1−s)h} sⁿ ds / B(h), computed here by the trapezoidal rule.
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
