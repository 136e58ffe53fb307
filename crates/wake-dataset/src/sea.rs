//! Seas that replace the simulator's.

use crate::error::Result;
use std::fmt::Debug;
use wake_physics::{Field, Scene};

/// A sea that draws the images of scenes itself, with its own speckle, such as one learnt from real images.
pub trait Sea: Debug + Send + Sync + 'static {
    /// Checks that the sea can be drawn with pixels of this side \[m\].
    ///
    /// # Errors
    ///
    /// For a side that the sea does not have.
    fn check_spacing(&self, spacing: f64) -> Result<()>;

    /// The image of a scene on this sea: intensity with speckle, `[rows, columns]` of the scene's grid.
    ///
    /// # Errors
    ///
    /// If it does not fit in memory, or cannot be drawn.
    fn image(&self, scene: &Scene) -> Result<Field>;
}
