//! What is known of a scene before it is computed: a few thousand of its waves, its backscatter, its motion.

mod doppler;
mod strengths;
mod waves;

use crate::kelvin::KelvinWake;
use crate::models::Models;
use crate::modulation::{ModulationTransfer, WaveSample, rms};
use crate::raster::Raster;
use crate::sar::AzimuthResolution;
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::{Scene, Term};
use crate::track::Track;
use crate::waves::{LARGEST_MODULATING_WAVENUMBER, Quantity};
use std::f64::consts::{PI, SQRT_2};
use strengths::{SLOPE_STEP, damping, edge, rough_specular, subpixel_wake};

/// Tolerance of the coarse wake that is only weighed.
const COARSE: f64 = 0.1;

/// Standard deviations that the margin holds; beyond lie 7 in a million.
const DEVIATIONS: f64 = 4.5;

/// Headings that stand for all of a ship that turns: chosen.
const HEADINGS: usize = 8;

/// Computed pixels along a side of one of the image above which an impulse response costs more than it shows: chosen.
const COARSE_PIXEL: f64 = 8.0;

/// Mean square of the wake where it is over that in the whole image: the wedge covers about a quarter of it.
const WEDGE: f64 = 4.0;

/// What is known of a scene before it is computed.
#[derive(Debug)]
pub(crate) struct Survey {
    /// Resolved waves of the sea, swell included.
    pub(crate) sea: Vec<WaveSample>,
    /// Resolved waves of the swell.
    pub(crate) swell: Vec<WaveSample>,
    /// Resolved waves of the wake.
    pub(crate) wake: Vec<WaveSample>,
    /// How waves modulate the image.
    pub(crate) modulation: ModulationTransfer,
    /// ½ ∂²ln σ⁰/∂slope² along x and y, absolute.
    pub(crate) curvature: [f64; 2],
    /// Azimuth resolution of the sea in motion.
    pub(crate) resolution: AzimuthResolution,
    /// Root of the mean square of the damping of the turbulent wake over the image, 0 to 1.
    pub(crate) damping: f64,
    /// Roots of mean squares over the image: what the current of the wake changes σ⁰ and its density in the image by,
    /// relative, and its velocity along the line of sight [m/s].
    pub(crate) edge: [f64; 2],
    /// Roots of mean squares over the image: what the ship's unresolved waves change σ⁰ by, relative, and the share of
    /// the width of a point that their velocities add, 0 to 1.
    pub(crate) subpixel_wake: [f64; 2],
    /// Specular return where the ship's unresolved waves are, root of the mean square over the mean σ⁰; 0 without them.
    pub(crate) rough_specular: f64,
    /// Damping in slicks.
    pub(crate) slicks: f64,
    /// Root of the mean square of what gusts change σ⁰ by, relative.
    pub(crate) gusts: f64,
    /// Breaking waves and noise over the mean σ⁰.
    pub(crate) added: [f64; 2],
    /// Correlation of neighbouring pixels by the impulse response.
    pub(crate) response: f64,
    /// Mean σ⁰: Bragg and specular.
    pub(crate) mean: [f64; 2],
    /// Slopes of the resolved waves where the wake is.
    pub(crate) resolved: SlopeCovariance,
    /// Pixel size \[m\].
    pub(crate) spacing: f64,
    /// Number of looks.
    pub(crate) looks: f64,
    /// Why a term is absent from the scene.
    pub(crate) absent: Vec<(Term, &'static str)>,
}

impl Survey {
    pub(crate) fn new(scene: &Scene, models: &Models) -> Self {
        // Half a cell of the sea's lattice more than the band: cells at its edge hold waves from beyond.
        let half_cell = 1.0 / models.computed.rows.min(models.computed.columns) as f64;
        let band = models.computed.nyquist_wavenumber() * (1.0 + half_cell);
        let swell = waves::swell(models.swell.as_ref(), models.transfer.depth, band);
        let wind_waves = waves::sea(&models.sea, band);
        let no_wind_waves = wind_waves.is_empty();
        let mut sea = wind_waves;
        sea.extend_from_slice(&swell);
        let (mut wake, mut wake_slopes) = (Vec::new(), [SlopeCovariance::NONE; 2]);
        for one in &models.wakes {
            let (waves, crowding) = sampled_wake(&one.kelvin, &models.computed);
            let over_image = slopes(&waves);
            wake_slopes[0] = wake_slopes[0].plus(&over_image);
            wake_slopes[1] = wake_slopes[1].plus(&over_image.times(crowding));
            wake.extend(waves);
        }
        let backscatter = models.backscatter(true, true);
        // Where the wake is, terms matter most; the mean is that of the whole image.
        let [mean_slopes, resolved] = wake_slopes.map(|wake| slopes(&sea).plus(&wake));
        let mean = backscatter.mean_over(&mean_slopes);
        let (tilt, curvature) = slope_of_ln_sigma(&backscatter);
        let total = mean[0] + mean[1];
        // Where nothing scatters all that is added is all there is.
        let over_mean = |value: f64| match value {
            v if v > 0.0 && total > 0.0 => v / total,
            v if v > 0.0 => 1.0,
            _ => 0.0,
        };
        let mut survey = Self {
            sea,
            swell,
            edge: edge(models),
            subpixel_wake: subpixel_wake(models, &backscatter),
            rough_specular: if total > 0.0 {
                rough_specular(models, &backscatter, &resolved) / total
            } else {
                0.0
            },
            slicks: models.slicks.map_or(0.0, |s| s.damping),
            gusts: models
                .gusts
                .map_or(0.0, |(g, exponent)| exponent * g.strength),
            added: [over_mean(models.breaking), over_mean(models.noise)],
            response: models
                .response
                .map_or(0.0, |r| r.pixel_correlation(models.image.spacing)),
            wake,
            modulation: ModulationTransfer {
                transfer: models.transfer,
                tilt,
                bragg_share: if total > 0.0 { mean[0] / total } else { 0.0 },
                range_to_velocity: models.range_to_velocity,
            },
            curvature,
            resolution: models.resolution(),
            damping: damping(models),
            mean,
            resolved,
            spacing: models.computed.spacing,
            looks: f64::from(scene.radar.looks),
            absent: Vec::new(),
        };
        survey.absent = survey.absent_terms(models, no_wind_waves);
        survey.absent.extend(absent_extras(scene, &survey, models));
        survey
    }

