//! Plane waves, their fields, and the slow harmonic sum that serves as reference for fast sums.

pub(crate) mod matrix_product;

pub use crate::fft::{fast_length, lattice_sum};

use crate::raster::{Field, Raster};
use num_complex::Complex64;
use rayon::prelude::*;
use std::ops::Range;

/// Plane waves of the sea surface at one instant:
///
/// ```text
/// ζ(x, y) = Σₙ Re[aₙ exp(i(kxₙ·x + kyₙ·y))],   travelling along +k with frequency ω
/// ```
///
/// # Shapes
///
/// All vectors have the same length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlaneWaves {
    /// Wavenumber along ground range kx [rad/m].
    pub kx: Vec<f64>,
    /// Wavenumber along azimuth ky [rad/m].
    pub ky: Vec<f64>,
    /// Angular frequency ω [rad/s], at least 0.
    pub omega: Vec<f64>,
    /// Complex amplitude a \[m\], the time factor e^{−iωt} included.
    pub amplitude: Vec<Complex64>,
}

impl PlaneWaves {
    /// No waves, with capacity for `count`.
    pub(crate) fn with_capacity(count: usize) -> Self {
        Self {
            kx: Vec::with_capacity(count),
            ky: Vec::with_capacity(count),
            omega: Vec::with_capacity(count),
            amplitude: Vec::with_capacity(count),
        }
    }

    /// Some of the waves, in order.
    pub(crate) fn part(&self, range: Range<usize>) -> Self {
        Self {
            kx: self.kx[range.clone()].to_vec(),
            ky: self.ky[range.clone()].to_vec(),
            omega: self.omega[range.clone()].to_vec(),
            amplitude: self.amplitude[range].to_vec(),
        }
    }

    /// Number of waves.
    #[must_use]
    pub fn len(&self) -> usize {
        self.kx.len()
    }

    /// Whether there is no wave.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.kx.is_empty()
    }

    /// Adds one wave.
    pub fn push(&mut self, [kx, ky]: [f64; 2], omega: f64, amplitude: Complex64) {
        self.kx.push(kx);
        self.ky.push(ky);
        self.omega.push(omega);
        self.amplitude.push(amplitude);
    }

    /// The `count` waves of largest |a|, in their original order.
    #[must_use]
    pub fn strongest(&self, count: usize) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| {
            self.amplitude[b]
                .norm_sqr()
                .total_cmp(&self.amplitude[a].norm_sqr())
        });
        order.truncate(count);
        order.sort_unstable();
        let mut out = Self::default();
        for n in order {
            out.push([self.kx[n], self.ky[n]], self.omega[n], self.amplitude[n]);
        }
        out
    }
}

/// A field that is linear in the waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Elevation ζ \[m\].
    Elevation,
    /// Slope ∂ζ/∂x \[1\].
    SlopeX,
    /// Slope ∂ζ/∂y \[1\].
    SlopeY,
    /// Velocity of the water at the surface along x [m/s].
    VelocityX,
    /// Velocity of the water at the surface along y [m/s].
    VelocityY,
    /// Upward velocity of the water at the surface [m/s].
    VelocityZ,
    /// Acceleration toward the radar [m/s²].
    RadialAcceleration,
    /// Relative modulation of the Bragg waves by the orbital current \[1\].
    Hydrodynamic,
}

/// Conversion from a wave's amplitude to the amplitude of any [`Quantity`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// Water depth h \[m\], may be infinite.
    pub depth: f64,
    /// Incidence angle θ \[rad\].
    pub incidence: f64,
    /// Relaxation rate μ of the Bragg waves [1/s].
    pub relaxation_rate: f64,
    /// Slope `m_B` of the action spectrum of the Bragg waves \[1\], −∂ln(ωΨ/k)/∂ln k; 4.5 for Ψ ∝ k⁻⁴.
    pub action_slope: f64,
}

/// Largest wavenumber that modulates the Bragg waves [rad/m]: waves shorter than 5 m do not (chosen). Above the relaxation
/// rate the modulation is `m_B` times the wave's steepness at any length, so its variance would otherwise depend on the
/// grid. The additional 1e-4 keeps rounding from deciding on 5 m itself.
pub(crate) const LARGEST_MODULATING_WAVENUMBER: f64 = std::f64::consts::TAU / 5.0 * 1.0001;

