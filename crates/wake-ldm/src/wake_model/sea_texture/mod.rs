//! The sea of real images: what it looks like, learnt from patches of them, and drawn again.
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
