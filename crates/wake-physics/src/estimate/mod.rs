//! What an image tells of the values of its scene.
//!
//! ```text
//! scene ─► expected image and derivatives ─┬─► likelihood, score and information of an image
//!      └─► covariance of sea and speckle ──┴─► bounds, without any image
//! ```
//!
//! [`expected_with_derivatives`] is the mean image of a scene with its derivatives, [`Likelihood`] reads an image with it, and
//! [`bound`] says how well any estimator can know ship and wind. [`estimate`] reads ship and wind from one image.

mod answer;
mod bound;
mod calibration;
mod expected;
mod likelihood;
mod matrix;
mod mode;
mod noise;
mod observed;
mod options;
mod parameter;
mod part;
mod priors;
mod reader;
mod scorer;
mod sea;
mod search;
mod state;
mod torus;
mod value;

pub use answer::{Alternative, Estimate, Fitted, GoodnessOfFit, Wake};
pub use bound::{Bound, bound};
pub use expected::{Expected, ExpectedImage, expected_with_derivatives};
pub use likelihood::{Likelihood, Score};
pub use options::{Detection, Options};
pub use parameter::{Factors, Parameter};
pub use priors::Priors;
pub use reader::estimate;
pub use value::Value;
