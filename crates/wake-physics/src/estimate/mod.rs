//! What an image tells of the values of its scene.
//!
//! ```text
//! scene ─► expected image and derivatives ─┬─► likelihood, score and information of an image
//!      └─► covariance of sea and speckle ──┴─► bounds, without any image
//! ```
//!
//! [`expected_with_derivatives`] is the mean image of a scene with its derivatives, [`Likelihood`] reads an image with it, and
//! [`bound`] says how well any estimate can know ship and wind.

mod bound;
mod expected;
mod likelihood;
mod matrix;
mod noise;
mod observed;
mod parameter;
mod priors;
mod sea;
mod torus;
mod value;

pub use bound::{Bound, bound};
pub use expected::{Expected, ExpectedImage, expected_with_derivatives};
pub use likelihood::{Likelihood, Score};
pub use parameter::{Factors, Parameter};
pub use priors::Priors;
pub use value::Value;
