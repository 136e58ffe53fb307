//! Two-scale model: short waves scatter on facets tilted by longer waves.

use crate::numeric::vector::{exp, vectorized};
use crate::scattering::Polarization;
use crate::scattering::bragg::{coefficients, cross_section};
use crate::scattering::slopes::{SlopeCovariance, gaussian_nodes};
use crate::spectrum::Elfouhaily;
use num_complex::Complex64;

/// Split wavenumber over radar wavenumber, `k_d`/`k_e` \[1\]. Longer waves tilt facets, shorter ones scatter.
/// The ratio lies between the usual 3 and 5 radar wavelengths (`k_e`/3 to `k_e`/5).
const SPLIT: f64 = 0.25;

/// Wavenumber of the roll-off of the Bragg return, over `k_d` \[1\]: chosen, so that the mean σ⁰ at 24° is within 0.1 dB of
/// that with a sharp limit at `k_d`.
const ROLL_OFF: f64 = 0.86;

/// Spacing of slopes of the exact average \[1\]: a tenth of the width of the roll-off near nadir, the sharpest feature of
/// the Bragg return. Half the spacing changes the average by less than 2e-7.
const FINE_SLOPES: f64 = 0.008;

/// Bragg scattering by tilted facets, for one radar, one sea and one wind.
///
/// The facet's tilt comes from its slopes; the Bragg waves on it follow Elfouhaily's spectrum and spreading.
///
/// # References
///
/// Valenzuela (1978), Boundary-Layer Meteorology 13, 61; Romeiser, Alpers and Wismann (1997),
/// J. Geophys. Res. 102(C11), 25237.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoScale {
    sin_incidence: f64,
    cos_incidence: f64,
    radar_wavenumber: f64,
    polarization: Polarization,
    permittivity: Complex64,
    spectrum: Elfouhaily,
    wind: [f64; 2],
}

impl TwoScale {
    /// The model for a radar and a sea.
    ///
    /// - `incidence` θ \[rad\], 0 to π/2; `radar_wavenumber` `k_e` = 2π/λ [rad/m]
    /// - `permittivity` ε of the water; `spectrum` of the short waves
    /// - `wind` unit vector (x, y) of the wind direction (toward)
    #[must_use]
    pub fn new(
        incidence: f64,
        radar_wavenumber: f64,
        polarization: Polarization,
        permittivity: Complex64,
        spectrum: Elfouhaily,
        wind: [f64; 2],
    ) -> Self {
        Self {
            sin_incidence: incidence.sin(),
            cos_incidence: incidence.cos(),
            radar_wavenumber,
            polarization,
            permittivity,
            spectrum,
            wind,
        }
    }

    /// Split wavenumber `k_d` = `k_e`/4 [rad/m].
    #[must_use]
    pub fn split_wavenumber(&self) -> f64 {
        SPLIT * self.radar_wavenumber
    }

    /// Slopes of the waves from `wavenumber` [rad/m] to `k_d`; zero if there are no waves between them.
    ///
    /// From a pixel's Nyquist wavenumber these are the slopes that it does not resolve, from 0 all slopes.
    #[must_use]
    pub fn slopes_from(&self, wavenumber: f64) -> SlopeCovariance {
        let variance = self
            .spectrum
            .slope_variance(wavenumber, self.split_wavenumber());
        SlopeCovariance::along_wind(variance, self.wind)
    }

