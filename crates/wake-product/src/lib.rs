#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
mod ships;

mod blocks;
mod scenes;

mod estimate;
mod simulate;

pub use error::{Error, Result};
pub use estimate::{MappedEstimate, estimate_wake};
pub use scenes::Wind;
pub use ships::{ShipAt, read_ships};
pub use simulate::{Options, Written, simulate};
