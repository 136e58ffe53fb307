//! Slicks: winding bands of surface films that damp the short waves, used as hard negatives beside wakes.
//!
//! ```text
//! damping = D exp(−½ (d/(w/2))²),     d = |ψ|/|∇ψ|
//! ```
//!
//! ψ is a random sum of plane waves of one length. Slicks lie along its zeros, lines that wind and close at a mean distance
//! of about half that length. The model imitates the appearance in images; every constant is chosen.

use crate::random::{Stream, generator};
use crate::raster::{Field, Raster};
use num_complex::Complex64;
use rand::Rng;
use std::f64::consts::TAU;
use std::ops::Range;

/// Wind speed above which films are torn apart [m/s]: chosen.
pub const STRONGEST_WIND: f64 = 6.0;

/// Number of plane waves in ψ, enough to make it nearly Gaussian.
const WAVES: usize = 24;

/// The slicks of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slicks {
    /// Damping of the short waves at the centre, D \[1\], 0 to 1.
    pub damping: f64,
    /// Full width w \[m\], above 0: twice the distance at which the damping has fallen to e^{−1/2}.
    pub width: f64,
    /// Length scale of the winding \[m\], above 0.
    pub scale: f64,
}

/// One plane wave: wavenumber [rad/m] and phase e^{iφ}.
type Wave = ([f64; 2], Complex64);

impl Slicks {
    /// Remaining share of the short waves at every pixel, 1 − damping \[1\]; 1 everywhere for winds above
    /// [`STRONGEST_WIND`].
    ///
    /// Evaluated at pixels up to a tenth of the width apart and interpolated linearly, with a mean error within 0.005 of
    /// the damping.
    ///
    /// - `seed`: gives the same field for any number of threads
    #[must_use]
    pub fn field(&self, raster: &Raster, wind_speed: f64, seed: u64) -> Field {
        self.strip(raster, &(0..raster.rows), wind_speed, seed)
    }

    /// Some rows of [`Self::field`].
    pub(crate) fn strip(
        &self,
        raster: &Raster,
        rows: &Range<usize>,
        wind_speed: f64,
        seed: u64,
    ) -> Field {
        let mut field = Field::constant(&raster.strip(rows), 1.0);
        if wind_speed > STRONGEST_WIND {
            return field;
        }
        let waves = self.waves(seed);
        let step = ((0.1 * self.width / raster.spacing) as usize).max(1);
        let above = rows.start / step;
        let [below, columns] = raster.every(step);
        let below = below.min(rows.end.div_ceil(step) + 1);
        // The phasor of a wave at a pixel is the product of those of its column and row.
        let turns =
            |axis: usize, at: f64| waves.iter().map(move |(k, _)| Complex64::cis(k[axis] * at));
        let of_columns = (0..columns).flat_map(|j| turns(0, raster.x(step * j)));
        let of_columns: Vec<Complex64> = of_columns.collect();
        let of_rows = (above..below).flat_map(|i| turns(1, raster.y(step * i)));
        let of_rows: Vec<Complex64> = of_rows.collect();
        let damping = Field::from_fn(&Raster::image(below - above, columns, 1.0), |i, j| {
            let turns = of_rows[i * WAVES..].iter().zip(&of_columns[j * WAVES..]);
            let turns = turns.map(|(row, column)| row * column);
            let off = 2.0 * distance(&waves, turns) / self.width;
            (self.damping * (-0.5 * off * off).exp()) as f32
        });
        let first = rows.start - above * step;
        field.change_with(&damping, step, first, |left, damping| *left -= damping);
        field
    }

    fn waves(&self, seed: u64) -> Vec<Wave> {
        let mut random = generator(seed, Stream::Slicks, 0);
        let mut turn = || TAU * (random.next_u64() >> 11) as f64 * 2f64.powi(-53);
        let k = TAU / self.scale;
        (0..WAVES)
            .map(|_| {
                let (sin, cos) = turn().sin_cos();
                ([k * sin, k * cos], Complex64::cis(turn()))
            })
            .collect()
    }
}

