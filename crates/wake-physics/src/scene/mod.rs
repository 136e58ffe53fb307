//! The scene: what is simulated, in the units and ranges of a scene file.

mod check;
mod file;
mod forms;
mod keys;
mod model;
pub(crate) mod paper;
mod polarization;
pub mod sensor;

use crate::window::Window;
pub use keys::stored_key;
pub use model::{Model, Term, TermRule, Terms};
pub use polarization::Polarization;
pub use sensor::Sensor;
use serde::{Deserialize, Serialize};

/// A ship, a sea and a radar over a grid of pixels.
///
/// The same type reads and writes scene files (TOML). Unknown keys are errors; an absent table takes its
/// defaults, except `[ship]`: no table, no ship. Several ships are a list of tables, `[[ship]]`. [`Scene::default`] has
/// the default ship. Where `radar.sensor` names a satellite, it sets what no key beside it does, [`Grid::spacing`] too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "keys::SceneKeys")]
pub struct Scene {
    /// Seed of the random sea and of the speckle; from 2⁶³ on, a file holds it as a string of digits.
    #[serde(with = "forms::seed")]
    pub seed: u64,
    /// The pixels.
    pub grid: Grid,
    /// Wind and waves.
    pub sea: Sea,
    /// The ships, at most 100; a file holds one as a table and several as a list, both named `ship`.
    #[serde(
        rename = "ship",
        serialize_with = "forms::ships::serialize",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub ships: Vec<Ship>,
    /// The radar and its platform.
    pub radar: Radar,
    /// Which terms are computed, and how well.
    pub model: Model,
}

fn default_seed() -> u64 {
    7
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            seed: default_seed(),
            grid: Grid::default(),
            sea: Sea::default(),
            ships: vec![Ship::default()],
            radar: Radar::default(),
            model: Model::default(),
        }
    }
}

/// The pixels of the image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Grid {
    /// Pixels along azimuth, 1 to 16384.
    pub rows: usize,
    /// Pixels along ground range, 1 to 16384.
    pub columns: usize,
    /// Pixel size \[m\], 0.1 to 100.
    pub spacing: f64,
    /// Pixels that are computed along each side of one of the image, 1 to 16; chosen by the plan where absent. An impulse
    /// response has at least as many as carry it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub oversampling: Option<u32>,
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            rows: 512,
            columns: 512,
            spacing: 2.5,
            oversampling: None,
        }
    }
}

/// Wind and waves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sea {
    /// Wind speed at 10 m height [m/s], 0 to 30; 0 is a flat sea.
    pub wind_speed: f64,
    /// Where the wind blows to [deg clockwise from azimuth]; 90 is away from the radar.
    pub wind_toward: f64,
    /// Distance over which the wind has blown \[m\], 100 to 1e7.
    pub fetch: f64,
    /// Spectrum of the resolved waves.
    pub spectrum: SpectrumModel,
    /// Directional spreading of the resolved waves.
    pub spreading: SpreadingModel,
    /// Water depth \[m\], 1 to infinite (`inf`, or the word "infinite" where a format has no infinity).
    #[serde(with = "forms::depth")]
    pub depth: f64,
    /// Time \[s\], 0 to 1e5; moves sea, ship and wake together.
    pub time: f64,
    /// Water temperature [°C], −2 to 40.
    pub temperature: f64,
    /// Salinity \[psu\], 0 to 45.
    pub salinity: f64,
    /// Standard deviation of the logarithm of the wind speed in gusts \[1\], 0 to 0.5; 0: none. See [`crate::gusts`].
    pub gust_strength: f64,
    /// Outer scale of the gusts \[m\], 100 to 50,000.
    pub gust_scale: f64,
    /// Standard deviation of the logarithm of the wind speed in the eddies of the surface layer \[1\], 0 to 0.5; 0: none. See
    /// [`crate::gusts`].
    pub mottle_strength: f64,
    /// Outer scale of these eddies \[m\], 20 to 5000.
    pub mottle_scale: f64,
    /// Significant height of a swell \[m\], 0 to 15; 0: none. See [`crate::swell`].
    pub swell_height: f64,
    /// Wavelength of the swell's peak \[m\], 30 to 1000.
    pub swell_length: f64,
    /// Where the swell goes to [deg clockwise from azimuth].
    pub swell_toward: f64,
    /// Whether breaking waves add to the return. See [`crate::scattering::breaking`].
    pub breaking: bool,
    /// Damping of the short waves in slicks \[1\], 0 to 1; 0: none. See [`crate::slicks`].
    pub slick_damping: f64,
    /// Full width of a slick \[m\], 5 to 1000.
    pub slick_width: f64,
    /// Length over which slicks wind \[m\], 100 to 50,000.
    pub slick_scale: f64,
}

