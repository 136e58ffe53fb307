//! The scene: ships, sea, radar and grid, in the units and ranges of a scene file.

mod check;
mod file;
mod forms;
mod keys;
mod model;
pub(crate) mod paper;
mod polarization;
pub mod sensor;

use crate::track::Track;
use crate::window::Window;
pub use keys::stored_key;
pub use model::{Model, Term, TermRule, Terms};
pub use polarization::Polarization;
pub use sensor::Sensor;
use serde::{Deserialize, Serialize};

/// Ships, sea and radar over a grid of pixels.
///
/// The same type reads and writes scene files (TOML). Unknown keys are errors. Absent tables take their defaults, except
/// `[ship]`: without it there is no ship. Several ships are a list of tables, `[[ship]]`. [`Scene::default`] has one
/// default ship. `radar.sensor` sets the radar's keys and [`Grid::spacing`], except those that the file sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "keys::SceneKeys")]
pub struct Scene {
    /// Seed of the random sea and of the speckle. In files, values of 2⁶³ and above are strings of digits.
    #[serde(with = "forms::seed")]
    pub seed: u64,
    /// Pixels of the image.
    pub grid: Grid,
    /// Wind and waves.
    pub sea: Sea,
    /// Ships, at most 100. In files, one ship is a table and several are a list of tables, both named `ship`.
    #[serde(
        rename = "ship",
        serialize_with = "forms::ships::serialize",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub ships: Vec<Ship>,
    /// The radar and its platform.
    pub radar: Radar,
    /// Terms that are computed, and their tolerance.
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
    /// Number of pixels along azimuth, 1 to 16384.
    pub rows: usize,
    /// Number of pixels along ground range, 1 to 16384.
    pub columns: usize,
    /// Pixel size \[m\], 0.1 to 100.
    pub spacing: f64,
    /// Number of computed pixels along each side of an image pixel, 1 to 16; chosen by the plan where absent. With an
    /// impulse response, at least the number that its bandwidth requires.
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
    /// Direction toward which the wind blows [deg clockwise from azimuth]; 0° is along the flight, 90° away from the radar.
    pub wind_toward: f64,
    /// Distance over which the wind has blown \[m\], 100 to 1e7.
    pub fetch: f64,
    /// Spectrum of the resolved waves.
    pub spectrum: SpectrumModel,
    /// Directional spreading of the resolved waves.
    pub spreading: SpreadingModel,
    /// Water depth \[m\], 1 to infinite (`inf`, or "infinite" in formats without infinity).
    #[serde(with = "forms::depth")]
    pub depth: f64,
    /// Time \[s\], 0 to 1e5; moves sea, ship and wake together.
    pub time: f64,
    /// Water temperature [°C], −2 to 40.
    pub temperature: f64,
    /// Salinity \[psu\], 0 to 45.
    pub salinity: f64,
    /// Standard deviation of the logarithm of the wind speed in gusts \[1\], 0 to 0.5; 0: no gusts. See [`crate::gusts`].
    pub gust_strength: f64,
    /// Outer scale of the gusts \[m\], 100 to 50,000.
    pub gust_scale: f64,
    /// Standard deviation of the logarithm of the wind speed in the eddies of the surface layer \[1\], 0 to 0.5; 0: no
    /// eddies. See [`crate::gusts`].
    pub mottle_strength: f64,
    /// Outer scale of the eddies of the surface layer \[m\], 20 to 5000.
    pub mottle_scale: f64,
    /// Significant wave height of the swell \[m\], 0 to 15; 0: no swell. See [`crate::swell`].
    pub swell_height: f64,
    /// Peak wavelength of the swell \[m\], 30 to 1000.
    pub swell_length: f64,
    /// Direction toward which the swell travels [deg clockwise from azimuth].
    pub swell_toward: f64,
    /// Whether breaking waves add to the radar return. See [`crate::scattering::breaking`].
    pub breaking: bool,
    /// Damping of the short waves in slicks \[1\], 0 to 1; 0: no slicks. See [`crate::slicks`].
    pub slick_damping: f64,
    /// Full width of a slick \[m\], 5 to 1000.
    pub slick_width: f64,
    /// Length scale on which slicks meander \[m\], 100 to 50,000.
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
    /// Direction of travel at time 0 [deg clockwise from azimuth]; 0° is along the flight, 90° away from the radar.
    pub heading: f64,
    /// Turn rate [deg/s], −10 to 10, positive to starboard; 0: a straight track. The ship came straight and has turned
    /// through half a circle. The radius must be at least twice the ship's length and twice its transverse wavelength, and
    /// at most 100 km.
    pub turn_rate: f64,
    /// Position (x, y) of midship at time 0 \[m\].
    #[serde(deserialize_with = "forms::two")]
    pub position: [f64; 2],
    /// Form of the hull.
    pub hull: HullForm,
    /// Block coefficient of the full hull, 0.45 to 0.9; 0.8 where absent; only with `hull = "full"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block_coefficient: Option<f64>,
    /// Whether the image contains the radar echo of the ship itself.
    pub echo: bool,
    /// Depth of the low-pass filter `exp(−k·filter_depth)` on the wake's spectrum \[m\], 0 to 20.
    pub filter_depth: f64,
    /// Largest wave slope in the wake one ship length astern of midship \[1\], 0.02 to 1: steeper waves break. No limit
    /// where absent. See [`crate::kelvin`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steepness: Option<f64>,
    /// Damping of the Bragg waves at the stern on the centreline of the turbulent wake \[1\], 0 to 1; with
    /// `recovery = "wind"`, its value in a wind of 5 m/s. See [`crate::turbulent`].
    pub damping: f64,
    /// Dependence of the turbulent wake's damping and bright edges on the wind.
    pub recovery: Recovery,
    /// Whether the turbulent wake has a current and bright edges. See [`crate::turbulent::current`].
    pub edge: bool,
    /// Response time of σ⁰ to the convergence of the turbulent wake's current \[s\], 0 to 1000; computed from wind and radar
    /// where absent; only with [`Self::edge`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge_time: Option<f64>,
    /// Speed of the outflow from the turbulent wake's centreline at the stern [m/s], 0 to 0.3; only with [`Self::edge`].
    pub edge_outflow: f64,
    /// Standard deviation of the line-of-sight velocity that roll and pitch give points on the ship [m/s], 0 to 2; only with
    /// [`Self::echo`].
    pub roll: f64,
    /// Period of roll and pitch \[s\], 4 to 60: points on the ship accelerate while the radar integrates, which defocuses the
    /// echo. Where absent, their velocities are constant; only with [`Self::echo`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_period: Option<f64>,
    /// Number of point scatterers in the echo, 1 to 1000; 12 where absent; only with [`Self::echo`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatterers: Option<u32>,
    /// Power of the halo around the echo relative to the power of its point scatterers \[dB\], −40 to 0; no halo where
    /// absent; only with [`Self::echo`]. See [`crate::sar::halo`].
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

/// Largest coordinate of a ship \[m\]. No image reaches so far.
const FARTHEST: f64 = 1e100;

impl Ship {
    /// Place and direction at a time \[s\], and the curve of the track. Coordinates of more than 10¹⁰⁰ m count as 10¹⁰⁰ m.
    #[must_use]
    pub fn track(&self, time: f64) -> Track {
        // Larger coordinates overflow in squares and areas.
        let start = self.position.map(|at| at.clamp(-FARTHEST, FARTHEST));
        Track::turning(start, self.heading, self.speed * time, self.curvature())
    }

