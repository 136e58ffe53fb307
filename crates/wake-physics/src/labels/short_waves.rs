//! Increase of the sea's brightness where a ship's waves roughen it.
//!
//! σ⁰ changes more for slopes toward the radar than for slopes away from it, so waves of any length raise its mean: waves that
//! the pixels do not carry, and equally waves that they carry but the image smears, such as the divergent waves of a ship along
//! the flight.

use crate::effects::Effects;
use crate::kelvin::{KelvinWake, SubpixelWake};
use crate::models::Models;
use crate::numeric::catmull_rom;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::Term;
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Number of rays from the track to the outermost ray at which the change is computed (chosen); it is smooth except where waves
/// break.
const RAYS: usize = 24;

/// Slope variance below which nothing is visible: σ⁰ changes by at most some hundreds times the variance.
const LEAST_VARIANCE: f64 = 1e-5;

/// Directions of waves, over half a circle, and variances of their slopes at which the change is computed. Between them, its
/// logarithm is interpolated by a cubic in direction and linearly in variance.
const DIRECTIONS: usize = 20;
const VARIANCES: [f64; 12] = [
    0.002, 0.004, 0.007, 0.01, 0.0135, 0.017, 0.0205, 0.024, 0.028, 0.032, 0.036, 0.04,
];

/// Change of a sea's mean σ⁰ by a variance of slopes.
#[derive(Debug)]
pub(super) struct ShortWaves {
    /// Waves of each ship, of all lengths that are drawn.
    waves: Vec<Option<SubpixelWake>>,
    /// Backscatter averaged over all slopes of the sea.
    backscatter: Backscatter,
    /// The mean σ⁰, Bragg and specular \[1\], above 0.
    mean: f64,
    /// ln of σ⁰ over its mean, by direction and variance; computed on first use.
    table: OnceLock<[[f64; VARIANCES.len()]; DIRECTIONS]>,
}

impl ShortWaves {
    /// Short waves on a sea whose models average over all its slopes; `None` if no such waves are drawn or the sea returns
    /// nothing.
    pub(super) fn new(
        models: &Models,
        effects: &Effects,
        drawn: impl Fn(Term) -> bool,
    ) -> Option<Self> {
        if !effects.subpixel_wake.counted {
            return None;
        }
        let backscatter = models.backscatter(drawn(Term::TiltAverage), drawn(Term::Specular));
        let mean = backscatter.mean_over(&SlopeCovariance::NONE);
        let mean = mean[0] + mean[1];
        let [from, to] = models.subpixel_band();
        let band = [if drawn(Term::Kelvin) { 0.0 } else { from }, to];
        (mean > 0.0).then(|| Self {
            waves: models
                .wakes
                .iter()
                .map(|wake| wake.subpixel(band))
                .collect(),
            backscatter,
            mean,
            table: OnceLock::new(),
        })
    }

    /// Waves of a ship, if they are steep enough to count.
    pub(super) fn of(&self, ship: usize) -> Option<WavesOfShip<'_>> {
        let waves = self.waves[ship].as_ref()?;
        let strongest = waves.steepest(0.5 * waves.length());
        (strongest >= LEAST_VARIANCE).then_some(WavesOfShip { sea: self, waves })
    }

    /// Relative change of σ⁰ by waves of one direction with the slope variances xx, xy and yy \[1\].
    fn change(&self, [xx, xy, yy]: [f64; 3]) -> f64 {
        let table = self.table.get_or_init(|| self.tabulated());
        let direction = 0.5 * (2.0 * xy).atan2(xx - yy) / PI * DIRECTIONS as f64;
        let variance = xx + yy;
        let next = VARIANCES.partition_point(|&v| v < variance);
        let next = next.min(VARIANCES.len() - 1);
        let (before, low) = match next.checked_sub(1) {
            None => (None, 0.0),
            Some(before) => (Some(before), VARIANCES[before]),
        };
        let part = ((variance - low) / (VARIANCES[next] - low)).min(1.0);
        let of = |direction: i64| {
            let row = &table[direction.rem_euclid(DIRECTIONS as i64) as usize];
            let start = before.map_or(0.0, |before| row[before]);
            start + part * (row[next] - start)
        };
        let whole = direction.floor();
        let weights = catmull_rom(direction - whole);
        let neighbours = weights.iter().zip(whole as i64 - 1..);
        let logarithm: f64 = neighbours.map(|(weight, at)| weight * of(at)).sum();
        logarithm.exp() - 1.0
    }

    fn tabulated(&self) -> [[f64; VARIANCES.len()]; DIRECTIONS] {
        let mut table = [[0.0; VARIANCES.len()]; DIRECTIONS];
        for (n, row) in table.iter_mut().enumerate() {
            let (sin, cos) = (PI * n as f64 / DIRECTIONS as f64).sin_cos();
            for (value, variance) in row.iter_mut().zip(VARIANCES) {
                let slopes = [cos * cos, cos * sin, sin * sin].map(|product| variance * product);
                *value = self.ratio(slopes).ln();
            }
        }
        table
    }

    /// Mean σ⁰ with a variance of slopes over mean σ⁰ without it \[1\].
    fn ratio(&self, [xx, xy, yy]: [f64; 3]) -> f64 {
        let [bragg, specular] = self.backscatter.mean_over(&SlopeCovariance { xx, xy, yy });
        (bragg + specular) / self.mean
    }
}

