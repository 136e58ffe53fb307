//! Figures of one kind of sea.

use serde::Serialize;
use wake_physics::Field;
use wake_physics::measure::{Binning, Texture, radial_spectrum, texture};

use crate::TwoSample;
use wake_ldm::sea_texture::WINDOW;

/// Figures of one kind of sea, means over its windows.
#[derive(Debug, Clone, Serialize)]
pub struct SeaRow {
    /// Name of the kind.
    pub kind: &'static str,
    /// Two-sample test against the right halves; `None` for the right halves themselves.
    pub two_sample: Option<TwoSample>,
    /// Root mean square difference from the reference's mean radial spectrum, over rings of windows of variance 1 \[dB\].
    pub spectrum_db: f64,
    /// Correlation of speckle one and two pixels apart, along rows and along columns.
    pub correlations: [f64; 4],
    /// Skewness of speckle.
    pub skewness: f64,
    /// Standard deviation over mean of the means of blocks of 8 and of 32 pixels.
    pub block_variation: [f64; 2],
}

impl SeaRow {
    /// Figures of windows of [`WINDOW`] rows and columns.
    ///
    /// - `reference`: [`mean_spectrum`] of the windows they are compared with
    #[must_use]
    pub fn of(
        kind: &'static str,
        windows: &[Field],
        reference: &[f64],
        two_sample: Option<TwoSample>,
    ) -> Self {
        let textures: Vec<_> = windows.iter().filter_map(|f| texture(f, WINDOW)).collect();
        let mean = |of: &dyn Fn(&Texture) -> f64| {
            textures.iter().map(of).sum::<f64>() / textures.len().max(1) as f64
        };
        let spectrum = mean_spectrum(windows);
        let squares = spectrum.iter().zip(reference).map(|(a, b)| (a - b).powi(2));
        Self {
            kind,
            two_sample,
            spectrum_db: (squares.sum::<f64>() / reference.len().max(1) as f64).sqrt(),
            correlations: [
                mean(&|t| t.along_rows[0]),
                mean(&|t| t.along_rows[1]),
                mean(&|t| t.along_columns[0]),
                mean(&|t| t.along_columns[1]),
            ],
            skewness: mean(&|t| t.skewness),
            block_variation: [
                mean(&|t| t.block_variation[0]),
                mean(&|t| t.block_variation[1]),
            ],
        }
    }
}

/// Mean radial power spectrum of windows of [`WINDOW`] rows and columns, scaled to variance 1, up to the Nyquist wavenumber
/// \[dB\].
#[must_use]
pub fn mean_spectrum(windows: &[Field]) -> Vec<f64> {
    let rings = WINDOW / 2;
    let mut sums = vec![0.0; rings - 1];
    for field in windows {
        let spectrum = radial_spectrum(field, Binning::Round);
        let pairs = || spectrum.power.iter().zip(&spectrum.count).skip(1);
        let total: f64 = pairs().map(|(power, &count)| power * count as f64).sum();
        for (sum, (power, _)) in sums.iter_mut().zip(pairs()) {
            *sum += 10.0 * (power / total).max(1e-12).log10();
        }
    }
    let count = windows.len().max(1) as f64;
    sums.into_iter().map(|sum| sum / count).collect()
}

#[cfg(test)]
mod tests {
    use super::super::pair::window;
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// White noise of any scale has a power of 1/(128² − 1) in every ring; the scatter of a mean over four windows is below 3 dB
    /// where a ring has eight waves.
    #[test]
    fn the_spectrum_knows_no_scale() {
        let noise = |seed: u64, scale: f32| {
            let values = NoiseSource::new(seed).normal(0, WINDOW * WINDOW);
            window(values.into_iter().map(|x| scale * (3.0 + x)).collect())
        };
        let windows: Vec<Field> = (1..5).map(|seed| noise(seed, 1.0)).collect();
        let louder: Vec<Field> = (1..5).map(|seed| noise(seed, 7.0)).collect();
        let spectrum = mean_spectrum(&windows);
        assert_eq!(spectrum.len(), WINDOW / 2 - 1);
        let row = SeaRow::of("louder", &louder, &spectrum, None);
        assert!(row.spectrum_db < 1e-3, "{row:?}");
        let expected = -10.0 * ((WINDOW * WINDOW - 1) as f64).log10();
        for ring in &spectrum[1..] {
            assert!((ring - expected).abs() < 3.0, "{ring} {expected}");
        }
    }
}
