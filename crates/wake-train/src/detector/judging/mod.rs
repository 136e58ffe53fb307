//! Scoring of finders on images whose wakes are known, simulated or labelled by people.
//!
//! ```text
//! recipe ─► images with their wakes ─┐
//! labels.json ─► tiles ──────────────┴─► finders ─► detections ─► judged images ─► curves
//! sea without ships ─► detector ─► false alarms per 1,000 km²
//! detections and what they turned out to be ─► probabilities and their reliability
//! ```
//!
//! [`score`](wake_detector::score) defines the rules and the curves.

mod bootstrap;
mod compared;
mod empty_sea;
mod open_sea;
mod outcomes;
mod reliability;
mod simulated;
mod tiles;

pub use bootstrap::bootstrap;
pub use compared::compared;
pub use empty_sea::{EmptySea, score_for};
pub use open_sea::{open_windows, paired_windows};
pub use outcomes::{DetectionOutcome, KnownImages, Spacing, outcomes};
pub use reliability::{Reliability, ReliabilityBin};
pub use simulated::{Searched, known};
pub use tiles::Tile;
