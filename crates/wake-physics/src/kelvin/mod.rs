//! The Kelvin wake of a thin ship: the free waves that follow it, as plane waves.
//!
//! ```text
//! ζ(ξ, η) = Re ∫ A(θ) e^{ik(ξ cos θ + η sin θ)} dθ = Re ∫ a(u) e^{i(αξ + βη)} du,     sec θ = cosh u
//! ```
//!
//! with ξ forward of midship and η to port. The waves lie on one curve in the plane of wavenumbers, so the integral is a sum of
//! plane waves once its nodes are chosen ([`KelvinWake::plan`]); any field of the waves follows from
//! [`synthesize`](crate::reference::synthesize). Modules: `steady` has the curve, `rays` the ray of each wave and the opening of
//! the arms, `zones` the part of the curve that reaches a raster, `panels` the nodes, `turning` the waves of a turning ship,
//! `fade` the transition along the hull, `subpixel` the waves that pixels do not carry, and `quadrature` the slow integral used
//! as a reference.

pub(crate) mod quadrature;
mod fade;
mod panels;
mod rays;
#[cfg(test)]
mod resistance;
mod steady;
mod turning;
mod subpixel;
mod zones;

pub use fade::{fade, fade_field};
pub(crate) use fade::{fade_at, fade_with_slope, fill_fade};
pub use panels::{WakePlan, Zone};
pub(crate) use rays::Ray;
pub use rays::{KELVIN_ANGLE, half_angle};
pub(crate) use subpixel::{LARGEST_SLOPE_VARIANCE, Roughness, SubpixelWake};
pub(crate) use turning::RingWork;

use crate::constants::GRAVITY;
use crate::hull::Hull;
use crate::track::Track;
use num_complex::Complex64;
use steady::{SteadyWave, SteadyWaves};

/// Direction θ \[rad\] of the waves on the arms, atan(1/√2): transverse waves below, divergent above.
pub const CUSP_ANGLE: f64 = 0.615_479_708_670_387_3;

/// A thin ship under way: everything on which its free waves depend.
///
/// # Validity
///
/// Linear and inviscid, with speed and course steady for a long time past; gravity waves only. In water of finite depth, the
/// waves and their amplitudes are those of that depth.
///
/// # References
///
/// Michell (1898); Tuck, Scullen and Lazauskas (2002), 24th Symposium on Naval Hydrodynamics; Sretensky (1936).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KelvinWake {
    /// Form and size of the hull.
    pub hull: Hull,
    /// Speed U [m/s], at least 0; a ship at rest makes no waves.
    pub speed: f64,
    /// Place and direction at the time of the image.
    pub track: Track,
    /// Water depth h \[m\], above 0, may be infinite.
    pub depth: f64,
    /// Depth d \[m\], at least 0; the spectrum is weighted with e^{−kd}.
    pub filter_depth: f64,
    /// Largest slope of a wave one ship length astern of midship \[1\], above 0; `None` for no limit. See
    /// [`KelvinWake::unbroken`].
    pub steepness: Option<f64>,
}

/// Number of nodes over a period of the interference of bow and stern: exact for a cosine.
const INTERFERENCE: usize = 8;

impl KelvinWake {
    /// Wavelength of the transverse waves on the track in deep water, 2πU²/g \[m\].
    #[must_use]
    pub fn transverse_wavelength(&self) -> f64 {
        std::f64::consts::TAU * self.speed * self.speed / GRAVITY
    }

    /// Amplitude of the free waves by direction.
    ///
    /// ```text
    /// A(θ) = −(2ν/π) sec³θ · F̄,    a du = A dθ
    /// ```
    ///
    /// and in water of finite depth
    ///
    /// ```text
    /// A(θ) = −(2/π) k sec θ · F̄/(1 − νh sec²θ/cosh²(kh)),    F with cosh(k(h − z))/cosh(kh)
    /// ```
    ///
    /// - `direction` θ \[rad\] between the track and the direction of the wave, |θ| < π/2
    /// - returns A \[m\]; 0 where no wave keeps station with the ship
    #[must_use]
    pub fn amplitude(&self, direction: f64) -> Complex64 {
        let u = direction.tan().asinh();
        let waves = self.steady_waves();
        if self.speed == 0.0 || u.abs() <= waves.first() && waves.first() > 0.0 {
            return Complex64::ZERO;
        }
        self.free_wave(&waves.at(u)) / direction.cos()
    }

    fn steady_waves(&self) -> SteadyWaves {
        SteadyWaves::new(self.speed, self.depth)
    }

    /// a = −w F̄ e^{−kd}, d the filter depth, [m per unit u].
    fn free_wave(&self, wave: &SteadyWave) -> Complex64 {
        self.source(wave.along, wave.wavenumber, wave.weight)
    }

    /// −w F̄ e^{−kd} at the wavenumber k with the component α along the track [rad/m], w a weight.
    fn source(&self, along: f64, wavenumber: f64, weight: f64) -> Complex64 {
        let michell = self.hull.michell_integral(along, wavenumber, self.depth);
        let filter = (-wavenumber * self.filter_depth).exp();
        -michell.conj() * (weight * filter * self.unbroken(along, wavenumber))
    }

    /// Share of a wave's amplitude that has not broken.
    ///
    /// ```text
    /// (1 + s²/s_max²)^{−½},     s² = 8 k⁴ ⟨|F|²⟩/(π ν L cosh u),     k = ν cosh² u
    /// ```
    ///
    /// s is the slope amplitude k `a_loc` that stationary phase gives the divergent waves of wavenumber k at the distance L of
    /// one ship length, ⟨|F|²⟩ the square of Michell's integral averaged over the interference of bow and stern, and `s_max` the
    /// limit [`Self::steepness`]. A thin ship makes divergent waves steeper than water can bear (slopes of 0.4 to 0.7 near the
    /// track); the excess becomes turbulence near the hull. Long waves are not steep and remain. Next to the cusp, where
    /// stationary phase fails, and for transverse waves, s is the slope of a divergent wave of the same length.
    ///
    /// - `along` α, `wavenumber` k [rad/m]
    /// - returns 1 without a limit
    ///
    /// # Validity
    ///
    /// Form and distance are chosen. Regular waves break at slopes of 0.44 (Stokes), waves of a wind sea at 0.2 to 0.3.
    #[must_use]
    pub fn unbroken(&self, along: f64, wavenumber: f64) -> f64 {
        let Some(limit) = self.steepness else {
            return 1.0;
        };
        let length = self.hull.length();
        let shortest = GRAVITY / (self.speed * self.speed);
        let period = std::f64::consts::TAU / length;
        let square = |n: usize| {
            let shift = ((n as f64 + 0.5) / INTERFERENCE as f64 - 0.5) * period;
            let michell = self
                .hull
                .michell_integral(along + shift, wavenumber, self.depth);
            michell.norm_sqr()
        };
        let mean = (0..INTERFERENCE).map(square).sum::<f64>() / INTERFERENCE as f64;
        let cosh = (wavenumber / shortest).sqrt().max(1.0);
        let squared =
            8.0 * wavenumber.powi(4) * mean / (std::f64::consts::PI * shortest * length * cosh);
        (1.0 + squared / (limit * limit)).powf(-0.5)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact zeros")]
mod tests;