impl Default for Sea {
    fn default() -> Self {
        Self {
            wind_speed: 5.0,
            wind_toward: 90.0,
            fetch: 40_000.0,
            spectrum: SpectrumModel::Elfouhaily,
            spreading: SpreadingModel::Hasselmann,
            depth: f64::INFINITY,
            time: 0.0,
            temperature: 20.0,
            salinity: 35.0,
            gust_strength: 0.0,
            gust_scale: 2000.0,
            mottle_strength: 0.0,
            mottle_scale: 250.0,
            swell_height: 0.0,
            swell_length: 200.0,
            swell_toward: 0.0,
            breaking: false,
            slick_damping: 0.0,
            slick_width: 50.0,
            slick_scale: 2500.0,
        }
    }
}

/// Wavenumber spectrum of the resolved waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SpectrumModel {
    /// Elfouhaily et al. (1997).
    Elfouhaily,
    /// Hasselmann et al. (1973), JONSWAP, capped at full development.
    Jonswap,
    /// Pierson and Moskowitz (1964): fully developed, whatever the fetch.
    PiersonMoskowitz,
}

/// Directional spreading of the resolved waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SpreadingModel {
    /// cos-2s with the exponent of Hasselmann et al. (1980).
    Hasselmann,
    /// cos-2s with the exponent of Mitsuyasu et al. (1975).
    Mitsuyasu,
    /// Elfouhaily et al. (1997): even in direction, so that half the waves run backwards.
    Elfouhaily,
}

/// A ship.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ship {
    /// Length at the waterline L \[m\], 1 to 500.
    pub length: f64,
    /// Beam B \[m\], 0.2 to 100, below the length.
    pub beam: f64,
    /// Draft T \[m\], 0.1 to 40, below the length.
    pub draft: f64,
    /// Speed U [m/s], 0 to 40.
    pub speed: f64,
    /// Direction of travel at time 0 [deg clockwise from azimuth].
    pub heading: f64,
    /// Turn rate [deg/s], −10 to 10, positive to starboard; 0: straight on. It has turned by half a circle, and came
    /// straight before. The radius is at least two lengths of the ship and of its transverse waves, at most 100 km.
    pub turn_rate: f64,
    /// Midship (x, y) at time 0 \[m\].
    #[serde(deserialize_with = "forms::two")]
    pub position: [f64; 2],
    /// Form of the hull.
    pub hull: HullForm,
    /// Block coefficient of the full hull, 0.45 to 0.9; 0.8 where absent; only with `hull = "full"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block_coefficient: Option<f64>,
    /// Whether the radar echo of the ship itself is drawn.
    pub echo: bool,
    /// Weights the wake's spectrum with `exp(−k·filter_depth)` \[m\], 0 to 20.
    pub filter_depth: f64,
    /// Largest slope of a wave of the wake, one length astern of midship \[1\], 0.02 to 1: steeper waves break. No limit where
    /// absent. See [`crate::kelvin`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steepness: Option<f64>,
    /// Damping of the Bragg waves at the stern in the middle of the turbulent wake \[1\], 0 to 1; with `recovery = "wind"` in a
    /// wind of 5 m/s. See [`crate::turbulent`].
    pub damping: f64,
    /// How damping and edges of the turbulent wake follow the wind.
    pub recovery: Recovery,
    /// Whether the turbulent wake has a current and bright edges. See [`crate::turbulent::current`].
    pub edge: bool,
    /// Response of σ⁰ to the convergence of that current \[s\], 0 to 1000; from wind and radar where absent; only with
    /// [`Self::edge`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge_time: Option<f64>,
    /// Outflow from the wake's middle at the stern [m/s], 0 to 0.3; only with [`Self::edge`].
    pub edge_outflow: f64,
    /// Standard deviation of the line-of-sight velocity of points on the ship by roll and pitch [m/s], 0 to 2; only with
    /// [`Self::echo`].
    pub roll: f64,
    /// Period of roll and pitch \[s\], 4 to 60: the points accelerate while the radar integrates, which defocuses the echo. They keep
    /// their velocity where absent; only with [`Self::echo`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_period: Option<f64>,
    /// Number of points that the echo consists of, 1 to 1000; 12 where absent; only with [`Self::echo`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatterers: Option<u32>,
    /// Power around the echo over the power of its points \[dB\], −40 to 0; none where absent; only with [`Self::echo`]. See
    /// [`crate::sar::halo`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub halo: Option<f64>,
}

