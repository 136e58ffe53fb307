//! What several rows share, because it is slow.

use std::collections::BTreeMap;

use wake_physics::DirectPixels;

/// What several rows share, because it is slow.
#[derive(Default)]
pub(crate) struct Memo {
    /// Seconds and exact σ⁰ of the sample, by stage and size.
    pub(crate) backscatter: BTreeMap<(&'static str, usize), (f64, Vec<f64>)>,
    /// Pixels of the scene by the oracles, by size.
    pub(crate) scene: BTreeMap<usize, DirectPixels>,
}
