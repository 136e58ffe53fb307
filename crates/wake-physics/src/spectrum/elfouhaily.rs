//! Unified spectrum of Elfouhaily et al. (1997): long gravity waves, and the short waves that scatter.
//!
//! Public codes of this model differ. This one follows the author's own program in using log10 in the peak enhancement,
//! `α_p` = 0.006 √Ω, the factor `L_PM·J_p` on both long and short waves, and a spreading that is even over the full circle.
//! It follows the paper in the slope 1 of `α_m` below `c_m` (the program has 0.9). The only variant is the drag law, see
//! [`DragLaw`].

use crate::constants::GRAVITY;
use crate::numeric::GaussLegendre;
use std::f64::consts::{LN_2, PI};

/// Wavenumber of the slowest wave `k_m` [rad/m], as rounded in the paper.
pub const SLOWEST_WAVENUMBER: f64 = 370.0;

/// Phase speed of the slowest wave `c_m` [m/s], as rounded in the paper.
pub const SLOWEST_SPEED: f64 = 0.23;

/// Inverse wave age of a fully developed sea `Ω_c` \[1\].
pub const FULLY_DEVELOPED: f64 = 0.84;

/// Dimensionless fetch at which a sea is developed, X₀ \[1\].
const DEVELOPED_FETCH: f64 = 2.2e4;

/// Largest inverse wave age to which the peak enhancement was fitted \[1\].
const YOUNGEST_SEA: f64 = 5.0;

/// Drag law of the wind, C₁₀ = (u*/U₁₀)².
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum DragLaw {
    /// C₁₀ = (0.8 + 0.065 U₁₀)·10⁻³ (Wu 1982), as in the author's program.
    #[default]
    Wu,
    /// C₁₀ = 0.00144 at every wind, a widespread variant. It makes the sea at 3 m/s about 2 dB brighter at X band.
    Fixed,
}

/// Friction velocity u* = √C₁₀·U₁₀ [m/s] of a wind U₁₀ [m/s].
///
/// # References
///
/// Wu (1982), J. Geophys. Res. 87, 9704.
#[must_use]
pub fn friction_velocity(wind_speed: f64, drag: DragLaw) -> f64 {
    let coefficient = match drag {
        DragLaw::Wu => (0.8 + 0.065 * wind_speed) * 1e-3,
        DragLaw::Fixed => 0.00144,
    };
    coefficient.sqrt() * wind_speed
}

/// Inverse wave age of a sea that has grown over a fetch.
///
/// ```text
/// Ω_c = 0.84 tanh[(X/X₀)^0.4]^(−0.75),   X = g F/U₁₀²,  X₀ = 2.2·10⁴
/// ```
///
/// - `wind_speed` U₁₀ [m/s], at least 0; `fetch` F \[m\], above 0
/// - returns `Ω_c` \[1\], at least 0.84
///
/// # References
///
/// Elfouhaily et al. (1997), J. Geophys. Res. 102, Eq. 37.
#[must_use]
pub fn inverse_wave_age(wind_speed: f64, fetch: f64) -> f64 {
    let dimensionless = GRAVITY * fetch / wind_speed.powi(2);
    FULLY_DEVELOPED
        * (dimensionless / DEVELOPED_FETCH)
            .powf(0.4)
            .tanh()
            .powf(-0.75)
}

/// Spectrum of one sea, with precomputed constants for its wind and wave age.
///
/// ```text
/// B = B_l + B_h = k³ S(k),        Ψ = B/k⁴ · (1 + Δ cos 2(φ − φ_wind))/(2π)
/// B_l = ½ α_p (c_p/c) L J exp[−(Ω/√10)(√(k/k_p) − 1)]
/// B_h = ½ α_m (c_m/c) L J exp[−¼(k/k_m − 1)²]
/// L = exp[−(5/4)(k_p/k)²]   J = γ^Γ   Γ = exp[−(√(k/k_p) − 1)²/(2σ²)]   c² = (g/k)(1 + (k/k_m)²)
/// k_p = g Ω²/U²   α_p = 0.006 √Ω   σ = 0.08(1 + 4Ω⁻³)   γ = 1.7 (Ω ≤ 1), 1.7 + 6 log₁₀ Ω (1 < Ω ≤ 5)
/// α_m = 0.01(1 + ln(u*/c_m)) if u* ≤ c_m, else 0.01(1 + 3 ln(u*/c_m))
/// ```
///
/// # Validity
///
/// Deep water, Ω from 0.84 to 5. For younger seas γ keeps its value at Ω = 5. `α_m` turns negative for u* < `c_m`/e (wind
/// below 2.7 m/s with Wu's drag) and is then set to 0, leaving only the tail of the long waves. Without wind every value is
/// 0.
///
/// # References
///
/// Elfouhaily, Chapron, Katsaros and Vandemark (1997), J. Geophys. Res. 102(C7), 15781.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elfouhaily {
    gravity: f64,
    inverse_wave_age: f64,
    friction_velocity: f64,
    peak_wavenumber: f64,
    peak_speed: f64,
    long_level: f64,
    short_level: f64,
    peak_width: f64,
    ln_enhancement: f64,
}

