//! Physics-based simulation of ship wakes in synthetic aperture radar (SAR) images.
//!
//! A [`Scene`] (ship, sea, radar, grid) becomes a SAR image with every intermediate field, labels, and a plan that states
//! which terms were computed and estimates those left out:
//!
//! ```
//! use wake_physics::{Scene, simulate};
//!
//! let mut scene = Scene::default(); // a 195 m ship at 10 m/s, wind 5 m/s, X band
//! (scene.grid.rows, scene.grid.columns) = (64, 64);
//! let simulation = simulate(&scene)?;
//! assert_eq!(simulation.speckled.values.len(), 64 * 64);
//! println!("{}", simulation.plan);
//! # Ok::<(), wake_physics::Error>(())
//! ```
//!
//! Every wave is a plane wave of linear theory: a random sea drawn from a wind spectrum, and the free waves of a thin ship.
//! Surface facets scatter by Bragg, two-scale and specular theory; the radar displaces and smears moving facets. Use a
//! [`Simulator`] for many scenes; [`measure`] analyses an image. Data flows one way:
//!
//! ```text
//! Scene ─► sea surface + Kelvin wake (+ turbulent wake) ─► slopes, velocities ─► σ⁰ ─► SAR image ─► labels
//! ```
//!
//! # Modules, in the order of the data flow
//!
//! | subject | modules |
//! | --- | --- |
//! | general | [`constants`], [`output`], [`export`], [`dispersion`], [`window`] |
//! | the scene | [`scene`] |
//! | the sea | [`spectrum`], [`spreading`], [`waves`], [`wind_sea`], [`swell`], [`surface`] |
//! | the ship | [`hull`], [`kelvin`], [`turbulent`] |
//! | the radar | [`permittivity`], [`scattering`], [`sar`], [`gusts`], [`slicks`] |
//! | the image | [`grey`], [`labels`], [`measure`] |
//! | tests and benches | [`reference`](mod@reference) |
//!
//! # Axes and units
//!
//! SI units. x is ground range, growing away from the radar; y is azimuth, along the flight; z is up. Directions are
//! degrees clockwise from +y and say where a thing goes to. Row 0 has the largest y; the pixel `[rows/2, columns/2]` is the
//! origin. Formulas are functions of plain `f64`; fields are `f32`.
//!
//! # Speed and error
//!
//! Every fast method has a slow reference in this crate ([`Method::Direct`]; for single pixels [`direct_intensity`]).
//! [`scene::Model::tolerance`] bounds the difference: for every field the largest difference relative to the field's root
//! mean square, for the image before speckle the root mean square difference relative to the mean.
#![cfg_attr(docsrs, feature(doc_cfg))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

/// The README's examples run as doc-tests, too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

// In the order of the data flow; docs/architecture.md is the same list.
mod error;
pub mod constants;
mod numeric;
mod raster;
mod memory;
mod workspace;
pub mod output;
pub mod export;
mod fft;
mod random;
pub mod dispersion;
pub mod window;
pub mod scene;
pub mod spectrum;
pub mod spreading;
pub mod waves;
pub mod wind_sea;
pub mod swell;
pub mod surface;
mod track;
pub mod hull;
mod nufft;
pub mod kelvin;
pub mod turbulent;
pub mod permittivity;
pub mod scattering;
pub mod sar;
pub mod gusts;
pub mod slicks;
pub mod grey;
mod pixels;
mod fields;
mod models;
mod linear;
mod effects;
mod prepared;
mod plan;
pub mod labels;
mod simulate;
pub mod measure;
pub mod estimate;
pub mod reference;

pub use error::{Error, Result};
pub use labels::{Labels, labels_of};
pub use memory::available as available_memory;
pub use plan::{Cost, Plan, PlannedTerm, Sizes};
pub use raster::{Field, Raster};
pub use scene::{Grid, Radar, Scene, Sea, Ship, Term};
pub use simulate::{
    Accuracy, DirectPixels, LinearSea, Method, Reached, SarImage, Seconds, Simulation, Simulator,
    direct_intensity, expected_intensity, simulate, simulate_with, unit_speckle,
};
pub use track::Track;
