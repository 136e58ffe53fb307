//! Paired echoes of a ship's brightest points, which form a cross along range and azimuth.
//!
//! A phase ripple of small amplitude b with n periods over the band makes two copies of a point, n resolution cells to
//! either side, each with (b/2)² of its power. Random ripple makes copies at every distance, with powers that follow the
//! ripple's spectrum. Flicker noise, with the spectrum 1/f, gives
//!
//! ```text
//! σ_n ∝ σ / n,     n = 1 … 40 cells,     Σ_n σ_n = ratio · σ
//! ```
//!
//! in each of the two axes; powers are exponentially distributed with a mean proportional to 1/n (fully developed ripple).
//! The shares of the axes, and of the sides of each axis, are uniform between 0 and 1 and equal for all points of a ship:
//! combined ripple of phase and amplitude is asymmetric. Rotating antennas and vibrating parts of the ship modulate its
//! echo likewise.
//!
//! # References
//!
//! Klauder, Price, Darlington and Albersheim (1960), Bell Syst. Tech. J. 39, 745: paired echoes. Carrara, Goodman and
//! Majewski (1995), Spotlight Synthetic Aperture Radar: power-law phase errors. The exponent 1, the farthest cell and the
//! number of points are chosen.

use super::impulse::PointTarget;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};

/// Farthest copy [cells]: chosen.
const FARTHEST: u32 = 40;

/// Number of a ship's brightest points that are copied: chosen; copies of weaker points are hidden by the sea.
const BRIGHTEST: usize = 3;

/// Parameters of the copies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairedEchoes {
    /// Power of all copies over the power of the copied points.
    pub(crate) ratio: f64,
    /// Resolution in range and azimuth \[m\].
    pub(crate) cell: [f64; 2],
}

impl PairedEchoes {
    /// Transfers a part of the power of a ship's brightest points to copies; the sum of cross sections is conserved.
    pub(crate) fn spread(&self, points: &mut Vec<PointTarget>, random: &mut impl Rng) {
        let brightness =
            |a: &PointTarget, b: &PointTarget| b.cross_section.total_cmp(&a.cross_section);
        points.sort_by(brightness);
        // Four arms: range toward and away from the radar, azimuth back and ahead.
        let [axis, range, azimuth]: [f64; 3] = [random.random(), random.random(), random.random()];
        let arms = [
            ([-1.0, 0.0], axis * range),
            ([1.0, 0.0], axis * (1.0 - range)),
            ([0.0, -1.0], (1.0 - axis) * azimuth),
            ([0.0, 1.0], (1.0 - axis) * (1.0 - azimuth)),
        ];
        for n in 0..points.len().min(BRIGHTEST) {
            let given = points[n].cross_section * self.ratio / (1.0 + self.ratio);
            points[n].cross_section -= given;
            let [x, y] = points[n].position;
            for ([right, ahead], share) in arms {
                let powers: Vec<f64> = (1..=FARTHEST)
                    .map(|cell| {
                        let drawn: f64 = Exp1.sample(random);
                        drawn / f64::from(cell)
                    })
                    .collect();
                let sum: f64 = powers.iter().sum();
                for (cell, power) in (1..=FARTHEST).zip(powers) {
                    let distance = f64::from(cell) + random.random::<f64>() - 0.5;
                    points.push(PointTarget {
                        position: [
                            x + right * distance * self.cell[0],
                            y + ahead * distance * self.cell[1],
                        ],
                        cross_section: given * share * power / sum,
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};

    fn points() -> Vec<PointTarget> {
        let point = |n: u32| PointTarget {
            position: [f64::from(n), 3.0 * f64::from(n)],
            cross_section: f64::from(100 - n),
        };
        (0..20).map(point).collect()
    }

    fn sum(points: &[PointTarget]) -> f64 {
        points.iter().map(|p| p.cross_section).sum()
    }

    /// Power is conserved; the three brightest points give away the share ratio/(1 + ratio), and the copies lie on the two
    /// axes.
    #[test]
    fn copies_take_what_points_give() {
        let echoes = PairedEchoes {
            ratio: 0.25,
            cell: [20.0, 15.0],
        };
        for ship in 0..20 {
            let mut spread = points();
            echoes.spread(&mut spread, &mut generator(4, Stream::PairedEchoes, ship));
            assert!((sum(&spread) / sum(&points()) - 1.0).abs() < 1e-12);
            let copies = &spread[20..];
            assert_eq!(copies.len(), 3 * 4 * FARTHEST as usize);
            let given = (100.0 + 99.0 + 98.0) * 0.2;
            assert!((sum(copies) / given - 1.0).abs() < 1e-12);
            for copy in copies {
                let [x, y] = copy.position;
                let on = |n: f64| {
                    let (dx, dy) = ((x - n).abs() / 20.0, (y - 3.0 * n).abs() / 15.0);
                    let (near, far) = (dx.min(dy), dx.max(dy));
                    near < 1e-12 && (0.5..=FARTHEST as f64 + 0.5).contains(&far)
                };
                assert!(on(0.0) || on(1.0) || on(2.0), "{x} {y}");
            }
        }
    }

    /// Mean power by distance is 1/n over the harmonic sum H(40), over 2,000 ships; copy n lies at n ± ½ cells.
    #[test]
    fn power_falls_as_flicker_noise() {
        let echoes = PairedEchoes {
            ratio: 1.0,
            cell: [1.0, 1.0],
        };
        let ships = 2000;
        let mut power = vec![0.0; FARTHEST as usize];
        for ship in 0..ships {
            let mut spread = points()[..1].to_vec();
            echoes.spread(&mut spread, &mut generator(9, Stream::PairedEchoes, ship));
            for copy in &spread[1..] {
                let [x, y] = copy.position;
                let cell = x.abs().max(y.abs()).round() as usize;
                power[cell.clamp(1, FARTHEST as usize) - 1] += copy.cross_section / 50.0;
            }
        }
        let harmonic: f64 = (1..=FARTHEST).map(|n| 1.0 / f64::from(n)).sum();
        // Powers are divided by their own sum, whose relative deviation is √(Σ 1/n²)/H = 0.3 per arm: a bias of up to 0.09
        // of the ratio of means, plus the standard error of 2,000 exponentials weighted by shares, 1/√1000.
        for n in [1, 2, 5, 12, 30] {
            let expected = 1.0 / (f64::from(n) * harmonic);
            let found = power[n as usize - 1] / ships as f64;
            let bias = if n == 1 { 0.2 } else { 0.12 };
            assert!(
                (found / expected - 1.0).abs() < bias + 4.0 / 1000f64.sqrt() * 0.3,
                "{n}: {found} {expected}"
            );
        }
    }
}
