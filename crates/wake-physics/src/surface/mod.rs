//! A random sea: its waves, and fields of them on a raster by FFT.

mod amplitude;
mod draw;
mod factor;
mod wave_lattice;
pub(crate) mod lane;

use crate::dispersion::angular_frequency;
use crate::fft::{Synthesis, signed_index};
use crate::numeric::vectorized;
use crate::raster::{Field, Raster};
use crate::waves::{PlaneWaves, Quantity, Transfer};
use crate::wind_sea::DirectionalSpectrum;
use crate::workspace::Workspace;
use amplitude::Amplitudes;
use draw::{Draw, Scatter};
use factor::Factors;
use lane::Lane;
use num_complex::{Complex, Complex32, Complex64};
use std::f64::consts::TAU;
use std::ops::Range;
use wave_lattice::WaveLattice;

/// Smallest tolerance at which single precision suffices: its error stays below a quarter of it.
const SINGLE_PRECISION_TOLERANCE: f64 = 2e-5;

/// Variances Ψ dkx dky \[m²\] of the waves along +k on a square lattice, |k| ≤ π/spacing, in the order of [`crate::fft`].
///
/// # Shapes
///
/// `[columns, rows]`, both `period`
pub(crate) fn wave_variances(
    spectrum: &DirectionalSpectrum,
    period: usize,
    spacing: f64,
) -> Vec<f32> {
    let lattice = WaveLattice {
        rows: period,
        columns: period,
        spacing,
    };
    let mut variances = vec![0.0; period * period];
    if spectrum.is_flat() {
        return variances;
    }
    let amplitudes = Amplitudes::new(spectrum, &lattice);
    let ky: Vec<f32> = (0..period).map(|a| lattice.ky(a) as f32).collect();
    let (mut along, mut against) = (ky.clone(), ky.clone());
    let variance = |amplitude: f32| 0.5 * amplitude * amplitude;
    for line in 0..lattice.lines() {
        for range in lattice.disk(line) {
            let (along, against) = (&mut along[range.clone()], &mut against[range.clone()]);
            amplitudes.fill(lattice.kx(line), &ky[range.clone()], along, against);
            for (row, (&mut along, &mut against)) in range.zip(along.iter_mut().zip(against)) {
                variances[line * period + row] = variance(along);
                if line > 0 {
                    variances[(period - line) * period + (period - row) % period] =
                        variance(against);
                }
            }
        }
    }
    variances[0] = 0.0;
    variances
}

/// Rows and columns of the lattice on which the sea of a raster is drawn.
pub(crate) fn lattice_size(spectrum: &DirectionalSpectrum, raster: &Raster) -> [usize; 2] {
    let lattice = WaveLattice::new(raster, TAU / spectrum.peak_wavenumber());
    [lattice.rows, lattice.columns]
}

/// One realisation of a wind sea at one instant, around one raster.
///
/// ```text
/// ζ(x, y) = Σ Re[c(k) exp(i(kx·x + ky·y))],   c(k) = √(2Ψ(k) dkx dky) · g · e^{−iωt},   ⟨|g|²⟩ = 1
/// ```
///
/// over the waves k of a periodic lattice with |k| ≤ π/spacing, larger than the raster by a guard so that nothing wraps
/// around. The g are complex Gaussian. Where the lattice is too coarse for the spectral peak, Ψ is averaged over cells to
/// keep the variance right; variance that no wave of the lattice can represent is [`Self::left_out`].
///
/// The seed determines every wave, for any number of threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    raster: Raster,
    lattice: WaveLattice,
    depth: f64,
    /// ½(c(k) + c*(−k)) of the lines b ≥ 0, with phases at pixel `[0, 0]`.
    even: Vec<Complex32>,
    /// ½(c(k) − c*(−k)).
    odd: Vec<Complex32>,
    carried: f64,
    left_out: f64,
}

impl Surface {
    /// Draws a sea.
    ///
    /// - `spectrum`: density of the waves
    /// - `seed` of the random numbers
    /// - `time` t \[s\], from 0 to 10⁵: each wave has advanced along its k by the phase ωt
    /// - `raster` of the fields, margins included
    #[must_use]
    pub fn new(spectrum: &DirectionalSpectrum, seed: u64, time: f64, raster: &Raster) -> Self {
        let mut workspace = Workspace::default();
        Self::new_in(&mut workspace, spectrum, seed, time, raster)
    }

    /// [`Self::new`] with buffers from a workspace; [`Self::give_back`] returns them.
    pub(crate) fn new_in(
        workspace: &mut Workspace,
        spectrum: &DirectionalSpectrum,
        seed: u64,
        time: f64,
        raster: &Raster,
    ) -> Self {
        Self::draw(spectrum, seed, time, raster, Scatter::Gaussian, workspace)
    }

