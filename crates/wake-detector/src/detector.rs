//! The detector as one call: an image becomes wakes.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use wake_nn::check_range;
use wake_nn::weights::{Layout, load, load_bytes};
use whole_files::{checksum, file_checksum};

use crate::calibration::{Calibration, Probabilities};
use crate::error::{Error, Result};
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::network::{INPUTS, Network, STRIDE};
use crate::raster::Raster;
use crate::search::{Mapper, Search, Tile, find, in_tile, merged};
use crate::self_check::{check_once, self_check};
use crate::wake::Detection;

/// Finds ship wakes in radar images with a trained network.
///
/// An image is searched at several scales, a large one in tiles that overlap; what several scales see scores higher. Grey may
/// have any scaling: the network sees contrast in standard deviations of the speckle around.
///
/// # References
///
/// Zhou, Wang & Krähenbühl (2019), "Objects as Points" (maps of centres); Ronneberger, Fischer & Brox (2015), "U-Net".
#[derive(Debug, Clone)]
pub struct Detector {
    network: Network,
    device: Device,
    /// CRC-32 of the file.
    weights: String,
    calibration: Option<Calibration>,
    search: Search,
}

/// The weights that ship and their calibration.
const NAME: &str = "detector.safetensors";
const WEIGHTS: &[u8] = include_bytes!("../assets/detector.safetensors");
const CALIBRATION: &str = include_str!("../assets/detector.calibration.json");
/// Detections with lower scores are not told, unless they are asked for.
const LEAST_SCORE: f32 = 0.03;
/// Score from which on a detection counts as found where no calibration says one.
const UNCALIBRATED: f32 = 0.25;

impl Detector {
    /// The weights of this crate: the content of a safetensors file.
    #[must_use]
    pub fn pretrained_weights() -> &'static [u8] {
        WEIGHTS
    }

    /// The network of this crate on a device.
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) where the weights do not fit in memory, and for a device that is no CPU and fails
    /// [`check_device`](crate::self_check::check_device).
    pub fn pretrained(device: &Device) -> Result<Self> {
        let mut detector = Self::uncalibrated(None, device)?;
        let name = Calibration::path_beside(Path::new(NAME));
        detector.calibration = Some(Calibration::read(&name, CALIBRATION, &detector.weights)?);
        Ok(detector)
    }

    /// The network of a file, as training writes it, after a check on one fixed image; with the calibration that lies beside the
    /// file, if there is one ([`Calibration::path_beside`]).
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) for a file that is not there or does not fit,
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

    /// The network, which turns normalised pixels into maps.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The network of a file, by default of this crate, without probabilities.
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

    /// The same detector with another calibration; `None` for none.
    #[must_use]
    pub fn with_calibration(mut self, calibration: Option<Calibration>) -> Self {
        self.calibration = calibration;
        self
    }

    /// CRC-32 of the file of weights.
    #[must_use]
    pub fn weights_checksum(&self) -> &str {
        &self.weights
    }

    /// Score from which on a detection is sure: that of the calibration, 0.25 without one.
    #[must_use]
    pub fn sure_from(&self) -> f32 {
        self.probabilities()
            .map_or(UNCALIBRATED, |found| found.sure_from)
    }

    /// The probabilities of the detections, by whether the pixel spacing is known; `None` without a calibration.
    #[must_use]
    pub fn probabilities(&self) -> Option<&Probabilities> {
        let calibration = self.calibration.as_ref()?;
        Some(match self.search.spacing {
            Some(_) => &calibration.known_spacing,
            None => &calibration.unknown_spacing,
        })
    }

    /// The same detector for images whose pixels are so far apart \[m\], 0.5 to 100; without it the scale comes from the image.
    ///
    /// # Errors
    ///
    /// [`OutOfRange`](wake_nn::Error::OutOfRange) for another number.
    pub fn with_spacing(mut self, spacing: f32) -> Result<Self> {
        check_range("spacing", spacing.into(), 0.5, 100.0)?;
        self.search.spacing = Some(spacing);
        Ok(self)
    }

    /// The same detector with another least score that is told, 0 to 1, by default 0.03.
    ///
    /// # Errors
    ///
    /// [`OutOfRange`](wake_nn::Error::OutOfRange) for another number.
    pub fn with_least_score(mut self, least_score: f32) -> Result<Self> {
        check_range("least_score", least_score.into(), 0.0, 1.0)?;
        self.search.least_score = least_score;
        Ok(self)
    }

    /// The wakes of an image, the surest first; each is told once.
    #[must_use]
    pub fn find(&self, image: &GreyImage) -> Vec<Detection> {
        let Ok(found) = find(image, self, self.search);
        let rated = self.rated(found).into_iter();
        rated.map(Detection::measured).collect()
    }

    /// The wakes of one of the [`Tile`]s of an image that is read window by window, without probabilities;
    /// [`merged`](Self::merged) puts those of all tiles together.
    ///
    /// # Errors
    ///
    /// Those of [`Raster::window`].
    pub fn find_in<R: Raster>(&self, image: &R, tile: &Tile) -> Result<Vec<Detection>, R::Error> {
        in_tile(image, tile, self, self.search)
    }

    /// The wakes of all tiles with their probabilities, each told once, the surest first, as long as the network says;
    /// [`Detection::measured`] makes them as long as they were measured to be.
    #[must_use]
    pub fn merged(&self, found: Vec<Detection>) -> Vec<Detection> {
        self.rated(merged(found))
    }

    /// Detections with their probabilities, and whether they are sure.
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
        let maps = self
            .network
            .forward(Tensor::from_data(inputs, &self.device));
        let values = maps.into_data();
        let values = match values.try_to_vec::<f32>() {
            Ok(values) => values,
            // Half precision.
            Err(_) => values.iter::<f32>().collect(),
        };
        Maps::new(rows / STRIDE, columns / STRIDE, values)
    }
}