    /// Bragg σ⁰ of a plane facet, per unit area of the horizontal plane.
    ///
    /// ```text
    /// s_p = atan(s_x)   s_n = atan(s_y cos s_p)   θ' = θ − s_p   cos θ_i = cos θ' cos s_n
    /// k_B = 2k_e (sin θ', −cos θ' sin s_n),   |k_B| = 2k_e sin θ_i
    /// g = (sin²θ' cos²s_n/sin²θ_i) g_VV(θ_i) + (sin²s_n/sin²θ_i) g_HH(θ_i)      for VV; HH by exchange
    /// σ = 16π k_e⁴ cos⁴θ_i |g|² Ψ(k_B) exp[−(0.86 k_d/|k_B|)⁶] / (cos s_p cos s_n)
    /// ```
    ///
    /// The last factor is the facet's area over its base. The exponential removes facets so steep toward the radar that
    /// their Bragg wave would be a long wave; those contribute to the specular return. Facets turned away (`θ_i` of 90° or
    /// more) return nothing.
    ///
    /// - `slope` (`s_x`, `s_y`) along and across the look direction \[1\]
    ///
    /// # References
    ///
    /// Romeiser et al. (1997), Eqs. 1–9, but their area weight is cos θ'/(cos θ cos `s_p`), a projection on the beam, which
    /// raises mean σ⁰ by at most 0.2 dB. Here σ⁰ is per unit area of sea.
    #[must_use]
    pub fn facet(&self, slope: [f64; 2]) -> f64 {
        self.facet_by(slope, f64::exp)
    }

    /// [`Self::facet`] for slopes on a line, from `first` in steps of `step`.
    pub(crate) fn facets(&self, first: [f64; 2], step: [f64; 2], out: &mut [f64]) {
        vectorized(
            #[inline(always)]
            || {
                // The compiler must assume that `out` aliases the model, but not this copy.
                let model = self.clone();
                for (n, value) in (0u32..).zip(out) {
                    let n = f64::from(n);
                    let slope = [first[0] + n * step[0], first[1] + n * step[1]];
                    *value = model.facet_by(slope, exp);
                }
            },
        );
    }

    #[inline(always)]
    fn facet_by(&self, [sx, sy]: [f64; 2], exp: impl Fn(f64) -> f64 + Copy) -> f64 {
        if self.spectrum.is_flat() {
            return 0.0;
        }
        let in_plane = (1.0 + sx * sx).sqrt();
        let area = (1.0 + sx * sx + sy * sy).sqrt();
        let cos_look = (self.cos_incidence + self.sin_incidence * sx) / in_plane;
        let sin_look = (self.sin_incidence - self.cos_incidence * sx) / in_plane;
        let (sin_tilt, cos_tilt) = (sy / area, in_plane / area);
        let bragg = [sin_look, -cos_look * sin_tilt];
        let sin2 = bragg[0] * bragg[0] + bragg[1] * bragg[1];
        let passed = self.roll_off(sin2, exp);
        let cos = cos_look * cos_tilt;
        let own = (sin_look * cos_tilt).powi(2) / sin2;
        let gain = self.gain(cos, own, sin_tilt * sin_tilt / sin2);
        let k = bragg.map(|b| 2.0 * self.radar_wavenumber * b);
        let density = self.spectrum.density_by(k, self.wind, exp);
        let sigma = cross_section(self.radar_wavenumber, cos, gain, density) * passed * area;
        // Where nothing passes, the other factors may be NaN.
        if cos_look > 0.0 && passed > 0.0 {
            sigma
        } else {
            0.0
        }
    }

    /// Factor of the roll-off on the Bragg return, from `sin²θ_i`.
    #[inline(always)]
    fn roll_off(&self, sin2: f64, exp: impl Fn(f64) -> f64) -> f64 {
        let ratio2 = (0.5 * ROLL_OFF * SPLIT).powi(2) / sin2;
        exp(-ratio2 * ratio2 * ratio2)
    }

    /// |g|² of a facet with the given shares of the co-polarized and of the other coefficient.
    #[inline(always)]
    fn gain(&self, cos_incidence: f64, own: f64, other: f64) -> f64 {
        let g = coefficients(self.permittivity, cos_incidence);
        match self.polarization {
            Polarization::VV => (g.vv * own + g.hh * other).norm_sqr(),
            Polarization::HH => (g.hh * own + g.vv * other).norm_sqr(),
        }
    }

    /// Mean Bragg σ⁰ of a facet over its unresolved slopes.
    ///
    /// ```text
    /// σ(s) = ∬ p(u) σ_facet(s + u) du,   p Gaussian
    /// ```
    ///
    /// By direct quadrature on slopes 0.008 apart: slow, the reference for the table. Its own relative error is below 2e-7.
    ///
    /// - `slope` s, the resolved slope \[1\]; `unresolved`, the covariance of u
    #[must_use]
    pub fn tilt_averaged(&self, slope: [f64; 2], unresolved: &SlopeCovariance) -> f64 {
        self.average(slope, unresolved, FINE_SLOPES)
    }

