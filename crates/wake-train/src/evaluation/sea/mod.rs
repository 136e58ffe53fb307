//! Comparison of learnt, simulated and Gaussian seas with the sea of real images.
//!
//! ```text
//! left half ─► what is learnt, styles and levels ─► kinds of sea ─┐
//! right half ─► what all kinds stand against ─────────────────────┴─► rows, and a discriminant by groups of features
//! ```

mod discriminant;
mod features;
mod kinds;
mod pair;
mod row;

pub use discriminant::{GroupAccuracy, discriminant};
pub use features::{FeatureGroup, feature_groups, features};
pub use kinds::{gaussian_amplitude, kinds, simulated_seas};
pub use pair::SeaPair;
pub use row::{SeaRow, mean_spectrum};
