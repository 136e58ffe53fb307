//! The detector as one call: an image becomes wakes.

use std::path::Path;

use burn::tensor::{Device, Tensor, TensorData};
use wake_nn::check_range;
use wake_nn::weights::{Layout, load, load_bytes};

use crate::error::Result;
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::network::{INPUTS, Network, STRIDE};
use crate::raster::Raster;
use crate::search::{Mapper, Search, Tile, find, in_tile, merged};
use crate::self_check::self_check;
use crate::wake::Detection;

/// Finds ship wakes in radar images with a trained network.
///
/// An image is searched at several scales, a large one in tiles that overlap; what several scales see scores higher. Grey may
/// have any scaling: the network sees contrast in standard deviations of the speckle around.
///
/// # References
///
/// Zhou, Wang & Krähenbühl (2019), "Objects as Points" (maps of centres); Ronneberger, Fischer & Brox (2015), "U-Net".
#[derive(Debug)]
pub struct Detector {
    network: Network,
    device: Device,
    search: Search,
}

impl Detector {
    /// The score from which on a wake is likely one: half a false alarm an image on real tiles.
    pub const OPERATING_POINT: f32 = 0.25;

    /// The network of this crate on a device.
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) where the weights do not fit in memory.
    pub fn pretrained(device: &Device) -> Result<Self> {
        let bytes = include_bytes!("../assets/detector.safetensors");
        let network = Network::new(device);
        let network = load_bytes(network, Layout::Diffusers, "detector.safetensors", bytes)?;
        Ok(Self::of(network, device))
    }

    /// The network of a file, as training writes it, after a check on one fixed image.
    ///
    /// # Errors
    ///
    /// [`Error::Model`](crate::Error::Model) for a file that is not there or does not fit,
    /// [`Error::WrongMaps`](crate::Error::WrongMaps) for weights that find nothing in any image, such as equal or huge ones.
    pub fn load(file: &Path, device: &Device) -> Result<Self> {
        let network = load(Network::new(device), Layout::Diffusers, file)?;
        self_check(&network, file, device)?;
        Ok(Self::of(network, device))
    }

    fn of(network: Network, device: &Device) -> Self {
        Self {
            network,
            device: device.clone(),
            search: Search {
                spacing: None,
                least_score: Self::OPERATING_POINT,
            },
        }
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

    /// The same detector with another least score that is told, 0 to 1, by default [`OPERATING_POINT`](Self::OPERATING_POINT).
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
        found
    }

    /// The wakes of one of the [`Tile`]s of an image that is read window by window; [`merged`](Self::merged) puts those of all
    /// tiles together.
    ///
    /// # Errors
    ///
    /// Those of [`Raster::window`].
    pub fn find_in<R: Raster>(&self, image: &R, tile: &Tile) -> Result<Vec<Detection>, R::Error> {
        in_tile(image, tile, self, self.search)
    }

    /// The wakes of all tiles, each told once, the surest first.
    #[must_use]
    pub fn merged(found: Vec<Detection>) -> Vec<Detection> {
        merged(found)
    }
}

impl Mapper for Detector {
    fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps {
        let inputs = TensorData::new(inputs, [1, INPUTS, rows, columns]);
        let maps = self
            .network
            .forward(Tensor::from_data(inputs, &self.device));
        let values = maps.into_data().iter::<f32>().collect();
        Maps::new(rows / STRIDE, columns / STRIDE, values)
    }
}
