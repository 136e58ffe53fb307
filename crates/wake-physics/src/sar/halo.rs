//! Halo of a ship: power returned from around the hull rather than from one of its points.
//!
//! ```text
//! I(r) = σ_h / (2π √det M) · (1 + rᵀ M⁻¹ r)^{−3/2}
//! M    = ρ²/4 + hull's second moments + (R/V)² σ_v² in azimuth
//! ```
//!
//! The hull's second moments are L²/12 along and B²/12 across the heading, ρ is the resolution of each axis. The integral over the
//! plane is the cross section `σ_h`, and the share inside the contour rᵀ M⁻¹ r = q² is 1 − (1 + q²)^{−1/2}.
//!
//! This power comes from double reflections between sea and ship, from spray and white water about the hull, and from parts
//! that the processor leaves out of focus. Its form is chosen: the power law of the far sidelobes (r^{−3} over the area,
//! like 1/x² along a line), continued to a finite centre.

use crate::raster::{Field, Raster};
use std::f64::consts::TAU;

/// Halo of one ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Halo {
    /// Imaged midship (x, y) \[m\].
    pub(crate) centre: [f64; 2],
    /// Second moments M: xx, xy, yy \[m²\].
    pub(crate) moments: [f64; 3],
    /// Radar cross section `σ_h` \[m²\].
    pub(crate) cross_section: f64,
}

/// Second moments of a hull on the sea.
///
/// - `[ahead_x, ahead_y]`: unit vector of the direction of travel
/// - `[length, beam]` \[m\]
/// - returns xx, xy, yy \[m²\]
#[must_use]
pub(crate) fn hull_moments([ahead_x, ahead_y]: [f64; 2], [length, beam]: [f64; 2]) -> [f64; 3] {
    let (along, across) = (length * length / 12.0, beam * beam / 12.0);
    [
        along * ahead_x * ahead_x + across * ahead_y * ahead_y,
        (along - across) * ahead_x * ahead_y,
        along * ahead_y * ahead_y + across * ahead_x * ahead_x,
    ]
}

impl Halo {
    /// Adds the halo to an image before speckle, `[rows, columns]` of `raster`, linear in units of σ⁰.
    pub(crate) fn add(&self, intensity: &mut Field, raster: &Raster) {
        let [xx, xy, yy] = self.moments;
        let determinant = xx * yy - xy * xy;
        let peak = self.cross_section / (TAU * determinant.sqrt());
        for (i, row) in intensity
            .values
            .chunks_exact_mut(raster.columns.max(1))
            .enumerate()
        {
            let y = raster.y(i) - self.centre[1];
            for (j, value) in row.iter_mut().enumerate() {
                let x = raster.x(j) - self.centre[0];
                let squared = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant;
                *value += (peak / ((1.0 + squared) * (1.0 + squared).sqrt())) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sar::geometry::direction;

    fn halo(heading: f64) -> Halo {
        let [xx, xy, yy] = hull_moments(direction(heading), [180.0, 28.0]);
        Halo {
            centre: [40.0, -25.0],
            moments: [xx + 100.0, xy, yy + 100.0],
            cross_section: 900.0,
        }
    }

    /// The sum over the pixels of a square of half-width h is the cross section minus the part outside, which lies between
    /// the circumscribed and the inscribed ellipse.
    #[test]
    fn the_halo_has_its_cross_section() {
        let raster = Raster::image(801, 801, 5.0);
        for heading in [0.0, 30.0, 117.0] {
            let halo = halo(heading);
            let mut image = Field::constant(&raster, 0.0);
            halo.add(&mut image, &raster);
            let sum: f64 = image.values.iter().map(|&v| 25.0 * f64::from(v)).sum();
            // Principal moments: L²/12 + 100 and B²/12 + 100. Nearest edge 1,960 m, farthest corner 2,900 m from the centre.
            let outside = |radius: f64, moment: f64| (1.0 + radius * radius / moment).powf(-0.5);
            let most = outside(1960.0, 180f64.powi(2) / 12.0 + 100.0);
            let least = outside(2900.0, 28f64.powi(2) / 12.0 + 100.0);
            let missing = 1.0 - sum / 900.0;
            assert!(
                least < missing && missing < most,
                "{least} {missing} {most}"
            );
        }
    }

    /// Half the power lies within q² = 3 for every heading, by counting.
    #[test]
    fn half_of_the_halo_lies_within_its_half_contour() {
        let raster = Raster::image(301, 301, 4.0);
        for heading in [10.0, 145.0] {
            let halo = halo(heading);
            let mut image = Field::constant(&raster, 0.0);
            halo.add(&mut image, &raster);
            let [sin, cos] = direction(heading);
            let mut inside = 0.0;
            for i in 0..raster.rows {
                for j in 0..raster.columns {
                    let [x, y] = [raster.x(j) - 40.0, raster.y(i) + 25.0];
                    // Along and across the heading, the moments are principal.
                    let [along, across] = [x * sin + y * cos, x * cos - y * sin];
                    let q = along * along / (180f64.powi(2) / 12.0 + 100.0)
                        + across * across / (28f64.powi(2) / 12.0 + 100.0);
                    if q < 3.0 {
                        inside += 16.0 * f64::from(image.at(i, j));
                    }
                }
            }
            // An ellipse of half-axes 92 and 22 m on pixels of 4 m: its edge, 380 m long, is uncertain by a quarter of a
            // pixel at random, where the power is 1/16 of the peak.
            assert!((inside / 900.0 - 0.5).abs() < 0.01, "{inside}");
        }
    }
}