impl Default for Ship {
    fn default() -> Self {
        Self {
            length: 195.0,
            beam: 26.0,
            draft: 10.0,
            speed: 10.0,
            heading: 45.0,
            turn_rate: 0.0,
            position: [0.0, 0.0],
            hull: HullForm::Wigley,
            block_coefficient: None,
            echo: false,
            filter_depth: 0.0,
            steepness: None,
            damping: 0.6,
            recovery: Recovery::Constant,
            edge: false,
            edge_time: None,
            edge_outflow: 0.0,
            roll: 0.0,
            roll_period: None,
            scatterers: None,
            halo: None,
        }
    }
}

impl Ship {
    /// Curvature of its track [1/m], positive to starboard; 0 on a straight one.
    pub(crate) fn curvature(&self) -> f64 {
        if self.turn_rate == 0.0 {
            return 0.0;
        }
        self.turn_rate.to_radians() / self.speed
    }

    /// Where it moves to at a time \[s\] [deg clockwise from azimuth].
    pub(crate) fn heading_at(&self, time: f64) -> f64 {
        self.heading + self.turn_rate * time
    }
}

/// How damping and edges of a turbulent wake follow the wind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Recovery {
    /// Not at all: damping and a given response of the edges are the same in every wind.
    #[default]
    Constant,
    /// The wind restores the damped waves: damping, its length and the response of the edges fall with wind.
    Wind,
}

/// Form of the hull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum HullForm {
    /// Wigley's parabolic hull, block coefficient 4/9.
    Wigley,
    /// A fuller hull with a parallel middle body.
    Full,
}

/// The radar and its platform; it looks toward +x.
///
/// Serialized scenes (reports, manifests, weights) keep the first names of four keys, `resolution`, `noise_floor`, `ambiguity`
/// and `pulse_rate`; [`Scene::to_toml`] writes the names of the fields, and every reader accepts both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Radar {
    /// Satellite mode that sets the radar keys below and `grid.spacing`, unless the scene sets them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Sensor>,
    /// Frequency \[Hz\], 1e9 to 2e10.
    pub frequency: f64,
    /// Polarization, sent and received.
    pub polarization: Polarization,
    /// Incidence angle \[deg\], 5 to 75.
    pub incidence: f64,
    /// Range over platform speed R/V \[s\], 0 to 200.
    pub range_to_velocity: f64,
    /// Single-look azimuth resolution \[m\], 0.5 to 100.
    #[serde(rename(serialize = "resolution"))]
    pub azimuth_resolution: f64,
    /// Resolution of one look in ground range \[m\], 0.5 to 500. Where absent it is the pixel and every pixel has its own
    /// speckle; with it the image has the radar's impulse response in both axes, see [`crate::sar::impulse`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_resolution: Option<f64>,
    /// Window over the bandwidth in range, and in azimuth where [`Self::azimuth_window`] is absent; uniform where absent.
    /// Only with a range resolution, as the four that follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Window over the bandwidth in azimuth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuth_window: Option<Window>,
    /// Number of looks, 1 to 1000.
    pub looks: u32,
    /// Share of its band that a look has in common with the next, 0 to 0.9; 0 where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look_overlap: Option<f64>,
    /// Noise-equivalent σ⁰ \[dB\], −60 to 20, added before the speckle; no noise where absent.
    #[serde(
        rename(serialize = "noise_floor"),
        skip_serializing_if = "Option::is_none"
    )]
    pub nesz: Option<f64>,
    /// Level of the ship's azimuth ambiguities over its echo \[dB\], −60 to 0; none where absent.
    #[serde(
        rename(serialize = "ambiguity"),
        skip_serializing_if = "Option::is_none"
    )]
    pub azimuth_ambiguity: Option<f64>,
    /// Pulse repetition frequency \[Hz\], 100 to 20,000: places the ambiguities; only with them.
    #[serde(
        rename(serialize = "pulse_rate"),
        skip_serializing_if = "Option::is_none"
    )]
    pub prf: Option<f64>,
    /// Power of the paired echoes of a ship's brightest points over the power of these points \[dB\], −40 to 0: a cross along range and
    /// azimuth; none where absent. See [`crate::sar::paired_echoes`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paired_echoes: Option<f64>,
    /// Relaxation rate of the Bragg waves [1/s], 0.01 to 100, in the hydrodynamic modulation and at the edges of wakes; from
    /// the Bragg wave and the wind where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation_rate: Option<f64>,
}

impl Default for Radar {
    fn default() -> Self {
        Self {
            sensor: None,
            frequency: 9.6e9,
            polarization: Polarization::VV,
            incidence: 32.0,
            range_to_velocity: 78.0,
            azimuth_resolution: 3.0,
            range_resolution: None,
            window: None,
            azimuth_window: None,
            looks: 4,
            look_overlap: None,
            nesz: None,
            azimuth_ambiguity: None,
            prf: None,
            paired_echoes: None,
            relaxation_rate: None,
        }
    }
}
