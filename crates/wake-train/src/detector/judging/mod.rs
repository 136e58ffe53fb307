//! How well finders find wakes: images whose wakes are known, simulated or labelled by people, searched and judged.
//!
//! ```text
//! recipe ─► images with their wakes ─┐
//! labels.json ─► tiles ──────────────┴─► finders ─► detections ─► judged images ─► curves
//! ```
//!
//! The rules and the curves are those of [`score`](wake_detector::score).

mod compared;
mod open_sea;
mod simulated;
mod tiles;

pub use compared::compared;
pub use open_sea::{open_windows, paired_windows};
pub use simulated::{Searched, known};
pub use tiles::Tile;
