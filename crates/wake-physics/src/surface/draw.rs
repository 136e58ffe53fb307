//! Random amplitudes of a sea, drawn line by line.

use super::amplitude::Amplitudes;
use super::wave_lattice::WaveLattice;
use crate::dispersion::angular_frequency;
use crate::numeric::vector::{cos_sin, ln_f32, vectorized};
use crate::random::{Stream, generator};
use crate::raster::Raster;
use crate::wind_sea::DirectionalSpectrum;
use num_complex::Complex32;
use rand::Rng;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Distribution of amplitudes around their mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scatter {
    /// Complex Gaussian.
    Gaussian,
    /// The mean amplitude with a random phase: every realisation has exactly the variance of the density.
    #[cfg(test)]
    Phase,
}

/// Inputs that determine the amplitudes of one sea.
pub(super) struct Draw<'a> {
    lattice: WaveLattice,
    amplitudes: Amplitudes<'a>,
    depth: f64,
    seed: u64,
    time: f64,
    scatter: Scatter,
    /// ky at every index [rad/m].
    ky: Vec<f32>,
    /// Phase of pixel `[0, 0]`, by index and by line [2⁻³² turns].
    place: [Vec<u32>; 2],
}

/// Buffers for one line.
struct Workspace {
    /// Mean amplitudes of k and of −k.
    level: [Vec<f32>; 2],
    /// Random bits of k and of −k: for the modulus and the phase.
    bits: [Vec<[u32; 2]>; 2],
    /// ωt [2⁻³² turns].
    motion: Vec<u32>,
    /// Amplitudes c(k) and c(−k).
    waves: [Vec<Complex32>; 2],
}

impl<'a> Draw<'a> {
    pub(super) fn new(
        spectrum: &'a DirectionalSpectrum,
        lattice: WaveLattice,
        raster: &Raster,
        seed: u64,
        time: f64,
        scatter: Scatter,
    ) -> Self {
        Self {
            lattice,
            amplitudes: Amplitudes::new(spectrum, &lattice),
            depth: spectrum.depth(),
            seed,
            time,
            scatter,
            ky: (0..lattice.rows).map(|a| lattice.ky(a) as f32).collect(),
            place: [
                turns(raster.origin_row, lattice.rows),
                turns(-raster.origin_column, lattice.columns),
            ],
        }
    }

    /// Even and odd parts ½(c(k) ± c*(−k)) of the amplitudes of all lines, with phases at pixel `[0, 0]`, and their mean
    /// variance \[m²\]; written into two buffers with any content.
    pub(super) fn run(
        &self,
        [mut even, mut odd]: [Vec<Complex32>; 2],
    ) -> ([Vec<Complex32>; 2], f64) {
        let rows = self.lattice.rows;
        let variances: Vec<f64> = even
            .par_chunks_mut(rows)
            .zip(odd.par_chunks_mut(rows))
            .enumerate()
            .map_init(
                || Workspace::new(rows),
                |work, (line, (even, odd))| {
                    vectorized(
                        #[inline(always)]
                        || self.line(line, work, even, odd),
                    )
                },
            )
            .collect();
        ([even, odd], variances.iter().sum())
    }

    #[inline(always)]
    fn line(
        &self,
        line: usize,
        work: &mut Workspace,
        even: &mut [Complex32],
        odd: &mut [Complex32],
    ) -> f64 {
        let [up, down] = self.lattice.disk(line);
        even[up.end..down.start].fill(Complex32::ZERO);
        odd[up.end..down.start].fill(Complex32::ZERO);
        let mut generator = generator(self.seed, Stream::Sea, line as u64);
        let mut variance = 0.0;
        for range in self.lattice.disk(line) {
            self.levels(line, range.clone(), work);
            variance += work.variance(line, range.clone());
            for n in range.clone() {
                work.bits[0][n] = words(generator.next_u64());
                work.bits[1][n] = words(generator.next_u64());
            }
            self.motion(line, range.clone(), work);
            self.waves(line, range, work);
        }
        if line == 0 {
            work.mirror(&self.lattice);
        }
        for range in self.lattice.disk(line) {
            let waves = work.waves[0][range.clone()]
                .iter()
                .zip(&work.waves[1][range.clone()]);
            let parts = even[range.clone()].iter_mut().zip(&mut odd[range]);
            for ((&c, &mirrored), (even, odd)) in waves.zip(parts) {
                *even = (c + mirrored.conj()) * 0.5;
                *odd = (c - mirrored.conj()) * 0.5;
            }
        }
        variance
    }

