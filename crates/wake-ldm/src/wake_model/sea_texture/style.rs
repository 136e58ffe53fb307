//! Style of a sea: a few statistics of a patch, and the correlation of its pixels.

use wake_physics::Field;
use wake_physics::measure::{Texture, median, texture};

use super::correlated::{CorrelatedNoise, Correlation};
use crate::error::{Error, Result};
use crate::streams::SEA_TEXTURE_STREAM;
use wake_nn::check_range;
use wake_nn::noise::NoiseSource;

/// Largest distance between pixels whose correlation a style keeps.
pub(super) const LAGS: usize = 32;
/// Largest amplitude of open sea in medians (chosen): a little above the brightest of 128² pixels of one look.
const BRIGHTEST: f32 = 4.0;
/// Largest skewness of open sea (chosen): speckle of one look has 0.63; bright points, as on land, give more.
const MOST_SKEWED: f64 = 1.0;
/// Largest variation of the means of blocks of 32 pixels (chosen): above the gusts of real images, below most coasts.
const MOST_VARIED: f64 = 0.2;
/// Number of features of a style that condition the flow.
pub(super) const FEATURES: usize = 8;
/// Number of values of a style in a file: the features and the mean.
pub(super) const NUMBERS: usize = FEATURES + 1;
/// Names and ranges of the values of a style in a file.
const RANGES: [(&str, f64, f64); NUMBERS] = [
    ("mean", 0.5, 2.0),
    ("spread", 1e-3, 2.0),
    ("skewness", -20.0, 20.0),
    ("correlation along rows at lag 1", -1.0, 1.0),
    ("correlation along rows at lag 2", -1.0, 1.0),
    ("correlation along columns at lag 1", -1.0, 1.0),
    ("correlation along columns at lag 2", -1.0, 1.0),
    ("variation of means of 8 x 8 pixels", 0.0, 2.0),
    ("variation of means of 32 x 32 pixels", 0.0, 2.0),
];

/// Statistics of a patch of open sea, of its amplitude divided by its median.
#[derive(Debug, Clone, PartialEq)]
pub struct SeaStyle {
    /// Mean, spread, and the other values of [`RANGES`].
    numbers: [f32; NUMBERS],
    correlation: Correlation,
}

impl SeaStyle {
    /// Estimates the style of a square patch of amplitudes of any scale; `None` if it is not open sea.
    ///
    /// A patch is rejected if it is smaller than 64 pixels or constant, has a pixel above four medians or eight standard
    /// deviations above the mean (a target) or a skewness above 1 (land), or if means of blocks of 32 pixels vary by more than
    /// a fifth (a coast, a front).
    #[must_use]
    pub fn of(amplitude: &Field) -> Option<Self> {
        let side = amplitude.rows;
        let median = median(&amplitude.values);
        let largest = amplitude.values.iter().copied().fold(0.0, f32::max);
        // A median of 0 or NaN fails, too.
        let lit = median > 0.0 && largest <= BRIGHTEST * median;
        if side < 2 * LAGS || amplitude.columns != side || !lit {
            return None;
        }
        let mean = amplitude.mean();
        let squares = amplitude.values.iter();
        let squares: f64 = squares.map(|&v| (f64::from(v) - mean).powi(2)).sum();
        let spread = (squares / amplitude.values.len() as f64).sqrt();
        let median = f64::from(median);
        let texture = texture(amplitude, side)?;
        if texture.skewness > MOST_SKEWED || texture.block_variation[1] > MOST_VARIED {
            return None;
        }
        let correlation = Correlation::of(amplitude, LAGS)?;
        Self::new(
            numbers(mean / median, spread / median, &texture),
            correlation,
        )
        .ok()
    }

    /// Makes a style from unchecked numbers.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] with the first number that is out of range for a sea.
    pub(super) fn new(numbers: [f32; NUMBERS], correlation: Correlation) -> Result<Self> {
        for (number, (name, min, max)) in numbers.iter().zip(RANGES) {
            check_range(name, f64::from(*number), min, max)?;
        }
        Ok(Self {
            numbers,
            correlation,
        })
    }

    /// Makes a style from one row of each tensor of a file.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`wake_nn::Error::InvalidOption`] for values that are not a correlation.
    pub(super) fn of_rows(numbers: &[f32], correlation: &[f32]) -> Result<Self> {
        let Some(correlation) = Correlation::new(LAGS, correlation.to_vec()) else {
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "correlation".to_owned(),
                value: "outside [-1, 1], or not 1 at lag 0".to_owned(),
                expected: "a file written by `wake train sea`".to_owned(),
            }));
        };
        let numbers = std::array::from_fn(|n| numbers.get(n).copied().unwrap_or(f32::NAN));
        Self::new(numbers, correlation)
    }

    /// Mean amplitude divided by the median.
    #[must_use]
    pub fn mean(&self) -> f32 {
        self.numbers[0]
    }

    /// Standard deviation of the amplitude divided by its median.
    #[must_use]
    pub fn spread(&self) -> f32 {
        self.numbers[1]
    }

    pub(super) fn numbers(&self) -> &[f32; NUMBERS] {
        &self.numbers
    }

    pub(super) fn correlations(&self) -> &[f32] {
        self.correlation.values()
    }

    /// Features that condition the flow, with mean about 0 and of order 1.
    pub fn features(&self) -> [f32; FEATURES] {
        let [_, spread, skewness, ref rest @ ..] = self.numbers;
        let [along @ .., fine, coarse] = rest;
        // Logarithms of positive values; the smallest block variation that 8 bits of grey resolve is some 1e-3.
        let logarithm = |x: f32| (x.max(1e-3)).ln();
        let mut features = [0.0; FEATURES];
        features[0] = logarithm(spread) + 1.5;
        features[1] = skewness;
        features[2..6].copy_from_slice(along);
        features[6] = 0.5 * (logarithm(*fine) + 3.0);
        features[7] = 0.5 * (logarithm(*coarse) + 4.0);
        features
    }

    /// Gaussian noise of mean 0 and variance 1 with the correlation of the style: a sea with this spectrum and no other
    /// structure.
    #[must_use]
    pub fn noise(&self, source: NoiseSource, rows: usize, columns: usize) -> Field {
        let noise = CorrelatedNoise::new(&self.correlation, rows, columns);
        noise.field(&source.normal(SEA_TEXTURE_STREAM, noise.normals()))
    }
}

fn numbers(mean: f64, spread: f64, texture: &Texture) -> [f32; NUMBERS] {
    let [r1, r2, ..] = texture.along_rows;
    let [c1, c2, ..] = texture.along_columns;
    let [fine, coarse] = texture.block_variation;
    [mean, spread, texture.skewness, r1, r2, c1, c2, fine, coarse].map(|x| x as f32)
}