    /// [`Self::tilt_averaged`] with slopes `step` apart.
    pub(crate) fn average(&self, slope: [f64; 2], unresolved: &SlopeCovariance, step: f64) -> f64 {
        let axes = unresolved.principal_axes();
        let [along, across] = axes.variance.map(|v| gaussian_nodes(v.sqrt(), step));
        let mut row = vec![0.0; along.len()];
        let step = match &along[..] {
            [a, b, ..] => axes.slope([b[0] - a[0], 0.0]),
            _ => [0.0; 2],
        };
        let mut sum = 0.0;
        for &[v, weight_v] in &across {
            let [dx, dy] = axes.slope([along[0][0], v]);
            self.facets([slope[0] + dx, slope[1] + dy], step, &mut row);
            let weighed = row.iter().zip(&along).map(|(value, [_, w])| w * value);
            sum += weight_v * weighed.sum::<f64>();
        }
        sum
    }
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;
    use crate::constants::SPEED_OF_LIGHT;
    use crate::permittivity::sea_water;
    use crate::scattering::bragg;
    use crate::spectrum::elfouhaily::{DragLaw, FULLY_DEVELOPED};
    use std::f64::consts::PI;

    fn model(degrees: f64, polarization: Polarization, wind_speed: f64) -> TwoScale {
        TwoScale::new(
            degrees.to_radians(),
            2.0 * PI * 9.6e9 / SPEED_OF_LIGHT,
            polarization,
            sea_water(9.6e9, 20.0, 35.0),
            Elfouhaily::of_age(wind_speed, FULLY_DEVELOPED, DragLaw::Wu),
            [1.0, 0.0],
        )
    }

    /// With vanishing slopes the average equals the flat facet, which is plain Bragg scattering.
    #[test]
    fn no_slopes_leave_plain_bragg() {
        for polarization in [Polarization::VV, Polarization::HH] {
            let model = model(32.0, polarization, 5.0);
            let theta = 32f64.to_radians();
            let k = bragg::wavenumber(model.radar_wavenumber, theta);
            let g = coefficients(model.permittivity, theta.cos());
            let gain = match polarization {
                Polarization::VV => g.vv.norm_sqr(),
                Polarization::HH => g.hh.norm_sqr(),
            };
            let density = model.spectrum.density([k, 0.0], [1.0, 0.0]);
            let plain = cross_section(model.radar_wavenumber, theta.cos(), gain, density);
            // The roll-off removes (0.86 k_d/k_B)⁶ = 6.9e-5 at 32°.
            let flat = model.facet([0.0; 2]);
            assert!((flat / plain - 1.0 + 6.9e-5).abs() < 1e-6);
            assert!((model.tilt_averaged([0.0; 2], &SlopeCovariance::NONE) - flat).abs() < 1e-15);
            // The contribution of the slopes falls in proportion to their variance.
            let added =
                |v| model.tilt_averaged([0.0; 2], &SlopeCovariance::isotropic(v)) / flat - 1.0;
            let order = (added(1e-4) / added(1e-5)).log10();
            assert!((order - 1.0).abs() < 0.02, "{order}");
        }
    }

    /// Sign of the tilt: for a k⁻⁴ spectrum and large |ε|, the derivative of ln σ is 4 cot θ/(1 + sin²θ) for VV.
    #[test]
    fn rising_away_from_the_radar_is_bright() {
        let model = model(32.0, Polarization::VV, 5.0);
        let d = 1e-4;
        let slope = (model.facet([d, 0.0]) / model.facet([-d, 0.0])).ln() / (2.0 * d);
        let theta = 32f64.to_radians();
        let linear = 4.0 / theta.tan() / (1.0 + theta.sin().powi(2));
        // The model's curvature spectrum is not flat, which accounts for a few per cent.
        assert!((slope / linear - 1.0).abs() < 0.1, "{slope} {linear}");
    }

