//! Figures of images against the simulator's image of the same scene: SSIM, PSNR, LPIPS, spectrum, brightness.

use burn::tensor::{Device, Tensor, TensorData};
use serde::Serialize;
use wake_physics::Field;
use wake_physics::grey::GreyScale;
use wake_physics::measure::{Binning, radial_spectrum};

use super::statistics::mean;
use crate::metrics::{Lpips, Plane, SsimWindow, blurred, psnr, ssim};

/// Standard deviation of the blurred baseline [pixels].
const BLUR: f64 = 4.0;
/// Smallest power of a ring, so that a constant image has a logarithm.
const LEAST_POWER: f64 = 1e-6;

/// Grey 0 to 1 of intensity, by the default mapping, which all figures are of.
#[must_use]
pub fn grey(intensity: &Field) -> Field {
    let scale = GreyScale::default();
    let grey = |&v: &f32| scale.grey(f64::from(v)) as f32;
    Field {
        values: intensity.values.iter().map(grey).collect(),
        ..*intensity
    }
}

/// A constant image with the mean of another.
pub(super) fn constant(image: &Field) -> Field {
    Field {
        values: vec![image.mean() as f32; image.values.len()],
        ..*image
    }
}

/// A blurred image.
pub(super) fn blur(image: &Field) -> Field {
    Field {
        values: blurred(&Plane::new(&image.values, image.columns), BLUR),
        ..*image
    }
}

/// Sums of the figures of one kind of image over scenes.
#[derive(Debug, Clone, Default)]
pub(super) struct PixelTally {
    ssim: Vec<f64>,
    psnr: Vec<f64>,
    lpips: Vec<f64>,
    mean: Vec<f64>,
    contrast: Vec<f64>,
    /// Per ring, power of the image less that of the reference [dB], summed.
    spectrum: Vec<f64>,
}

/// The figures of one kind of image.
#[derive(Debug, Clone, Serialize)]
pub struct PixelRow {
    /// Kind of image.
    pub image: &'static str,
    /// Structural similarity of grey of range 1, with a Gaussian window, mean over scenes.
    pub ssim: Option<f64>,
    /// Peak signal-to-noise ratio of range 1, mean over scenes \[dB\].
    pub psnr_db: Option<f64>,
    /// Perceptual distance, mean over scenes; `None` without its networks.
    pub lpips: Option<f64>,
    /// Mean grey less the reference's, mean over scenes \[1\].
    pub brightness_difference: Option<f64>,
    /// Standard deviation of grey over the reference's, mean over scenes \[1\].
    pub contrast_ratio: Option<f64>,
    /// Largest difference of the mean radial spectrum up to half the Nyquist frequency \[dB\].
    pub spectrum_db: Option<f64>,
    /// The difference, ring by ring \[dB\].
    pub spectrum_curve_db: Vec<f64>,
}

impl PixelTally {
    /// Counts an image against its reference, both grey and as large as all others.
    ///
    /// # Panics
    ///
    /// If the sizes differ.
    pub(super) fn add(&mut self, reference: &Field, image: &Field, lpips: Option<&Lpips>) {
        let planes = [reference, image].map(|f| Plane::new(&f.values, f.columns));
        self.ssim
            .push(ssim(&planes[0], &planes[1], 1.0, SsimWindow::Gaussian));
        self.psnr.push(psnr(&planes[0], &planes[1], 1.0));
        if let Some(lpips) = lpips {
            let [a, b] = [reference, image].map(|field| colour(field, lpips.device()));
            self.lpips
                .extend(lpips.distance(a, b).iter().map(|d| d.total));
        }
        self.mean.push(image.mean() - reference.mean());
        self.contrast.push(deviation(image) / deviation(reference));
        let powers = [reference, image].map(|f| radial_spectrum(f, Binning::Round).power);
        let rings = reference.rows.min(reference.columns) / 2;
        self.spectrum.resize(rings, 0.0);
        for (n, sum) in self.spectrum.iter_mut().enumerate() {
            let ratio = powers[1][n].max(LEAST_POWER) / powers[0][n].max(LEAST_POWER);
            *sum += 10.0 * ratio.log10();
        }
    }

    /// Number of images.
    #[must_use]
    pub(super) fn len(&self) -> usize {
        self.ssim.len()
    }

    /// Whether no image was counted.
    #[must_use]
    pub(super) fn is_empty(&self) -> bool {
        self.ssim.is_empty()
    }

    /// The means.
    #[must_use]
    pub(super) fn row(&self, image: &'static str) -> PixelRow {
        let count = self.len().max(1) as f64;
        let curve: Vec<f64> = self.spectrum.iter().map(|sum| sum / count).collect();
        // Ring 0 is the mean, counted as brightness; the rings end at the Nyquist frequency.
        let half = curve.iter().take(curve.len() / 2 + 1).skip(1);
        PixelRow {
            image,
            ssim: mean(&self.ssim),
            psnr_db: mean(&self.psnr),
            lpips: mean(&self.lpips),
            brightness_difference: mean(&self.mean),
            contrast_ratio: mean(&self.contrast),
            spectrum_db: half.map(|d| d.abs()).reduce(f64::max),
            spectrum_curve_db: curve,
        }
    }
}

/// Standard deviation of the pixels.
fn deviation(image: &Field) -> f64 {
    let mean = image.mean();
    let squares = image.values.iter().map(|&v| (f64::from(v) - mean).powi(2));
    (squares.sum::<f64>() / image.values.len() as f64).sqrt()
}

/// Grey as the three equal channels that a network for photographs takes.
fn colour(image: &Field, device: &Device) -> Tensor<4> {
    let data = TensorData::new(image.values.repeat(3), [1, 3, image.rows, image.columns]);
    Tensor::from_data(data, device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// Twice the contrast around the same mean: 20 lg 2 dB in every ring, no difference of brightness.
    #[test]
    fn contrast_shows_in_every_ring_of_the_spectrum() {
        let side = 32;
        let noise = NoiseSource::new(4).normal(0, side * side);
        let image = |contrast: f32| Field {
            rows: side,
            columns: side,
            values: noise.iter().map(|x| 0.5 + contrast * x).collect(),
        };
        let mut tally = PixelTally::default();
        tally.add(&image(0.05), &image(0.1), None);
        let row = tally.row("twice the contrast");
        let expected = 20.0 * 2f64.log10();
        // Ring 0 holds the mean.
        for db in &row.spectrum_curve_db[1..] {
            assert!((db - expected).abs() < 1e-3, "{row:?}");
        }
        assert!(row.contrast_ratio.is_some_and(|r| (r - 2.0).abs() < 1e-5));
        assert!(row.lpips.is_none() && tally.len() == 1);
    }
}
