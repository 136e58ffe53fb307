//! The perceptual distances of a report.

use burn::tensor::Device;

use super::{FeatureDistance, Lpips};
use crate::error::Result;

/// Perceptual distances that pixel figures include.
#[derive(Debug)]
pub struct Perceptual {
    /// Distance by the features of the shipped detector.
    pub(crate) features: FeatureDistance,
    /// LPIPS, if its weights are given.
    pub(crate) lpips: Option<Lpips>,
}

impl Perceptual {
    /// Loads the detector's network on a device.
    ///
    /// # Errors
    ///
    /// As [`FeatureDistance::new`].
    pub fn new(lpips: Option<Lpips>, device: &Device) -> Result<Self> {
        Ok(Self {
            features: FeatureDistance::new(device)?,
            lpips,
        })
    }
}
