//! Density of the wind sea over wavenumber vectors, and its variances over a band.

use crate::dispersion::{angular_frequency, depth_factor};
use crate::scene::{SpectrumModel, SpreadingModel};
use crate::spectrum::{Spectrum, deep_equivalent, from_deep_equivalent};
use crate::spreading::{Spread, Spreading};

/// Largest peak wavenumber [rad/m] (a wave of 0.06 mm); beyond it the sea is flat.
const LARGEST_PEAK: f64 = 1e5;

/// Parameters of a wind sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindSea {
    /// Wind speed at 10 m height U₁₀ [m/s], at least 0; 0 is a flat sea.
    pub wind_speed: f64,
    /// Wind direction (toward) [rad clockwise from +y].
    pub wind_toward: f64,
    /// Fetch F \[m\], above 0.
    pub fetch: f64,
    /// Water depth h \[m\], above 0, may be infinite.
    pub depth: f64,
    /// Spectrum of the waves.
    pub spectrum: SpectrumModel,
    /// Directional spreading of the waves.
    pub spreading: SpreadingModel,
}

/// Density Ψ(kx, ky) of a wind sea, with precomputed constants.
///
/// ```text
/// Ψ(k, δ) = S(k) D(k, δ)/k,   ∬Ψ dkx dky = ⟨ζ²⟩,   δ the angle between k and the wind
/// ```
///
/// Waves of density Ψ(k) travel along +k: Ψ is two-sided but not even.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalSpectrum {
    spectrum: Spectrum,
    spreading: Spreading,
    wind: [f64; 2],
    depth: f64,
    flat: bool,
}

/// Variances of the sea surface over a band of wavenumbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// ⟨ζ²⟩ \[m²\].
    pub elevation: f64,
    /// ⟨(∂ζ/∂x)²⟩ \[1\].
    pub slope_xx: f64,
    /// ⟨∂ζ/∂x ∂ζ/∂y⟩ \[1\].
    pub slope_xy: f64,
    /// ⟨(∂ζ/∂y)²⟩ \[1\].
    pub slope_yy: f64,
    /// `⟨v_r²⟩` [m²/s²], the velocity toward the radar squared.
    pub radial_velocity: f64,
    /// `⟨a_r²⟩` [m²/s⁴], the acceleration toward the radar squared.
    pub radial_acceleration: f64,
}

/// Waves of one wavenumber, see [`DirectionalSpectrum::ring`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    /// S(k)/k \[m⁴\].
    level: f64,
    spread: Spread,
}

impl Ring {
    /// Density Ψ \[m⁴\] of waves travelling at an angle to the wind, given its cosine.
    pub(crate) fn psi(&self, cos_angle: f64) -> f64 {
        self.level * self.spread.density(cos_angle)
    }
}

impl DirectionalSpectrum {
    /// Prepares the density of a sea.
    #[must_use]
    pub fn new(sea: &WindSea) -> Self {
        let spectrum = Spectrum::new(sea.spectrum, sea.wind_speed, sea.fetch);
        let peak = spectrum.peak_wavenumber();
        let spreading = Spreading::new(sea.spreading, sea.wind_speed, sea.fetch, peak);
        let (sin, cos) = sea.wind_toward.sin_cos();
        Self {
            spectrum,
            spreading,
            wind: [sin, cos],
            depth: sea.depth,
            // NaN counts as flat, too.
            flat: !(sea.wind_speed > 0.0 && peak < LARGEST_PEAK),
        }
    }

    /// Whether there are no waves.
    #[must_use]
    pub(crate) fn is_flat(&self) -> bool {
        self.flat
    }

    /// Unit vector (x, y) of the wind direction (toward).
    #[must_use]
    pub fn wind(&self) -> [f64; 2] {
        self.wind
    }

    /// Water depth \[m\].
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Spreading, as a function of the deep-water equivalent of k.
    #[must_use]
    pub fn spreading(&self) -> &Spreading {
        &self.spreading
    }

    /// Wavenumber of the peak of S(ω) over this depth [rad/m]; infinite without wind.
    #[must_use]
    pub fn peak_wavenumber(&self) -> f64 {
        from_deep_equivalent(self.spectrum.peak_wavenumber(), self.depth)
    }

