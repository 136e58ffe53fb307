//! Common interface of methods that find wakes: the trained network, the classical transform, or your own.

use crate::detector::Detector;
use crate::image::GreyImage;
use crate::radon;
use crate::wake::Detection;

/// A method that finds wakes in images.
///
/// ```
/// use wake_detector::{Detection, Finder, GreyImage, Radon};
///
/// /// The surest wake alone.
/// struct Surest<F>(F);
///
/// impl<F: Finder> Finder for Surest<F> {
///     fn find(&self, image: &GreyImage) -> Vec<Detection> {
///         self.0.find(image).into_iter().take(1).collect()
///     }
/// }
///
/// let image = GreyImage::eight_bits(64, 64, vec![90; 64 * 64])?;
/// assert!(Surest(Radon).find(&image).is_empty());
/// # Ok::<(), wake_detector::Error>(())
/// ```
pub trait Finder: Sync {
    /// Returns the wakes of an image in descending order of score.
    fn find(&self, image: &GreyImage) -> Vec<Detection>;
}

impl Finder for Detector {
    fn find(&self, image: &GreyImage) -> Vec<Detection> {
        Self::find(self, image)
    }
}

/// The classical method; see [`radon::find`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Radon;

impl Finder for Radon {
    fn find(&self, image: &GreyImage) -> Vec<Detection> {
        radon::find(image)
    }
}
