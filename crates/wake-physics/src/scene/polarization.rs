//! Polarization.

use serde::{Deserialize, Serialize};

/// Polarization, sent and received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Polarization {
    /// Vertical both ways.
    VV,
    /// Horizontal both ways.
    HH,
}
