//! Mean amplitude of every wave of a lattice, from a table over |k| and an elementary function of direction.

use super::wave_lattice::WaveLattice;
use crate::numeric::vector::{exp_f32, ln_f32};
use crate::spectrum::deep_equivalent;
use crate::spreading::{Cos2s, Spreading};
use crate::wind_sea::{DirectionalSpectrum, GAUSS_8};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Low bits of k² between nodes: 2⁷ nodes per octave. Linear interpolation of a power k⁻ⁿ errs by at most n²/2¹⁷.
const SHIFT: u32 = 16;

/// Peak wavenumber in lattice steps from which the lattice samples the peak well; below it, densities are cell averages.
const SAMPLED_PEAK: f64 = 8.0;

/// Radius in lattice steps within which densities are then averaged over cells.
const AVERAGED_RADIUS: f64 = 16.0;

/// Amplitudes √(2Ψ dkx dky) of the waves of a lattice \[m\]: twice the square is their mean variance.
pub(super) struct Amplitudes<'a> {
    spectrum: &'a DirectionalSpectrum,
    cell: [f64; 2],
    /// Radius within which densities are averaged over cells [rad/m].
    averaged: f64,
    wind: [f32; 2],
    /// Bits of k² at node 0, shifted.
    first: u32,
    /// Nodes: amplitude without its directional factor \[m\], and shape: s/2 or Δ \[1\].
    nodes: Vec<[f32; 2]>,
}

impl<'a> Amplitudes<'a> {
    pub(super) fn new(spectrum: &'a DirectionalSpectrum, lattice: &WaveLattice) -> Self {
        let cell = lattice.steps();
        let key = |squared: f64| (squared as f32).to_bits() >> SHIFT;
        let first = key(0.9 * cell[0].min(cell[1]).powi(2));
        let last = key(1.1 * lattice.cutoff().powi(2));
        let coarse = cell[0].max(cell[1]);
        let sampled = spectrum.peak_wavenumber() >= SAMPLED_PEAK * coarse;
        let nodes = (first..last + 2)
            .into_par_iter()
            .with_min_len(64)
            .map(|bits| {
                node(
                    spectrum,
                    cell,
                    f64::from(f32::from_bits(bits << SHIFT)).sqrt(),
                )
            })
            .collect();
        Self {
            spectrum,
            cell,
            averaged: if sampled {
                0.0
            } else {
                AVERAGED_RADIUS * coarse
            },
            wind: spectrum.wind().map(|v| v as f32),
            first,
            nodes,
        }
    }

    /// Amplitudes of the waves k and −k for a part of a line.
    #[inline(always)]
    pub(super) fn fill(&self, kx: f64, ky: &[f32], along: &mut [f32], against: &mut [f32]) {
        let x = kx as f32;
        for ((&y, along), against) in ky.iter().zip(&mut *along).zip(&mut *against) {
            [*along, *against] = self.interpolate(x * x + y * y);
        }
        let [wind_x, wind_y] = self.wind;
        let directions = ky
            .iter()
            .map(|&y| (x * wind_x + y * wind_y) / (x * x + y * y).sqrt());
        let waves = directions.zip(along.iter_mut().zip(against.iter_mut()));
        match self.spectrum.spreading() {
            Spreading::Cos2s(_) => waves.for_each(|(cos, (along, against))| {
                let (level, half_s) = (*along, *against);
                *along = level * exp_f32(half_s * ln_f32((0.5 + 0.5 * cos).max(1e-30)));
                *against = level * exp_f32(half_s * ln_f32((0.5 - 0.5 * cos).max(1e-30)));
            }),
            Spreading::Even(_) => waves.for_each(|(cos, (along, against))| {
                *along *= (1.0 + *against * (2.0 * cos * cos - 1.0)).max(0.0).sqrt();
                *against = *along;
            }),
        }
        if kx < self.averaged {
            self.average(kx, ky, along, against);
        }
    }

    /// Level and shape at k².
    #[inline(always)]
    fn interpolate(&self, squared: f32) -> [f32; 2] {
        let bits = squared.to_bits();
        let n = ((bits >> SHIFT).saturating_sub(self.first) as usize).min(self.nodes.len() - 2);
        let t = (bits & ((1 << SHIFT) - 1)) as f32 / (1 << SHIFT) as f32;
        let ([level, shape], [next_level, next_shape]) = (self.nodes[n], self.nodes[n + 1]);
        [
            level + t * (next_level - level),
            shape + t * (next_shape - shape),
        ]
    }