    #[inline(always)]
    fn levels(&self, line: usize, range: Range<usize>, work: &mut Workspace) {
        let [along, against] = &mut work.level;
        let ky = &self.ky[range.clone()];
        let kx = self.lattice.kx(line);
        self.amplitudes
            .fill(kx, ky, &mut along[range.clone()], &mut against[range]);
        if line == 0 {
            (along[0], against[0]) = (0.0, 0.0);
        }
    }

    /// ωt in turns, in double precision to keep the phase accurate at the longest time.
    fn motion(&self, line: usize, range: Range<usize>, work: &mut Workspace) {
        if self.time == 0.0 {
            return;
        }
        let kx = self.lattice.kx(line);
        for n in range {
            let k = kx.hypot(self.lattice.ky(n));
            let turns = angular_frequency(k, self.depth) * self.time / TAU;
            work.motion[n] = (turns.fract() * 4_294_967_296.0) as i64 as u32;
        }
    }

    /// c = level · √E · exp(i phase) with E exponential and the phase uniform: Box and Muller (1958).
    #[inline(always)]
    fn waves(&self, line: usize, range: Range<usize>, work: &mut Workspace) {
        let [by_index, by_line] = &self.place;
        for (side, sign) in [1u32, u32::MAX].into_iter().enumerate() {
            let bits = work.bits[side][range.clone()].iter();
            let shifts = work.motion[range.clone()]
                .iter()
                .zip(&by_index[range.clone()]);
            let levels = work.level[side][range.clone()].iter();
            let waves = work.waves[side][range.clone()].iter_mut();
            for (((c, level), &[modulus, phase]), (&motion, &place)) in
                waves.zip(levels).zip(bits).zip(shifts)
            {
                let place = place.wrapping_add(by_line[line]).wrapping_mul(sign);
                let [cos, sin] = cos_sin(phase.wrapping_add(place).wrapping_sub(motion));
                let length = level * self.modulus(modulus);
                *c = Complex32::new(length * cos, length * sin);
            }
        }
    }

    /// √E from 31 random bits n: E = −ln u, u = (n + ½) 2⁻³¹.
    #[inline(always)]
    fn modulus(&self, bits: u32) -> f32 {
        match self.scatter {
            Scatter::Gaussian => {
                let u = ((bits >> 1) as i32 as f32 + 0.5) * f32::from_bits((127 - 31) << 23);
                (-ln_f32(u)).max(0.0).sqrt()
            }
            #[cfg(test)]
            Scatter::Phase => 1.0,
        }
    }
}

impl Workspace {
    fn new(rows: usize) -> Self {
        Self {
            level: [vec![0.0; rows], vec![0.0; rows]],
            bits: [vec![[0; 2]; rows], vec![[0; 2]; rows]],
            motion: vec![0; rows],
            waves: [vec![Complex32::ZERO; rows], vec![Complex32::ZERO; rows]],
        }
    }

    /// Σ½ level² over both sides; on line 0 the second side repeats the first.
    #[inline(always)]
    fn variance(&self, line: usize, range: Range<usize>) -> f64 {
        let sides = if line == 0 { 1 } else { 2 };
        let squares = |level: &Vec<f32>| -> f64 {
            level[range.clone()]
                .iter()
                .map(|&v| 0.5 * f64::from(v * v))
                .sum()
        };
        self.level[..sides].iter().map(squares).sum()
    }

    /// On line 0, the wave −k is another wave of the same line.
    fn mirror(&mut self, lattice: &WaveLattice) {
        let [waves, mirrored] = &mut self.waves;
        for n in lattice.disk(0).into_iter().flatten() {
            mirrored[n] = waves[(lattice.rows - n) % lattice.rows];
        }
    }
}

#[inline(always)]
fn words(bits: u64) -> [u32; 2] {
    [(bits >> 32) as u32, bits as u32]
}

/// Phases of a pixel `shift` pixels from the origin, n·shift/period for every n of a period [2⁻³² turns].
fn turns(shift: i64, period: usize) -> Vec<u32> {
    let step = shift.rem_euclid(period as i64) as u64;
    let period = period as u64;
    (0..period)
        .map(|n| ((((n * step) % period) << 32) / period) as u32)
        .collect()
}
