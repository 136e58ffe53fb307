//! Evaluation of generated images, with every figure beside the simulator's own.
//!
//! ```text
//! scenes ─► ImageSource ─► intensity ─► readings of heading, speed, wind, fetch and incidence ─► rows of errors, controllability
//!                              └─► grey ─► pixels, ablation, wake correlation, two-sample test, domain
//! real images ─► pairs of windows ─► kinds of sea ─► rows
//! ```
//!
//! Two simulated images of one scene differ, since their seas are random. So every figure stands beside those of a second
//! simulated image, of the physics without a network ([`Baseline`]), of a constant image and of a blurred one: a model is good
//! if its images are as close to a simulated image as another simulated image is.
//!
//! Every type whose name ends in `Row` is a line of a report, serialized under the names of its fields. Any [`ImageSource`] can
//! be evaluated:
//!
//! ```
//! use wake_train::evaluation::{Baseline, ImageSource, Quantity, Reading, Told};
//! use wake_physics::Scene;
//!
//! let scenes = [Scene::default().with_assignments(&["grid.rows = 64", "grid.columns = 64"])?];
//! let images = Baseline::Gaussian.draw(&scenes, Told::Both)?;
//! let reading = Reading::of(&images[0], &scenes[0])?;
//! println!("error of the wind speed {:?} m/s", reading.error(Quantity::WindSpeed, &scenes[0]));
//! # Ok::<(), wake_train::Error>(())
//! ```

// Sources of images.
mod baseline;
mod held_out;
mod source;

// Figures of images.
mod judge;
mod estimates;
mod pixels;
mod reading;
mod shape;
mod statistics;
mod view;
mod text_to_image;

// Figures of sources, over scenes.
mod comparison;
mod domain;
mod measurements;
mod wake_correlation;
mod ablation;
mod controllability;

mod figures;

pub mod sea;

pub use ablation::AblationRow;
pub use baseline::Baseline;
pub use controllability::ControllabilityRow;
pub use domain::{DomainRow, Views};
pub use estimates::{EstimateRow, EstimatedImage, ToEstimate};
pub use figures::{ConditionRow, Evaluation, Figures, Speckle};
pub use held_out::HeldOut;
pub use measurements::MeasurementRow;
pub use pixels::PixelRow;
pub use reading::{Quantity, Reading};
pub use source::{ImageSource, Named, Told, other_sea};
pub use statistics::AbsoluteErrors;
pub use text_to_image::{Reconstructed, TextToImage};
pub use view::View;
pub use wake_correlation::WakeCorrelation;