    /// A facet turned about the line of sight is unchanged: the return depends only on the angle between normal and radar,
    /// apart from polarization and the direction of the Bragg wave.
    #[test]
    fn tilt_geometry_is_that_of_the_normal() {
        let model = model(40.0, Polarization::VV, 7.0);
        for slope in [[0.1, 0.2], [-0.3, 0.4], [0.2, -0.6]] {
            let [sx, sy] = slope;
            let length = (1.0f64 + sx * sx + sy * sy).sqrt();
            let (sin, cos) = 40f64.to_radians().sin_cos();
            let expected = (sx * sin + cos) / length;
            let in_plane = (1.0 + sx * sx).sqrt();
            let cos_look = (cos + sin * sx) / in_plane;
            assert!((cos_look * in_plane / length - expected).abs() < 1e-15);
            // Left and right are equal for a wind along the look direction.
            let mirrored = model.facet([sx, -sy]);
            assert!((model.facet(slope) / mirrored - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn facets_that_face_away_or_face_the_radar_return_no_bragg() {
        let model = model(60.0, Polarization::VV, 7.0);
        let grazing = -1.0 / 60f64.to_radians().tan();
        assert_eq!(model.facet([grazing - 1e-9, 0.0]), 0.0);
        assert_eq!(model.facet([-1e8, 3.0]), 0.0);
        assert_eq!(model.facet([60f64.to_radians().tan(), 0.0]), 0.0);
        assert!(model.facet([1e8, 1e8]).is_finite());
    }

    /// Facets on a line equal single facets, toward grazing and toward nadir, up to the rounding of the exponent of the
    /// roll-off, which reaches 700, and of its argument.
    #[test]
    fn facets_on_a_line_are_facets() {
        for (degrees, polarization) in [(8.0, Polarization::VV), (35.0, Polarization::HH)] {
            let model = model(degrees, polarization, 6.0);
            let mut row = [0.0; 83];
            for j in -40..=40 {
                let y = 0.0625 * f64::from(j);
                model.facets([-2.5, y], [0.0625, 0.0], &mut row);
                for (i, other) in (0..).zip(row) {
                    let one = model.facet([0.0625 * f64::from(i) - 2.5, y]);
                    let bound = 700.0 * 10.0 * f64::EPSILON * one + 1e-290;
                    assert!((one - other).abs() <= bound, "{i} {j}: {one} {other}");
                }
            }
        }
    }

    #[test]
    fn no_wind_returns_nothing() {
        for degrees in [5.0, 32.0, 75.0] {
            let model = model(degrees, Polarization::VV, 0.0);
            assert_eq!(model.slopes_from(0.0), SlopeCovariance::NONE);
            assert_eq!(model.tilt_averaged([0.1, 0.0], &SlopeCovariance::NONE), 0.0);
        }
    }

    /// Pixels that resolve every tilting wave leave no slopes to average.
    #[test]
    fn unresolved_slopes_end_at_the_split() {
        let model = model(32.0, Polarization::VV, 7.0);
        assert_eq!(
            model.slopes_from(model.split_wavenumber()),
            SlopeCovariance::NONE
        );
        assert_eq!(model.slopes_from(1e3), SlopeCovariance::NONE);
        let [all, part] = [0.0, 1.0].map(|k| model.slopes_from(k));
        assert!(all.xx > part.xx && part.xx > part.yy && part.yy > 0.0);
    }

    /// The reference's own error: halving the spacing of slopes changes nothing, for wide and narrow tilt, even where the
    /// roll-off near nadir is within reach.
    #[test]
    fn tilt_average_has_converged() {
        for (degrees, variance) in [(16.0, 0.012), (16.0, 0.001), (40.0, 0.01), (70.0, 0.015)] {
            let model = model(degrees, Polarization::HH, 7.0);
            let tilt = SlopeCovariance::along_wind([variance, 0.7 * variance], [0.8, 0.6]);
            for slope in [[0.0, 0.0], [0.15, -0.1]] {
                let oracle = model.tilt_averaged(slope, &tilt);
                let finer = model.average(slope, &tilt, 0.5 * FINE_SLOPES);
                let error = (oracle / finer - 1.0).abs();
                assert!(error < 2e-7, "{degrees} {variance} {slope:?} {error}");
            }
        }
    }
}
