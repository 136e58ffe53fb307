//! A ship at satellite incidence: bright points with random shares of its radar cross section.
//!
//! ```text
//! 10 log₁₀ σ = 10 log₁₀(0.08 L^{7/3}) − 3 dB ± 3 dB
//! y_image    = y + (R/V) (v + a t)                    v, a toward the radar; t over one aperture, −T/2 to T/2
//! var y      = (R/V)² (σ_v² + σ_a² T²/12)             in addition to the hull's;   σ_a = 2π σ_v/P
//! ```
//!
//! Roll and pitch of period P displace the points by their velocities, of standard deviation `σ_v`, and spread each over
//! (R/V) a T during the aperture: the echo is defocused.
//!
//! The points are the same with and without an impulse response.

use super::geometry::{azimuth_displacement, direction, layover};
use super::impulse::PointTarget;
use crate::random::{Stream, generator};
use rand::Rng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};

/// Default number of points along the deck: chosen; 2 to 11 maxima within 10 dB of the peak were counted in real echoes.
const POINTS: usize = 12;

/// Share of a defocused echo above which a point is spread over the aperture in parts: chosen.
const LARGE_SHARE: f64 = 0.05;

/// Number of these parts: chosen; the longest apertures smear over four resolution cells, two parts each.
const PARTS: usize = 8;

/// Smallest and largest share of the brightest point: chosen.
const DOMINANT_SHARE: [f64; 2] = [0.15, 0.85];

/// Standard deviation of the echo of ships of equal length \[dB\]: measured on fifteen ships.
const SPREAD_DB: f64 = 3.0;

/// Height of the points above the water, as a share of the beam: chosen.
const HEIGHT_OF_BEAM: f64 = 0.4;

/// Median radar cross section of ships of a given length.
///
/// ```text
/// 10 log₁₀ σ = 10 log₁₀(0.08 L^{7/3}) − 3 dB
/// ```
///
/// - `length` L \[m\]
/// - returns σ \[m²\], 32.7 dB m² at 100 m, 39.7 at 200 m
///
/// # Validity
///
/// Ships of 40 to 350 m, incidence of 20 to 60°, C band; used unchanged for VV and HH and at L, S and X band, which is
/// chosen. −3 dB and the spread of 3 dB fit fifteen ships measured in Sentinel-1 images (34.6 to 42.9 dB m², mean 39.0,
/// calibrated to 1 dB). The median itself is uncertain by about 3 dB: Vachon, English and Wolfe (2007) found different
/// scales for the same ships in two modes of one radar.
///
/// Skolnik's law for grazing incidence, 52 √f D^{3/2} m² with f in MHz and D in 1000 t, does not apply: it was measured on
/// naval ships of 2 to 17 thousand tonnes whose sides face the radar, and gives a ship of 195 m and 23 thousand tonnes 57.5
/// dB m² at X band, where this law gives 39.5.
///
/// # References
///
/// Vachon, Campbell, Bjerkelund, Dobson and Rey (1997), Can. J. Remote Sens. 23, 48: the power of L, quoted from memory,
/// not verified. Vachon, English and Wolfe (2007), DRDC Ottawa TM 2007-052: a law in length alone with a log-normal spread,
/// 1,805 ships. Skolnik (1974), IEEE Trans. Aerosp. Electron. Syst. 10, 292.
#[must_use]
pub fn median_cross_section(length: f64) -> f64 {
    0.08 * length.powf(7.0 / 3.0) * 10f64.powf(-0.3)
}

/// A ship whose echo is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShipEcho {
    /// True midship position (x, y) \[m\].
    pub(crate) position: [f64; 2],
    /// Direction of motion [deg clockwise from azimuth].
    pub(crate) heading: f64,
    /// Length L \[m\].
    pub(crate) length: f64,
    /// Beam B \[m\].
    pub(crate) beam: f64,
    /// Velocity toward the radar [m/s].
    pub(crate) radial_velocity: f64,
    /// Standard deviation of the points' velocity toward the radar by roll and pitch [m/s].
    pub(crate) roll_velocity: f64,
    /// Standard deviation of their acceleration [m/s²].
    pub(crate) roll_acceleration: f64,
    /// Number of points; 12 by default.
    pub(crate) points: Option<u32>,
}

