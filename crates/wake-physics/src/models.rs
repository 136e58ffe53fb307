//! The models of a scene: sea, wake, backscatter and radar, with the scene's parameters in the units of the formulas.

use crate::constants::SPEED_OF_LIGHT;
use crate::hull::Hull;
use crate::kelvin::KelvinWake;
use crate::permittivity;
use crate::pixels::Pixels;
use crate::sar::impulse::Axis;
use crate::sar::{AzimuthResolution, ImpulseResponse};
use crate::scattering::hydrodynamic::{action_slope, relaxation_rate};
use crate::scattering::{Backscatter, SlopeCovariance, Specular, TwoScale, bragg};
use crate::scene::{HullForm, Radar, Scene, Ship, Term};
use crate::spectrum::elfouhaily::{DragLaw, Elfouhaily, friction_velocity};
use crate::swell::Swell;
use crate::waves::Transfer;
use crate::wind_sea::{DirectionalSpectrum, WindSea};
use crate::window::Window;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2, TAU};

/// Block coefficient of the full hull if the scene gives none: a laden tanker.
const TANKER_BLOCK_COEFFICIENT: f64 = 0.8;

/// The models of a valid scene.
#[derive(Debug, Clone)]
pub(crate) struct Models {
    /// Pixels of the image and computed pixels.
    pub(crate) pixels: Pixels,
    /// Impulse response in range and azimuth, if the scene asks for one.
    pub(crate) response: Option<ImpulseResponse>,
    /// Incidence angle \[rad\].
    pub(crate) incidence: f64,
    /// R/V \[s\].
    pub(crate) range_to_velocity: f64,
    /// Radar wavelength \[m\].
    pub(crate) wavelength: f64,
    /// Transfer from wave amplitudes to fields.
    pub(crate) transfer: Transfer,
    /// The resolved waves.
    pub(crate) sea: DirectionalSpectrum,
    /// Bragg scattering by the short waves.
    pub(crate) two_scale: TwoScale,
    /// Relative permittivity of the water.
    pub(crate) permittivity: Complex64,
    /// Single-look azimuth resolution \[m\].
    pub(crate) azimuth_resolution: f64,
    /// The swell, if there is one.
    pub(crate) swell: Option<Swell>,
    /// The Kelvin wakes, one per ship.
    pub(crate) wakes: Vec<KelvinWake>,
    /// Variances of the waves shorter than a pixel.
    pub(crate) subpixel: SubpixelVariance,
}

/// Variances of the sea's waves that enter statistically, without phase.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubpixelVariance {
    /// Slopes of resolved waves that are averaged over nevertheless.
    averaged_slopes: SlopeCovariance,
    /// Standard deviation of the line-of-sight velocity [m/s].
    pub(crate) velocity: f64,
}

impl Models {
    pub(crate) fn new(scene: &Scene) -> Self {
        let sea = wind_sea(scene);
        let response = response(scene);
        let spectrum = DirectionalSpectrum::new(&sea);
        // The short waves follow Elfouhaily's spectrum whatever spectrum the resolved waves have.
        let short_waves = Elfouhaily::new(scene.sea.wind_speed, scene.sea.fetch);
        let action_slope = action_slope(
            &short_waves,
            bragg_wavenumber(&scene.radar),
            spectrum.wind(),
        );
        let relaxation_rate = relaxation(scene);
        let kelvin = |ship| kelvin_wake(ship, scene.sea.depth, scene.sea.time);
        let wakes: Vec<KelvinWake> = scene.ships.iter().map(kelvin).collect();
        let pixels = Pixels::new(&scene.grid, response.as_ref(), &wakes);
        let incidence = scene.radar.incidence.to_radians();
        let permittivity = permittivity::sea_water(
            scene.radar.frequency,
            scene.sea.temperature,
            scene.sea.salinity,
        );
        let two_scale = TwoScale::new(
            incidence,
            TAU * scene.radar.frequency / SPEED_OF_LIGHT,
            scene.radar.polarization,
            permittivity,
            short_waves,
            spectrum.wind(),
        );
        let subpixel = DirectionalSpectrum::new(&WindSea {
            spectrum: crate::scene::SpectrumModel::Elfouhaily,
            ..sea
        })
        .moments(
            pixels.computed.nyquist_wavenumber(),
            f64::INFINITY,
            incidence,
        );
        Self {
            pixels,
            response,
            swell: swell(scene),
            incidence,
            range_to_velocity: scene.radar.range_to_velocity,
            wavelength: SPEED_OF_LIGHT / scene.radar.frequency,
            transfer: Transfer {
                depth: scene.sea.depth,
                incidence,
                relaxation_rate,
                action_slope,
            },
            two_scale,
            permittivity,
            azimuth_resolution: scene.radar.azimuth_resolution,
            sea: spectrum,
            wakes,
            subpixel: SubpixelVariance {
                averaged_slopes: SlopeCovariance::NONE,
                velocity: subpixel.radial_velocity.sqrt(),
            },
        }
    }

