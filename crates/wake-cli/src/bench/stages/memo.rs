//! Slow results shared by several rows.

use std::collections::BTreeMap;

use wake_physics::DirectPixels;

/// Slow results shared by several rows.
#[derive(Default)]
pub(crate) struct Memo {
    /// Seconds and exact σ⁰ of the sample, by stage and size.
    pub(crate) backscatter: BTreeMap<(&'static str, usize), (f64, Vec<f64>)>,
    /// Oracle values of the scene, by size.
    pub(crate) scene: BTreeMap<usize, DirectPixels>,
}