impl Transfer {
    /// Complex factor T of a quantity: the field is Σ Re[T·a·exp(i k·x)].
    ///
    /// ```text
    /// slopes            i kx, i ky
    /// velocity          vz: −iω     vx, vy: ω coth(kh)·kx/k, ω coth(kh)·ky/k
    /// toward the radar  v_r = vz cos θ − vx sin θ,  acceleration −iω v_r
    /// hydrodynamic      m_B ω coth(kh) (kx²/k)(ω − iμ)/(ω² + μ²)     for waves of 5 m and more
    /// ```
    ///
    /// The water under a crest moves along +k. The last line is the relaxation model
    /// ∂m/∂t + μ m = −`m_B` ∂vx/∂x for Bragg waves along the line of sight.
    ///
    /// - `kx`, `ky` [rad/m], not both 0 (there T is 0 except for the elevation)
    /// - `omega` ω [rad/s]
    ///
    /// # References
    ///
    /// Alpers, Ross and Rufenach (1981), J. Geophys. Res. 86(C7), 6481, Eqs. 9 and 13–16.
    #[must_use]
    pub fn factor(&self, quantity: Quantity, [kx, ky]: [f64; 2], omega: f64) -> Complex64 {
        let k = kx.hypot(ky);
        if k == 0.0 {
            let elevation = f64::from(u8::from(quantity == Quantity::Elevation));
            return Complex64::new(elevation, 0.0);
        }
        let i = Complex64::i();
        let horizontal = omega / crate::dispersion::depth_factor(k, self.depth);
        match quantity {
            Quantity::Elevation => Complex64::ONE,
            Quantity::SlopeX => i * kx,
            Quantity::SlopeY => i * ky,
            Quantity::VelocityX => (horizontal * kx / k).into(),
            Quantity::VelocityY => (horizontal * ky / k).into(),
            Quantity::VelocityZ => -i * omega,
            Quantity::RadialAcceleration => -i * omega * self.radial([kx, ky], omega),
            Quantity::Hydrodynamic if k > LARGEST_MODULATING_WAVENUMBER => Complex64::ZERO,
            Quantity::Hydrodynamic => self.modulation([kx, ky], omega),
        }
    }

    /// Modulation by a wave of any length [1/m]; [`Self::factor`] ends at 5 m.
    pub(crate) fn modulation(&self, [kx, ky]: [f64; 2], omega: f64) -> Complex64 {
        let k = kx.hypot(ky);
        let horizontal = omega / crate::dispersion::depth_factor(k, self.depth);
        let gradient = Complex64::i() * kx * (horizontal * kx / k);
        -self.action_slope * gradient / (self.relaxation_rate - Complex64::i() * omega)
    }

    /// Factor of the velocity toward the radar, vz cos θ − vx sin θ [1/s]; 0 at k = 0.
    #[must_use]
    pub fn radial(&self, k: [f64; 2], omega: f64) -> Complex64 {
        self.factor(Quantity::VelocityZ, k, omega) * self.incidence.cos()
            - self.factor(Quantity::VelocityX, k, omega) * self.incidence.sin()
    }
}

/// Sums plane waves pixel by pixel: slow, the reference for every fast sum.
///
/// `pixels` are (row, column) pairs. The cost is waves × pixels sines and cosines, shared by all quantities.
///
/// # Shapes
///
/// Returns one vector per quantity, one value per pixel.
#[must_use]
pub fn harmonic_sum(
    waves: &PlaneWaves,
    transfer: &Transfer,
    quantities: &[Quantity],
    raster: &Raster,
    pixels: &[[usize; 2]],
) -> Vec<Vec<f64>> {
    let strengths = strengths(waves, transfer, quantities);
    let sums: Vec<Vec<f64>> = pixels
        .par_iter()
        .map(|&[row, column]| {
            let (x, y) = (raster.x(column), raster.y(row));
            let mut sum = vec![0.0; quantities.len()];
            for n in 0..waves.len() {
                let (sin, cos) = (waves.kx[n] * x + waves.ky[n] * y).sin_cos();
                for (s, c) in sum.iter_mut().zip(&strengths) {
                    *s += c[n].re * cos - c[n].im * sin;
                }
            }
            sum
        })
        .collect();
    (0..quantities.len())
        .map(|q| sums.iter().map(|s| s[q]).collect())
        .collect()
}

/// Amplitudes T·a of each quantity, one vector per quantity.
#[must_use]
pub(crate) fn strengths(
    waves: &PlaneWaves,
    transfer: &Transfer,
    quantities: &[Quantity],
) -> Vec<Vec<Complex64>> {
    let one = |&quantity: &Quantity| {
        (0..waves.len())
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|n| {
                let factor = transfer.factor(quantity, [waves.kx[n], waves.ky[n]], waves.omega[n]);
                factor * waves.amplitude[n]
            })
            .collect()
    };
    quantities.iter().map(one).collect()
}