    /// Omnidirectional spectrum S(k) \[m³\]; 0 at k ≤ 0 and on a flat sea.
    #[must_use]
    pub fn omnidirectional(&self, wavenumber: f64) -> f64 {
        if self.flat || wavenumber <= 0.0 {
            return 0.0;
        }
        let curvature = self
            .spectrum
            .curvature(deep_equivalent(wavenumber, self.depth));
        if curvature > 0.0 {
            curvature / wavenumber.powi(3)
        } else {
            0.0
        }
    }

    /// Density Ψ(kx, ky) \[m⁴\] of waves travelling along +k.
    #[must_use]
    pub fn psi(&self, [kx, ky]: [f64; 2]) -> f64 {
        let k = kx.hypot(ky);
        match self.ring(k) {
            Some(ring) => ring.psi((kx * self.wind[0] + ky * self.wind[1]) / k),
            None => 0.0,
        }
    }

    /// The waves of one wavenumber in all directions; `None` if there are none.
    pub(crate) fn ring(&self, wavenumber: f64) -> Option<Ring> {
        let s = self.omnidirectional(wavenumber);
        (s > 0.0).then(|| Ring {
            level: s / wavenumber,
            spread: self.spreading.at(deep_equivalent(wavenumber, self.depth)),
        })
    }

    /// Variances of the waves from `low` to `high` viewed at an incidence.
    ///
    /// ```text
    /// ⟨sx²⟩ = ∫k² S ½(1 + a₂ cos 2β) dk      ⟨v_r²⟩ = ∫ω² S [cos²θ + coth²(kh) sin²θ ½(1 + a₂ cos 2β)] dk
    /// ```
    ///
    /// with a₂ the second harmonic of the spreading and β the angle of the wind to +x. Integrated by Gauss–Legendre panels
    /// of 8 nodes, 0.3 wide in ln k, with a panel limit at the peak.
    ///
    /// - `low`, `high` wavenumbers [rad/m], from 0 to infinity (cut at 10⁵); no waves if `high` ≤ `low`
    /// - `incidence` θ \[rad\]
    #[must_use]
    pub fn moments(&self, low: f64, high: f64, incidence: f64) -> Moments {
        let mut moments = Moments::default();
        if self.flat {
            return moments;
        }
        // Below 0.15 k_p the factor exp[−(5/4)(k_p/k)²] is under 1e-24.
        let start = from_deep_equivalent(0.15 * self.spectrum.peak_wavenumber(), self.depth);
        let (low, high) = (low.max(start), high.min(LARGEST_PEAK));
        let peak = self.peak_wavenumber();
        if low < peak && peak < high {
            self.add_band([low, peak], incidence, &mut moments);
            self.add_band([peak, high], incidence, &mut moments);
        } else if low < high {
            self.add_band([low, high], incidence, &mut moments);
        }
        moments
    }

    fn add_band(&self, [low, high]: [f64; 2], incidence: f64, moments: &mut Moments) {
        let panels = ((high / low).ln() / 0.3).ceil().max(1.0);
        let half = 0.5 * (high / low).ln() / panels;
        for panel in 0..panels as usize {
            let middle = (2.0 * panel as f64 + 1.0) * half;
            for (node, weight) in GAUSS_8 {
                for sign in [-1.0, 1.0] {
                    let k = low * (middle + sign * node * half).exp();
                    self.add_node(k, half * weight * k, incidence, moments);
                }
            }
        }
    }

    fn add_node(&self, k: f64, width: f64, incidence: f64, moments: &mut Moments) {
        let variance = self.omnidirectional(k) * width;
        if variance <= 0.0 {
            return;
        }
        let [x, y] = self.wind;
        let tanh = depth_factor(k, self.depth);
        let second = self.spreading.second_harmonic(k * tanh);
        let along_x = 0.5 * (1.0 + second * (x * x - y * y));
        let omega2 = angular_frequency(k, self.depth).powi(2);
        let (sin, cos) = incidence.sin_cos();
        let toward = cos * cos + sin * sin * along_x / (tanh * tanh);
        moments.elevation += variance;
        moments.slope_xx += variance * k * k * along_x;
        moments.slope_yy += variance * k * k * (1.0 - along_x);
        moments.slope_xy += variance * k * k * second * x * y;
        moments.radial_velocity += variance * omega2 * toward;
        moments.radial_acceleration += variance * omega2 * omega2 * toward;
    }
}

