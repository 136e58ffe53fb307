//! First-order theory of a scene: statistics of its image before it is computed.
//!
//! A few thousand waves represent sea and wakes ([`waves`], [`wake`]), transfer functions give each wave's modulation of
//! the image ([`modulation`](crate::scattering::modulation)), and [`amplitudes`] sums them. The plan weighs terms by these
//! figures, and labels use them to find what is visible; they never enter the image.

pub(crate) mod amplitudes;
mod doppler;
mod open_sea;
mod wake;
mod waves;

pub(crate) use amplitudes::Amplitudes;
pub(crate) use open_sea::{OpenSea, curvature_of, over_mean};
pub(crate) use waves::WaveSample;

use crate::models::Models;
use crate::sar::AzimuthResolution;
use crate::scattering::SlopeCovariance;
use crate::scattering::modulation::ModulationTransfer;
use crate::waves::{LARGEST_MODULATING_WAVENUMBER, Quantity};
use open_sea::slopes;
use std::f64::consts::{PI, SQRT_2};
use waves::rms;

/// Margin in standard deviations of the displacement; 7 in a million lie beyond.
const DEVIATIONS: f64 = 4.5;

/// Ratio of the wake's mean square inside its wedge to that over the image: the wedge covers about a quarter of it.
const WEDGE: f64 = 4.0;

/// First-order theory of a scene: its open sea and the waves of its ships.
#[derive(Debug)]
pub(crate) struct FirstOrder<'a> {
    /// The sea without ships.
    pub(crate) open: &'a OpenSea,
    /// Resolved waves of the wakes.
    pub(crate) wake: Vec<WaveSample>,
    /// Modulation of the image by waves.
    pub(crate) modulation: ModulationTransfer,
    /// Azimuth resolution of the moving sea.
    pub(crate) resolution: AzimuthResolution,
    /// Mean σ⁰ over the image: Bragg and specular.
    pub(crate) mean: [f64; 2],
    /// Slopes of the resolved waves inside the wake.
    pub(crate) resolved: SlopeCovariance,
    /// Variance of the hydrodynamic modulation by waves of the sea that pixels resolve and that modulate \[1\].
    pub(crate) modulation_variance: f64,
    /// Size of a computed pixel \[m\].
    pub(crate) spacing: f64,
}

impl<'a> FirstOrder<'a> {
    pub(crate) fn new(models: &Models, open: &'a OpenSea) -> Self {
        let (mut wake, mut wake_slopes) = (Vec::new(), [SlopeCovariance::NONE; 2]);
        for one in &models.wakes {
            let (waves, crowding) = wake::sampled(one, &models.pixels.computed);
            let over_image = slopes(&waves);
            wake_slopes[0] = wake_slopes[0].plus(&over_image);
            wake_slopes[1] = wake_slopes[1].plus(&over_image.times(crowding));
            wake.extend(waves);
        }
        // Terms matter most inside the wake; the mean is taken over the whole image.
        let [mean_slopes, resolved] = wake_slopes.map(|wake| open.slopes.plus(&wake));
        let mean = match wake.is_empty() {
            true => open.mean(),
            false => open.backscatter.mean_over(&mean_slopes),
        };
        Self {
            modulation: open.modulation_of_mean(mean),
            resolution: models.resolution(),
            mean,
            resolved,
            modulation_variance: modulation_variance(models),
            spacing: models.pixels.computed.spacing,
            wake,
            open,
        }
    }

    /// Mean σ⁰ \[1\].
    pub(crate) fn mean_sigma0(&self) -> f64 {
        self.mean[0] + self.mean[1]
    }

    /// Ratio to the mean σ⁰ of a cross-section that is added to the image; 1 where nothing scatters.
    pub(crate) fn over_mean(&self, sigma0: f64) -> f64 {
        over_mean(sigma0, self.mean)
    }

    /// Whether no wave is resolved.
    pub(crate) fn is_flat(&self) -> bool {
        self.open.waves.is_empty() && self.wake.is_empty()
    }

    /// Margin in rows and columns. It depends on the scene alone, not on the terms used, so that a seed always draws the
    /// same sea.
    pub(crate) fn margin(&self, models: &Models) -> [usize; 2] {
        if self.is_flat() {
            return [0, 0];
        }
        let transfer = &self.modulation.transfer;
        let velocity = self.deviation(|w| transfer.radial(w.k, w.omega));
        let elevation = self.deviation(|w| transfer.factor(Quantity::Elevation, w.k, w.omega));
        let width = self.resolution.at(self.acceleration()) / (SQRT_2 * PI);
        let azimuth = (models.range_to_velocity * velocity).hypot(width);
        let range = elevation / models.incidence.tan();
        [azimuth, range]
            .map(|d| (DEVIATIONS * d / models.pixels.computed.spacing).ceil() as usize + 1)
    }

    /// Standard deviation of the acceleration toward the radar inside the wake [m/s²].
    pub(crate) fn acceleration(&self) -> f64 {
        let transfer = &self.modulation.transfer;
        self.deviation(|w| transfer.factor(Quantity::RadialAcceleration, w.k, w.omega))
    }

    /// Standard deviation of a linear field inside the wake.
    fn deviation(&self, factor: impl Fn(&WaveSample) -> num_complex::Complex64) -> f64 {
        rms(&self.open.waves, &factor).hypot(WEDGE.sqrt() * rms(&self.wake, &factor))
    }
}

/// Variance of the hydrodynamic modulation by waves of the sea that pixels resolve and that modulate \[1\].
fn modulation_variance(models: &Models) -> f64 {
    let band = models
        .pixels
        .computed
        .nyquist_wavenumber()
        .min(LARGEST_MODULATING_WAVENUMBER);
    let factor = |w: &WaveSample| {
        let transfer = &models.transfer;
        transfer.factor(Quantity::Hydrodynamic, w.k, w.omega)
    };
    rms(&waves::sea(&models.sea, band), factor).powi(2)
}