    fn draw(
        spectrum: &DirectionalSpectrum,
        seed: u64,
        time: f64,
        raster: &Raster,
        scatter: Scatter,
        workspace: &mut Workspace,
    ) -> Self {
        let lattice = WaveLattice::new(raster, TAU / spectrum.peak_wavenumber());
        let band = spectrum.moments(0.0, lattice.cutoff(), 0.0).elevation;
        let ([even, odd], carried) = if band > 0.0 {
            let len = lattice.lines() * lattice.rows;
            let parts = [(); 2].map(|()| workspace.spectra.0.take(len));
            Draw::new(spectrum, lattice, raster, seed, time, scatter).run(parts)
        } else {
            ([Vec::new(), Vec::new()], 0.0)
        };
        Self {
            raster: *raster,
            lattice,
            depth: spectrum.depth(),
            even,
            odd,
            carried,
            left_out: if band > 0.0 {
                (1.0 - carried / band).max(0.0)
            } else {
                0.0
            },
        }
    }

    /// Returns the buffers of the amplitudes to the workspace.
    pub(crate) fn give_back(self, workspace: &mut Workspace) {
        workspace.spectra.0.give(self.even);
        workspace.spectra.0.give(self.odd);
    }

    /// Whether there are no resolved waves.
    fn is_flat(&self) -> bool {
        self.carried <= 0.0
    }

