//! What the backscatter of each pixel depends on.

use crate::raster::Field;
use crate::scattering::hydrodynamic::bragg_factor;

/// Fields of one size that determine σ⁰.
#[derive(Debug, Clone, Copy)]
pub struct FacetFields<'a> {
    /// Slope ∂ζ/∂x, along the look direction \[1\].
    pub slope_x: &'a Field,
    /// Slope ∂ζ/∂y \[1\].
    pub slope_y: &'a Field,
    /// Hydrodynamic modulation m of the Bragg waves \[1\], where it counts.
    pub modulation: Option<&'a Field>,
    /// Share of the Bragg waves that the turbulent wake leaves, 0 to 1, where it counts.
    pub damping: Option<&'a Field>,
}

impl FacetFields<'_> {
    /// Slope of pixel `n`, counted row after row.
    #[inline(always)]
    pub(crate) fn slope(&self, n: usize) -> [f64; 2] {
        [
            f64::from(self.slope_x.values[n]),
            f64::from(self.slope_y.values[n]),
        ]
    }

    /// σ⁰ of pixel `n` from its Bragg and specular parts: only the Bragg part is modulated and damped.
    #[inline(always)]
    pub(crate) fn combine(&self, n: usize, [bragg, specular]: [f64; 2]) -> f32 {
        let modulation = self.modulation.map_or(1.0, |m| bragg_factor(m.values[n]));
        let damping = self.damping.map_or(1.0, |d| d.values[n]);
        (bragg * f64::from(modulation * damping) + specular) as f32
    }
}
