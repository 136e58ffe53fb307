//! Perceptual distance by the features of the shipped detector.

use burn::tensor::{DType, Device, Tensor, TensorData};
use wake_detector::network::{INPUTS, MULTIPLE, Network};
use wake_detector::normalize::{contrast, inputs};
use wake_nn::cast_to;
use wake_physics::Field;

use crate::error::Result;

/// Perceptual distance of grey images: the formula of LPIPS with equal weights, on the features of the shipped detector.
///
/// ```text
/// d = mean over levels and places of ½ |a/|a| − b/|b||² = 1 − a·b / (|a| |b|)
/// ```
///
/// 0 for equal images, 1 for features at right angles. The levels are the detector's encoder at strides 4, 8 and 16. Its inputs are
/// contrasts to the surroundings, so gain and offset do not matter.
///
/// # References
///
/// Zhang, Isola, Efros, Shechtman and Wang (2018), "The Unreasonable Effectiveness of Deep Features as a Perceptual
/// Metric", equation 1.
#[derive(Debug)]
pub struct FeatureDistance {
    network: Network,
    device: Device,
}

impl FeatureDistance {
    /// Loads the network on a device.
    ///
    /// # Errors
    ///
    /// None in a build from unchanged files.
    pub fn new(device: &Device) -> Result<Self> {
        Ok(Self {
            network: Network::pretrained(device)?,
            device: device.clone(),
        })
    }

    /// Distance of two images, of their first rows and columns in multiples of 64; `None` for smaller images.
    ///
    /// # Panics
    ///
    /// If the sizes differ.
    #[must_use]
    pub fn distance(&self, one: &Field, other: &Field) -> Option<f64> {
        assert_eq!(
            [one.rows, one.columns],
            [other.rows, other.columns],
            "both images must have the same size"
        );
        let [rows, columns] = [one.rows, one.columns].map(|n| n / MULTIPLE * MULTIPLE);
        if rows == 0 || columns == 0 {
            return None;
        }
        let [one, other] = [one, other].map(|image| {
            let seen = self.inputs(image, rows, columns);
            self.network.features(seen)
        });
        let levels = one.into_iter().zip(other).map(|(a, b)| {
            let [a, b] = [a, b].map(|features| unit(cast_to(features, DType::F32)));
            1.0 - f64::from((a * b).sum_dim(1).mean().into_scalar::<f32>())
        });
        Some(levels.sum::<f64>() / 3.0)
    }

    /// The network's inputs, `[1, INPUTS, rows, columns]`.
    fn inputs(&self, image: &Field, rows: usize, columns: usize) -> Tensor<4> {
        let lines = image.values.chunks_exact(image.columns).take(rows);
        let pixels: Vec<f32> = lines.flat_map(|line| &line[..columns]).copied().collect();
        let both: Vec<[f32; INPUTS]> = contrast(&pixels, rows, columns)
            .into_iter()
            .map(inputs)
            .collect();
        let channel = |n: usize| both.iter().map(move |values| values[n]);
        let values: Vec<f32> = (0..INPUTS).flat_map(channel).collect();
        Tensor::from_data(
            TensorData::new(values, [1, INPUTS, rows, columns]),
            &self.device,
        )
    }
}

/// Features scaled to length 1 at every place.
fn unit(features: Tensor<4>) -> Tensor<4> {
    let length = features.clone().square().sum_dim(1).sqrt();
    features / (length + 1e-10)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use crate::metrics::{Plane, blurred};
    use wake_nn::noise::NoiseSource;

    /// Noise of unit variance with a brighter line, 70 × 130 pixels: the network reads 64 × 128 of them.
    fn image(seed: u64) -> Field {
        let (rows, columns) = (70, 130);
        let mut values = NoiseSource::new(seed).normal(0, rows * columns);
        for line in values.chunks_exact_mut(columns) {
            line[40..44].iter_mut().for_each(|x| *x += 3.0);
        }
        Field {
            rows,
            columns,
            values,
        }
    }

    fn scaled(image: &Field, gain: f32, offset: f32) -> Field {
        Field {
            values: image.values.iter().map(|x| offset + gain * x).collect(),
            ..*image
        }
    }

    /// The angles between features, place by place, in 64 bits.
    #[test]
    fn the_distance_is_one_less_the_cosine_of_features() {
        let distance = FeatureDistance::new(&Device::flex()).unwrap();
        let [one, other] = [1, 2].map(image);
        let features = |image: &Field| distance.network.features(distance.inputs(image, 64, 128));
        let mut expected = 0.0;
        for (a, b) in features(&one).into_iter().zip(features(&other)) {
            let [_, channels, rows, columns] = a.dims();
            let [a, b] = [a, b].map(|x| x.into_data().iter::<f64>().collect::<Vec<f64>>());
            let places = rows * columns;
            let product = |x: &[f64], y: &[f64], place: usize| -> f64 {
                (0..channels)
                    .map(|c| x[c * places + place] * y[c * places + place])
                    .sum()
            };
            let cosine = |place| {
                product(&a, &b, place) / (product(&a, &a, place) * product(&b, &b, place)).sqrt()
            };
            expected += 1.0 - (0..places).map(cosine).sum::<f64>() / places as f64;
        }
        let found = distance.distance(&one, &other).unwrap();
        // Sums of up to 512 products in 32 bits.
        assert!((found - expected / 3.0).abs() < 512.0 * f64::from(f32::EPSILON));
        assert!((found - distance.distance(&other, &one).unwrap()).abs() < 1e-6);
    }

    /// Equal images have no distance, nor has an image of another gain and offset; a constant and a blurred image are farther than
    /// other noise around the same line.
    #[test]
    fn lost_texture_is_farther_than_other_noise() {
        let distance = FeatureDistance::new(&Device::flex()).unwrap();
        let [one, other] = [1, 2].map(image);
        let from_one = |image: &Field| distance.distance(&one, image).unwrap();
        assert!(from_one(&one).abs() < 1e-5);
        assert!(from_one(&scaled(&one, 0.01, 0.5)).abs() < 1e-3);
        let soft = Field {
            values: blurred(&Plane::new(&other.values, other.columns), 2.0),
            ..other
        };
        let flat = scaled(&other, 0.0, 0.5);
        let [noise, soft, flat] = [&other, &soft, &flat].map(from_one);
        assert!(noise > 0.05 && soft > 1.2 * noise && flat > 1.2 * noise);
        let small = scaled(&one, 1.0, 0.0);
        let small = Field {
            rows: 63,
            values: small.values[..63 * 130].to_vec(),
            ..small
        };
        assert!(distance.distance(&small, &small).is_none());
    }
}