    /// Replaces the amplitudes of long waves by those of cell-averaged densities.
    fn average(&self, kx: f64, ky: &[f32], along: &mut [f32], against: &mut [f32]) {
        for ((&ky, along), against) in ky.iter().zip(along).zip(against) {
            let ky = f64::from(ky);
            if kx.hypot(ky) < self.averaged {
                *along = self.of_cell([kx, ky]);
                *against = self.of_cell([-kx, -ky]);
            }
        }
    }

    /// √(2 ∬Ψ) over the cell around k, by 8 × 8 Gauss–Legendre nodes.
    fn of_cell(&self, k: [f64; 2]) -> f32 {
        let nodes = || GAUSS_8.into_iter().flat_map(|(x, w)| [(x, w), (-x, w)]);
        let [dx, dy] = self.cell;
        let mut mean = 0.0;
        for (x, weight_x) in nodes() {
            for (y, weight_y) in nodes() {
                let k = [k[0] + 0.5 * x * dx, k[1] + 0.5 * y * dy];
                mean += 0.25 * weight_x * weight_y * self.spectrum.psi(k);
            }
        }
        (2.0 * mean * dx * dy).sqrt() as f32
    }
}

/// Level √(2 S dkx dky D₀/k), with D₀ independent of direction, and shape of the spreading at k.
fn node(spectrum: &DirectionalSpectrum, cell: [f64; 2], k: f64) -> [f32; 2] {
    let deep = deep_equivalent(k, spectrum.depth());
    let (shape, spread) = match spectrum.spreading() {
        Spreading::Cos2s(model) => {
            let s = model.exponent(deep);
            (0.5 * s, Cos2s::normalization(s))
        }
        Spreading::Even(model) => (model.anisotropy(deep), 1.0 / TAU),
    };
    let level = 2.0 * spectrum.omnidirectional(k) / k * cell[0] * cell[1] * spread;
    [level.sqrt() as f32, shape as f32]
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "an unused radius is exactly 0")]
mod tests {
    use super::*;
    use crate::scene::{SpectrumModel, SpreadingModel};
    use crate::wind_sea::WindSea;

    /// Table and fast functions against Ψ itself, wave by wave.
    #[test]
    fn amplitudes_are_those_of_the_density() {
        let lattice = WaveLattice {
            rows: 180,
            columns: 160,
            spacing: 2.0,
        };
        for spreading in [SpreadingModel::Hasselmann, SpreadingModel::Elfouhaily] {
            for depth in [3.0, f64::INFINITY] {
                let spectrum = DirectionalSpectrum::new(&WindSea {
                    wind_speed: 5.0,
                    wind_toward: 0.4,
                    fetch: 4e4,
                    depth,
                    spectrum: SpectrumModel::Elfouhaily,
                    spreading,
                });
                let amplitudes = Amplitudes::new(&spectrum, &lattice);
                assert_eq!(amplitudes.averaged, 0.0);
                let cell = lattice.steps()[0] * lattice.steps()[1];
                let ky: Vec<f32> = (0..lattice.rows).map(|a| lattice.ky(a) as f32).collect();
                let (mut along, mut against) = (ky.clone(), ky.clone());
                let mut largest = 0.0f64;
                let mut worst = 0.0f64;
                for line in 1..lattice.lines() {
                    let kx = lattice.kx(line);
                    amplitudes.fill(kx, &ky, &mut along, &mut against);
                    for range in lattice.disk(line) {
                        for a in range {
                            let of = |sign: f64| {
                                let k = [sign * kx, sign * lattice.ky(a)];
                                (2.0 * spectrum.psi(k) * cell).sqrt()
                            };
                            for (got, expected) in [(along[a], of(1.0)), (against[a], of(-1.0))] {
                                largest = largest.max(expected);
                                worst = worst.max((f64::from(got) - expected).abs());
                            }
                        }
                    }
                }
                // Worst where Hasselmann's exponent s = 8.5 has its kink: the slope ds/d ln k² jumps by
                // 8.5·6.4/4 = 14, a quarter of which times 2⁻⁷ is lost on s; q^{s/2} with q = (1 + cos δ)/2 then
                // errs by at most half of that times max |ln q| q^{s/2} = 2/(e s): 1.2e-3.
                assert!(worst < 1.2e-3 * largest, "{worst} of {largest}");
            }
        }
    }
}