/// Imaging parameters of the echo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Viewing {
    /// Incidence θ \[rad\].
    pub(crate) incidence: f64,
    /// R/V \[s\].
    pub(crate) range_to_velocity: f64,
    /// Time of one aperture T \[s\].
    pub(crate) aperture: f64,
}

impl ShipEcho {
    /// Total cross section of all points \[m²\].
    ///
    /// - `number` of the ship in its scene, as for [`scatterers`](Self::scatterers)
    pub(crate) fn cross_section(&self, seed: u64, number: usize) -> f64 {
        self.drawn_cross_section(&mut generator(seed, Stream::Scatterers, number as u64))
    }

    /// The cross section from the first random number of the ship's stream.
    fn drawn_cross_section(&self, random: &mut impl Rng) -> f64 {
        let normal: f64 = StandardNormal.sample(random);
        median_cross_section(self.length) * 10f64.powf(0.1 * SPREAD_DB * normal)
    }

    /// The points at their imaged positions.
    ///
    /// Positions along the deck are evenly spaced with jitter, shares are exponential except for one point that has 0.15 to
    /// 0.85 of the total. Each point is displaced in azimuth by its velocity and toward the radar by its height (0.4 of the
    /// beam, chosen). Together they have the median cross section times a log-normal factor of 3 dB.
    ///
    /// - `number` of the ship in its scene: the same seed and number give the same echo
    #[must_use]
    pub(crate) fn scatterers(&self, view: &Viewing, seed: u64, number: usize) -> Vec<PointTarget> {
        let mut random = generator(seed, Stream::Scatterers, number as u64);
        let normal = |random: &mut _| -> f64 { StandardNormal.sample(random) };
        let total = self.drawn_cross_section(&mut random);
        let count = self.points.map_or(POINTS, |count| count as usize);
        let shares = shares(&mut random, count);
        let [ahead_x, ahead_y] = direction(self.heading);
        let mut points = Vec::with_capacity(count);
        for (n, share) in shares.into_iter().enumerate() {
            let along: f64 = uniform(&mut random, [0.0, 1.0]);
            let along = self.length * ((n as f64 + along) / count as f64 - 0.5);
            let side = self.beam * uniform(&mut random, [-0.5, 0.5]);
            let height = HEIGHT_OF_BEAM * self.beam * uniform(&mut random, [0.0, 1.0]);
            let velocity = self.radial_velocity + self.roll_velocity * normal(&mut random);
            let mut add = |velocity, cross_section| {
                points.push(PointTarget {
                    position: [
                        self.position[0]
                            + along * ahead_x
                            + side * ahead_y
                            + layover(height, view.incidence),
                        self.position[1] + along * ahead_y - side * ahead_x
                            + azimuth_displacement(view.range_to_velocity, velocity),
                    ],
                    cross_section,
                });
            };
            if self.roll_acceleration == 0.0 {
                add(velocity, total * share);
                continue;
            }
            let acceleration = self.roll_acceleration * normal(&mut random);
            let parts = if share > LARGE_SHARE { PARTS } else { 1 };
            for part in 0..parts {
                let place = (part as f64 + uniform(&mut random, [0.0, 1.0])) / parts as f64;
                let change = acceleration * view.aperture * (place - 0.5);
                add(velocity + change, total * share / parts as f64);
            }
        }
        points
    }
}

/// Random shares with sum 1: exponential, except for one dominant share.
fn shares(random: &mut impl Rng, count: usize) -> Vec<f64> {
    if count == 1 {
        return vec![1.0];
    }
    let dominant = uniform(random, DOMINANT_SHARE);
    let place = (uniform(random, [0.0, count as f64]) as usize).min(count - 1);
    let mut shares: Vec<f64> = (0..count).map(|_| Exp1.sample(random)).collect();
    shares[place] = 0.0;
    let rest: f64 = shares.iter().sum();
    for share in &mut shares {
        *share *= (1.0 - dominant) / rest;
    }
    shares[place] = dominant;
    shares
}

