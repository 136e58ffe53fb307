//! The open sea of a scene without ships: its waves, its mean σ⁰ and their modulation.

use super::waves::{WaveSample, rms};
use super::{doppler, waves};
use crate::models::Models;
use crate::scattering::modulation::ModulationTransfer;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::Scene;
use crate::waves::Transfer;
use std::sync::OnceLock;

/// Step of the finite differences for the slope of ln σ⁰ \[1\].
pub(super) const SLOPE_STEP: f64 = 0.05;

/// First-order theory of a scene's sea without ships.
#[derive(Debug)]
pub(crate) struct OpenSea {
    /// Resolved waves, swell included.
    pub(crate) waves: Vec<WaveSample>,
    /// Resolved waves of the swell.
    pub(crate) swell: Vec<WaveSample>,
    /// Slopes of the resolved waves.
    pub(crate) slopes: SlopeCovariance,
    /// σ⁰ of facets with tilt average over subpixel slopes and specular return.
    pub(crate) backscatter: Backscatter,
    /// Mean σ⁰, Bragg and specular; computed on demand.
    mean: OnceLock<[f64; 2]>,
    transfer: Transfer,
    /// First derivatives of ln σ⁰ by the slopes.
    tilt: [f64; 2],
    range_to_velocity: f64,
    /// ½ ∂²ln σ⁰/∂slope² along x and y, absolute.
    pub(crate) curvature: [f64; 2],
}

impl OpenSea {
    pub(crate) fn new(models: &Models) -> Self {
        // Half a cell of the sea's lattice beyond the band: cells at its edge hold waves from beyond.
        let half_cell = 1.0
            / models
                .pixels
                .computed
                .rows
                .min(models.pixels.computed.columns) as f64;
        let band = models.pixels.computed.nyquist_wavenumber() * (1.0 + half_cell);
        let swell = waves::swell(models.swell.as_ref(), models.transfer.depth, band);
        let mut waves = waves::sea(&models.sea, band);
        waves.extend_from_slice(&swell);
        let slopes = slopes(&waves);
        let backscatter = models.backscatter(true, true);
        let (tilt, curvature) = slope_of_ln_sigma(&backscatter);
        Self {
            waves,
            swell,
            slopes,
            mean: OnceLock::new(),
            transfer: models.transfer,
            tilt,
            range_to_velocity: models.range_to_velocity,
            backscatter,
            curvature: curvature.map(f64::abs),
        }
    }

    /// Whether pixels resolve no wind wave.
    pub(crate) fn no_wind_waves(&self) -> bool {
        self.waves.len() == self.swell.len()
    }

    /// Mean σ⁰: Bragg and specular.
    pub(crate) fn mean(&self) -> [f64; 2] {
        let mean = || self.backscatter.mean_over(&self.slopes);
        *self.mean.get_or_init(mean)
    }

    /// Modulation of the intensity by waves.
    pub(crate) fn modulation(&self) -> ModulationTransfer {
        self.modulation_of_mean(self.mean())
    }

    /// Modulation of an intensity with the given mean σ⁰, Bragg and specular.
    pub(super) fn modulation_of_mean(&self, mean: [f64; 2]) -> ModulationTransfer {
        ModulationTransfer {
            transfer: self.transfer,
            tilt: self.tilt,
            bragg_share: bragg_share(mean),
            range_to_velocity: self.range_to_velocity,
        }
    }

    /// Standard deviation of the line-of-sight velocity of the resolved waves [m/s].
    pub(crate) fn velocity(&self) -> f64 {
        let transfer = &self.transfer;
        rms(&self.waves, |w: &WaveSample| transfer.radial(w.k, w.omega))
    }

    /// Mean velocity toward the radar by the Doppler shift [m/s].
    pub(crate) fn mean_velocity(&self, scene: &Scene, models: &Models) -> f64 {
        doppler::mean_velocity(scene, models, &self.modulation())
    }

    /// Share of the mean intensity that waves modulate \[1\].
    ///
    /// - `added`: components of σ⁰ that no wave modulates
    pub(crate) fn modulated_share(&self, added: &[f64]) -> f64 {
        let share = added.iter().map(|&sigma0| over_mean(sigma0, self.mean()));
        1.0 / share.fold(1.0, |sum, share| sum + share)
    }

    /// Models that also average over the resolved waves, for the mean over all seas.
    pub(crate) fn averaged(&self, models: &Models) -> Models {
        let mut models = models.clone();
        models.average_over(&self.slopes, self.velocity());
        models
    }

    /// Modulation for models that may average over more waves.
    pub(crate) fn modulation_of(&self, models: &Models) -> ModulationTransfer {
        ModulationTransfer {
            tilt: slope_of_ln_sigma(&models.backscatter(true, true)).0,
            ..self.modulation()
        }
    }
}

/// Second derivatives of ln σ⁰ by the slopes along x and y.
pub(crate) fn curvature_of(models: &Models) -> [f64; 2] {
    slope_of_ln_sigma(&models.backscatter(true, true))
        .1
        .map(|half| 2.0 * half)
}

/// Share of the Bragg return in a mean σ⁰, Bragg and specular \[1\].
fn bragg_share(mean: [f64; 2]) -> f64 {
    let total = mean[0] + mean[1];
    if total > 0.0 { mean[0] / total } else { 0.0 }
}

/// Ratio of an added cross-section to a mean σ⁰, Bragg and specular; 1 where only the added one scatters.
pub(crate) fn over_mean(value: f64, mean: [f64; 2]) -> f64 {
    let total = mean[0] + mean[1];
    match value {
        v if v > 0.0 && total > 0.0 => v / total,
        v if v > 0.0 => 1.0,
        _ => 0.0,
    }
}

/// Covariance of the slopes of waves.
pub(super) fn slopes(waves: &[WaveSample]) -> SlopeCovariance {
    waves.iter().fold(SlopeCovariance::NONE, |sum, w| {
        let [kx, ky] = w.k;
        sum.plus(&SlopeCovariance {
            xx: w.variance * kx * kx,
            xy: w.variance * kx * ky,
            yy: w.variance * ky * ky,
        })
    })
}

/// First derivatives and half the second ones of ln σ⁰ by the slopes, on the calm facet.
fn slope_of_ln_sigma(backscatter: &Backscatter) -> ([f64; 2], [f64; 2]) {
    let ln_sigma = |slope: [f64; 2]| {
        let [bragg, specular] = backscatter.coarse_parts(slope);
        (bragg + specular).ln()
    };
    let calm = ln_sigma([0.0, 0.0]);
    let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
    for axis in 0..2 {
        let mut step = [0.0; 2];
        step[axis] = SLOPE_STEP;
        let (up, down) = (ln_sigma(step), ln_sigma([-step[0], -step[1]]));
        if (up + down + calm).is_finite() {
            first[axis] = (up - down) / (2.0 * SLOPE_STEP);
            second[axis] = 0.5 * (up + down - 2.0 * calm) / SLOPE_STEP.powi(2);
        }
    }
    (first, second)
}