impl Elfouhaily {
    /// Sea raised by a wind U₁₀ [m/s] over a fetch \[m\].
    #[must_use]
    pub fn new(wind_speed: f64, fetch: f64) -> Self {
        Self::of_age(
            wind_speed,
            inverse_wave_age(wind_speed, fetch),
            DragLaw::default(),
        )
    }

    /// Sea of a wind U₁₀ [m/s] and an inverse wave age Ω \[1\], at least 0.84, under a drag law.
    #[must_use]
    pub fn of_age(wind_speed: f64, inverse_wave_age: f64, drag: DragLaw) -> Self {
        Self::under_gravity(wind_speed, inverse_wave_age, drag, GRAVITY)
    }

    fn under_gravity(wind_speed: f64, omega: f64, drag: DragLaw, gravity: f64) -> Self {
        let friction_velocity = friction_velocity(wind_speed, drag);
        let peak_wavenumber = gravity * (omega / wind_speed).powi(2);
        let enhancement = 1.7 + 6.0 * omega.clamp(1.0, YOUNGEST_SEA).log10();
        Self {
            gravity,
            inverse_wave_age: omega,
            friction_velocity,
            peak_wavenumber,
            peak_speed: (gravity / peak_wavenumber).sqrt(),
            long_level: 0.006 * omega.sqrt(),
            short_level: short_level(friction_velocity),
            peak_width: 0.08 * (1.0 + 4.0 * omega.powi(-3)),
            ln_enhancement: enhancement.ln(),
        }
    }

    /// Inverse wave age Ω \[1\].
    #[must_use]
    pub fn inverse_wave_age(&self) -> f64 {
        self.inverse_wave_age
    }

    /// Friction velocity u* [m/s].
    #[must_use]
    pub fn friction_velocity(&self) -> f64 {
        self.friction_velocity
    }

    /// Wavenumber `k_p` of the spectral peak [rad/m]; infinite without wind.
    #[must_use]
    pub fn peak_wavenumber(&self) -> f64 {
        self.peak_wavenumber
    }

    /// Whether there is no wind and hence no wave.
    #[inline(always)]
    pub(crate) fn is_flat(&self) -> bool {
        self.peak_wavenumber.is_infinite()
    }

    /// Phase speed c [m/s] in this model's form: deep water, with surface tension.
    #[must_use]
    #[inline(always)]
    pub fn phase_speed(&self, wavenumber: f64) -> f64 {
        (self.gravity / wavenumber * (1.0 + (wavenumber / SLOWEST_WAVENUMBER).powi(2))).sqrt()
    }

    /// Curvature spectrum B(k) = k³ S(k) \[1\]; 0 at k ≤ 0 and without wind.
    #[must_use]
    pub fn curvature(&self, wavenumber: f64) -> f64 {
        if wavenumber <= 0.0 || self.is_flat() {
            return 0.0;
        }
        self.curvature_by(wavenumber, f64::exp)
    }

    /// B(k) at k above 0 for a sea with wind, using the given exponential function.
    #[inline(always)]
    fn curvature_by(&self, k: f64, exp: impl Fn(f64) -> f64) -> f64 {
        let age = (k / self.peak_wavenumber).sqrt() - 1.0;
        let distance = age / self.peak_width;
        // At nine widths from the peak Γ is below rounding, which saves the exponential for the radar's short waves.
        let peak = if distance < 9.0 {
            exp(-0.5 * distance * distance)
        } else {
            0.0
        };
        let shape = exp(self.ln_enhancement * peak - 1.25 * (self.peak_wavenumber / k).powi(2));
        let long =
            self.long_level * self.peak_speed * exp(-self.inverse_wave_age / 10f64.sqrt() * age);
        let short =
            self.short_level * SLOWEST_SPEED * exp(-0.25 * (k / SLOWEST_WAVENUMBER - 1.0).powi(2));
        0.5 * (long + short) / self.phase_speed(k) * shape
    }