    /// Terms that the scene has nothing of.
    fn absent_terms(&self, models: &Models, no_wind_waves: bool) -> Vec<(Term, &'static str)> {
        let no_waves = self.sea.is_empty() && self.wake.is_empty();
        let no_bragg = models.short_waves_vanish();
        let no_wake = match &models.wakes[..] {
            [] => Some("there is no ship"),
            [wake] if wake.kelvin.speed == 0.0 => Some("the ship is at rest"),
            wakes if wakes.iter().all(|w| w.kelvin.speed == 0.0) => Some("all ships are at rest"),
            _ => None,
        };
        let unseen = self.wake.is_empty();
        let kelvin = unseen.then_some("no wave that a pixel carries reaches the image");
        let outside = (self.damping == 0.0).then_some("it does not reach the image");
        let undamped = no_bragg.then_some("there are no short waves to damp");
        let sea = no_wind_waves.then_some("no wind wave that a pixel carries");
        let flat = no_waves.then_some("there are no resolved waves");
        let still = (models.range_to_velocity == 0.0).then_some("R/V is 0");
        let bragg = no_bragg.then_some("there are no short waves to scatter");
        let tilt = (models.subpixel_slopes() == SlopeCovariance::NONE)
            .then_some("no wave between pixel and Bragg waves");
        [
            (Term::Sea, sea),
            (Term::Kelvin, no_wake.or(kelvin)),
            (Term::Turbulent, no_wake.or(undamped).or(outside)),
            (Term::TiltAverage, bragg.or(tilt)),
            (Term::RangeBunching, flat),
            (Term::Hydrodynamic, flat.or(bragg)),
            (Term::VelocityBunching, still.or(flat)),
            (Term::AzimuthSmear, still.or(flat)),
        ]
        .into_iter()
        .filter_map(|(term, why)| why.map(|why| (term, why)))
        .collect()
    }

    /// Slopes of the resolved waves of the sea, and the standard deviation of their line-of-sight velocity [m/s].
    pub(crate) fn resolved_sea(&self) -> (SlopeCovariance, f64) {
        let radial = |w: &WaveSample| self.modulation.transfer.radial(w.k, w.omega);
        (slopes(&self.sea), rms(&self.sea, radial))
    }

