//! Similarity of two images: PSNR, SSIM, LPIPS, and correlation.
//!
//! Pixel metrics between two random seas say little by themselves: compare each with those of a second simulated image of the
//! same scene, of a constant image and of a blurred one.

mod lpips;
mod plane;
mod ssim;

pub use lpips::{Lpips, LpipsDistance, LpipsNetwork};
pub use plane::{Plane, correlation, mean_square_error, psnr};
pub use ssim::{SsimWindow, blurred, ssim, ssim_map};