/// Distance to the nearest zero of ψ to first order, |ψ|/|∇ψ| \[m\].
///
/// - `turns`: e^{i(kx x + ky y)} of every wave at the position, in the order of the waves
fn distance(waves: &[Wave], turns: impl Iterator<Item = Complex64>) -> f64 {
    let (mut value, mut slope) = (0.0, [0.0; 2]);
    for (([kx, ky], phase), turn) in waves.iter().zip(turns) {
        let wave = turn * phase;
        value += wave.re;
        slope[0] -= kx * wave.im;
        slope[1] -= ky * wave.im;
    }
    value.abs() / slope[0].hypot(slope[1]).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLICKS: Slicks = Slicks {
        damping: 0.5,
        width: 50.0,
        scale: 2500.0,
    };

    /// The distance at a position.
    fn at(waves: &[Wave], [x, y]: [f64; 2]) -> f64 {
        let turn = |(k, _): &Wave| Complex64::cis(k[0] * x + k[1] * y);
        distance(waves, waves.iter().map(turn))
    }

    /// One wave alone gives parallel bands, where the distance follows tan: d(1 + O((kd)²/3)).
    #[test]
    fn one_wave_makes_straight_bands() {
        let waves = [([0.002, 0.0], Complex64::cis(-TAU / 4.0))];
        for d in [0.0, 10.0, 40.0] {
            let kd: f64 = 0.002 * d;
            assert!((at(&waves, [d, 77.0]) - kd.tan() / 0.002).abs() < 1e-9);
            assert!((at(&waves, [d, 0.0]) / d.max(1e-9) - 1.0).abs() < kd * kd || d < 1.0);
        }
    }

    /// Length of the zeros of an isotropic Gaussian field of one wavenumber k: k/(2√2) per area (Longuet-Higgins 1957),
    /// measured as the area within a distance over twice that distance, over many seeds.
    #[test]
    fn length_of_slicks_per_area() {
        let raster = Raster::image(100, 100, 40.0);
        let (mut area, count) = (0.0, 60);
        for seed in 0..count {
            let waves = SLICKS.waves(seed);
            for i in 0..100 {
                for j in 0..100 {
                    let near = at(&waves, [raster.x(j), raster.y(i)]) < 25.0;
                    area += f64::from(u8::from(near)) / 1e4;
                }
            }
        }
        let length = area / f64::from(count as u32) / 50.0;
        let expected = TAU / 2500.0 / (2.0 * 2f64.sqrt());
        // About 2.6 periods squared per field, sixty fields: 7 % of scatter; the first-order distance adds (kd)²/3.
        assert!(
            (length / expected - 1.0).abs() < 0.2,
            "{}",
            length / expected
        );
    }

    /// Evaluated at every pixel and at every fourth: the curvature of the profile, 4D/w², over an eighth of the squared
    /// step.
    #[test]
    fn interpolation_keeps_the_profile() {
        let fine = Raster::image(320, 360, 1.25);
        let slicks = Slicks {
            scale: 400.0,
            ..SLICKS
        };
        let waves = slicks.waves(9);
        let field = slicks.field(&fine, 3.0, 9);
        let mut square = 0.0;
        for i in 0..320 {
            for j in 0..360 {
                let off = 2.0 * at(&waves, [fine.x(j), fine.y(i)]) / 50.0;
                let exact = 1.0 - 0.5 * (-0.5 * off * off).exp();
                square += (f64::from(field.at(i, j)) - exact).powi(2) / (320.0 * 360.0);
            }
        }
        // A mean error: where slicks cross, ∇ψ vanishes and the profile has more curvature.
        let error = square.sqrt();
        assert!(error < 0.005 * 0.5 && error > 1e-5, "{error}");
    }

    #[test]
    fn damping_is_bounded_and_off_in_wind() {
        let raster = Raster::image(60, 50, 30.0);
        let field = SLICKS.field(&raster, 4.0, 3);
        let (low, high) = field
            .values
            .iter()
            .fold((1f32, 0f32), |(l, h), &v| (l.min(v), h.max(v)));
        assert!((0.5..0.6).contains(&low) && high <= 1.0 && high > 0.99);
        let windy = SLICKS.field(&raster, 6.1, 3);
        assert_eq!(windy, Field::constant(&raster, 1.0));
        assert_ne!(field, SLICKS.field(&raster, 4.0, 4));
    }
}
