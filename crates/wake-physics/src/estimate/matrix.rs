//! Small symmetric matrices.

/// A symmetric matrix, row after row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Matrix {
    pub(super) size: usize,
    pub(super) values: Vec<f64>,
}

impl Matrix {
    pub(super) fn zero(size: usize) -> Self {
        Self {
            size,
            values: vec![0.0; size * size],
        }
    }

    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.size + column]
    }

    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.values[row * self.size + column] += value;
    }

    pub(super) fn plus(mut self, other: &Self) -> Self {
        let pairs = self.values.iter_mut().zip(&other.values);
        pairs.for_each(|(sum, value)| *sum += value);
        self
    }

    /// Product A M A of symmetric matrices.
    pub(super) fn around(&self, middle: &Self) -> Self {
        let n = self.size;
        let mut out = Self::zero(n);
        for i in 0..n {
            for j in 0..n {
                let pairs = (0..n).flat_map(|k| (0..n).map(move |l| [k, l]));
                let terms = pairs.map(|[k, l]| self.at(i, k) * middle.at(k, l) * self.at(l, j));
                out.add(i, j, terms.sum());
            }
        }
        out
    }

    /// Inverse of a positive definite matrix, by Cholesky decomposition of the matrix scaled to diagonal 1; `None` where a pivot
    /// is below 1e-10, which leaves some direction of the values undetermined.
    pub(super) fn inverse(&self) -> Option<Self> {
        let n = self.size;
        let scale: Vec<f64> = (0..n).map(|i| self.at(i, i).sqrt().recip()).collect();
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let mut lower = Self::zero(n);
        for i in 0..n {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| lower.at(i, k) * lower.at(j, k)).sum();
                let rest = self.at(i, j) * scale[i] * scale[j] - inner;
                if i == j && rest < 1e-10 {
                    return None;
                }
                let value = if i == j {
                    rest.sqrt()
                } else {
                    rest / lower.at(j, j)
                };
                lower.values[i * n + j] = value;
            }
        }
        let mut out = Self::zero(n);
        for c in 0..n {
            let mut x = vec![0.0; n];
            x[c] = 1.0;
            for i in 0..n {
                let inner: f64 = (0..i).map(|k| lower.at(i, k) * x[k]).sum();
                x[i] = (x[i] - inner) / lower.at(i, i);
            }
            for i in (0..n).rev() {
                let inner: f64 = (i + 1..n).map(|k| lower.at(k, i) * x[k]).sum();
                x[i] = (x[i] - inner) / lower.at(i, i);
            }
            for (i, x) in x.iter().enumerate() {
                out.values[i * n + c] = x * scale[i] * scale[c];
            }
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_one() {
        let matrix = Matrix {
            size: 3,
            values: vec![4e6, 2e3, 0.5, 2e3, 5.0, 1e-3, 0.5, 1e-3, 2e-6],
        };
        let inverse = matrix.inverse().unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| inverse.at(i, k) * matrix.at(k, j)).sum();
                let expected = f64::from(u8::from(i == j));
                let scale = (matrix.at(j, j) / matrix.at(i, i)).sqrt();
                assert!((product - expected).abs() < 1e-12 * scale.max(1.0));
            }
        }
        let singular = Matrix {
            size: 2,
            values: vec![1.0, 1.0, 1.0, 1.0],
        };
        assert_eq!(singular.inverse(), None);
    }
}
