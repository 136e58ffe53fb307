//! A few thousand waves that represent the resolved sea and wake.

use crate::dispersion::angular_frequency;
use crate::swell::Swell;
use crate::waves::PlaneWaves;
use crate::wind_sea::DirectionalSpectrum;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// One wave, or a bin of waves, with its contribution to the variance of the elevation in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WaveSample {
    /// Wavenumber (kx, ky) [rad/m].
    pub(crate) k: [f64; 2],
    /// Angular frequency [rad/s].
    pub(crate) omega: f64,
    /// Mean square elevation \[m²\].
    pub(crate) variance: f64,
}

impl AsRef<Self> for WaveSample {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// Steps of the sea's polar grid in ln k and in direction.
const STEPS: [usize; 2] = [64, 36];

/// Longest waves sampled, as a fraction of the peak wavenumber: exp(−(5/4)·5²) of the spectrum lies below.
const LONGEST: f64 = 0.2;

/// The resolved sea, |k| ≤ `band` [rad/m], as bins of a polar grid with variance Ψ k dk dφ each.
pub(crate) fn sea(spectrum: &DirectionalSpectrum, band: f64) -> Vec<WaveSample> {
    let low = LONGEST * spectrum.peak_wavenumber();
    if spectrum.is_flat() || low >= band {
        return Vec::new();
    }
    let step = (band / low).ln() / STEPS[0] as f64;
    let turn = TAU / STEPS[1] as f64;
    let directions: Vec<[f64; 2]> = (0..STEPS[1])
        .map(|m| ((m as f64 + 0.5) * turn).sin_cos().into())
        .collect();
    let wind = spectrum.wind();
    let mut waves = Vec::with_capacity(STEPS[0] * STEPS[1]);
    for n in 0..STEPS[0] {
        let k = low * ((n as f64 + 0.5) * step).exp();
        let omega = angular_frequency(k, spectrum.depth());
        let ring = spectrum.ring(k);
        let wave = |[x, y]: [f64; 2]| {
            let psi = ring.map_or(0.0, |ring| ring.psi(x * wind[0] + y * wind[1]));
            WaveSample {
                k: [k * x, k * y],
                omega,
                variance: psi * k * k * step * turn,
            }
        };
        waves.extend(directions.iter().map(|&direction| wave(direction)));
    }
    waves
}

/// The swell, as one wave in the middle of each of its cells.
pub(crate) fn swell(swell: Option<&Swell>, depth: f64, band: f64) -> Vec<WaveSample> {
    let cells = swell.map_or_else(Vec::new, |swell| swell.cells(band, || 0.5));
    let sample = |(k, variance): ([f64; 2], f64)| WaveSample {
        k,
        omega: angular_frequency(k[0].hypot(k[1]), depth),
        variance,
    };
    cells.into_iter().map(sample).collect()
}

/// The wake, each node with its contribution to the mean square over an image.
///
/// Across the track, at any distance astern, ∫ζ² dy' = π∫|A|²/(dky'/dθ) dθ (Parseval; y' across the track, A the
/// amplitude per θ). Nodes aₙ = A dθ in order along the curve have spacing Δky': the mean square over an area is
/// (length of track/area)·π Σ|aₙ|²/Δky'ₙ. Energy of the wedge outside the image is counted too: an upper bound.
///
/// - `heading`: unit vector (x, y) of the ship's course
/// - `track_length` \[m\] of the wake that can lie in the image, `area` \[m²\] of the image
pub(crate) fn wake(
    nodes: &PlaneWaves,
    heading: [f64; 2],
    track_length: f64,
    area: f64,
) -> Vec<WaveSample> {
    let across = |n: usize| nodes.ky[n] * heading[0] - nodes.kx[n] * heading[1];
    let count = nodes.len();
    (0..count)
        .filter(|_| count > 1)
        .map(|n| {
            let (before, after) = (n.saturating_sub(1), (n + 1).min(count - 1));
            let spacing = (across(after) - across(before)).abs() / (after - before) as f64;
            let square = nodes.amplitude[n].norm_sqr();
            // Wavenumbers that underflow, as they do far astern in shallow water, coincide at 0 and carry no energy.
            let variance = if square > 0.0 && spacing > 0.0 {
                PI * square / spacing * track_length / area
            } else {
                0.0
            };
            WaveSample {
                k: [nodes.kx[n], nodes.ky[n]],
                omega: nodes.omega[n],
                variance,
            }
        })
        .collect()
}

/// Root mean square of a linear quantity over independent waves.
pub(crate) fn rms<W: AsRef<WaveSample>>(waves: &[W], factor: impl Fn(&W) -> Complex64) -> f64 {
    waves
        .iter()
        .map(|w| w.as_ref().variance * factor(w).norm_sqr())
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Raster;
    use crate::scene::{SpectrumModel, SpreadingModel};
    use crate::waves::{Quantity, Transfer, harmonic_sum};
    use crate::wind_sea::WindSea;
    use num_complex::Complex64;

    /// The variances of the bins sum to those of the band.
    #[test]
    fn the_sea_sample_has_the_variances_of_the_band() {
        for (wind_speed, band) in [(3.0, 1.2), (5.0, 1.2), (12.0, 0.6)] {
            let spectrum = DirectionalSpectrum::new(&WindSea {
                wind_speed,
                wind_toward: 0.7,
                fetch: 4e4,
                depth: f64::INFINITY,
                spectrum: SpectrumModel::Elfouhaily,
                spreading: SpreadingModel::Hasselmann,
            });
            let exact = spectrum.moments(0.0, band, 0.5);
            let waves = sea(&spectrum, band);
            let elevation: f64 = waves.iter().map(|w| w.variance).sum();
            let slope: f64 = waves.iter().map(|w| w.variance * w.k[0] * w.k[0]).sum();
            // Midpoint rule with steps of 0.05 in ln k across a peak 0.2 wide: error below one percent.
            assert!(
                (elevation / exact.elevation - 1.0).abs() < 0.01,
                "{wind_speed}"
            );
            assert!((slope / exact.slope_xx - 1.0).abs() < 0.01, "{wind_speed}");
        }
    }

    /// Waves of a smooth curve, summed across the track, against Parseval's theorem.
    #[test]
    fn the_wake_sample_has_the_mean_square_across_the_track() {
        let mut nodes = PlaneWaves::default();
        let step = 2e-3;
        for n in 0..1000 {
            let ky = step * (f64::from(n) - 500.0);
            let amplitude = step * (-(ky / 0.2).powi(2)).exp();
            nodes.push([0.3, ky], 1.0, Complex64::new(amplitude, 0.0));
        }
        let waves = wake(&nodes, [1.0, 0.0], 1.0, 1.0);
        let sum: f64 = waves.iter().map(|w| w.variance).sum();
        // ∫ζ²dy by pixels, averaged over the phase along the track (two positions a quarter wave apart).
        let transfer = Transfer {
            depth: f64::INFINITY,
            incidence: 0.5,
            relaxation_rate: 1.0,
            action_slope: 4.5,
        };
        let raster = Raster::image(401, 1, 0.5);
        let pixels: Vec<[usize; 2]> = (0..401).map(|i| [i, 0]).collect();
        let mut integral = 0.0;
        for shift in [0.0, PI / 2.0] {
            let mut shifted = nodes.clone();
            for a in &mut shifted.amplitude {
                *a *= Complex64::cis(shift);
            }
            let zeta = harmonic_sum(
                &shifted,
                &transfer,
                &[Quantity::Elevation],
                &raster,
                &pixels,
            );
            integral += 0.5 * 0.5 * zeta[0].iter().map(|z| z * z).sum::<f64>();
        }
        assert!((sum / integral - 1.0).abs() < 1e-3, "{sum} {integral}");
    }
}