    /// Wavenumbers of ship waves that the pixels do not resolve but that tilt shorter waves [rad/m].
    pub(crate) fn subpixel_band(&self) -> [f64; 2] {
        let split = self.two_scale.split_wavenumber();
        [self.pixels.computed.nyquist_wavenumber(), split]
    }

    /// Also averages over resolved waves, as if they were shorter than a pixel.
    ///
    /// - `slopes`: covariance of their slopes
    /// - `velocity`: standard deviation of their line-of-sight velocity [m/s]
    pub(crate) fn average_over(&mut self, slopes: &SlopeCovariance, velocity: f64) {
        let subpixel = &mut self.subpixel;
        subpixel.averaged_slopes = subpixel.averaged_slopes.plus(slopes);
        subpixel.velocity = subpixel.velocity.hypot(velocity);
    }

    /// σ⁰ of facets, with or without the tilt average over subpixel slopes and the specular return.
    pub(crate) fn backscatter(&self, tilt_average: bool, specular: bool) -> Backscatter {
        let subpixel = self.subpixel_slopes();
        let lobe = Specular::mirror_lobe(self.radar_wavenumber(), self.pixels.computed.spacing);
        Backscatter {
            two_scale: self.two_scale.clone(),
            tilt: if tilt_average {
                subpixel
            } else {
                SlopeCovariance::NONE
            },
            specular: if specular {
                Specular::new(self.permittivity, self.incidence, &subpixel, lobe)
            } else {
                Specular::NONE
            },
        }
    }

    /// Slopes of the waves between the pixel's and the radar's split wavenumber, and of resolved waves that are averaged
    /// over.
    pub(crate) fn subpixel_slopes(&self) -> SlopeCovariance {
        let short = self
            .two_scale
            .slopes_from(self.pixels.computed.nyquist_wavenumber());
        short.plus(&self.subpixel.averaged_slopes)
    }