/// [`harmonic_sum`] over a whole raster, as fields.
pub(crate) fn harmonic_fields(
    waves: &PlaneWaves,
    transfer: &Transfer,
    quantities: &[Quantity],
    raster: &Raster,
) -> Vec<Field> {
    let pixels: Vec<[usize; 2]> = (0..raster.len())
        .map(|n| [n / raster.columns, n % raster.columns])
        .collect();
    harmonic_sum(waves, transfer, quantities, raster, &pixels)
        .into_iter()
        .map(|values| Field {
            rows: raster.rows,
            columns: raster.columns,
            values: values.into_iter().map(|v| v as f32).collect(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::angular_frequency;

    const TRANSFER: Transfer = Transfer {
        depth: 12.0,
        incidence: 0.5,
        relaxation_rate: 0.7,
        action_slope: 4.5,
    };

    fn value(quantity: Quantity, k: [f64; 2], [x, y, t]: [f64; 3]) -> f64 {
        let omega = angular_frequency(k[0].hypot(k[1]), TRANSFER.depth);
        let phase = k[0] * x + k[1] * y - omega * t + 0.3;
        (TRANSFER.factor(quantity, k, omega) * Complex64::cis(phase)).re
    }

    /// Slopes, vertical velocity and acceleration against finite differences of elevation and velocity.
    #[test]
    fn factors_are_derivatives() {
        let (k, p, d) = ([0.21, -0.13], [3.0, -4.0, 5.0], 1e-4);
        let slope = |q, axis: usize| {
            let (mut a, mut b) = (p, p);
            a[axis] -= d;
            b[axis] += d;
            (value(q, k, b) - value(q, k, a)) / (2.0 * d)
        };
        let radial = |p| {
            value(Quantity::VelocityZ, k, p) * TRANSFER.incidence.cos()
                - value(Quantity::VelocityX, k, p) * TRANSFER.incidence.sin()
        };
        let acceleration =
            (radial([p[0], p[1], p[2] + d]) - radial([p[0], p[1], p[2] - d])) / (2.0 * d);
        // Central differences of unit waves with k, ω below 2: error below d².
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-8, "{a} {b}");
        close(value(Quantity::SlopeX, k, p), slope(Quantity::Elevation, 0));
        close(value(Quantity::SlopeY, k, p), slope(Quantity::Elevation, 1));
        close(
            value(Quantity::VelocityZ, k, p),
            slope(Quantity::Elevation, 2),
        );
        close(value(Quantity::RadialAcceleration, k, p), acceleration);
        // The relaxation equation ∂m/∂t + μ m = −m_B ∂vx/∂x, here with 4.5.
        let m = value(Quantity::Hydrodynamic, k, p);
        close(
            slope(Quantity::Hydrodynamic, 2) + TRANSFER.relaxation_rate * m,
            -4.5 * slope(Quantity::VelocityX, 0),
        );
    }

    /// Waves of 5 m modulate, shorter ones do not.
    #[test]
    fn short_waves_do_not_modulate() {
        for (length, modulates) in [(10.0, true), (5.0, true), (4.99, false), (1.0, false)] {
            let k = std::f64::consts::TAU / length;
            let factor = TRANSFER.factor(Quantity::Hydrodynamic, [0.8 * k, 0.6 * k], 1.0);
            assert_eq!(factor != Complex64::ZERO, modulates, "{length}");
        }
    }

    /// Under a crest the water moves along the wave; continuity holds at the surface in deep water.
    #[test]
    fn water_under_a_crest_moves_with_the_wave() {
        for k in [[0.3f64, 0.0], [-0.2, 0.1], [0.0, -0.4]] {
            let omega = angular_frequency(k[0].hypot(k[1]), TRANSFER.depth);
            let vx = TRANSFER.factor(Quantity::VelocityX, k, omega).re;
            let vy = TRANSFER.factor(Quantity::VelocityY, k, omega).re;
            assert!(vx * k[0] + vy * k[1] > 0.0);
        }
    }

    #[test]
    fn the_mean_level_has_no_slope_and_no_velocity() {
        for q in [
            Quantity::SlopeX,
            Quantity::VelocityX,
            Quantity::Hydrodynamic,
        ] {
            assert_eq!(TRANSFER.factor(q, [0.0, 0.0], 0.0), Complex64::ZERO);
        }
        assert_eq!(
            TRANSFER.factor(Quantity::Elevation, [0.0, 0.0], 0.0),
            Complex64::ONE
        );
    }

    /// One wave on three pixels against its cosine, and the strongest of several.
    #[test]
    fn one_wave_is_its_cosine() {
        let mut waves = PlaneWaves::default();
        waves.push([0.3, 0.4], 2.0, Complex64::new(0.0, -2.0));
        waves.push([0.1, 0.0], 1.0, Complex64::new(0.5, 0.0));
        let raster = Raster::image(4, 4, 1.0);
        let one = waves.strongest(1);
        assert_eq!(one.kx, [0.3]);
        let fields = harmonic_fields(&one, &TRANSFER, &[Quantity::Elevation], &raster);
        for (i, j) in [(0, 0), (2, 2), (3, 1)] {
            let expected = 2.0 * (0.3 * raster.x(j) + 0.4 * raster.y(i)).sin();
            assert!((f64::from(fields[0].at(i, j)) - expected).abs() < 1e-6);
        }
    }
}
