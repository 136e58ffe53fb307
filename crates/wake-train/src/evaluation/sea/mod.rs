//! How like the sea of real images a learnt, a simulated and a Gaussian one are.
//!
//! ```text
//! left half ─► what is learnt, styles and levels ─► kinds of sea ─┐
//! right half ─► what all kinds stand against ─────────────────────┴─► rows
//! ```

mod kinds;
mod pair;
mod row;

pub use kinds::{gaussian_amplitude, kinds};
pub use pair::SeaPair;
pub use row::{SeaRow, mean_spectrum};
