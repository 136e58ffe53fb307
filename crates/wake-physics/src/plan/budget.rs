//! The error budget: which share of `model.tolerance` each source of error may use.

/// Shares of the tolerance \[1\].
///
/// The errors are of different seas of rounding, interpolation and neglect; that they all add up, with one sign at one
/// pixel, is the worst case, and in it the shares make up the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Budget {
    /// Terms left out, by estimate.
    pub(crate) terms: f64,
    /// Nodes of the wake integral.
    pub(crate) wake_nodes: f64,
    /// Sums of waves on the raster. Bunching turns an error of the velocity into a larger one of the image, but
    /// the largest error of a field, which is what counts here, is some five times its root mean square.
    pub(crate) fields: f64,
    /// The table of σ⁰.
    pub(crate) table: f64,
    /// The kernels of the imaging.
    pub(crate) kernels: f64,
}

/// The one budget there is.
pub(crate) const SHARES: Budget = Budget {
    terms: 0.5,
    wake_nodes: 1.0,
    fields: 0.3,
    table: 0.5,
    kernels: 0.4,
};
