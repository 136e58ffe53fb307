//! What is known of a scene before it is computed: its waves, its backscatter, its motion.

use super::linear::{LinearImage, WaveSample, rms};
use super::sample;
use crate::kelvin::KelvinWake;
use crate::raster::Raster;
use crate::sar::AzimuthResolution;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::{Scene, Term};
use crate::setup::{Setup, turbulent_wake};

/// Step of the differences that give the slope of ln σ⁰ \[1\].
const SLOPE_STEP: f64 = 0.05;

/// Tolerance of the coarse wake that is only weighed.
const COARSE: f64 = 0.1;

/// Points along each side of the image where the turbulent wake is looked at.
const DAMPING_POINTS: usize = 48;

/// What is known of a scene before it is computed.
#[derive(Debug)]
pub(crate) struct Situation {
    /// Resolved waves of the sea.
    pub(crate) sea: Vec<WaveSample>,
    /// Resolved waves of the wake.
    pub(crate) wake: Vec<WaveSample>,
    /// How waves modulate the image.
    pub(crate) image: LinearImage,
    /// ½ ∂²ln σ⁰/∂slope² along x and y, absolute.
    pub(crate) curvature: [f64; 2],
    /// Azimuth resolution of the sea in motion.
    pub(crate) resolution: AzimuthResolution,
    /// Root of the mean square of the damping of the turbulent wake over the image, 0 to 1.
    pub(crate) damping: f64,
    /// Mean σ⁰: Bragg and specular.
    pub(crate) mean: [f64; 2],
    /// Relative root mean square change of σ⁰ without tilt average, and without specular return.
    pub(crate) backscatter: [f64; 2],
    /// Pixel size \[m\].
    pub(crate) spacing: f64,
    /// Number of looks.
    pub(crate) looks: f64,
    /// Why a term is absent from the scene.
    pub(crate) absent: Vec<(Term, &'static str)>,
}

impl Situation {
    pub(crate) fn new(scene: &Scene, setup: &Setup) -> Self {
        // Half a cell of the sea's lattice more than the band: cells at its edge hold waves from beyond.
        let half_cell = 1.0 / setup.image.rows.min(setup.image.columns) as f64;
        let band = setup.image.nyquist_wavenumber() * (1.0 + half_cell);
        let sea = sample::sea(&setup.sea, band);
        let (wake, crowding) = match &setup.wake {
            Some(wake) => sampled_wake(wake, &setup.image),
            None => (Vec::new(), 1.0),
        };
        let backscatter = setup.backscatter(true, true);
        let resolved = slopes(&sea).plus(&slopes(&wake).times(crowding));
        let sensitivity = backscatter.sensitivity(&resolved);
        let (tilt, curvature) = slope_of_ln_sigma(&backscatter);
        let total = sensitivity.mean[0] + sensitivity.mean[1];
        let mut situation = Self {
            sea,
            wake,
            image: LinearImage {
                transfer: setup.transfer,
                tilt,
                bragg_share: if total > 0.0 {
                    sensitivity.mean[0] / total
                } else {
                    0.0
                },
                range_to_velocity: setup.range_to_velocity,
            },
            curvature,
            resolution: setup.resolution(),
            damping: damping(setup),
            mean: sensitivity.mean,
            backscatter: [sensitivity.tilt_average, sensitivity.specular],
            spacing: scene.grid.spacing,
            looks: f64::from(scene.radar.looks),
            absent: Vec::new(),
        };
        situation.absent = situation.absent_terms(setup);
        situation
    }

    /// Terms that the scene has nothing of.
    fn absent_terms(&self, setup: &Setup) -> Vec<(Term, &'static str)> {
        let no_waves = self.sea.is_empty() && self.wake.is_empty();
        let no_bragg = setup.short_waves_vanish();
        let ship = setup.wake.as_ref();
        let kelvin = match ship {
            None => Some("there is no ship"),
            Some(w) if w.speed == 0.0 => Some("the ship is at rest"),
            Some(_) if self.wake.is_empty() => {
                Some("no wave that a pixel carries reaches the image")
            }
            Some(_) => None,
        };
        let turbulent = match ship {
            None => Some("there is no ship"),
            Some(w) if w.speed == 0.0 => Some("the ship is at rest"),
            Some(_) if no_bragg => Some("there are no short waves to damp"),
            Some(_) if self.damping == 0.0 => Some("it does not reach the image"),
            Some(_) => None,
        };
        let sea = self
            .sea
            .is_empty()
            .then_some("no wind wave that a pixel carries");
        let flat = no_waves.then_some("there are no resolved waves");
        let still = (setup.range_to_velocity == 0.0).then_some("R/V is 0");
        let bragg = no_bragg.then_some("there are no short waves to scatter");
        let tilt = (setup.unresolved_slopes() == SlopeCovariance::NONE)
            .then_some("no wave between pixel and Bragg waves");
        [
            (Term::Sea, sea),
            (Term::Kelvin, kelvin),
            (Term::Turbulent, turbulent),
            (Term::TiltAverage, bragg.or(tilt)),
            (Term::RangeBunching, flat),
            (Term::Hydrodynamic, flat.or(bragg)),
            (Term::Bunching, still.or(flat)),
            (Term::Coherence, still.or(flat)),
        ]
        .into_iter()
        .filter_map(|(term, why)| why.map(|why| (term, why)))
        .collect()
    }