    /// Reason why there is no wake, if there is none.
    pub(crate) fn no_wake(&self) -> Option<&'static str> {
        match &self.wakes[..] {
            [] => Some("there is no ship"),
            [wake] if wake.speed == 0.0 => Some("the ship is at rest"),
            wakes if wakes.iter().all(|w| w.speed == 0.0) => Some("all ships are at rest"),
            _ => None,
        }
    }

    /// Whether the wind raises no waves that scatter.
    pub(crate) fn short_waves_vanish(&self) -> bool {
        self.two_scale.facet([0.0, 0.0]) <= 0.0
    }

    /// Azimuth resolution of the moving sea. Every look has the radar's resolution; looks only average speckle.
    ///
    /// An impulse response includes the nominal resolution, which is then not applied again.
    pub(crate) fn resolution(&self) -> AzimuthResolution {
        let resolution = AzimuthResolution::of_moving_sea(
            self.wavelength,
            self.range_to_velocity,
            self.azimuth_resolution,
            1,
            self.subpixel.velocity,
        );
        AzimuthResolution {
            nominal: self.resolution_at_rest().nominal,
            ..resolution
        }
    }

    /// Azimuth resolution of a sea at rest; 0 if an impulse response includes it.
    pub(crate) fn resolution_at_rest(&self) -> AzimuthResolution {
        let nominal = match self.response {
            Some(_) => 0.0,
            None => self.azimuth_resolution,
        };
        AzimuthResolution::at_rest(nominal, 1)
    }

    /// Acceleration with the same defocus as the smear by a random velocity of 1 m/s [1/s]: (π/2 T (R/V) a)² of the squared
    /// resolution equals `2π² (R/V)² σ_u²`.
    pub(crate) fn defocus_of_velocity(&self) -> f64 {
        let defocus = self.resolution().defocus;
        if defocus > 0.0 {
            SQRT_2 * PI * self.range_to_velocity / defocus
        } else {
            0.0
        }
    }

    /// Radar wavenumber `k_e` [rad/m].
    fn radar_wavenumber(&self) -> f64 {
        TAU / self.wavelength
    }
}

/// The Kelvin wake of a ship.
pub(crate) fn kelvin_wake(ship: &Ship, depth: f64, time: f64) -> KelvinWake {
    let (length, beam, draft) = (ship.length, ship.beam, ship.draft);
    KelvinWake {
        hull: match ship.hull {
            HullForm::Wigley => Hull::wigley(length, beam, draft),
            HullForm::Full => {
                let block = ship.block_coefficient.unwrap_or(TANKER_BLOCK_COEFFICIENT);
                Hull::full(length, beam, draft, block)
            }
        },
        speed: ship.speed,
        track: ship.track(time),
        depth,
        filter_depth: ship.filter_depth,
        steepness: ship.steepness,
    }
}

fn wind_sea(scene: &Scene) -> WindSea {
    WindSea {
        wind_speed: scene.sea.wind_speed,
        wind_toward: scene.sea.wind_toward.rem_euclid(360.0).to_radians(),
        fetch: scene.sea.fetch,
        depth: scene.sea.depth,
        spectrum: scene.sea.spectrum,
        spreading: scene.sea.spreading,
    }
}

/// The scene's relaxation rate, by default that of the Bragg waves in the scene's wind.
fn relaxation(scene: &Scene) -> f64 {
    let of_bragg_waves = || {
        let friction = friction_velocity(scene.sea.wind_speed, DragLaw::default());
        relaxation_rate(friction, bragg_wavenumber(&scene.radar))
    };
    scene.radar.relaxation_rate.unwrap_or_else(of_bragg_waves)
}

/// Wavenumber of the waves that scatter from a calm facet [rad/m].
fn bragg_wavenumber(radar: &Radar) -> f64 {
    let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
    bragg::wavenumber(k_e, radar.incidence.to_radians())
}

/// The impulse response that a scene asks for, unless its list of terms excludes it.
///
/// The plan never drops it: without it, the waves between the spacings of sources and pixels, a ship's sidelobes and the
/// smear of all contrast are missing, which no tolerance covers.
fn response(scene: &Scene) -> Option<ImpulseResponse> {
    let radar = &scene.radar;
    let resolution = radar
        .range_resolution
        .filter(|_| scene.model.terms.allow(Term::ImpulseResponse))?;
    let window = radar.window.unwrap_or(Window::Uniform);
    Some(ImpulseResponse {
        range: Axis { resolution, window },
        azimuth: Axis {
            resolution: radar.azimuth_resolution,
            window: radar.azimuth_window.unwrap_or(window),
        },
    })
}

fn swell(scene: &Scene) -> Option<Swell> {
    let sea = &scene.sea;
    (sea.swell_height > 0.0 && scene.model.terms.allow(Term::Swell)).then(|| Swell {
        height: sea.swell_height,
        wavelength: sea.swell_length,
        toward: sea.swell_toward.rem_euclid(360.0).to_radians(),
    })
}
