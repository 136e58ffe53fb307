//! Polarization.

use serde::{Deserialize, Serialize};

/// Transmit and receive polarization.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Polarization {
    /// Vertical on transmit and receive.
    VV,
    /// Horizontal on transmit and receive.
    HH,
}
