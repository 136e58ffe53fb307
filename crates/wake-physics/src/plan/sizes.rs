//! Sizes of a simulation.

use crate::raster::Raster;
use serde::Serialize;

/// Most pixels computed at once, margins included; larger scenes are computed in strips of at most half as many (chosen:
/// about a gibibyte of fields, and an image of 4096 × 4096 pixels is one strip).
const MOST_AT_ONCE: usize = 1 << 25;

/// Numbers of pixels, waves and nodes of a simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sizes {
    /// Spacing of the computed pixels \[m\]: the image's spacing or an integer fraction of it.
    pub computed_spacing: f64,
    /// Strips of rows, computed one after the other.
    pub strips: usize,
    /// Rows and columns added on each side of the image.
    pub margin: [usize; 2],
    /// Rows and columns computed.
    pub computed: [usize; 2],
    /// Largest resolved wavenumber [rad/m].
    pub band: f64,
    /// Rows and columns of the periodic lattice of the sea; 0 without a sea.
    pub sea_lattice: [usize; 2],
    /// Plane waves of the Kelvin wakes: transverse and divergent.
    pub wake_nodes: [usize; 2],
    /// Ranges of the direction of wake waves to the track \[deg\].
    pub wake_directions: Vec<[f64; 2]>,
}

/// Number of strips of rows of an image.
pub(super) fn strips(computed: &Raster, image: &Raster) -> usize {
    if computed.len() <= MOST_AT_ONCE {
        return 1;
    }
    (2 * computed.len()).div_ceil(MOST_AT_ONCE).min(image.rows)
}
