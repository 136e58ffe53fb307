//! Replacements of the simulator's sea.

use crate::error::Result;
use std::fmt::Debug;
use wake_physics::{Field, Scene};

/// A sea that makes the images of scenes itself, with its own speckle, such as one learnt from real images.
pub trait Sea: Debug + Send + Sync + 'static {
    /// Checks that the sea supports a pixel spacing \[m\].
    ///
    /// # Errors
    ///
    /// If the sea does not support the spacing.
    fn check_spacing(&self, spacing: f64) -> Result<()>;

    /// Makes the image of a scene on this sea: intensity with speckle, `[rows, columns]` of the scene's grid.
    ///
    /// # Errors
    ///
    /// If the image does not fit in memory or cannot be made.
    fn image(&self, scene: &Scene) -> Result<Field>;
}
