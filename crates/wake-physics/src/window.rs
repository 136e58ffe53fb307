//! Windows over the bandwidth of a radar, and their impulse responses.
//!
//! A window weights the spectrum over a bandwidth B: `W(f)` at the frequency f/B from −½ to ½. Distances are in units
//! of 1/B:
//!
//! ```text
//! h(x)  = ∫W(f) e^{2πifx} df / ∫W df            response in amplitude to a point
//! ρ²(x) = |∫W² e^{2πifx} df / ∫W² df|²          correlation of the intensity of a rough surface at the distance x
//! ```

use crate::numeric::{GaussLegendre, root};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

/// Quadrature rule for integrals over the window: exact up to rounding to the distance [`FARTHEST`].
static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(96));

/// Bisection steps of the searches for zeros.
const HALVINGS: usize = 60;

/// Farthest sidelobe considered \[1/B\].
const FARTHEST: f64 = 20.0;

/// Weight over the bandwidth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Window {
    /// W = 1: the narrowest response, with sidelobes of −13 dB.
    Uniform,
    /// W = α + (1 − α) cos 2πf with α from 0.5 to 1; Hamming's own value is 0.54.
    Hamming(f64),
    /// W = I₀(β√(1 − 4f²))/I₀(β) with β from 0 to 10.
    Kaiser(f64),
}

impl Window {
    /// W at the frequency f/B; 0 outside −½ to ½.
    #[must_use]
    pub fn weight(self, f: f64) -> f64 {
        if f.abs() > 0.5 {
            return 0.0;
        }
        match self {
            Self::Uniform => 1.0,
            Self::Hamming(alpha) => alpha + (1.0 - alpha) * (TAU * f).cos(),
            Self::Kaiser(beta) => {
                bessel_i0(beta * (1.0 - 4.0 * f * f).max(0.0).sqrt()) / bessel_i0(beta)
            }
        }
    }

    /// Response in amplitude h, 1 at distance 0.
    ///
    /// - `x`: distance \[1/B\]
    #[must_use]
    pub fn response(self, x: f64) -> f64 {
        match self {
            Self::Uniform => sinc(x),
            Self::Hamming(alpha) => {
                let sides = 0.5 * (1.0 - alpha) * (sinc(x - 1.0) + sinc(x + 1.0));
                sinc(x) + sides / alpha
            }
            Self::Kaiser(beta) => {
                let of = |square: f64| {
                    let root = square.abs().sqrt();
                    match square {
                        _ if root < 1e-6 => 1.0,
                        s if s > 0.0 => root.sinh() / root,
                        _ => root.sin() / root,
                    }
                };
                of(beta * beta - (PI * x).powi(2)) / of(beta * beta)
            }
        }
    }

    /// Resolution ρB: the full width of h² at half its peak \[1/B\].
    #[must_use]
    pub fn width(self) -> f64 {
        let half = |x: f64| self.response(x).powi(2) - 0.5;
        2.0 * root(half, [0.0, self.first_null()], HALVINGS)
    }

    /// Loss of a point's peak relative to the matched filter \[dB\]: −10 log₁₀ (∫W df)²/∫W² df.
    #[must_use]
    pub fn loss(self) -> f64 {
        -10.0 * (self.moment(1).powi(2) / self.moment(2)).log10()
    }

    /// Correlation ρ² of the intensity of a rough surface at distance x \[1/B\].
    #[must_use]
    pub fn correlation(self, x: f64) -> f64 {
        let panels = (x.abs() / FARTHEST).ceil().max(1.0);
        let panel = |n: u32| {
            let ends = [n, n + 1].map(|n| f64::from(n) / panels - 0.5);
            RULE.integrate(ends, |f| self.weight(f).powi(2) * (TAU * f * x).cos())
        };
        let transform: f64 = (0..panels as u32).map(panel).sum();
        (transform / self.moment(2)).powi(2)
    }

    /// Intensity transfer function at the frequency f/B, 1 at 0: ∫W(u − f/2) W(u + f/2) du/∫W² du; 0 for f ≥ 1.
    #[must_use]
    pub fn intensity_transfer(self, f: f64) -> f64 {
        let shared = (1.0 - f.abs()).max(0.0);
        let pair = |u: f64| self.weight(u * shared - 0.5 * f) * self.weight(u * shared + 0.5 * f);
        shared * over_band(pair) / self.moment(2)
    }