    /// Omnidirectional spectrum S(k) \[m³\]; 0 at k ≤ 0.
    #[must_use]
    pub fn spectrum(&self, wavenumber: f64) -> f64 {
        let curvature = self.curvature(wavenumber);
        if curvature > 0.0 {
            curvature / wavenumber.powi(3)
        } else {
            0.0
        }
    }

    /// Anisotropy Δ(k) \[1\]: excess of waves along the wind over waves across it.
    ///
    /// ```text
    /// D(k, φ) = (1 + Δ cos 2φ)/(2π),   Δ = tanh[ln2/4 + 4 (c/c_p)^2.5 + 0.13 (u*/c_m)(c_m/c)^2.5]
    /// ```
    #[must_use]
    pub fn anisotropy(&self, wavenumber: f64) -> f64 {
        self.anisotropy_by(wavenumber, f64::exp)
    }

    /// Δ(k) using the given exponential function.
    #[inline(always)]
    fn anisotropy_by(&self, wavenumber: f64, exp: impl Fn(f64) -> f64) -> f64 {
        let c = self.phase_speed(wavenumber);
        let to_two_and_half = |ratio: f64| ratio * ratio * ratio.sqrt();
        let long = 4.0 * to_two_and_half(c / self.peak_speed);
        let wind = 0.13 * self.friction_velocity / SLOWEST_SPEED;
        let x = LN_2 / 4.0 + long + wind * to_two_and_half(SLOWEST_SPEED / c);
        // tanh x by one exponential; x is far enough from 0 to avoid cancellation.
        2.0 / (1.0 + exp(-2.0 * x)) - 1.0
    }

    /// Spectral density Ψ(kx, ky) \[m⁴\], two-sided and even.
    ///
    /// - `k` [rad/m]; `wind`: unit vector of the wind direction (toward)
    #[must_use]
    pub fn density(&self, k: [f64; 2], wind: [f64; 2]) -> f64 {
        if self.is_flat() {
            return 0.0;
        }
        self.density_by(k, wind, f64::exp)
    }

    /// Ψ(kx, ky) for a sea with wind, using the given exponential function.
    #[inline(always)]
    pub(crate) fn density_by(
        &self,
        k: [f64; 2],
        wind: [f64; 2],
        exp: impl Fn(f64) -> f64 + Copy,
    ) -> f64 {
        let squared = k[0] * k[0] + k[1] * k[1];
        let along = k[0] * wind[0] + k[1] * wind[1];
        let cos_twice = 2.0 * along * along / squared - 1.0;
        let anisotropy = self.anisotropy_by(squared.sqrt(), exp);
        let spread = (1.0 + anisotropy * cos_twice) / (2.0 * PI);
        let curvature = self.curvature_by(squared.sqrt(), exp);
        // Where there is no wave, as at k = 0, the other factors may be NaN.
        if curvature > 0.0 {
            curvature / (squared * squared) * spread
        } else {
            0.0
        }
    }

    /// Slope variances along and across the wind of all waves from `low` to `high` \[1\].
    ///
    /// ```text
    /// mss_up, mss_cross = ∫ k² S ½(1 ± Δ/2) dk = ∫ B ½(1 ± Δ/2) d ln k
    /// ```
    ///
    /// - `low`, `high` wavenumbers [rad/m], from 0 to infinity; no waves if `high` ≤ `low`
    ///
    /// Gauss–Legendre panels no wider than ½ in ln k, which resolve the spectral peak to 1 part in 10⁶.
    #[must_use]
    pub fn slope_variance(&self, low: f64, high: f64) -> [f64; 2] {
        let low = low.max(self.peak_wavenumber / 10.0);
        let high = high.min((20.0 * SLOWEST_WAVENUMBER).max(1e4 * self.peak_wavenumber));
        if low >= high || self.is_flat() {
            return [0.0; 2];
        }
        let rule = GaussLegendre::new(5);
        let panels = ((high / low).ln() / 0.5).ceil();
        let width = (high / low).ln() / panels;
        let mut sum = [0.0; 2];
        for panel in 0..panels as usize {
            let from = low.ln() + width * panel as f64;
            for (log, weight) in rule.on(from, from + width) {
                let k = log.exp();
                let share = weight * 0.5 * self.curvature(k);
                let half = 0.5 * self.anisotropy(k);
                sum[0] += share * (1.0 + half);
                sum[1] += share * (1.0 - half);
            }
        }
        sum
    }
}