    /// Curvature of the ship's track [1/m], positive to starboard; 0 on a straight track.
    pub(crate) fn curvature(&self) -> f64 {
        if self.turn_rate == 0.0 {
            return 0.0;
        }
        self.turn_rate.to_radians() / self.speed
    }

    /// Heading at a time \[s\] [deg clockwise from azimuth].
    pub(crate) fn heading_at(&self, time: f64) -> f64 {
        self.heading + self.turn_rate * time
    }
}

/// Dependence of a turbulent wake's damping and bright edges on the wind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Recovery {
    /// None: damping and a given response time of the edges are the same in every wind.
    #[default]
    Constant,
    /// The wind restores the damped waves: damping, its length and the response time of the edges decrease with wind speed.
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

/// The radar and its platform; the radar looks toward +x.
///
/// Serialized scenes (reports, manifests, weights) keep the older names of four keys, `resolution`, `noise_floor`, `ambiguity`
/// and `pulse_rate`; [`Scene::to_toml`] writes the names of the fields, and every reader accepts both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Radar {
    /// Satellite mode that sets the radar keys below and `grid.spacing`, unless the scene sets them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Sensor>,
    /// Frequency \[Hz\], 1e9 to 2e10.
    pub frequency: f64,
    /// Transmit and receive polarization.
    pub polarization: Polarization,
    /// Incidence angle \[deg\], 5 to 75.
    pub incidence: f64,
    /// Ratio R/V of slant range and platform speed \[s\], 0 to 200.
    pub range_to_velocity: f64,
    /// Single-look azimuth resolution \[m\], 0.5 to 100.
    #[serde(rename(serialize = "resolution"))]
    pub azimuth_resolution: f64,
    /// Single-look resolution in ground range \[m\], 0.5 to 500. With it, the image has the radar's impulse response along
    /// both axes, see [`crate::sar::impulse`]. Where absent, the pixel is the resolution, with speckle of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_resolution: Option<f64>,
    /// Window over the bandwidth in range, and in azimuth where [`Self::azimuth_window`] is absent; uniform where absent;
    /// only with [`Self::range_resolution`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Window over the bandwidth in azimuth; [`Self::window`] where absent; only with [`Self::range_resolution`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuth_window: Option<Window>,
    /// Number of looks, 1 to 1000.
    pub looks: u32,
    /// Overlap of adjacent looks as a share of a look's band, 0 to 0.9; 0 where absent; only with
    /// [`Self::range_resolution`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look_overlap: Option<f64>,
    /// Noise-equivalent σ⁰ \[dB\], −60 to 20, added before the speckle; no noise where absent.
    #[serde(
        rename(serialize = "noise_floor"),
        skip_serializing_if = "Option::is_none"
    )]
    pub nesz: Option<f64>,
    /// Level of the ship's azimuth ambiguities relative to its echo \[dB\], −60 to 0; none where absent; only with
    /// [`Self::range_resolution`] and [`Self::prf`].
    #[serde(
        rename(serialize = "ambiguity"),
        skip_serializing_if = "Option::is_none"
    )]
    pub azimuth_ambiguity: Option<f64>,
    /// Pulse repetition frequency \[Hz\], 100 to 20,000, which places the azimuth ambiguities; only with
    /// [`Self::azimuth_ambiguity`].
    #[serde(
        rename(serialize = "pulse_rate"),
        skip_serializing_if = "Option::is_none"
    )]
    pub prf: Option<f64>,
    /// Power of the paired echoes of a ship's brightest points relative to the power of these points \[dB\], −40 to 0: a
    /// cross along range and azimuth; none where absent; only with [`Self::range_resolution`]. See
    /// [`crate::sar::paired_echoes`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paired_echoes: Option<f64>,
    /// Relaxation rate of the Bragg waves [1/s], 0.01 to 100, for the hydrodynamic modulation and the bright edges of
    /// wakes; computed from the Bragg waves and the wind where absent.
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