    /// Largest correlation between two pixels of a row or a column.
    ///
    /// - `pixels`: pixel spacing over resolution, above 0
    ///
    /// Where it is small, independent pixels suffice: at a spacing of 1.5 resolutions it is 0.042 (uniform) and 0.002
    /// (Hamming 0.75), at one resolution 0.016 and 0.099.
    #[must_use]
    pub fn pixel_correlation(self, pixels: f64) -> f64 {
        let step = pixels * self.width();
        let lags = (FARTHEST / step).floor().max(1.0) as u32;
        (1..=lags)
            .map(|lag| self.correlation(f64::from(lag) * step))
            .fold(0.0, f64::max)
    }

    /// Equivalent number of `count` looks, each of bandwidth B, that overlap by the given share of it.
    ///
    /// ```text
    /// K/(1 + 2 Σ (1 − k/K) r_k),     r_k = [∫W(f) W(f − k(1 − overlap)) df / ∫W² df]²
    /// ```
    ///
    /// - `count` K, at least 1; `overlap` 0 to 1
    #[must_use]
    pub fn overlapping_looks(self, count: u32, overlap: f64) -> f64 {
        equivalent(count, |k| {
            self.look_correlation(f64::from(k) * (1.0 - overlap))
        })
    }

    /// Correlation of two looks whose bands are `shift` bandwidths apart.
    fn look_correlation(self, shift: f64) -> f64 {
        if shift >= 1.0 {
            return 0.0;
        }
        let common = RULE.integrate([shift - 0.5, 0.5], |f| {
            self.weight(f) * self.weight(f - shift)
        });
        (common / self.moment(2)).powi(2)
    }

    /// ∫Wⁿ df.
    fn moment(self, power: i32) -> f64 {
        over_band(|f| self.weight(f).powi(power))
    }

    /// Distance of the first null of h \[1/B\].
    fn first_null(self) -> f64 {
        let step = 0.01;
        let mut x = 0.5;
        while self.response(x + step) > 0.0 && x < FARTHEST {
            x += step;
        }
        root(|x| self.response(x), [x, x + step], HALVINGS)
    }
}

/// Number of independent values in a sum of `count` values whose correlation at a lag is `correlation(lag)`.
fn equivalent(count: u32, correlation: impl Fn(u32) -> f64) -> f64 {
    let n = f64::from(count.max(1));
    let pairs: f64 = (1..count)
        .map(|lag| (1.0 - f64::from(lag) / n) * correlation(lag))
        .sum();
    n / (1.0 + 2.0 * pairs)
}

/// Integral over the bandwidth.
fn over_band(f: impl Fn(f64) -> f64) -> f64 {
    RULE.integrate([-0.5, 0.5], f)
}

/// sin πx/(πx).
pub(crate) fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    if angle.abs() < 1e-6 {
        1.0 - angle * angle / 6.0
    } else {
        angle.sin() / angle
    }
}