    /// Mean velocity of the open sea toward the radar by its Doppler shift [m/s].
    pub(crate) fn mean_velocity(&self, scene: &Scene, models: &Models) -> f64 {
        doppler::mean_velocity(scene, models, &self.modulation)
    }

    /// Share of the mean intensity of open sea that its waves modulate: neither breaking waves' nor noise \[1\].
    pub(crate) fn modulated_share(&self) -> f64 {
        1.0 / (1.0 + self.added[0] + self.added[1])
    }

    /// The modulation where models may average over more waves than those this was made of.
    pub(crate) fn modulation_of(&self, models: &Models) -> ModulationTransfer {
        ModulationTransfer {
            tilt: slope_of_ln_sigma(&models.backscatter(true, true)).0,
            ..self.modulation
        }
    }

    /// Margin in rows and columns. It depends on the scene alone, not on the terms that are used: the same seed
    /// draws the same sea whatever is left out.
    pub(crate) fn margin(&self, models: &Models) -> [usize; 2] {
        if self.sea.is_empty() && self.wake.is_empty() {
            return [0, 0];
        }
        let deviation = |quantity| {
            let factor = |w: &WaveSample| self.modulation.transfer.factor(quantity, w.k, w.omega);
            rms(&self.sea, factor).hypot(WEDGE.sqrt() * rms(&self.wake, factor))
        };
        let radial = |w: &WaveSample| self.modulation.transfer.radial(w.k, w.omega);
        let velocity = rms(&self.sea, radial).hypot(WEDGE.sqrt() * rms(&self.wake, radial));
        let acceleration = self.acceleration();
        let width = self.resolution.at(acceleration) / (SQRT_2 * PI);
        let azimuth = (models.range_to_velocity * velocity).hypot(width);
        let range = deviation(Quantity::Elevation) / models.incidence.tan();
        [azimuth, range].map(|d| (DEVIATIONS * d / models.computed.spacing).ceil() as usize + 1)
    }

    /// Standard deviation of the acceleration toward the radar, where the wake is [m/s²].
    pub(crate) fn acceleration(&self) -> f64 {
        let factor = |w: &WaveSample| {
            let quantity = Quantity::RadialAcceleration;
            self.modulation.transfer.factor(quantity, w.k, w.omega)
        };
        rms(&self.sea, factor).hypot(WEDGE.sqrt() * rms(&self.wake, factor))
    }

