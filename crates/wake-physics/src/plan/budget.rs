//! The error budget: which share of `model.tolerance` each source of error may use.

/// Shares of the tolerance \[1\].
///
/// The sources know nothing of each other and their errors rarely have one sign at one pixel; even where they have, the
/// shares together make up the tolerance. The split follows how cost grows, and was not tuned by measurement: most goes to
/// the terms left out, which save whole stages, and to the table, whose nodes grow with error^(−1/4) along each axis;
/// little to nodes, sums and kernels, whose cost grows with the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Budget {
    /// Terms left out, by estimate.
    pub(crate) terms: f64,
    /// Nodes of the wake integral.
    pub(crate) wake_nodes: f64,
    /// Sums of waves on the raster, largest error of a field over its root mean square.
    pub(crate) fields: f64,
    /// The table of σ⁰, largest error over the mean.
    pub(crate) table: f64,
    /// The kernels of the imaging, mean error over the mean.
    pub(crate) kernels: f64,
}

/// The one budget there is.
pub(crate) const SHARES: Budget = Budget {
    terms: 0.3,
    wake_nodes: 0.1,
    fields: 0.15,
    table: 0.3,
    kernels: 0.15,
};

#[cfg(test)]
mod tests {
    use super::*;

    /// All shares, none forgotten (a new one does not compile here), are positive and no more than the tolerance.
    #[test]
    fn the_shares_are_at_most_the_tolerance() {
        let Budget {
            terms,
            wake_nodes,
            fields,
            table,
            kernels,
        } = SHARES;
        let shares = [terms, wake_nodes, fields, table, kernels];
        assert!(shares.iter().all(|&share| share > 0.0));
        // Sums of five decimal fractions round by a few 1e-16.
        assert!(shares.iter().sum::<f64>() <= 1.0 + 1e-15);
    }
}