/// Positive nodes and their weights of 8-node Gauss–Legendre quadrature on [−1, 1] (Abramowitz and Stegun, table 25.4).
pub(crate) const GAUSS_8: [(f64, f64); 4] = [
    (0.183434642495650, 0.362683783378362),
    (0.525532409916329, 0.313706645877887),
    (0.796666477413627, 0.222381034453374),
    (0.960289856497536, 0.101228536290376),
];

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "nothing is exactly 0")]
mod tests {
    use super::*;
    use crate::constants::GRAVITY;
    use crate::waves::{Quantity, Transfer};
    use std::f64::consts::{PI, TAU};

    const MODELS: [SpectrumModel; 3] = [
        SpectrumModel::Elfouhaily,
        SpectrumModel::Jonswap,
        SpectrumModel::PiersonMoskowitz,
    ];

    fn sea(spectrum: SpectrumModel, spreading: SpreadingModel) -> WindSea {
        WindSea {
            wind_speed: 6.0,
            wind_toward: 0.7,
            fetch: 3e4,
            depth: f64::INFINITY,
            spectrum,
            spreading,
        }
    }

    /// All variances against a plain double sum of Ψ|T|² over polar cells.
    #[test]
    fn moments_are_the_double_integral() {
        let incidence = 0.5;
        for (n, model) in MODELS.into_iter().enumerate() {
            let spreading = [
                SpreadingModel::Hasselmann,
                SpreadingModel::Elfouhaily,
                SpreadingModel::Mitsuyasu,
            ][n];
            let depth = [f64::INFINITY, 4.0, 1.5][n];
            let spectrum = DirectionalSpectrum::new(&WindSea {
                depth,
                ..sea(model, spreading)
            });
            let transfer = Transfer {
                depth,
                incidence,
                relaxation_rate: 1.0,
                action_slope: 4.5,
            };
            let (low, high) = (0.05, 40.0);
            let (radii, angles) = (600, 720);
            let step = f64::ln(high / low) / f64::from(radii);
            let mut expected = [0.0; 6];
            for r in 0..radii {
                let k = low * ((f64::from(r) + 0.5) * step).exp();
                let omega = angular_frequency(k, depth);
                for a in 0..angles {
                    let (sin, cos) = (TAU * f64::from(a) / f64::from(angles)).sin_cos();
                    let vector = [k * cos, k * sin];
                    let v = spectrum.psi(vector) * k * k * step * TAU / f64::from(angles);
                    let radial = transfer.radial(vector, omega).norm_sqr();
                    let acceleration = transfer
                        .factor(Quantity::RadialAcceleration, vector, omega)
                        .norm_sqr();
                    let [x, y] = vector;
                    for (sum, factor) in
                        expected
                            .iter_mut()
                            .zip([1.0, x * x, x * y, y * y, radial, acceleration])
                    {
                        *sum += v * factor;
                    }
                }
            }
            let m = spectrum.moments(low, high, incidence);
            let got = [
                m.elevation,
                m.slope_xx,
                m.slope_xy,
                m.slope_yy,
                m.radial_velocity,
                m.radial_acceleration,
            ];
            for (g, e) in got.iter().zip(expected) {
                // The sum's own error: the cusp of small exponents at δ = π costs up to one angular step, 1/720, of the few
                // waves there; the kink of the JONSWAP peak costs a squared step of 1e-4.
                assert!(
                    (g - e).abs() < 1e-3 * e.abs(),
                    "{model:?} {got:?} {expected:?}"
                );
            }
        }
    }

    /// Hs, and the mean square slope of the developed Elfouhaily sea with its own spreading (table 7.5).
    #[test]
    fn moments_meet_the_reference() {
        for (wind, height, up, cross) in [
            (3.0, 0.230, 0.01384, 0.00875),
            (5.0, 0.648, 0.01894, 0.01273),
            (7.0, 1.277, 0.02382, 0.01639),
        ] {
            let spectrum = DirectionalSpectrum::new(&WindSea {
                wind_speed: wind,
                wind_toward: PI / 2.0,
                fetch: 1e7,
                ..sea(SpectrumModel::Elfouhaily, SpreadingModel::Elfouhaily)
            });
            let m = spectrum.moments(0.0, f64::INFINITY, 0.0);
            // One unit of the last digit; the table uses g = 9.81.
            assert!((4.0 * m.elevation.sqrt() - height).abs() < 1.5e-3);
            assert!((m.slope_xx - up).abs() < 3e-5, "{m:?}");
            assert!((m.slope_yy - cross).abs() < 3e-5, "{m:?}");
            assert!(m.slope_xy.abs() < 1e-12);
        }
    }