/// Level `α_m` of the short waves \[1\], at least 0.
fn short_level(friction_velocity: f64) -> f64 {
    let log = (friction_velocity / SLOWEST_SPEED).ln();
    let slope = if log <= 0.0 { 1.0 } else { 3.0 };
    (0.01 * (1.0 + slope * log)).max(0.0)
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    /// The gravity of the reference table.
    const TABLE_GRAVITY: f64 = 9.81;

    fn developed(wind: f64, drag: DragLaw) -> Elfouhaily {
        Elfouhaily::under_gravity(wind, FULLY_DEVELOPED, drag, TABLE_GRAVITY)
    }

    fn close(value: f64, expected: f64, relative: f64) {
        assert!(
            (value / expected - 1.0).abs() < relative,
            "{value} is not {expected}"
        );
    }

    /// Six-digit values from the independent implementation `tests/reference/sea_and_scattering.py`.
    #[test]
    fn curvature_and_anisotropy_meet_the_reference() {
        let k = [1.0, 10.0, 100.0, 200.0, 370.0];
        let five = [4.71048e-3, 4.98731e-3, 2.54506e-3, 3.03164e-3, 3.42216e-3];
        let three = [2.44441e-3, 5.02574e-3, 2.25637e-3, 1.18660e-3, 7.22875e-4];
        let delta = [0.7517, 0.2174, 0.2129, 0.2453, 0.2627];
        for n in 0..5 {
            close(developed(5.0, DragLaw::Wu).curvature(k[n]), five[n], 3e-6);
            close(developed(3.0, DragLaw::Wu).curvature(k[n]), three[n], 3e-6);
            close(developed(5.0, DragLaw::Wu).anisotropy(k[n]), delta[n], 3e-4);
        }
    }

    /// Wave height, peak and slope variances from the same implementation; four digits, so half a unit of the last.
    #[test]
    fn moments_meet_the_reference() {
        let table = [
            (3.0, 0.230, 8.2, 0.02259, 0.01384, 0.00875),
            (5.0, 0.648, 22.7, 0.03167, 0.01894, 0.01273),
            (7.0, 1.277, 44.5, 0.04021, 0.02382, 0.01639),
        ];
        for (wind, height, length, total, up, cross) in table {
            let sea = developed(wind, DragLaw::Wu);
            assert!((significant_height(&sea) - height).abs() < 6e-4, "{wind}");
            assert!((2.0 * PI / sea.peak_wavenumber() - length).abs() < 0.06);
            let variance = sea.slope_variance(0.0, f64::INFINITY);
            assert!((variance[0] - up).abs() < 6e-6, "{variance:?}");
            assert!((variance[1] - cross).abs() < 6e-6, "{variance:?}");
            assert!((variance[0] + variance[1] - total).abs() < 6e-6);
        }
    }

    /// Hs = 4 √∫S dk by the trapezoidal rule in ln k, with 400 steps per octave.
    fn significant_height(sea: &Elfouhaily) -> f64 {
        let step = LN_2 / 400.0;
        let sum: f64 = (-1600..16_000)
            .map(|n| {
                let k = sea.peak_wavenumber() * (f64::from(n) * step).exp();
                sea.spectrum(k) * k * step
            })
            .sum();
        4.0 * sum.sqrt()
    }

    /// Growing seas from the same implementation.
    #[test]
    fn a_fetch_makes_the_reference_seas() {
        let table = [
            (3.0, 1e4, 1.176, 0.128, 4.16, 0.0187),
            (5.0, 4e4, 1.094, 0.406, 13.38, 0.0284),
            (7.0, 7e4, 1.118, 0.775, 25.11, 0.0367),
        ];
        for (wind, fetch, age, height, length, mss) in table {
            let sea = Elfouhaily::new(wind, fetch);
            // One unit of the last digit: half for rounding, half for gravity 9.80665 against 9.81.
            assert!((sea.inverse_wave_age() - age).abs() < 1e-3);
            assert!((significant_height(&sea) - height).abs() < 1e-3);
            assert!((2.0 * PI / sea.peak_wavenumber() - length).abs() < 0.02);
            let [up, cross] = sea.slope_variance(0.0, f64::INFINITY);
            assert!((up + cross - mss).abs() < 1e-4);
        }
        close(inverse_wave_age(5.0, 1e9), FULLY_DEVELOPED, 1e-9);
    }

    /// The documented variant: a fixed drag raises the slopes at low wind.
    #[test]
    fn fixed_drag_meets_its_reference() {
        for (wind, mss) in [
            (3.0, 0.02543),
            (5.0, 0.03359),
            (7.0, 0.04343),
            (10.0, 0.06031),
        ] {
            let [up, cross] = developed(wind, DragLaw::Fixed).slope_variance(0.0, f64::INFINITY);
            assert!((up + cross - mss).abs() < 6e-6, "{wind} {}", up + cross);
        }
    }

    /// Optical slopes of a clean sea (Cox and Munk 1954): total 0.003 + 0.00512 U, within 25 %.
    #[test]
    fn slopes_agree_with_cox_and_munk() {
        for wind in 3..=15 {
            let wind = f64::from(wind);
            let [up, cross] = Elfouhaily::of_age(wind, FULLY_DEVELOPED, DragLaw::Wu)
                .slope_variance(0.0, f64::INFINITY);
            close(up + cross, 0.003 + 0.00512 * wind, 0.25);
        }
    }

    #[test]
    fn slope_variances_add_up_over_bands() {
        let sea = Elfouhaily::new(7.0, 4e4);
        let whole = sea.slope_variance(0.0, f64::INFINITY);
        let parts = [(0.0, 0.3), (0.3, 7.0), (7.0, 7.0), (7.0, 7e5), (9.0, 3.0)];
        let sum = parts.iter().fold([0.0; 2], |s, &(low, high)| {
            let v = sea.slope_variance(low, high);
            [s[0] + v[0], s[1] + v[1]]
        });
        // Different panels: the agreement is the accuracy of the quadrature.
        close(sum[0], whole[0], 1e-6);
        close(sum[1], whole[1], 1e-6);
    }

    /// Ψ integrates over direction to S/k, is even, and is largest along the wind.
    #[test]
    fn density_spreads_the_spectrum() {
        let (sea, wind) = (Elfouhaily::new(6.0, 3e4), [0.6, -0.8]);
        for k in [0.2f64, 3.0, 200.0] {
            let n = 8;
            let sum: f64 = (0..n)
                .map(|i| {
                    let (sin, cos) = (2.0 * PI * f64::from(i) / f64::from(n)).sin_cos();
                    sea.density([k * cos, k * sin], wind) * 2.0 * PI / f64::from(n)
                })
                .sum();
            close(sum, sea.spectrum(k) / k, 1e-12);
            let along = sea.density([k * wind[0], k * wind[1]], wind);
            close(
                sea.density([-k * wind[0], -k * wind[1]], wind),
                along,
                1e-12,
            );
            assert!(along > sea.density([-k * wind[1], k * wind[0]], wind));
        }
    }

    /// Zero without wind; below 2.7 m/s no short waves, but never a negative spectrum.
    #[test]
    fn low_winds_stay_finite() {
        for wind in [0.0, 1e-200, 1e-3, 0.5, 2.0, 2.7] {
            let sea = Elfouhaily::new(wind, 4e4);
            assert!(sea.short_level <= 0.0, "{wind}");
            for k in [0.0, 1e-200, 1e-90, 1e-6, 1.0, 370.0, 1e6] {
                let psi = sea.density([k, 0.0], [1.0, 0.0]);
                assert!(psi.is_finite() && psi >= 0.0, "{wind} {k}");
            }
            let [up, cross] = sea.slope_variance(0.0, f64::INFINITY);
            assert!(up.is_finite() && cross >= 0.0);
        }
        assert_eq!(Elfouhaily::new(0.0, 4e4).slope_variance(0.0, 1e9), [0.0; 2]);
        assert!(Elfouhaily::new(2.72, 4e4).short_level > 0.0);
    }

    /// The shortest fetch with the strongest wind lies beyond Ω = 5 and gives a finite spectrum.
    #[test]
    fn very_young_seas_stay_finite() {
        let sea = Elfouhaily::new(30.0, 100.0);
        assert!(sea.inverse_wave_age() > YOUNGEST_SEA);
        let [up, cross] = sea.slope_variance(0.0, f64::INFINITY);
        assert!(up > cross && cross > 0.0 && up < 1.0);
    }
}
