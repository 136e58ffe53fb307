//! The models of a scene: sea, wake, backscatter and radar, with the scene's numbers in the units of formulas.

use crate::constants::SPEED_OF_LIGHT;
use crate::hull::Hull;
use crate::kelvin::KelvinWake;
use crate::permittivity;
use crate::raster::Raster;
use crate::sar::AzimuthResolution;
use crate::scattering::hydrodynamic::relaxation_rate;
use crate::scattering::{Backscatter, SlopeCovariance, Specular, TwoScale};
use crate::scene::{HullForm, Radar, Scene, Ship};
use crate::spectrum::elfouhaily::{DragLaw, Elfouhaily, friction_velocity};
use crate::track::Track;
use crate::turbulent::TurbulentWake;
use crate::waves::Transfer;
use crate::wind_sea::{DirectionalSpectrum, WindSea};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Block coefficient of the full hull where the scene names none: a laden tanker.
const TANKER_BLOCK_COEFFICIENT: f64 = 0.8;

/// The models of a valid scene.
#[derive(Debug, Clone)]
pub(crate) struct Models {
    /// Pixels of the image.
    pub(crate) image: Raster,
    /// Incidence angle \[rad\].
    pub(crate) incidence: f64,
    /// R/V \[s\].
    pub(crate) range_to_velocity: f64,
    /// Radar wavelength \[m\].
    pub(crate) wavelength: f64,
    /// From amplitudes of waves to fields.
    pub(crate) transfer: Transfer,
    /// The resolved waves.
    pub(crate) sea: DirectionalSpectrum,
    /// Bragg scattering by the short waves.
    pub(crate) two_scale: TwoScale,
    /// Relative permittivity of the water.
    pub(crate) permittivity: Complex64,
    /// Single-look azimuth resolution \[m\].
    pub(crate) azimuth_resolution: f64,
    /// The ship's wake, if there is a ship.
    pub(crate) wake: Option<KelvinWake>,
    /// Standard deviation of the line-of-sight velocity of unresolved waves [m/s].
    pub(crate) unresolved_velocity: f64,
    /// Slopes of resolved waves that are averaged over nevertheless.
    averaged_slopes: SlopeCovariance,
}

impl Models {
    pub(crate) fn new(scene: &Scene) -> Self {
        let sea = wind_sea(scene);
        let image = Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing);
        let incidence = scene.radar.incidence.to_radians();
        // Whatever spectrum the resolved waves have, the short ones are Elfouhaily's.
        let short_waves = Elfouhaily::new(scene.sea.wind_speed, scene.sea.fetch);
        let permittivity = permittivity::sea_water(
            scene.radar.frequency,
            scene.sea.temperature,
            scene.sea.salinity,
        );
        let spectrum = DirectionalSpectrum::new(&sea);
        let unresolved = DirectionalSpectrum::new(&WindSea {
            spectrum: crate::scene::SpectrumModel::Elfouhaily,
            ..sea
        })
        .moments(image.nyquist_wavenumber(), f64::INFINITY, incidence);
        Self {
            incidence,
            range_to_velocity: scene.radar.range_to_velocity,
            wavelength: SPEED_OF_LIGHT / scene.radar.frequency,
            transfer: Transfer {
                depth: scene.sea.depth,
                incidence,
                relaxation_rate: relaxation(scene),
            },
            two_scale: TwoScale::new(
                incidence,
                TAU * scene.radar.frequency / SPEED_OF_LIGHT,
                scene.radar.polarization,
                permittivity,
                short_waves,
                spectrum.wind(),
            ),
            permittivity,
            azimuth_resolution: scene.radar.resolution,
            sea: spectrum,
            wake: scene
                .ship
                .as_ref()
                .map(|ship| wake(ship, scene.sea.depth, scene.sea.time)),
            unresolved_velocity: unresolved.radial_velocity.sqrt(),
            averaged_slopes: SlopeCovariance::NONE,
            image,
        }
    }

    /// Averages over resolved waves too, as if a pixel held them.
    ///
    /// - `slopes`: their covariance
    /// - `velocity`: standard deviation of their line-of-sight velocity [m/s]
    pub(crate) fn average_over(&mut self, slopes: &SlopeCovariance, velocity: f64) {
        self.averaged_slopes = self.averaged_slopes.plus(slopes);
        self.unresolved_velocity = self.unresolved_velocity.hypot(velocity);
    }

    /// σ⁰ of facets, with or without the average over unresolved slopes and the specular return.
    pub(crate) fn backscatter(&self, tilt_average: bool, specular: bool) -> Backscatter {
        let unresolved = self.unresolved_slopes();
        let lobe = Specular::mirror_lobe(self.radar_wavenumber(), self.image.spacing);
        Backscatter {
            two_scale: self.two_scale.clone(),
            tilt: if tilt_average {
                unresolved
            } else {
                SlopeCovariance::NONE
            },
            specular: if specular {
                Specular::new(self.permittivity, self.incidence, &unresolved, lobe)
            } else {
                Specular::NONE
            },
        }
    }

    /// Slopes of the waves between the pixel's and the radar's split wavenumber, and of those that are averaged over.
    pub(crate) fn unresolved_slopes(&self) -> SlopeCovariance {
        let short = self.two_scale.slopes_from(self.image.nyquist_wavenumber());
        short.plus(&self.averaged_slopes)
    }

    /// Whether the wind raises no waves that scatter.
    pub(crate) fn short_waves_vanish(&self) -> bool {
        self.two_scale.facet([0.0, 0.0]) <= 0.0
    }

    /// Azimuth resolution of the sea in motion. Every look has the radar's resolution; looks only average speckle.
    pub(crate) fn resolution(&self) -> AzimuthResolution {
        AzimuthResolution::of_moving_sea(
            self.wavelength,
            self.range_to_velocity,
            (self.azimuth_resolution, 1),
            self.unresolved_velocity,
        )
    }

    /// Wavenumber of the radar `k_e` [rad/m].
    fn radar_wavenumber(&self) -> f64 {
        TAU / self.wavelength
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

/// The scene's relaxation rate, or that of its Bragg waves in its wind.
fn relaxation(scene: &Scene) -> f64 {
    let of_bragg_waves = |radar: &Radar| {
        let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
        let bragg = crate::scattering::bragg::wavenumber(k_e, radar.incidence.to_radians());
        relaxation_rate(
            friction_velocity(scene.sea.wind_speed, DragLaw::default()),
            bragg,
        )
    };
    scene
        .radar
        .relaxation_rate
        .unwrap_or_else(|| of_bragg_waves(&scene.radar))
}

fn wake(ship: &Ship, depth: f64, time: f64) -> KelvinWake {
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
        track: Track::new(ship.position, ship.heading, ship.speed * time),
        depth,
        filter_depth: ship.filter_depth,
    }
}

/// The turbulent wake of the same ship.
pub(crate) fn turbulent_wake(wake: &KelvinWake) -> TurbulentWake {
    TurbulentWake {
        track: wake.track,
        speed: wake.speed,
        length: wake.hull.length(),
        beam: wake.hull.beam(),
    }
}
