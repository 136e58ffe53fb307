//! Half spectra of a line of waves, from the even and odd parts of their amplitudes.
//!
//! A real field has the half spectrum H(k) = ½(T(k) c(k) + T*(−k) c*(−k)). With E and O = ½(c(k) ± c*(−k))
//! and the factors T of [`Transfer::factor`], each quantity needs one or both of E and O.

use super::lane::Lane;
use super::wave_lattice::WaveLattice;
use crate::constants::{GRAVITY, KINEMATIC_SURFACE_TENSION};
use crate::waves::{LARGEST_MODULATING_WAVENUMBER, Quantity, Transfer};
use num_complex::{Complex, Complex32};
use std::ops::Range;

/// Common and individual parameters of the waves of a line.
pub(super) struct LineWaves<T> {
    kx: T,
    /// ω [rad/s].
    omega: Vec<T>,
    /// ω coth(kh)/k: horizontal velocity over wavenumber and amplitude [m/s].
    orbital: Vec<T>,
}

/// Factors common to all waves.
pub(super) struct Factors<'a, T> {
    lattice: &'a WaveLattice,
    ky: Vec<T>,
    depth: Option<T>,
    sin: T,
    cos: T,
    rate: T,
    action_slope: T,
}

impl<'a, T: Lane> Factors<'a, T> {
    pub(super) fn new(lattice: &'a WaveLattice, transfer: &Transfer) -> Self {
        Self {
            lattice,
            ky: (0..lattice.rows)
                .map(|a| T::constant(lattice.ky(a)))
                .collect(),
            depth: transfer
                .depth
                .is_finite()
                .then(|| T::constant(transfer.depth)),
            sin: T::constant(transfer.incidence.sin()),
            cos: T::constant(transfer.incidence.cos()),
            rate: T::constant(transfer.relaxation_rate),
            action_slope: T::constant(transfer.action_slope),
        }
    }

    /// Frequencies of the waves of a line.
    #[inline(always)]
    pub(super) fn waves(&self, line: usize) -> LineWaves<T> {
        let kx = T::constant(self.lattice.kx(line));
        let (mut omega, mut orbital) = (
            vec![T::zero(); self.ky.len()],
            vec![T::zero(); self.ky.len()],
        );
        for range in self.lattice.disk(line) {
            let out = omega[range.clone()]
                .iter_mut()
                .zip(&mut orbital[range.clone()]);
            let waves = self.ky[range].iter().zip(out);
            match self.depth {
                None => {
                    waves.for_each(|(&ky, (omega, orbital))| {
                        frequency(kx * kx + ky * ky, |_| T::one(), omega, orbital);
                    });
                }
                Some(depth) => waves.for_each(|(&ky, (omega, orbital))| {
                    frequency(kx * kx + ky * ky, |k| (k * depth).tanh(), omega, orbital);
                }),
            }
        }
        if line == 0 {
            (omega[0], orbital[0]) = (T::zero(), T::zero());
        }
        LineWaves { kx, omega, orbital }
    }

    /// Writes a part of the half spectrum of a quantity.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        quantity: Quantity,
        waves: &LineWaves<T>,
        range: Range<usize>,
        [even, odd]: [&[Complex32]; 2],
        out: &mut [Complex<T>],
    ) {
        let kx = waves.kx;
        let (ky, omega) = (&self.ky[range.clone()], &waves.omega[range.clone()]);
        let orbital = &waves.orbital[range];
        match quantity {
            Quantity::Elevation => map(out, even, |_, e| e),
            Quantity::SlopeX => map(out, even, |_, e| times_i(e, kx)),
            Quantity::SlopeY => map(out, even, |n, e| times_i(e, ky[n])),
            Quantity::VelocityX => map(out, odd, |n, o| o * (kx * orbital[n])),
            Quantity::VelocityY => map(out, odd, |n, o| o * (ky[n] * orbital[n])),
            Quantity::VelocityZ => map(out, odd, |n, o| times_i(o, -omega[n])),
            Quantity::RadialAcceleration => map(out, even, |n, e| {
                let horizontal = omega[n] * kx * orbital[n] * self.sin;
                e * Complex::new(-omega[n] * omega[n] * self.cos, horizontal)
            }),
            Quantity::Hydrodynamic => {
                let limit = T::constant(LARGEST_MODULATING_WAVENUMBER.powi(2));
                let rate = self.rate;
                let gain = |n: usize| {
                    let action_slope = if kx * kx + ky[n] * ky[n] > limit {
                        T::zero()
                    } else {
                        self.action_slope
                    };
                    action_slope * kx * kx * orbital[n] / (omega[n] * omega[n] + rate * rate)
                };
                map(out, even, |n, e| e * (gain(n) * omega[n]));
                for ((n, h), &o) in out.iter_mut().enumerate().zip(odd) {
                    *h = *h - times_i(widen(o), gain(n) * rate);
                }
            }
        }
    }
}

/// ω² = (gk + (τ/ρ)k³) tanh(kh) and ω coth(kh)/k from k².
#[inline(always)]
fn frequency<T: Lane>(squared: T, tanh: impl Fn(T) -> T, omega: &mut T, orbital: &mut T) {
    let tension = T::constant(KINEMATIC_SURFACE_TENSION);
    let k = squared.sqrt();
    let t = tanh(k);
    *omega = (k * (T::constant(GRAVITY) + tension * squared) * t).sqrt();
    *orbital = *omega / (k * t);
}

#[inline(always)]
fn map<T: Lane>(
    out: &mut [Complex<T>],
    part: &[Complex32],
    factor: impl Fn(usize, Complex<T>) -> Complex<T>,
) {
    for ((n, h), &part) in out.iter_mut().enumerate().zip(part) {
        *h = factor(n, widen(part));
    }
}

#[inline(always)]
fn widen<T: Lane>(value: Complex32) -> Complex<T> {
    Complex::new(T::widen(value.re), T::widen(value.im))
}

/// i·s·z.
#[inline(always)]
fn times_i<T: Lane>(z: Complex<T>, s: T) -> Complex<T> {
    Complex::new(-s * z.im, s * z.re)
}