    /// Expected variance ⟨ζ²⟩ of the waves over all seeds \[m²\].
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.carried
    }

    /// Share of the resolved variance, |k| from 0 to π/spacing, that no wave of the lattice represents \[1\]: waves longer
    /// than the period. If the peak is resolved, 0 to about 10⁻³, the accuracy of sum and integral.
    #[must_use]
    pub fn left_out(&self) -> f64 {
        self.left_out
    }

    /// The individual waves, for a harmonic sum: exactly those summed by [`Self::fields`].
    #[must_use]
    pub fn modes(&self) -> PlaneWaves {
        let mut waves = PlaneWaves::default();
        for line in 0..self.lines() {
            for index in self.lattice.disk(line).into_iter().flatten() {
                for (sign, amplitude) in [1.0, -1.0].into_iter().zip(self.pair(line, index)) {
                    if amplitude != Complex64::ZERO {
                        self.push(&mut waves, [line, index], sign, amplitude);
                    }
                }
            }
        }
        waves
    }

    /// Number of lines drawn; 0 on a flat sea.
    fn lines(&self) -> usize {
        self.even.len() / self.lattice.rows
    }

    /// c(k) and c(−k); on line 0 the second is 0, because it is another wave of the line.
    fn pair(&self, line: usize, index: usize) -> [Complex64; 2] {
        let n = line * self.lattice.rows + index;
        let [even, odd] = [self.even[n], self.odd[n]].map(widen);
        let mirrored = if line == 0 {
            Complex64::ZERO
        } else {
            (even - odd).conj()
        };
        [even + odd, mirrored]
    }

    /// Adds the wave sign·k, with its phase moved from pixel `[0, 0]` to the origin.
    fn push(&self, waves: &mut PlaneWaves, [line, index]: [usize; 2], sign: f64, c: Complex64) {
        let (rows, columns) = (self.lattice.rows as i64, self.lattice.columns as i64);
        let k = [sign * self.lattice.kx(line), sign * self.lattice.ky(index)];
        // Whole turns are removed in integers, so that the phase is accurate for any origin.
        let by_column = (line as i64 * self.raster.origin_column.rem_euclid(columns)) % columns;
        let by_row =
            signed_index(index, self.lattice.rows) * self.raster.origin_row.rem_euclid(rows) % rows;
        let turns = by_column as f64 / columns as f64 - by_row as f64 / rows as f64;
        let omega = angular_frequency(k[0].hypot(k[1]), self.depth);
        waves.push(k, omega, c * Complex64::cis(sign * TAU * turns));
    }

    /// The same sea with only its `count` strongest waves.
    #[must_use]
    pub fn strongest(&self, count: usize) -> Self {
        let mut strengths: Vec<f64> = Vec::new();
        for n in 0..self.even.len() {
            let pair = self.pair(n / self.lattice.rows, n % self.lattice.rows);
            strengths.extend(pair.map(|c| c.norm_sqr()));
        }
        if count >= strengths.len() {
            return self.clone();
        }
        let (_, &mut threshold, _) = strengths.select_nth_unstable_by(count, |a, b| b.total_cmp(a));
        self.masked(|c| c.norm_sqr() > threshold)
    }

    /// The same sea with only the waves whose amplitude satisfies `keep`.
    fn masked(&self, keep: impl Fn(Complex64) -> bool) -> Self {
        let rows = self.lattice.rows;
        let mut masked = self.clone();
        for n in 0..self.even.len() {
            let (line, index) = (n / rows, n % rows);
            let of = |c: Complex64| if keep(c) { c } else { Complex64::ZERO };
            let [c, mut mirrored] = self.pair(line, index);
            if line == 0 {
                [mirrored, _] = self.pair(line, (rows - index) % rows);
            }
            let (c, mirrored) = (of(c), of(mirrored).conj());
            masked.even[n] = narrow(0.5 * (c + mirrored));
            masked.odd[n] = narrow(0.5 * (c - mirrored));
        }
        masked
    }

    /// Fields of the sea on its raster, in the order of `quantities`, two per FFT.
    ///
    /// - `transfer`: its depth must be that of the sea
    /// - `tolerance`: largest error relative to the root mean square of a field, at least 10⁻⁶; single precision is used
    ///   from 2·10⁻⁵ upward
    #[must_use]
    pub fn fields(
        &self,
        transfer: &Transfer,
        quantities: &[Quantity],
        tolerance: f64,
    ) -> Vec<Field> {
        let (workspace, rows) = (&mut Workspace::default(), 0..self.raster.rows);
        self.strip_in(workspace, &rows, transfer, quantities, tolerance)
    }

    /// Some rows of [`Self::fields`], with buffers from a workspace.
    pub(crate) fn strip_in(
        &self,
        workspace: &mut Workspace,
        rows: &Range<usize>,
        transfer: &Transfer,
        quantities: &[Quantity],
        tolerance: f64,
    ) -> Vec<Field> {
        let strip = self.raster.strip(rows);
        let field = |_: &Quantity| workspace.field(&strip);
        let mut fields: Vec<Field> = quantities.iter().map(field).collect();
        if self.is_flat() || strip.is_empty() {
            fields.iter_mut().for_each(|field| field.values.fill(0.0));
        } else if tolerance >= SINGLE_PRECISION_TOLERANCE {
            self.synthesize::<f32>(workspace, rows, transfer, quantities, &mut fields);
        } else {
            self.synthesize::<f64>(workspace, rows, transfer, quantities, &mut fields);
        }
        fields
    }

    /// Overwrites the fields.
    fn synthesize<T: Lane>(
        &self,
        workspace: &mut Workspace,
        rows: &Range<usize>,
        transfer: &Transfer,
        quantities: &[Quantity],
        fields: &mut [Field],
    ) {
        let columns = self.raster.columns;
        let mut unused = if quantities.len() % 2 == 1 {
            workspace.floats.take(rows.len() * columns)
        } else {
            Vec::new()
        };
        let (blocks, planner) = T::of(workspace);
        let plan = Synthesis::<T>::planned(planner, self.lattice.rows, self.lattice.columns);
        let factors = Factors::new(&self.lattice, transfer);
        let mut half = blocks.take(plan.half_len(rows.len()));
        for (pair, quantities) in fields.chunks_mut(2).zip(quantities.chunks(2)) {
            let out = match pair {
                [first, second] => [&mut first.values[..], &mut second.values[..]],
                [first] => [&mut first.values[..], &mut unused[..]],
                _ => continue,
            };
            plan.run_real(&mut half, rows.clone(), columns, out, |line, one, two| {
                vectorized(
                    #[inline(always)]
                    || self.half_spectra(&factors, line, quantities, [one, two]),
                );
            });
        }
        T::of(workspace).0.give(half);
        workspace.floats.give(unused);
    }

    /// Writes line `line` of the half spectra of one or two quantities.
    #[inline(always)]
    fn half_spectra<T: Lane>(
        &self,
        factors: &Factors<'_, T>,
        line: usize,
        quantities: &[Quantity],
        out: [&mut [Complex<T>]; 2],
    ) {
        let rows = self.lattice.rows;
        let parts = [&self.even, &self.odd].map(|part| &part[line * rows..(line + 1) * rows]);
        let waves = factors.waves(line);
        let [up, down] = self.lattice.disk(line);
        for (n, out) in out.into_iter().enumerate() {
            let Some(&quantity) = quantities.get(n) else {
                out.fill(Complex::new(T::zero(), T::zero()));
                continue;
            };
            out[up.end..down.start].fill(Complex::new(T::zero(), T::zero()));
            for range in [up.clone(), down.clone()] {
                let parts = parts.map(|part| &part[range.clone()]);
                factors.fill(quantity, &waves, range.clone(), parts, &mut out[range]);
            }
        }
    }
}

fn widen(c: Complex32) -> Complex64 {
    Complex64::new(f64::from(c.re), f64::from(c.im))
}

fn narrow(c: Complex64) -> Complex32 {
    Complex32::new(c.re as f32, c.im as f32)
}

#[cfg(test)]
mod tests;