/// The waves of one ship on a sea.
#[derive(Debug)]
pub(super) struct WavesOfShip<'s> {
    sea: &'s ShortWaves,
    waves: &'s SubpixelWake,
}

impl WavesOfShip<'_> {
    /// The change across the track at a distance astern of midship \[m\].
    pub(super) fn profile(&self, wake: &KelvinWake, distance: f64) -> Profile {
        let reach = self.waves.widest() * distance;
        let step = reach / RAYS as f64;
        let change = |n: usize, side: f64| {
            // At the middle of steps: the outermost ray itself is beyond the waves.
            let port = side * (n as f64 + 0.5) * step;
            let place = wake.track.on_sea([-distance, port]);
            let rough = self.waves.at(place);
            rough.map_or(0.0, |rough| self.sea.change(rough.slopes))
        };
        let side = |side: f64| (0..RAYS).map(|n| change(n, side)).collect();
        Profile {
            step,
            sides: [side(1.0), side(-1.0)],
        }
    }
}

/// The change across the track at one distance.
#[derive(Debug)]
pub(super) struct Profile {
    step: f64,
    /// Changes in steps to port, and to starboard.
    sides: [Vec<f64>; 2],
}

impl Profile {
    /// Distance off the track beyond which nothing changes \[m\].
    pub(super) fn reach(&self) -> f64 {
        self.step * RAYS as f64
    }

    /// Distance between places at which the change is computed \[m\].
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// The change `port` off the track \[m\].
    pub(super) fn at(&self, port: f64) -> f64 {
        let side = &self.sides[usize::from(port < 0.0)];
        let n = (port.abs() / self.step) as usize;
        side.get(n).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// Between its directions and variances, for three sensors, the table gives σ⁰ within 5 % (0.2 dB), also where it is several
    /// times the sea's.
    #[test]
    fn the_table_is_the_change_between_its_nodes() {
        for (sensor, incidence) in [
            ("alos-2-sm10", 35),
            ("sentinel-1-iw", 35),
            ("novasar-1", 28),
        ] {
            let set = [
                format!("radar.sensor=\"{sensor}\""),
                format!("radar.incidence={incidence}"),
            ];
            let set = set.each_ref().map(String::as_str);
            let scene = Scene::default().with_assignments(&set).unwrap();
            let models = Models::new(&scene);
            let effects = Effects::new(&scene, &models);
            let sea = ShortWaves::new(&models, &effects, |_| true).unwrap();
            for degrees in [4.0f64, 22.0, 52.0, 97.0, 128.0, 171.0] {
                for variance in [0.001, 0.003, 0.0085, 0.015, 0.0225, 0.03] {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    let slopes = [cos * cos, cos * sin, sin * sin].map(|p| variance * p);
                    let (found, expected) = (sea.change(slopes) + 1.0, sea.ratio(slopes));
                    assert!(
                        (found / expected - 1.0).abs() < 0.05,
                        "{sensor} {degrees} {variance}: {found} {expected}"
                    );
                }
            }
        }
    }
}