    /// Slopes of the resolved waves of the sea, and the standard deviation of their line-of-sight velocity [m/s].
    pub(crate) fn resolved_sea(&self) -> (SlopeCovariance, f64) {
        let radial = |w: &WaveSample| self.image.transfer.radial(w.k, w.omega);
        (slopes(&self.sea), rms(&self.sea, radial))
    }

    /// The linear image of a setup that may average over more than the one this was made of.
    pub(crate) fn linear_image(&self, setup: &Setup) -> LinearImage {
        LinearImage {
            tilt: slope_of_ln_sigma(&setup.backscatter(true, true)).0,
            ..self.image
        }
    }

    /// What a user should know.
    pub(crate) fn notes(&self, scene: &Scene, setup: &Setup) -> Vec<String> {
        let mut notes = Vec::new();
        if setup.short_waves_vanish() {
            notes.push(format!(
                "a wind of {} m/s raises no short waves at this incidence: the image is specular only, or dark",
                scene.sea.wind_speed
            ));
        }
        if let Some(wake) = &setup.wake {
            let froude = wake.hull.froude_number(wake.speed);
            if froude > 0.0 && 2.0 * setup.image.spacing > wake.transverse_wavelength() {
                notes.push(format!(
                    "the transverse waves are {:.2} m long: a pixel of {} m carries none of them",
                    wake.transverse_wavelength(),
                    setup.image.spacing
                ));
            }
        }
        notes
    }
}

/// The waves of the wake in the image, and how much stronger they are within a ship's length of the stern.
fn sampled_wake(wake: &KelvinWake, image: &Raster) -> (Vec<WaveSample>, f64) {
    let corners = wake.track.corners(image);
    let length = wake.hull.length();
    let farthest = corners
        .iter()
        .map(|c| 0.5 * length - c[0])
        .fold(0.0, f64::max);
    let nearest = corners
        .iter()
        .map(|c| -0.5 * length - c[0])
        .fold(f64::INFINITY, f64::min);
    let nodes = wake.waves(&wake.plan(image, COARSE));
    if nodes.is_empty() || farthest <= 0.0 {
        return (Vec::new(), 1.0);
    }
    let [height, across] = [image.rows, image.columns].map(|n| n as f64 * image.spacing);
    let track_length = farthest
        .min(height.hypot(across))
        .min(farthest - nearest.min(0.0));
    // The wedge is 0.71 of the distance wide, counted from half a length astern of midship: the energy across the
    // track stands on this width, also where the image is narrower.
    let wedge = track_length * 0.71 * (0.5 * length).max(nearest);
    let area = (height * across).max(wedge);
    let waves = sample::wake(&nodes, wake.track.forward, track_length, area);
    (waves, area / wedge)
}

fn slopes(waves: &[WaveSample]) -> SlopeCovariance {
    waves.iter().fold(SlopeCovariance::NONE, |sum, w| {
        let [kx, ky] = w.k;
        sum.plus(&SlopeCovariance {
            xx: w.variance * kx * kx,
            xy: w.variance * kx * ky,
            yy: w.variance * ky * ky,
        })
    })
}

/// First derivatives and half the second ones of ln σ⁰ by the slopes, on the calm facet.
fn slope_of_ln_sigma(backscatter: &Backscatter) -> ([f64; 2], [f64; 2]) {
    let ln_sigma = |slope: [f64; 2]| {
        let [bragg, specular] = backscatter.coarse_parts(slope);
        (bragg + specular).ln()
    };
    let calm = ln_sigma([0.0, 0.0]);
    let (mut first, mut second) = ([0.0; 2], [0.0; 2]);
    for axis in 0..2 {
        let mut step = [0.0; 2];
        step[axis] = SLOPE_STEP;
        let (up, down) = (ln_sigma(step), ln_sigma([-step[0], -step[1]]));
        if (up + down + calm).is_finite() {
            first[axis] = (up - down) / (2.0 * SLOPE_STEP);
            second[axis] = (0.5 * (up + down - 2.0 * calm) / SLOPE_STEP.powi(2)).abs();
        }
    }
    (first, second)
}

/// Root of the mean square of the turbulent wake's damping over the image, looked at on a coarse raster.
fn damping(setup: &Setup) -> f64 {
    let Some(wake) = setup.wake.as_ref().filter(|w| w.speed > 0.0) else {
        return 0.0;
    };
    let turbulent = turbulent_wake(wake);
    let image = &setup.image;
    let (rows, columns) = (
        image.rows.min(DAMPING_POINTS),
        image.columns.min(DAMPING_POINTS),
    );
    let mut sum = 0.0;
    for i in 0..rows {
        for j in 0..columns {
            let (x, y) = (
                image.x(j * image.columns / columns),
                image.y(i * image.rows / rows),
            );
            sum += turbulent.damping(wake.track.seen_from_ship([x, y])).powi(2);
        }
    }
    (sum / (rows * columns) as f64).sqrt()
}
