//! Estimates of a scene's values from an image, with their uncertainty.
//!
//! ```text
//! scene ─► expected image and derivatives ─┬─► likelihood, score and information of an image ─► estimate near a guess
//!      └─► covariance of sea and speckle ──┴─► bounds, without any image
//! ```
//!
//! [`expected_with_derivatives`] computes the mean image of a scene with its derivatives, [`Likelihood`] compares an image with
//! it, [`estimate`] searches for ship and wind around a sighting, [`refine`] maximises the likelihood near a guess, and [`bound`]
//! gives the smallest standard deviations of unbiased estimates.

mod ascent;
mod bound;
mod echo;
mod estimator;
mod expected;
mod information;
mod likelihood;
mod matrix;
mod noise;
mod observed;
mod parameter;
mod priors;
mod radial;
mod refine;
mod refined;
mod sea;
mod search;
mod sighting;
mod similar;
mod texture;
mod torus;
mod value;
mod winds;

pub use bound::{Bound, bound};
pub use estimator::estimate;
pub use expected::{Expected, ExpectedImage, expected_with_derivatives};
pub use likelihood::{Likelihood, Score};
pub use parameter::{Factors, Parameter};
pub use priors::Priors;
pub use refine::refine;
pub use refined::{Alternative, Estimate, Estimated};
pub use sighting::Sighting;
pub use value::Value;
