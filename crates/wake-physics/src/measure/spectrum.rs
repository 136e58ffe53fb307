//! Power spectrum of the windowed part of an image.

use super::smooth::smooth;
use crate::fft::lattice_sum;
use crate::raster::{Field, Raster};
use num_complex::Complex32;
use std::f64::consts::TAU;

/// Power by wavenumber, per unit of the window's energy.
///
/// Row i and column j hold kx = j·2π/(columns·spacing), ky = i·2π/(rows·spacing), in the order of an FFT: 0, 1, …, then
/// negative. y grows upward, so ky > 0 with kx > 0 is a wave whose crests fall from left to right.
pub(super) struct PowerSpectrum {
    pub(super) power: Field,
    step: [f64; 2],
}

/// Relative width of the taper at the border of the image.
const TAPER: f64 = 1.0 / 16.0;

/// Signed number of periods at an index in the order of an FFT.
pub(super) fn signed(at: usize, count: usize) -> f64 {
    if 2 * at < count {
        at as f64
    } else {
        at as f64 - count as f64
    }
}

/// A window that falls to 0 at the border, times `inside` of the place (x, y) \[m\].
pub(super) fn window(raster: &Raster, inside: impl Fn([f64; 2]) -> f64 + Sync) -> Field {
    let taper = |at: usize, count: usize| {
        let edge = at.min(count - 1 - at) as f64 / (TAPER * count as f64);
        0.5 - 0.5 * (std::f64::consts::PI * edge.min(1.0)).cos()
    };
    Field::from_fn(raster, |i, j| {
        let border = taper(i, raster.rows) * taper(j, raster.columns);
        (border * inside([raster.x(j), raster.y(i)])) as f32
    })
}

impl PowerSpectrum {
    /// Spectrum of `field` within `window` after its weighted mean is subtracted; `None` where the window is empty.
    pub(super) fn of(field: &Field, window: &Field, spacing: f64) -> Option<Self> {
        let (rows, columns) = (field.rows, field.columns);
        let pairs = || field.values.iter().zip(&window.values);
        let sum: f64 = window.values.iter().map(|&w| f64::from(w)).sum();
        let energy: f64 = window.values.iter().map(|&w| f64::from(w).powi(2)).sum();
        if energy <= 0.0 {
            return None;
        }
        let mean = pairs()
            .map(|(&v, &w)| f64::from(v) * f64::from(w))
            .sum::<f64>()
            / sum;
        let mut lines = vec![Complex32::new(0.0, 0.0); rows * columns];
        for (n, (&v, &w)) in pairs().enumerate() {
            lines[(n % columns) * rows + n / columns].re = w * (v - mean as f32);
        }
        // The sum over pixels with exp(i(kx x + ky y)) is a synthesis with the roles of place and wave exchanged.
        let [re, im] = lattice_sum(&mut lines, [rows, columns], [rows, columns]);
        let scale = 1.0 / energy as f32;
        let power = re.iter().zip(&im).map(|(a, b)| scale * (a * a + b * b));
        Some(Self {
            power: Field {
                rows,
                columns,
                values: power.collect(),
            },
            step: [columns, rows].map(|count| TAU / (count as f64 * spacing)),
        })
    }

    /// Wavenumber (kx, ky) of a value [rad/m].
    pub(super) fn wavenumber(&self, n: usize) -> [f64; 2] {
        let [rows, columns] = [self.power.rows, self.power.columns];
        [
            self.step[0] * signed(n % columns, columns),
            self.step[1] * signed(n / columns, rows),
        ]
    }

    /// The larger of the two steps between wavenumbers [rad/m].
    pub(super) fn resolution(&self) -> f64 {
        self.step[0].max(self.step[1])
    }

    /// The spectrum smoothed over `std` steps.
    pub(super) fn smoothed(&self, std: f64) -> Field {
        // Centred first, so that neighbours in wavenumber are neighbours in the field.
        let (rows, columns) = (self.power.rows, self.power.columns);
        let rolled = |field: &Field, down: usize, right: usize| {
            let mut out = field.clone();
            out.values.rotate_right(down * columns);
            for row in out.values.chunks_mut(columns) {
                row.rotate_right(right);
            }
            out
        };
        let centred = rolled(&self.power, rows / 2, columns / 2);
        rolled(
            &smooth(&centred, std),
            rows - rows / 2,
            columns - columns / 2,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane_wave(raster: &Raster, k: [f64; 2]) -> Field {
        Field::from_fn(raster, |i, j| {
            (k[0] * raster.x(j) + k[1] * raster.y(i) + 0.4).cos() as f32
        })
    }

    /// The strongest value of a plane wave lies at its wavenumber or the opposite one, including the sign of ky.
    #[test]
    fn a_plane_wave_is_a_peak_at_its_wavenumber() {
        for (rows, columns) in [(64, 96), (45, 50)] {
            let raster = Raster::image(rows, columns, 2.0);
            let everywhere = window(&raster, |_| 1.0);
            for k in [[0.4, 0.3], [0.4, -0.3], [0.0, 0.5], [0.7, 0.0]] {
                let spectrum =
                    PowerSpectrum::of(&plane_wave(&raster, k), &everywhere, 2.0).unwrap();
                let values = &spectrum.power.values;
                let peak = (0..values.len())
                    .max_by(|&a, &b| values[a].total_cmp(&values[b]))
                    .unwrap();
                let found = spectrum.wavenumber(peak);
                let near = |sign: f64| {
                    (0..2).all(|a| (found[a] - sign * k[a]).abs() <= 0.51 * spectrum.step[a])
                };
                assert!(near(1.0) || near(-1.0), "{k:?}: {found:?}");
            }
        }
    }

    /// Parseval: the mean of the power is the variance in the window.
    #[test]
    fn mean_power_is_the_variance() {
        let raster = Raster::image(40, 60, 3.0);
        let field = Field::from_fn(&raster, |i, j| ((i * 17 + j * 31) % 23) as f32);
        let everywhere = window(&raster, |_| 1.0);
        let spectrum = PowerSpectrum::of(&field, &everywhere, 3.0).unwrap();
        let weight = |n: usize| f64::from(everywhere.values[n]);
        let value = |n: usize| f64::from(field.values[n]);
        let total: f64 = (0..2400).map(weight).sum();
        let mean = (0..2400).map(|n| weight(n) * value(n)).sum::<f64>() / total;
        let energy: f64 = (0..2400).map(|n| weight(n).powi(2)).sum();
        let variance = (0..2400)
            .map(|n| (weight(n) * (value(n) - mean)).powi(2))
            .sum::<f64>()
            / energy;
        // f32 sums of 2,400 values.
        assert!((spectrum.power.mean() / variance - 1.0).abs() < 1e-4);
        let smooth = spectrum.smoothed(2.0);
        assert!((smooth.mean() / variance - 1.0).abs() < 0.2);
    }

    #[test]
    fn an_empty_window_shows_nothing() {
        let raster = Raster::image(8, 8, 1.0);
        let field = Field::constant(&raster, 1.0);
        assert!(PowerSpectrum::of(&field, &window(&raster, |_| 0.0), 1.0).is_none());
    }
}