    /// What a user should know.
    pub(crate) fn notes(&self, scene: &Scene, models: &Models) -> Vec<String> {
        let mut notes = Vec::new();
        if models.short_waves_vanish() {
            notes.push(format!(
                "a wind of {} m/s raises no short waves at this incidence: the image is specular only, or dark",
                scene.sea.wind_speed
            ));
        }
        if let Some(asked) = models.asked_spacing {
            notes.push(format!(
                "waves on the arms of a wake ask for pixels of {asked:.2} m; {} m are computed: shorter waves count by the \
                 variances of their slopes and velocities where an impulse response is asked for, else not",
                models.computed.spacing
            ));
        }
        let spacing = models.image.spacing;
        let divisions = (spacing / models.computed.spacing).round();
        if let Some(response) = models.response.filter(|_| divisions > COARSE_PIXEL) {
            let [range, azimuth] = [response.range, response.azimuth].map(|axis| axis.resolution);
            notes.push(format!(
                "a pixel of {spacing} m takes {divisions} x {divisions} computed ones, for the radar resolves {range:.1} x {azimuth:.1} m: for an image \
                 averaged to such pixels set radar.range_resolution and radar.azimuth_resolution to what that image resolves"
            ));
        }
        let count = models.wakes.len();
        for (n, wake) in models.wakes.iter().enumerate() {
            let wavelength = wake.kelvin.transverse_wavelength();
            if wake.kelvin.speed > 0.0 && 2.0 * models.computed.spacing > wavelength {
                notes.push(format!(
                    "the transverse waves of the {} are {wavelength:.2} m long: a pixel of {} m carries none of them",
                    Scene::ship_name(n, count),
                    models.computed.spacing
                ));
            }
        }
        notes
    }
}

/// Terms that a scene has only where it asks for them.
fn absent_extras(scene: &Scene, survey: &Survey, models: &Models) -> Vec<(Term, &'static str)> {
    let edge = if scene.ships.is_empty() {
        Some("there is no ship")
    } else if !scene.ships.iter().any(|ship| ship.edge) {
        Some("not asked for")
    } else if models.wakes.iter().all(|wake| wake.edge.is_none()) {
        Some("the ship is at rest, or there is no wind")
    } else {
        let unseen = survey.edge.iter().all(|v| *v == 0.0);
        unseen.then_some("it does not reach the image")
    };
    let asked = |asked: bool| (!asked).then_some("not asked for");
    let subpixel = match &models.subpixel_wakes[..] {
        _ if !models.counts_subpixel => Some("not asked for"),
        [] => Some("there is no ship, or no such wave of one"),
        _ if survey.subpixel_wake[0] == 0.0 => Some("it does not reach the image"),
        _ => None,
    };
    let swell = match &models.swell {
        None => Some("not asked for"),
        Some(_) if survey.swell.is_empty() => Some("no swell that a pixel carries"),
        Some(_) => None,
    };
    let slicks = match &models.slicks {
        None if scene.sea.slick_damping > 0.0 => Some("the wind tears films apart"),
        slicks => asked(slicks.is_some()),
    };
    let response = match (&models.response, scene.radar.range_resolution) {
        (Some(_), _) => None,
        (None, None) => Some("not asked for"),
        (None, Some(_)) => Some("not in model.terms"),
    };
    [
        (Term::Swell, swell),
        (Term::SubpixelWake, subpixel),
        (Term::BrightEdge, edge),
        (Term::Slicks, slicks),
        (Term::Breaking, asked(models.breaking > 0.0)),
        (Term::Gusts, asked(models.gusts.is_some())),
        (Term::Noise, asked(models.noise > 0.0)),
        (Term::ImpulseResponse, response),
    ]
    .into_iter()
    .filter_map(|(term, why)| why.map(|why| (term, why)))
    .collect()
}

/// The waves of the wake in the image, and how much stronger they are within a ship's length of the stern.
fn sampled_wake(wake: &KelvinWake, image: &Raster) -> (Vec<WaveSample>, f64) {
    match wake.track.turn() {
        None => sampled_straight(wake, image),
        Some((radius, _)) => sampled_turn(wake, radius, image),
    }
}

/// The same behind a ship that turns: the mean over ships that go straight on, on all headings that it has had, and are as
/// far ahead of the middle of the image as it is from it.
fn sampled_turn(wake: &KelvinWake, radius: f64, image: &Raster) -> (Vec<WaveSample>, f64) {
    if wake.plan(image, COARSE).nodes() == 0 {
        return (Vec::new(), 1.0);
    }
    let middle = [image.x(image.columns / 2), image.y(image.rows / 2)];
    let [dx, dy] = [0, 1].map(|a| wake.track.position[a] - middle[a]);
    let (mut waves, mut largest) = (Vec::new(), 1.0f64);
    for n in 0..HEADINGS {
        let there = wake.track.at(-PI * radius * n as f64 / HEADINGS as f64);
        let ahead = dx.hypot(dy);
        let track = Track {
            position: [0, 1].map(|a| middle[a] + ahead * there.forward[a]),
            ..there.straight()
        };
        let (mut one, crowding) = sampled_straight(&KelvinWake { track, ..*wake }, image);
        one.iter_mut().for_each(|w| w.variance /= HEADINGS as f64);
        waves.extend(one);
        largest = largest.max(crowding);
    }
    (waves, largest)
}

fn sampled_straight(wake: &KelvinWake, image: &Raster) -> (Vec<WaveSample>, f64) {
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
    let waves = waves::wake(&nodes, wake.track.forward, track_length, area);
    (waves, area / wedge)
}

/// Variance of the hydrodynamic modulation by the waves of the sea that pixels carry and that modulate \[1\].
pub(crate) fn modulation_variance(models: &Models) -> f64 {
    let band = models
        .computed
        .nyquist_wavenumber()
        .min(LARGEST_MODULATING_WAVENUMBER);
    let factor = |w: &WaveSample| {
        let transfer = &models.transfer;
        transfer.factor(Quantity::Hydrodynamic, w.k, w.omega)
    };
    rms(&waves::sea(&models.sea, band), factor).powi(2)
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
