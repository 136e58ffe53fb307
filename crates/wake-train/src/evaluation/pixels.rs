//! Figures of images against the simulator's image of the same scene: SSIM, PSNR, perceptual distances, spectrum, brightness.

use burn::tensor::{Device, Tensor, TensorData};
use serde::Serialize;
use wake_physics::Field;
use wake_physics::measure::{Binning, radial_spectrum};

use super::statistics::mean;
use crate::metrics::{Perceptual, Plane, SsimWindow, blurred, psnr, ssim};

/// Standard deviation of the blurred baseline [pixels].
const BLUR: f64 = 4.0;
/// Smallest power of a ring, so that a constant image has a logarithm.
const LEAST_POWER: f64 = 1e-6;

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
    features: Vec<f64>,
    lpips: Vec<f64>,
    mean: Vec<f64>,
    contrast: Vec<f64>,
    /// Per ring, power of the image and of the reference [dB], summed.
    powers: [Vec<f64>; 2],
}

/// The figures of one kind of image.
#[derive(Debug, Clone, Serialize)]
pub struct PixelRow {
    /// Kind of image.
    pub image: String,
    /// Structural similarity of grey of range 1, with a Gaussian window, mean over scenes.
    pub ssim: Option<f64>,
    /// Peak signal-to-noise ratio of range 1, mean over scenes \[dB\].
    pub psnr_db: Option<f64>,
    /// Distance by the features of the shipped detector, mean over scenes; `None` for images below 64 pixels.
    pub features: Option<f64>,
    /// LPIPS, mean over scenes; `None` without its weights.
    pub lpips: Option<f64>,
    /// Mean grey less the reference's, mean over scenes \[1\].
    pub brightness_difference: Option<f64>,
    /// Standard deviation of grey over the reference's, mean over scenes \[1\].
    pub contrast_ratio: Option<f64>,
    /// Largest difference of the mean radial spectrum up to half the Nyquist frequency \[dB\].
    pub spectrum_db: Option<f64>,
    /// Difference of the mean radial spectrum, ring by ring \[dB\].
    pub spectrum_curve_db: Vec<f64>,
    /// Power of the image's rings, mean over scenes \[dB\].
    pub power_db: Vec<f64>,
    /// Mean difference over the rings of each third up to the Nyquist frequency \[dB\].
    pub bands_db: [f64; 3],
}

impl PixelRow {
    /// The figures of some images against their references, grey and of one size.
    ///
    /// # Panics
    ///
    /// If sizes differ.
    #[must_use]
    pub fn of(name: &str, references: &[Field], images: &[Field], perceptual: &Perceptual) -> Self {
        let mut tally = PixelTally::default();
        for (reference, image) in references.iter().zip(images) {
            tally.add(reference, image, perceptual);
        }
        tally.row(name)
    }
}

impl PixelTally {
    /// Adds an image and its reference, both grey and as large as all others.
    ///
    /// # Panics
    ///
    /// If the sizes differ.
    pub(super) fn add(&mut self, reference: &Field, image: &Field, perceptual: &Perceptual) {
        let planes = [reference, image].map(|f| Plane::new(&f.values, f.columns));
        self.ssim
            .push(ssim(&planes[0], &planes[1], 1.0, SsimWindow::Gaussian));
        self.psnr.push(psnr(&planes[0], &planes[1], 1.0));
        self.features
            .extend(perceptual.features.distance(reference, image));
        if let Some(lpips) = &perceptual.lpips {
            let [a, b] = [reference, image].map(|field| colour(field, lpips.device()));
            self.lpips
                .extend(lpips.distance(a, b).iter().map(|d| d.total));
        }
        self.mean.push(image.mean() - reference.mean());
        self.contrast.push(deviation(image) / deviation(reference));
        let powers = [reference, image].map(|f| radial_spectrum(f, Binning::Round).power);
        let rings = reference.rows.min(reference.columns) / 2;
        for (sums, power) in self.powers.iter_mut().zip([&powers[1], &powers[0]]) {
            sums.resize(rings, 0.0);
            for (sum, power) in sums.iter_mut().zip(power) {
                *sum += 10.0 * power.max(LEAST_POWER).log10();
            }
        }
    }

    /// Means over all images.
    #[must_use]
    pub(super) fn row(&self, image: &str) -> PixelRow {
        let count = self.ssim.len().max(1) as f64;
        let [power, reference] = self
            .powers
            .each_ref()
            .map(|sums| sums.iter().map(move |sum| sum / count));
        let power: Vec<f64> = power.collect();
        let curve: Vec<f64> = power.iter().zip(reference).map(|(a, b)| a - b).collect();
        // Ring 0 is the mean, counted as brightness; the rings end at the Nyquist frequency.
        let half = curve.iter().take(curve.len() / 2 + 1).skip(1);
        PixelRow {
            image: image.to_owned(),
            ssim: mean(&self.ssim),
            psnr_db: mean(&self.psnr),
            features: mean(&self.features),
            lpips: mean(&self.lpips),
            brightness_difference: mean(&self.mean),
            contrast_ratio: mean(&self.contrast),
            spectrum_db: half.map(|d| d.abs()).reduce(f64::max),
            bands_db: thirds(&curve),
            spectrum_curve_db: curve,
            power_db: power,
        }
    }
}

/// Means over the thirds of a curve, without its first point.
fn thirds(curve: &[f64]) -> [f64; 3] {
    let third = |n: usize| {
        let end = (n + 1) * curve.len() / 3;
        let begin = (n * curve.len() / 3).max(1).min(end);
        mean(&curve[begin..end]).unwrap_or(0.0)
    };
    [0, 1, 2].map(third)
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
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// Ring 0 belongs to no third.
    #[test]
    fn thirds_of_a_curve_have_its_means() {
        let curve = [9.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        for (found, expected) in thirds(&curve).iter().zip([1.5, 14.0 / 3.0, 8.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert!(thirds(&[1.0]).iter().all(|mean| mean.abs() < 1e-12));
    }

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
        let perceptual = Perceptual::new(None, &Device::flex()).unwrap();
        let [one, other] = [0.05, 0.1].map(image);
        let row = PixelRow::of("twice the contrast", &[one], &[other], &perceptual);
        let expected = 20.0 * 2f64.log10();
        // Ring 0 holds the mean.
        for db in &row.spectrum_curve_db[1..] {
            assert!((db - expected).abs() < 1e-3, "{row:?}");
        }
        for db in row.bands_db {
            assert!((db - expected).abs() < 1e-3, "{row:?}");
        }
        assert!(row.contrast_ratio.is_some_and(|r| (r - 2.0).abs() < 1e-5));
        // Smaller than the network's inputs, and no weights.
        assert!(row.features.is_none() && row.lpips.is_none());
    }
}
