//! Inputs of the wake model: numbers of a scene, positions in the ship's frame, and words.
//!
//! ```text
//! prompt ─► token ids ─► compact ids ─► reader ─► numbers
//! numbers ─┬─► Fourier features ──────────────┐
//!          ├─► places in the ship's frame ────┼─► model
//!          └─► scene ─► image expected of it ─┘
//! ```
//!
//! Unknown values are left out: a number that the prompt does not state has the flag 0 and no value, and without
//! speed, heading and position of the ship the maps are empty.

mod features;
mod position_maps;
mod statement;
mod vocabulary;

pub use features::{FEATURES, features};
pub use position_maps::MapGrid;
pub use position_maps::WEDGE;
pub use position_maps::{PATCH_SIZE, PLACES, places};
pub use statement::{QUANTITIES, said, statement};
pub use vocabulary::{Vocabulary, tokens};
