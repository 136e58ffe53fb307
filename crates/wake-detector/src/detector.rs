//! The detector as one call: an image becomes wakes.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use wake_nn::weights::{Layout, load, load_bytes};
use wake_nn::{check_range, on_pool};
use whole_files::{checksum, file_checksum};

use crate::calibration::{Calibration, Probabilities};
use crate::error::{Error, Result};
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::network::{INPUTS, Network, STRIDE};
use crate::raster::Raster;
use crate::search::{LEAST_SCORE, Mapper, Search, Tile, find, in_tile, merged};
use crate::self_check::{check_once, self_check};
use crate::wake::Detection;

/// Finds ship wakes in radar images with a trained network.
///
/// An image is searched at several scales, a large one in overlapping tiles; wakes found at several scales score higher. Grey
/// levels may have any scaling: the input of the network is contrast in standard deviations of the local speckle.
///
/// # References
///
/// Zhou, Wang & Krähenbühl (2019), "Objects as Points" (maps of centres); Ronneberger, Fischer & Brox (2015), "U-Net".
#[derive(Debug, Clone)]
pub struct Detector {
    network: Network,
    device: Device,
    /// CRC-32 of the weight file.
    weights: String,
    calibration: Option<Calibration>,
    search: Search,
}

/// The shipped weights and their calibration.
const NAME: &str = "detector.safetensors";
const WEIGHTS: &[u8] = include_bytes!("../assets/detector.safetensors");
const CALIBRATION: &str = include_str!("../assets/detector.calibration.json");
/// Lowest score of a sure detection without a calibration.
const UNCALIBRATED: f32 = 0.25;

impl Detector {
    /// The shipped weights: the content of a safetensors file.
    #[must_use]
    pub fn pretrained_weights() -> &'static [u8] {
        WEIGHTS
    }

    /// Loads the shipped network on a device, with its calibration.
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) if the weights do not fit in memory, or if a device other than a CPU fails
    /// [`check_device`](crate::self_check::check_device).
    pub fn pretrained(device: &Device) -> Result<Self> {
        let mut detector = Self::uncalibrated(None, device)?;
        let name = Calibration::path_beside(Path::new(NAME));
        detector.calibration = Some(Calibration::read(&name, CALIBRATION, &detector.weights)?);
        Ok(detector)
    }

    /// Loads a network from a file written by training, after a check on one fixed image, with the calibration beside the file
    /// if there is one ([`Calibration::path_beside`]).
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) for a file that is missing or does not fit the network,
    /// [`Error::WrongMaps`](crate::Error::WrongMaps) for weights that find nothing in any image, such as equal or huge ones,
    /// [`Error::Calibration`](crate::Error::Calibration) for a calibration of other weights.
    pub fn load(file: &Path, device: &Device) -> Result<Self> {
        let mut detector = Self::uncalibrated(Some(file), device)?;
        let beside = Calibration::path_beside(file);
        if beside.exists() {
            let text = whole_files::read_text(&beside)?;
            detector.calibration = Some(Calibration::read(&beside, &text, &detector.weights)?);
        }
        Ok(detector)
    }

    /// The network, which maps normalised pixels to maps.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Loads a network from a file, or the shipped one for `None`, without a calibration.
    ///
    /// # Errors
    ///
    /// As [`load`](Self::load), for the weights alone.
    pub fn uncalibrated(file: Option<&Path>, device: &Device) -> Result<Self> {
        check_once(device)?;
        let network = Network::new(device);
        let (network, weights) = match file {
            None => (
                load_bytes(network, Layout::Diffusers, NAME, WEIGHTS)?,
                checksum(WEIGHTS),
            ),
            Some(file) => {
                let network = load(network, Layout::Diffusers, file)?;
                self_check(&network, file, device)?;
                let sum = file_checksum(file).map_err(|source| Error::Io {
                    path: file.to_owned(),
                    source,
                })?;
                (network, sum)
            }
        };
        Ok(Self {
            network,
            device: device.clone(),
            weights,
            calibration: None,
            search: Search {
                spacing: None,
                least_score: LEAST_SCORE,
            },
        })
    }

    /// Replaces the calibration; `None` removes it.
    #[must_use]
    pub fn with_calibration(mut self, calibration: Option<Calibration>) -> Self {
        self.calibration = calibration;
        self
    }

    /// CRC-32 of the weight file.
    #[must_use]
    pub fn weights_checksum(&self) -> &str {
        &self.weights
    }

    /// Lowest score of a sure detection: from the calibration, 0.25 without one.
    #[must_use]
    pub fn sure_from(&self) -> f32 {
        self.probabilities()
            .map_or(UNCALIBRATED, |found| found.sure_from)
    }

    /// Calibration curves for known or unknown pixel spacing, as this detector is set; `None` without a calibration.
    #[must_use]
    pub fn probabilities(&self) -> Option<&Probabilities> {
        let calibration = self.calibration.as_ref()?;
        Some(match self.search.spacing {
            Some(_) => &calibration.known_spacing,
            None => &calibration.unknown_spacing,
        })
    }

    /// Sets the pixel spacing \[m\] of the images, 0.5 to 100; by default the scale is estimated from each image.
    ///
    /// # Errors
    ///
    /// [`OutOfRange`](wake_nn::Error::OutOfRange) for another number.
    pub fn with_spacing(mut self, spacing: f32) -> Result<Self> {
        check_range("spacing", spacing.into(), 0.5, 100.0)?;
        self.search.spacing = Some(spacing);
        Ok(self)
    }

    /// Sets the lowest score of the reported wakes, 0 to 1, by default [`LEAST_SCORE`].
    ///
    /// # Errors
    ///
    /// [`OutOfRange`](wake_nn::Error::OutOfRange) for another number.
    pub fn with_least_score(mut self, least_score: f32) -> Result<Self> {
        check_range("least_score", least_score.into(), 0.0, 1.0)?;
        self.search.least_score = least_score;
        Ok(self)
    }

    /// Returns the wakes of an image in descending order of score, without duplicates.
    #[must_use]
    pub fn find(&self, image: &GreyImage) -> Vec<Detection> {
        let Ok(found) = find(image, self, self.search);
        let rated = self.rated(found).into_iter();
        rated.map(Detection::measured).collect()
    }

    /// Returns the wakes in one [`Tile`] of an image that is read window by window, without probabilities;
    /// [`merged`](Self::merged) combines the wakes of all tiles.
    ///
    /// # Errors
    ///
    /// The errors of [`Raster::window`].
    pub fn find_in<R: Raster>(&self, image: &R, tile: &Tile) -> Result<Vec<Detection>, R::Error> {
        in_tile(image, tile, self, self.search)
    }

    /// Combines the wakes of all tiles, with probabilities and without duplicates, in descending order of score. Lengths are the
    /// network's; [`Detection::measured`] replaces them by measured ones.
    #[must_use]
    pub fn merged(&self, found: Vec<Detection>) -> Vec<Detection> {
        self.rated(merged(found))
    }

    /// Sets the probabilities of detections, and whether they are sure.
    fn rated(&self, mut found: Vec<Detection>) -> Vec<Detection> {
        for one in &mut found {
            one.sure = one.score >= self.sure_from();
            if let Some(probabilities) = self.probabilities() {
                probabilities.rate(one);
            }
        }
        found
    }
}