fn uniform(random: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    let distribution = Uniform::new(low, high);
    distribution.map_or(low, |d| d.sample(random))
}

/// Azimuth ambiguities: fainter copies of points, at the same distance ahead and behind.
///
/// - `distance` \[m\], see [`crate::scene::sensor::ambiguity_distance`]
/// - `level`: cross section of the copies over the cross section of the points \[1\]
///
/// Their range shift and smear are neglected.
#[must_use]
pub(crate) fn ambiguities(points: &[PointTarget], distance: f64, level: f64) -> Vec<PointTarget> {
    let copy = |point: &PointTarget, shift: f64| PointTarget {
        position: [point.position[0], point.position[1] + shift],
        cross_section: level * point.cross_section,
    };
    points
        .iter()
        .flat_map(|point| [copy(point, distance), copy(point, -distance)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: Viewing = Viewing {
        incidence: 0.61,
        range_to_velocity: 115.0,
        aperture: 0.8,
    };

    fn ship() -> ShipEcho {
        ShipEcho {
            position: [100.0, -40.0],
            heading: 90.0,
            length: 180.0,
            beam: 28.0,
            radial_velocity: -4.0,
            roll_velocity: 0.0,
            roll_acceleration: 0.0,
            points: None,
        }
    }

    /// 0.08 L^{7/3} is 35.7, 39.8 and 42.7 dB m² at 100, 150 and 200 m; the law is 3 dB below.
    #[test]
    fn cross_section_by_length() {
        for (length, expected) in [(100.0, 35.7), (150.0, 39.8), (200.0, 42.7)] {
            let db = 10.0 * median_cross_section(length).log10();
            assert!((db - (expected - 3.0)).abs() < 0.06, "{length}: {db}");
        }
    }

    /// Over many ships: median and spread of the sum, mean position, extent along the heading, layover.
    #[test]
    fn many_ships_have_the_statistics_of_the_model() {
        let count = 4000;
        let mut decibels = Vec::new();
        let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
        for seed in 0..count {
            let points = ship().scatterers(&VIEW, seed, 0);
            let total: f64 = points.iter().map(|p| p.cross_section).sum();
            decibels.push(10.0 * (total / median_cross_section(180.0)).log10());
            for p in &points {
                let [px, py] = [p.position[0] - 100.0, p.position[1] + 40.0 + 460.0];
                (x[0], x[1]) = (x[0] + px, x[1] + px * px);
                (y[0], y[1]) = (y[0] + py, y[1] + py * py);
                assert!(px.abs() < 90.0 + 0.4 * 28.0 / 0.61f64.tan() && py.abs() <= 14.0);
            }
        }
        let n = count as f64;
        let mean = decibels.iter().sum::<f64>() / n;
        let square = decibels.iter().map(|d| d * d).sum::<f64>() / n - mean * mean;
        // Four standard errors of the mean, σ/√n, and of the deviation, σ/√2n.
        assert!(mean.abs() < 4.0 * 3.0 / n.sqrt(), "{mean}");
        assert!((square.sqrt() - 3.0).abs() < 4.0 * 3.0 / (2.0 * n).sqrt());
        // Layover of half the height, 0.2 B cot θ; uniform along the deck: L/√12.
        let n = n * POINTS as f64;
        let shift = -0.2 * 28.0 / 0.61f64.tan();
        let deviation = (x[1] / n - (x[0] / n).powi(2)).sqrt();
        assert!((x[0] / n - shift).abs() < 4.0 * deviation / n.sqrt());
        let expected = (180.0f64.powi(2) + (0.4 * 28.0 / 0.61f64.tan()).powi(2)) / 12.0;
        assert!((deviation / expected.sqrt() - 1.0).abs() < 4.0 / n.sqrt());
        assert!((y[0] / n).abs() < 4.0 * 28.0 / 12f64.sqrt() / n.sqrt());
    }

    #[test]
    fn shares_are_shares() {
        for seed in 0..200 {
            let mut random = generator(seed, Stream::Sea, 0);
            let shares = shares(&mut random, POINTS);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let largest = shares.iter().copied().fold(0.0, f64::max);
            assert!(largest >= DOMINANT_SHARE[0] && shares.iter().all(|&s| s > 0.0));
        }
    }

    /// Roll of 0.3 m/s smears the points by 34.5 m, in azimuth only.
    #[test]
    fn roll_smears_in_azimuth() {
        let rolling = ShipEcho {
            roll_velocity: 0.3,
            ..ship()
        };
        let (mut sum, mut n) = (0.0, 0.0);
        for seed in 0..2000 {
            let (still, rolled) = (
                ship().scatterers(&VIEW, seed, 0),
                rolling.scatterers(&VIEW, seed, 0),
            );
            for (a, b) in still.iter().zip(&rolled) {
                assert!((a.position[0] - b.position[0]).abs() < 1e-12);
                sum += (a.position[1] - b.position[1]).powi(2);
                n += 1.0;
            }
        }
        let deviation = f64::sqrt(sum / n);
        assert!(
            (deviation / 34.5 - 1.0).abs() < 4.0 / f64::sqrt(2.0 * n),
            "{deviation}"
        );
    }

    /// Velocity and acceleration of a defocused ship of 200 points: the power-weighted variance of the azimuth exceeds the
    /// variance of the hull, 14²/3 across the heading, by `(R/V)² (σ_v² + σ_a² T²/12)`. The cross section stays the same.
    #[test]
    fn a_rolling_ship_is_defocused() {
        let rolling = ShipEcho {
            roll_velocity: 0.2,
            roll_acceleration: 0.5,
            points: Some(200),
            ..ship()
        };
        let still = ShipEcho {
            points: Some(200),
            ..ship()
        };
        let (mut sum, mut power) = (0.0, 0.0);
        let ships = 600;
        for seed in 0..ships {
            let points = rolling.scatterers(&VIEW, seed, 0);
            let total =
                |points: &[PointTarget]| -> f64 { points.iter().map(|p| p.cross_section).sum() };
            let whole = total(&points);
            assert!((whole / rolling.cross_section(seed, 0) - 1.0).abs() < 1e-9);
            assert!((whole / total(&still.scatterers(&VIEW, seed, 0)) - 1.0).abs() < 1e-9);
            for point in &points {
                let off = point.position[1] + 40.0 + 460.0;
                sum += point.cross_section / whole * off * off;
                power += point.cross_section / whole;
            }
        }
        let variance = sum / power;
        let motion = 115.0f64.powi(2) * (0.2f64.powi(2) + (0.5f64 * 0.8).powi(2) / 12.0);
        let expected = motion + 28.0f64.powi(2) / 12.0;
        // One point has half the power on average, so a ship counts little more than one sample: the variance of a squared
        // normal is twice its square, weighted by the mean square of the shares, 0.3. Four standard errors.
        let error = 4.0 * (2.0 * 0.3 / ships as f64).sqrt();
        assert!(
            (variance / expected - 1.0).abs() < error,
            "{variance} {expected}"
        );
    }

    #[test]
    fn ghosts_lie_on_both_sides() {
        let points = ship().scatterers(&VIEW, 1, 0);
        let ghosts = ambiguities(&points, 5000.0, 0.003);
        assert_eq!(ghosts.len(), 2 * points.len());
        let sum = |points: &[PointTarget]| -> f64 { points.iter().map(|p| p.cross_section).sum() };
        assert!((sum(&ghosts) / sum(&points) - 0.006).abs() < 1e-12);
        assert!((ghosts[0].position[1] - ghosts[1].position[1] - 1e4).abs() < 1e-9);
    }
}
