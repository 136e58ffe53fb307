//! Single-channel images, and metrics that are summed pixel by pixel.

/// One channel of an image, row after row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane<'a> {
    /// The pixels.
    pub values: &'a [f32],
    /// Pixels in a row.
    pub columns: usize,
}

impl<'a> Plane<'a> {
    /// A plane of `rows` times `columns` pixels.
    ///
    /// # Panics
    ///
    /// If the number of values is not a multiple of `columns`.
    #[must_use]
    pub fn new(values: &'a [f32], columns: usize) -> Self {
        assert!(
            columns > 0 && values.len().is_multiple_of(columns),
            "{} values do not fill rows of {columns}",
            values.len()
        );
        Self { values, columns }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.values.len() / self.columns
    }

    pub(super) fn assert_same_size(&self, other: &Self) {
        assert_eq!(
            (self.rows(), self.columns),
            (other.rows(), other.columns),
            "both planes must have the same size"
        );
    }
}

/// Mean square of the difference of two planes.
///
/// # Panics
///
/// If the sizes differ.
#[must_use]
pub fn mean_square_error(one: &Plane<'_>, other: &Plane<'_>) -> f64 {
    one.assert_same_size(other);
    let pairs = one.values.iter().zip(other.values);
    let sum: f64 = pairs
        .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
        .sum();
    sum / one.values.len() as f64
}

/// Peak signal-to-noise ratio.
///
/// ```text
/// PSNR = 10 log₁₀(range²/⟨(a − b)²⟩)
/// ```
///
/// - `range`: largest less smallest value that a pixel can have
/// - returns \[dB\]; infinite for equal planes
///
/// # Panics
///
/// If the sizes differ.
#[must_use]
pub fn psnr(one: &Plane<'_>, other: &Plane<'_>, range: f64) -> f64 {
    10.0 * (range * range / mean_square_error(one, other)).log10()
}

/// Correlation of two planes where `mask` is true.
///
/// ```text
/// ρ = ⟨(a − ā)(b − b̄)⟩/√(⟨(a − ā)²⟩⟨(b − b̄)²⟩)
/// ```
///
/// - returns −1 to 1; `None` where a plane is constant within the mask, or the mask is empty
///
/// # Panics
///
/// If the sizes differ.
#[must_use]
pub fn correlation(one: &Plane<'_>, other: &Plane<'_>, mask: &[bool]) -> Option<f64> {
    one.assert_same_size(other);
    assert_eq!(
        mask.len(),
        one.values.len(),
        "the mask must have one value per pixel"
    );
    let pairs = || {
        let pairs = one.values.iter().zip(other.values).zip(mask);
        pairs
            .filter(|(_, inside)| **inside)
            .map(|((&a, &b), _)| (f64::from(a), f64::from(b)))
    };
    let count = pairs().count() as f64;
    let (sum_a, sum_b) = pairs().fold((0.0, 0.0), |(s, t), (a, b)| (s + a, t + b));
    let (mean_a, mean_b) = (sum_a / count, sum_b / count);
    let [aa, bb, ab] = pairs().fold([0.0; 3], |[aa, bb, ab], (a, b)| {
        let (a, b) = (a - mean_a, b - mean_b);
        [aa + a * a, bb + b * b, ab + a * b]
    });
    (aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_a_known_difference() {
        let (a, b) = ([0.0f32; 12], [0.1f32; 12]);
        let [a, b] = [&a, &b].map(|v| Plane::new(v.as_slice(), 4));
        // ⟨d²⟩ = 0.01: 20 dB, to the rounding of 0.1 in f32.
        assert!((psnr(&a, &b, 1.0) - 20.0).abs() < 1e-6);
        assert!((psnr(&a, &b, 2.0) - 20.0 - 20.0 * 2f64.log10()).abs() < 1e-6);
        assert!(psnr(&a, &a, 1.0).is_infinite());
    }

    #[test]
    fn correlation_sees_neither_gain_nor_offset_nor_what_is_masked() {
        let a: Vec<f32> = (0..20).map(|i| ((i * 7) % 11) as f32).collect();
        let mut b: Vec<f32> = a.iter().map(|v| 3.0 - 2.0 * v).collect();
        let mut mask = vec![true; 20];
        let rho =
            |b: &[f32], mask: &[bool]| correlation(&Plane::new(&a, 5), &Plane::new(b, 5), mask);
        assert!((rho(&b, &mask).unwrap() + 1.0).abs() < 1e-12);
        b[3] = 1e6;
        assert!(rho(&b, &mask).unwrap() > -0.9);
        mask[3] = false;
        assert!((rho(&b, &mask).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(rho(&[1.0; 20], &mask), None);
        assert_eq!(rho(&b, &[false; 20]), None);
    }
}