/// Modified Bessel function I₀ by its power series Σ (x²/4)ⁿ/n!², for x from 0 to 20.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for n in 1..60 {
        term *= quarter / f64::from(n * n);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOWS: [Window; 5] = [
        Window::Uniform,
        Window::Hamming(0.75),
        Window::Hamming(0.70),
        Window::Hamming(0.54),
        Window::Kaiser(2.5),
    ];

    /// Characteristic figures of windows.
    impl Window {
        /// Highest sidelobe of h² over its peak \[dB\].
        fn peak_sidelobe(self) -> f64 {
            let null = self.first_null();
            let count = 4000;
            let step = (FARTHEST - null) / f64::from(count);
            let at = |i| self.response(null + step * f64::from(i)).powi(2);
            10.0 * (0..=count).map(at).fold(0.0, f64::max).log10()
        }

        /// Length over which the intensity is correlated, ∫ρ² dx = ∫W⁴ df/(∫W² df)² \[1/B\].
        ///
        /// Pixels of a smaller spacing hold less than one independent sample each.
        fn correlation_length(self) -> f64 {
            self.moment(4) / self.moment(2).powi(2)
        }
    }

    /// Figures of the windows, computed by another program from the same definitions, to the last printed digit.
    #[test]
    fn resolution_sidelobes_and_loss() {
        let expected = [
            [0.886, -13.3, 0.0, 1.000],
            [1.000, -21.2, 0.23, 1.201],
            [1.042, -24.1, 0.38, 1.312],
            [1.303, -42.7, 1.34, 1.817],
            [1.042, -20.9, 0.36, 1.264],
        ];
        for (window, [width, peak, loss, length]) in WINDOWS.into_iter().zip(expected) {
            // Half a unit of the last printed digit.
            assert!((window.width() - width).abs() < 6e-4, "{window:?}");
            assert!((window.peak_sidelobe() - peak).abs() < 0.06, "{window:?}");
            assert!((window.loss() - loss).abs() < 6e-3, "{window:?}");
            assert!(
                (window.correlation_length() - length).abs() < 6e-4,
                "{window:?}"
            );
        }
        // In closed form: the first sidelobe of sinc² is −13.26 dB; half power at πx = 1.39156.
        assert!((Window::Uniform.peak_sidelobe() + 13.2615).abs() < 1e-3);
        assert!((Window::Uniform.width() - 2.0 * 1.391_557_378 / PI).abs() < 1e-9);
    }

    /// For a uniform window the triangle 1 − |f|; for all windows the numerical transform of |h|².
    #[test]
    fn the_transfer_of_the_intensity_is_that_of_the_squared_response() {
        for f in [0.0, 0.2, 0.5, 0.9, 1.0, 1.3] {
            let triangle = (1.0 - f64::abs(f)).max(0.0);
            assert!((Window::Uniform.intensity_transfer(f) - triangle).abs() < 1e-12);
        }
        for window in WINDOWS {
            for f in [0.1, 0.4, 0.8] {
                let (step, farthest) = (5e-3, 200.0);
                let count = (farthest / step) as u32;
                let sum = |k: f64| -> f64 {
                    let at = |n: u32| (f64::from(n) + 0.5) * step;
                    (0..count)
                        .map(|n| window.response(at(n)).powi(2) * (TAU * k * at(n)).cos())
                        .sum()
                };
                // Beyond 200 resolutions, |h|² leaves at most 1/(2π² · 200) of the total.
                let found = sum(f) / sum(0.0);
                assert!(
                    (window.intensity_transfer(f) - found).abs() < 5e-4,
                    "{window:?} {f}"
                );
            }
        }
    }

    #[test]
    fn correlation_of_pixels() {
        let expected = [
            [0.849, 0.500, 0.174, 0.016, 0.042],
            [0.879, 0.590, 0.293, 0.099, 0.002],
            [0.887, 0.615, 0.328, 0.130, 0.008],
            [0.907, 0.674, 0.408, 0.198, 0.022],
            [0.884, 0.604, 0.308, 0.108, 0.001],
        ];
        for (window, expected) in WINDOWS.into_iter().zip(expected) {
            for (pixels, value) in [0.25, 0.5, 0.75, 1.0, 1.5].into_iter().zip(expected) {
                let found = window.correlation(pixels * window.width());
                assert!((found - value).abs() < 6e-4, "{window:?} {pixels}: {found}");
            }
        }
        // Uniform: sinc², in closed form.
        for x in [0.1, 0.7, 3.3, 17.2, 31.5, 287.3] {
            assert!((Window::Uniform.correlation(x) - sinc(x).powi(2)).abs() < 1e-12);
        }
        // Hamming: W² is a sum of three cosines.
        let (a, b) = (0.6, 0.4);
        for x in [0.7, 17.2, 31.5, 287.3] {
            let pair = |n: f64| 0.5 * (sinc(x - n) + sinc(x + n));
            let square = |pair: &dyn Fn(f64) -> f64| {
                (a * a + 0.5 * b * b) * pair(0.0)
                    + 2.0 * a * b * pair(1.0)
                    + 0.5 * b * b * pair(2.0)
            };
            let norm = a * a + 0.5 * b * b;
            let expected = (square(&pair) / norm).powi(2);
            assert!((Window::Hamming(a).correlation(x) - expected).abs() < 1e-12);
        }
        assert!((Window::Uniform.pixel_correlation(1.5) - 0.042).abs() < 6e-4);
        assert!((Window::Hamming(0.75).pixel_correlation(1.0) - 0.099).abs() < 6e-4);
        // Uniform: at half a resolution, lag 1; at 1.13 resolutions the nearest lag is a null, and so is the next.
        assert!(Window::Uniform.pixel_correlation(1.0 / Window::Uniform.width()) < 1e-12);
    }

    /// Closed forms of the response against quadrature over the window.
    #[test]
    fn response_is_the_transform_of_the_window() {
        for window in WINDOWS {
            for x in [0.0, 0.3, 0.5, 0.795_774_7, 1.0, 2.6, 11.0, -1.4] {
                let integral = over_band(|f| window.weight(f) * (TAU * f * x).cos());
                let expected = integral / over_band(|f| window.weight(f));
                assert!(
                    (window.response(x) - expected).abs() < 1e-12,
                    "{window:?} {x}"
                );
            }
        }
    }

    #[test]
    fn limits_are_the_uniform_window() {
        for f in [-0.5, -0.2, 0.0, 0.37] {
            assert!((Window::Hamming(1.0).weight(f) - 1.0).abs() < 1e-15);
            assert!((Window::Kaiser(0.0).weight(f) - 1.0).abs() < 1e-15);
        }
        assert!(Window::Uniform.weight(0.500_1).abs() < f64::MIN_POSITIVE);
        // I₀(1) and I₀(10), Abramowitz and Stegun (1964), table 9.8 and its scaled form.
        assert!((bessel_i0(1.0) - 1.266_065_877_752_008).abs() < 1e-14);
        assert!((bessel_i0(10.0) / 2_815.716_628_466_254 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn looks_that_overlap_are_worth_less() {
        let hamming = Window::Hamming(0.70);
        assert!((hamming.look_correlation(0.75) - 0.0138).abs() < 6e-5);
        for (window, count, overlap, expected) in [
            (hamming, 3, 0.25, 2.95),
            (hamming, 4, 0.25, 3.92),
            (hamming, 5, 0.25, 4.89),
            (Window::Uniform, 3, 0.25, 2.77),
            (Window::Uniform, 4, 0.25, 3.66),
            (Window::Uniform, 5, 0.25, 4.55),
            (Window::Uniform, 4, 0.5, 2.91),
            (Window::Uniform, 6, 0.0, 6.0),
        ] {
            let found = window.overlapping_looks(count, overlap);
            assert!((found - expected).abs() < 6e-3, "{window:?}: {found}");
        }
        // One band repeated K times is one look.
        assert!((Window::Uniform.overlapping_looks(7, 1.0) - 1.0).abs() < 1e-12);
    }

    /// A Sentinel-1 IW GRDH product: slant bandwidth 14.1 MHz at an incidence where ρ is 20.3 m, Hamming 0.70, 10 m pixels;
    /// azimuth unweighted, 18.4 m. Measured on its sea: 0.63 0.15 0.01 and 0.43 −0.01, each to ±0.01 for the size of the
    /// crop and ±0.005 of rounding; the annotated width is rounded to 0.05 m.
    #[test]
    fn lags_of_a_real_product() {
        let measured = [(Window::Hamming(0.70), 20.3, [0.63, 0.15, 0.01])];
        for (window, resolution, lags) in measured {
            for (n, lag) in lags.into_iter().enumerate() {
                let distance = (n + 1) as f64 * 10.0 / resolution * window.width();
                assert!((window.correlation(distance) - lag).abs() < 0.015);
            }
        }
        let step = 10.0 / 18.4 * Window::Uniform.width();
        assert!((Window::Uniform.correlation(step) - 0.43).abs() < 0.015);
        assert!((Window::Uniform.correlation(2.0 * step) + 0.01).abs() < 0.015);
        // Pixels per independent sample, each axis.
        let pixels = |w: Window, rho: f64| w.correlation_length() * rho / (10.0 * w.width());
        assert!((pixels(Window::Hamming(0.70), 20.3) - 2.56).abs() < 6e-3);
        assert!((pixels(Window::Uniform, 18.4) - 2.08).abs() < 6e-3);
    }
}