impl Mapper for Detector {
    fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps {
        let inputs = TensorData::new(inputs, [1, INPUTS, rows, columns]);
        let values = on_pool(&self.device, || {
            let inputs = Tensor::from_data(inputs, &self.device);
            self.network.forward(inputs).into_data()
        });
        let values = match values.try_to_vec::<f32>() {
            Ok(values) => values,
            // Half precision.
            Err(_) => values.iter::<f32>().collect(),
        };
        Maps::new(rows / STRIDE, columns / STRIDE, values)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the same numbers")]
mod tests {
    use super::*;

    /// The least score of sure detections comes from the calibration for known or unknown spacing, and is 0.25 without one.
    #[test]
    fn the_calibration_says_what_is_sure() {
        let device = Device::flex();
        let detector = Detector::pretrained(&device).expect("weights");
        let found = |detector: &Detector, score: f32| {
            let wake = crate::wake::Wake {
                tip: [10.0, 10.0],
                axis_deg: 90.0,
                half_angle_deg: 5.0,
                length: 100.0,
                snr: f32::INFINITY,
                contrast_db: None,
            };
            detector.rated(vec![Detection::new(score, wake)])[0]
        };
        let unknown = detector.probabilities().expect("calibrated").sure_from;
        assert_eq!(detector.sure_from(), unknown);
        assert!(found(&detector, unknown).sure && !found(&detector, unknown - 1e-4).sure);
        let known = detector.with_spacing(10.0).expect("in range");
        let sure_from = known.probabilities().expect("calibrated").sure_from;
        assert!(sure_from != unknown, "the two curves differ");
        assert_eq!(known.sure_from(), sure_from);
        let plain = known.with_calibration(None);
        assert_eq!(plain.sure_from(), 0.25);
        assert!(found(&plain, 0.25).sure && !found(&plain, 0.249).sure);
        assert!(found(&plain, 0.9).probability.is_none());
    }
}
