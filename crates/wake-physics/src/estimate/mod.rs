//! From an image back to ship and sea, with standard deviations.
//!
//! ```text
//! image ─► search ─► Fisher scoring ─► values, covariance, other modes, goodness of fit
//!            scene ─► expected image and derivatives ─┘        └─► bounds, without any image
//! ```
//!
//! [`expected_with_derivatives`] is the mean image of a scene with its exact derivatives, [`estimate`] reads an image with it,
//! and [`bound`] says how well any estimator can.

mod bound;
mod coarse;
mod echo;
mod expected;
mod fit;
mod likelihood;
mod matrix;
mod noise;
mod options;
mod parameter;
mod report;
mod search;
mod torus;
mod value;
mod wake;

pub use bound::{Bound, bound};
pub use expected::{Expected, ExpectedImage, expected_with_derivatives};
pub use fit::Priors;
pub use options::{Detection, Options};
pub use parameter::Parameter;
pub use report::{Alternative, Estimate, Estimated, Fitted, GoodnessOfFit};
pub use value::Value;
pub use wake::estimate;
