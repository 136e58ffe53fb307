//! How close two images are: PSNR, SSIM, LPIPS, and the correlation of what is deterministic in them.
//!
//! Pixel metrics between two random seas say little by themselves: each figure belongs beside those of a second
//! simulated image of the same scene, of a constant image and of a blurred one.

mod lpips;
mod plane;
mod ssim;

pub use lpips::{Lpips, LpipsDistance, LpipsNetwork};
pub use plane::{Plane, correlation, mean_square_error, psnr};
pub use ssim::{SsimWindow, blurred, ssim, ssim_map};
