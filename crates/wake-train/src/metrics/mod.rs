//! Similarity of two images: PSNR, SSIM, perceptual distances, and correlation.
//!
//! Pixel metrics between two random seas say little by themselves: compare each with those of a second simulated image of the
//! same scene, of a constant image and of a blurred one.

mod features;
mod lpips;
mod perceptual;
mod plane;
mod ssim;

pub use features::FeatureDistance;
pub use lpips::{Lpips, LpipsDistance, LpipsNetwork};
pub use perceptual::Perceptual;
pub use plane::{Plane, correlation, mean_square_error, psnr};
pub use ssim::{SsimWindow, blurred, ssim, ssim_map};
