#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;

// Product → pixels → wakes.
mod sea;

mod state;

mod search;

// Wakes → answers.
mod echo;
mod profile;

mod seen;

mod ship;
mod wake;

mod geojson;
mod report;
mod table;

pub use echo::Echo;
pub use error::{Error, Result};
pub use geojson::geojson;
pub use profile::Kind;
pub use report::html;
pub use search::{Search, search};
pub use ship::EstimatedShip;
pub use table::csv;
pub use wake::{MappedWake, mapped};
