//! Texture of the sea in real images, learnt from patches of them and sampled.
//!
//! ```text
//! image ─► open patches ─► styles ─► Gaussian noise of a style's correlation ─► flow ─► amplitude with its speckle
//!                                                 scene ─► contrast of its wakes ─► times the sea, and echoes on it
//! ```

mod correlated;
mod flow;
mod image;
mod style;
mod texture;

pub use flow::SeaFlow;
pub use image::{SeaImage, WINDOW};
pub use style::SeaStyle;
pub use texture::SeaTexture;
