//! Either way of finding wakes.

use crate::detector::Detector;
use crate::image::GreyImage;
use crate::radon;
use crate::wake::Detection;

/// Something that finds wakes.
#[derive(Debug)]
pub enum Finder {
    /// The trained network.
    Network(Box<Detector>),
    /// The classical transform, see [`radon::find`].
    Radon,
}

impl Finder {
    /// The wakes of an image, the surest first.
    #[must_use]
    pub fn find(&self, image: &GreyImage) -> Vec<Detection> {
        match self {
            Self::Network(detector) => detector.find(image),
            Self::Radon => radon::find(image),
        }
    }
}

impl From<Detector> for Finder {
    fn from(detector: Detector) -> Self {
        Self::Network(Box::new(detector))
    }
}
