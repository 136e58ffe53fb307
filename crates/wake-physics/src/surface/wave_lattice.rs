//! Lattice of wavenumbers of a periodic sea larger than its raster.

use crate::fft::{fast_length, signed_index};
use crate::raster::Raster;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Guard between opposite edges of the raster, around the period, in peak wavelengths.
const GUARD_WAVELENGTHS: f64 = 4.0;

/// Peak wavelengths per period.
const PERIOD_WAVELENGTHS: f64 = 8.0;

/// Largest period in pixels to which long waves may stretch the lattice.
const LONGEST_STRETCH: f64 = 1024.0;

/// Smallest period in pixels.
const LEAST_PERIOD: usize = 32;

/// Smallest guard between opposite edges of the raster, around the period, in pixels.
const LEAST_GUARD: usize = 8;

/// The wavenumbers of a periodic sea:
///
/// ```text
/// kx = b·2π/(columns·spacing),  ky = a·2π/(rows·spacing),   |k| ≤ π/spacing,  k ≠ 0,  no Nyquist line
/// ```
///
/// Only the lines b ≥ 0 are stored, each with the indices a in FFT order; −k is stored beside k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WaveLattice {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) spacing: f64,
}

impl WaveLattice {
    /// The lattice for a raster and a peak wavelength \[m\].
    ///
    /// Each period holds the raster and a guard of 4 peak wavelengths (at most a quarter of the raster), so that opposite
    /// edges are uncorrelated, and at least 8 peak wavelengths (up to 1024 pixels).
    pub(super) fn new(raster: &Raster, peak_wavelength: f64) -> Self {
        let peak = peak_wavelength / raster.spacing;
        let period = |pixels: usize| {
            let guard = (GUARD_WAVELENGTHS * peak).min(0.25 * pixels as f64).ceil() as usize;
            let stretch = (PERIOD_WAVELENGTHS * peak).min(LONGEST_STRETCH).ceil() as usize;
            fast_length(
                (pixels + guard.max(LEAST_GUARD))
                    .max(stretch)
                    .max(LEAST_PERIOD),
            )
        };
        Self {
            rows: period(raster.rows),
            columns: period(raster.columns),
            spacing: raster.spacing,
        }
    }

    /// Spacing of lines and of indices, [dkx, dky] [rad/m].
    pub(super) fn steps(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|n| TAU / (n as f64 * self.spacing))
    }

    /// Number of lines stored.
    pub(super) fn lines(&self) -> usize {
        self.columns.div_ceil(2)
    }

    /// Largest |k| of the sea [rad/m].
    pub(super) fn cutoff(&self) -> f64 {
        PI / self.spacing
    }

    /// kx of a line [rad/m].
    pub(super) fn kx(&self, line: usize) -> f64 {
        line as f64 * self.steps()[0]
    }

    /// ky of an index [rad/m].
    pub(super) fn ky(&self, index: usize) -> f64 {
        signed_index(index, self.rows) as f64 * self.steps()[1]
    }

    /// The indices of a line within |k| ≤ π/spacing: those from 0 upward, and the negative ones.
    pub(super) fn disk(&self, line: usize) -> [Range<usize>; 2] {
        // In units of the cutoff, b·2/columns; rounding must not decide on points of the circle.
        let x = 2.0 * line as f64 / self.columns as f64;
        let reach = (1.0 - x * x).max(0.0).sqrt() * 0.5 * self.rows as f64;
        let last = ((reach + 1e-9) as usize).min((self.rows - 1) / 2);
        [0..last + 1, self.rows - last..self.rows]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disk_holds_the_resolved_waves() {
        for (rows, columns) in [(32, 32), (45, 36), (40, 75)] {
            let lattice = WaveLattice {
                rows,
                columns,
                spacing: 2.0,
            };
            for line in 0..lattice.lines() {
                let [up, down] = lattice.disk(line);
                for index in 0..rows {
                    let k = lattice.kx(line).hypot(lattice.ky(index));
                    let nyquist = 2 * index == rows;
                    let inside = k <= lattice.cutoff() * (1.0 + 1e-12) && !nyquist;
                    assert_eq!(up.contains(&index) || down.contains(&index), inside);
                }
            }
        }
    }

    #[test]
    fn period_holds_raster_guard_and_long_waves() {
        let size = |rows, columns, spacing, peak| {
            let lattice = WaveLattice::new(&Raster::image(rows, columns, spacing), peak);
            [lattice.rows, lattice.columns]
        };
        assert_eq!(size(616, 520, 2.5, 13.4), [640, 576]);
        assert_eq!(size(1, 1, 2.5, 13.4), [45, 45]);
        assert_eq!(size(1, 64, 2.5, 1e9), [1024, 1024]);
        assert_eq!(size(1, 1, 100.0, 8.0), [32, 32]);
        // Strong wind on a large raster costs at most 25 % in each direction.
        let [rows, columns] = size(4096, 16384, 2.5, 800.0);
        assert!(rows > 4096 && rows <= 5400 && columns > 16384 && columns <= 20736);
    }
}