    /// `σ_v` = 0.0646 U₁₉.₅ viewed from above (closed form), and parts that add up.
    #[test]
    fn vertical_velocity_of_the_developed_sea() {
        let spectrum = DirectionalSpectrum::new(&sea(
            SpectrumModel::PiersonMoskowitz,
            SpreadingModel::Hasselmann,
        ));
        // Surface tension matters beyond 30 rad/m, where 0.4 % of ∫ω²S is left: the sum stops there, and the remainder α
        // g/(2k) is added in closed form.
        let cut = 30.0;
        let m = spectrum.moments(0.0, cut, 0.0);
        let sigma = (m.radial_velocity + 0.5 * 0.0081 * GRAVITY / cut).sqrt();
        assert!(
            (sigma / (0.0646 * 1.026 * 6.0) - 1.0).abs() < 2e-3,
            "{sigma}"
        );
        let parts = [(0.0, 0.2), (0.2, 3.0), (3.0, cut), (5.0, 4.0)];
        let sum: f64 = parts
            .map(|(a, b)| spectrum.moments(a, b, 0.0).radial_velocity)
            .iter()
            .sum();
        assert!((sum / m.radial_velocity - 1.0).abs() < 1e-6);
    }

    /// Shallow water lowers the waves and shortens their peak; deep water of finite depth has no effect.
    #[test]
    fn depth_lowers_the_waves() {
        for model in MODELS {
            let at = |depth| {
                let spectrum = DirectionalSpectrum::new(&WindSea {
                    depth,
                    ..sea(model, SpreadingModel::Hasselmann)
                });
                (
                    spectrum.moments(0.0, 10.0, 0.5).elevation,
                    spectrum.peak_wavenumber(),
                )
            };
            let (deep, same) = (at(f64::INFINITY), at(500.0));
            assert!((same.0 / deep.0 - 1.0).abs() < 1e-9);
            let (mut energy, mut peak) = deep;
            for depth in [10.0, 4.0, 2.0, 1.0] {
                let (e, p) = at(depth);
                assert!(e <= energy && p >= peak, "{model:?} {depth}");
                (energy, peak) = (e, p);
            }
            assert!(energy < 0.9 * deep.0 && peak > 1.2 * deep.1);
        }
    }

    #[test]
    fn no_wind_no_waves() {
        for model in MODELS {
            for wind_speed in [0.0, 1e-200, 1e-3, f64::NAN] {
                let spectrum = DirectionalSpectrum::new(&WindSea {
                    wind_speed,
                    ..sea(model, SpreadingModel::Mitsuyasu)
                });
                assert!(spectrum.is_flat());
                assert_eq!(spectrum.psi([0.3, 0.2]), 0.0);
                assert_eq!(spectrum.moments(0.0, 1e9, 0.5), Moments::default());
            }
        }
    }

    /// Every extreme of the allowed scenes gives finite, non-negative values.
    #[test]
    fn corners_are_finite() {
        for model in MODELS {
            for spreading in [
                SpreadingModel::Hasselmann,
                SpreadingModel::Mitsuyasu,
                SpreadingModel::Elfouhaily,
            ] {
                for wind_speed in [0.1, 2.0, 30.0] {
                    for (fetch, depth) in [(100.0, 1.0), (1e7, 1.0), (100.0, f64::INFINITY)] {
                        let spectrum = DirectionalSpectrum::new(&WindSea {
                            wind_speed,
                            fetch,
                            depth,
                            ..sea(model, spreading)
                        });
                        let m = spectrum.moments(0.0, f64::INFINITY, 0.5);
                        assert!(m.elevation > 0.0 && m.elevation < 100.0, "{m:?}");
                        assert!(m.radial_acceleration.is_finite() && m.slope_xx >= 0.0);
                        for k in [1e-5, 0.01, 1.0, 1e3, 1e6] {
                            for direction in [[k, 0.0], [0.0, -k], [-k, k]] {
                                let psi = spectrum.psi(direction);
                                assert!(psi.is_finite() && psi >= 0.0);
                            }
                        }
                    }
                }
            }
        }
    }
}
