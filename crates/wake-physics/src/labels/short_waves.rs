//! How much brighter the sea is where a ship's waves roughen it that the pixels do not carry.

use crate::kelvin::{KelvinWake, UnresolvedWaves};
use crate::models::Models;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::Term;

/// Rays from the track to the outermost one at which the change is known: chosen, it is smooth but where waves break.
const RAYS: usize = 24;

/// Slope variance below which nothing is to be seen: σ⁰ changes by at most some hundreds of it.
const LEAST_VARIANCE: f64 = 1e-5;

/// What a variance of slopes makes of the mean σ⁰ of a sea.
#[derive(Debug)]
pub(super) struct ShortWaves {
    /// Averaged over all slopes of the sea.
    backscatter: Backscatter,
    /// The mean σ⁰, Bragg and specular \[1\], above 0.
    mean: f64,
    /// Wavenumbers of the waves that count [rad/m].
    band: [f64; 2],
}

impl ShortWaves {
    /// Those of a sea whose models average over all its slopes; `None` if no such waves are drawn.
    pub(super) fn new(models: &Models, drawn: impl Fn(Term) -> bool) -> Option<Self> {
        if !models.counts_unresolved {
            return None;
        }
        let backscatter = models.backscatter(drawn(Term::TiltAverage), drawn(Term::Specular));
        let mean = backscatter.mean_over(&SlopeCovariance::NONE);
        let mean = mean[0] + mean[1];
        (mean > 0.0).then(|| Self {
            backscatter,
            mean,
            band: models.unresolved_band(),
        })
    }

    /// The waves of a ship that are steep enough to count.
    pub(super) fn of(&self, wake: &KelvinWake) -> Option<WavesOfShip<'_>> {
        let waves = wake.unresolved(self.band)?;
        let strongest = waves.steepest(0.5 * wake.hull.length());
        (strongest >= LEAST_VARIANCE).then_some(WavesOfShip { sea: self, waves })
    }

    /// Relative change of σ⁰ by a variance of slopes \[1\].
    fn change(&self, slopes: [f64; 3]) -> f64 {
        let [xx, xy, yy] = slopes;
        let [bragg, specular] = self.backscatter.mean_over(&SlopeCovariance { xx, xy, yy });
        (bragg + specular) / self.mean - 1.0
    }
}

/// The waves of one ship on a sea.
#[derive(Debug)]
pub(super) struct WavesOfShip<'s> {
    sea: &'s ShortWaves,
    waves: UnresolvedWaves,
}

impl WavesOfShip<'_> {
    /// The change across the track at a distance astern of midship \[m\].
    pub(super) fn profile(&self, wake: &KelvinWake, distance: f64) -> Profile {
        let reach = self.waves.widest() * distance;
        let step = reach / RAYS as f64;
        let change = |n: usize, side: f64| {
            // In the middle of steps: the outermost ray itself is beyond the waves.
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
    /// In steps to port, and to starboard.
    sides: [Vec<f64>; 2],
}

impl Profile {
    /// Distance off the track beyond which nothing changes \[m\].
    pub(super) fn reach(&self) -> f64 {
        self.step * RAYS as f64
    }

    /// Distance between two places at which the change is known \[m\].
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
