//! Relative permittivity of sea water.
//!
//! Time factor e^{−iωt}: the imaginary part is positive.

use num_complex::Complex64;

/// Vacuum part of the conductivity term, 1/(2π ε₀) in GHz·m/S.
const CONDUCTIVITY_SCALE: f64 = 17.97510;

/// Relative permittivity ε of sea water.
///
/// ```text
/// ε = (ε0 − ε1)/(1 − i f/ν1) + (ε1 − ε2)/(1 − i f/ν2) + ε2 + i σ·17.97510/f      (f, ν in GHz)
/// ```
///
/// - `frequency` \[Hz\], `temperature` T [°C], `salinity` S \[psu\]
///
/// # Validity
///
/// Up to 90 GHz, −2 to 30 °C (to 40 °C by the authors' linear continuation of ν1), 0 to 40 psu.
///
/// # References
///
/// Meissner and Wentz (2004), IEEE Trans. Geosci. Remote Sens. 42, 1836, with the coefficients revised in
/// Meissner and Wentz (2012), ibid. 50, 3004 (sign of d3 corrected) and Meissner et al. (2014).
#[must_use]
pub fn sea_water(frequency: f64, temperature: f64, salinity: f64) -> Complex64 {
    let gigahertz = frequency * 1e-9;
    let debye = DoubleDebye::new(temperature, salinity);
    let relaxation = |step: f64, at: f64| step / Complex64::new(1.0, -gigahertz / at);
    let [e0, e1, e2] = debye.levels;
    let [f1, f2] = debye.relaxation;
    let loss = conductivity(temperature, salinity) * CONDUCTIVITY_SCALE / gigahertz;
    relaxation(e0 - e1, f1) + relaxation(e1 - e2, f2) + Complex64::new(e2, loss)
}

/// The two relaxations: permittivities below, between and above them, and their frequencies \[GHz\].
struct DoubleDebye {
    levels: [f64; 3],
    relaxation: [f64; 2],
}

impl DoubleDebye {
    fn new(t: f64, s: f64) -> Self {
        let pure = Self::pure(t);
        let [e0, e1, e2] = pure.levels;
        let [f1, f2] = pure.relaxation;
        Self {
            levels: [
                e0 * (-3.33300e-3 * s + 4.74868e-6 * s * s).exp(),
                e1 * (-6.28908e-3 * s + 1.76032e-4 * s * s - 9.22144e-5 * s * t).exp(),
                e2 * (1.0 + s * (-2.04265e-3 + 1.57883e-4 * t)),
            ],
            relaxation: [
                f1 * (1.0 + s * salt_shift(t)),
                f2 * (1.0 + s * (-0.0199723 + 0.5 * 1.81176e-4 * (t + 30.0))),
            ],
        }
    }

    fn pure(t: f64) -> Self {
        Self {
            levels: [
                (37088.6 - 82.168 * t) / (421.854 + t),
                5.7230 + 0.022379 * t - 7.1237e-4 * t * t,
                3.6143 + 0.028841 * t,
            ],
            relaxation: [
                (45.0 + t) / (5.0478 - 0.070315 * t + 6.0059e-4 * t * t),
                (45.0 + t) / (0.13652 + 1.4825e-3 * t + 2.4166e-4 * t * t),
            ],
        }
    }
}

/// Relative shift of the first relaxation per psu: a quartic up to 30 °C, its tangent above.
fn salt_shift(t: f64) -> f64 {
    if t > 30.0 {
        return 9.1873715e-4 + 1.5012396e-4 * (t - 30.0);
    }
    2.3232e-3 + t * (-7.9208e-5 + t * (3.6764e-6 + t * (-3.5594e-7 + t * 8.9795e-9)))
}

/// Electrical conductivity σ of sea water [S/m] at T [°C] and S \[psu\].
///
/// # References
///
/// Stogryn et al. (1995), as used by Meissner and Wentz (2004), Eqs. 10–14.
#[must_use]
pub fn conductivity(temperature: f64, salinity: f64) -> f64 {
    let (t, s) = (temperature, salinity);
    let at_35_psu = 2.903602 + t * (0.08607 + t * (4.738817e-4 + t * (-2.991e-6 + t * 4.3047e-9)));
    let a0 = (6.9431 + 3.2841 * s - 0.099486 * s * s) / (84.85 + 69.024 * s + s * s);
    let a1 = 49.843 - 0.2276 * s + 0.00198 * s * s;
    at_35_psu * ratio_at_15_degrees(s) * (1.0 + (t - 15.0) * a0 / (a1 + t))
}

/// Conductivity at 15 °C relative to 35 psu, R15 \[1\].
fn ratio_at_15_degrees(s: f64) -> f64 {
    s * (37.5109 + 5.45216 * s + 0.014409 * s * s) / (1004.75 + 182.283 * s + s * s)
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    /// Values from the independent implementation `tests/reference/sea_and_scattering.py`, to five digits.
    #[test]
    fn permittivity_meets_the_reference() {
        for (frequency, re, im) in [
            (1.27e9, 71.444, 72.692),
            (5.405e9, 65.849, 34.941),
            (9.6e9, 56.063, 37.275),
        ] {
            let e = sea_water(frequency, 20.0, 35.0);
            assert!((e - Complex64::new(re, im)).norm() < 1e-3, "{e}");
        }
    }

    /// Klein and Swift (1977) and Stogryn et al. (1995), independent fits, agree within 2 % (they differ by 1.6 %).
    #[test]
    fn other_models_agree() {
        for (frequency, other) in [
            (5.405e9, Complex64::new(66.592, 34.972)),
            (5.405e9, Complex64::new(65.257, 34.139)),
            (9.6e9, Complex64::new(56.850, 37.455)),
            (9.6e9, Complex64::new(56.036, 36.322)),
        ] {
            let e = sea_water(frequency, 20.0, 35.0);
            assert!((e - other).norm() / e.norm() < 0.02, "{e} {other}");
        }
    }

    #[test]
    fn conductivity_meets_published_values() {
        assert!((ratio_at_15_degrees(35.0) - 1.0).abs() < 2e-5);
        assert!((conductivity(20.0, 35.0) - 4.7913).abs() < 1e-4);
        assert!((conductivity(15.0, 35.0) - 4.29).abs() < 5e-3);
        assert!((conductivity(25.0, 35.0) - 5.306).abs() < 5e-3);
        assert_eq!(conductivity(10.0, 0.0), 0.0);
    }

    /// The continuation above 30 °C matches the quartic's value and slope there, to the five digits of its coefficients.
    #[test]
    fn warm_water_continues_smoothly() {
        let (at, d) = (30.0, 1e-6);
        let above = salt_shift(at + d);
        assert!((above / salt_shift(at) - 1.0).abs() < 3e-6);
        let slope = (salt_shift(at) - salt_shift(at - d)) / d;
        let continued = (salt_shift(at + 1.0) - above) / (1.0 - d);
        assert!((continued / slope - 1.0).abs() < 1e-3);
    }

    /// Over the whole range of scenes, water is a passive, lossy dielectric.
    #[test]
    fn every_scene_has_a_lossy_dielectric() {
        for frequency in [1e9, 5e9, 2e10] {
            for t in [-2.0, 0.0, 30.0, 40.0] {
                for s in [0.0, 1.0, 35.0, 45.0] {
                    let e = sea_water(frequency, t, s);
                    assert!(e.re > 10.0 && e.re < 90.0 && e.im > 0.0, "{e}");
                }
            }
        }
    }
}
