//! The scene: what is simulated, in the units and ranges of a scene file.

use crate::error::{Error, Result, finite, in_range};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A ship, a sea and a radar over a grid of pixels.
///
/// The same type reads and writes scene files (TOML). Unknown keys are errors; an absent table takes its
/// defaults, except `[ship]`: no table, no ship. [`Scene::default`] has the default ship.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Seed of the random sea and of the speckle.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// The pixels.
    #[serde(default)]
    pub grid: Grid,
    /// Wind and waves.
    #[serde(default)]
    pub sea: Sea,
    /// The ship, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ship: Option<Ship>,
    /// The radar and its platform.
    #[serde(default)]
    pub radar: Radar,
    /// Which terms are computed, and how well.
    #[serde(default)]
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
            ship: Some(Ship::default()),
            radar: Radar::default(),
            model: Model::default(),
        }
    }
}

/// The pixels of the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Grid {
    /// Pixels along azimuth, 1 to 16384.
    pub rows: usize,
    /// Pixels along ground range, 1 to 16384.
    pub columns: usize,
    /// Pixel size [m], 0.1 to 100.
    pub spacing: f64,
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            rows: 512,
            columns: 512,
            spacing: 2.5,
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
    /// Distance over which the wind has blown [m], 100 to 1e7.
    pub fetch: f64,
    /// Spectrum of the resolved waves.
    pub spectrum: SpectrumModel,
    /// How the resolved waves spread around the wind.
    pub spreading: SpreadingModel,
    /// Water depth [m], 1 to infinite (`inf`, or the word "infinite" where a format has no infinity).
    #[serde(with = "depth_or_infinite")]
    pub depth: f64,
    /// Time [s], 0 to 1e5; moves sea, ship and wake together.
    pub time: f64,
    /// Water temperature [°C], −2 to 40.
    pub temperature: f64,
    /// Salinity [psu], 0 to 45.
    pub salinity: f64,
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
        }
    }
}

/// Wavenumber spectrum of the resolved waves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
pub enum SpreadingModel {
    /// cos-2s with the exponent of Hasselmann et al. (1980).
    Hasselmann,
    /// cos-2s with the exponent of Mitsuyasu et al. (1975).
    Mitsuyasu,
    /// Elfouhaily et al. (1997): even in direction, so that half the waves run backwards.
    Elfouhaily,
}

/// The ship.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ship {
    /// Length at the waterline L [m], 1 to 500.
    pub length: f64,
    /// Beam B [m], 0.2 to 100, below the length.
    pub beam: f64,
    /// Draft T [m], 0.1 to 40, below the length.
    pub draft: f64,
    /// Speed U [m/s], 0 to 40.
    pub speed: f64,
    /// Where it moves to [deg clockwise from azimuth].
    pub heading: f64,
    /// Midship (x, y) at time 0 [m].
    pub position: [f64; 2],
    /// Form of the hull.
    pub hull: HullForm,
    /// Block coefficient of the full hull, 0.45 to 0.9; 0.8 where absent; only with `hull = "full"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block_coefficient: Option<f64>,
    /// Whether the radar echo of the ship itself is drawn.
    pub echo: bool,
    /// Weights the wake's spectrum with exp(−k·filter_depth) [m], 0 to 20.
    pub filter_depth: f64,
}

impl Default for Ship {
    fn default() -> Self {
        Self {
            length: 195.0,
            beam: 26.0,
            draft: 10.0,
            speed: 10.0,
            heading: 45.0,
            position: [0.0, 0.0],
            hull: HullForm::Wigley,
            block_coefficient: None,
            echo: false,
            filter_depth: 0.0,
        }
    }
}

/// Form of the hull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HullForm {
    /// Wigley's parabolic hull, block coefficient 4/9.
    Wigley,
    /// A fuller hull with a parallel middle body.
    Full,
}

/// The radar and its platform; it looks toward +x.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Radar {
    /// Frequency [Hz], 1e9 to 2e10.
    pub frequency: f64,
    /// Polarization, sent and received.
    pub polarization: Polarization,
    /// Incidence angle [deg], 5 to 75.
    pub incidence: f64,
    /// Range over platform speed R/V [s], 0 to 200.
    pub range_to_velocity: f64,
    /// Single-look azimuth resolution [m], 0.5 to 100.
    pub resolution: f64,
    /// Number of independent looks, 1 to 1000.
    pub looks: u32,
    /// Relaxation rate of the hydrodynamic modulation [1/s], 0.01 to 100; from the Bragg wave and the
    /// wind where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation_rate: Option<f64>,
}

impl Default for Radar {
    fn default() -> Self {
        Self {
            frequency: 9.6e9,
            polarization: Polarization::VV,
            incidence: 32.0,
            range_to_velocity: 78.0,
            resolution: 3.0,
            looks: 4,
            relaxation_rate: None,
        }
    }
}

/// Polarization, sent and received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Polarization {
    /// Vertical both ways.
    VV,
    /// Horizontal both ways.
    HH,
}

/// Which terms are computed, and how well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Model {
    /// The terms.
    pub terms: Terms,
    /// Largest error asked for [1], 1e-6 to 0.1: for every field relative to its root mean square, for the
    /// image before speckle as root mean square relative to its mean.
    pub tolerance: f64,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            terms: Terms::Rule(TermRule::Needed),
            tolerance: 1e-3,
        }
    }
}

/// Which terms are computed: a rule, or a list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "\"needed\", \"all\" or a list of the terms sea, kelvin, turbulent, tilt_average, specular, range_bunching, hydrodynamic, bunching, coherence, speckle"
)]
pub enum Terms {
    /// By a rule.
    Rule(TermRule),
    /// Exactly these.
    List(Vec<Term>),
}

/// How terms are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TermRule {
    /// Those that change the image by more than the tolerance.
    Needed,
    /// All that the scene has.
    All,
}

/// One physical effect that can be computed or left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    /// The resolved wind waves.
    Sea,
    /// The Kelvin wake.
    Kelvin,
    /// The turbulent wake.
    Turbulent,
    /// The average of σ⁰ over the slopes of unresolved waves.
    TiltAverage,
    /// The quasi-specular return.
    Specular,
    /// Layover of elevated points toward the radar.
    RangeBunching,
    /// Modulation of the Bragg waves by the currents of longer ones.
    Hydrodynamic,
    /// Azimuth shift by the line-of-sight velocity.
    Bunching,
    /// Loss of azimuth resolution by unresolved and accelerated motion.
    Coherence,
    /// Multi-look speckle.
    Speckle,
}

impl Term {
    /// Every term, in the order of the data flow.
    pub const ALL: [Self; 10] = [
        Self::Sea,
        Self::Kelvin,
        Self::Turbulent,
        Self::TiltAverage,
        Self::Specular,
        Self::RangeBunching,
        Self::Hydrodynamic,
        Self::Bunching,
        Self::Coherence,
        Self::Speckle,
    ];
}

/// Depth as a number, or "infinite": JSON has no infinity.
mod depth_or_infinite {
    use serde::{Deserialize, Deserializer, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a depth in metres, inf or \"infinite\"")]
    enum Depth {
        Metres(f64),
        Word(Word),
    }

    #[derive(Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Word {
        Infinite,
    }

    pub(super) fn serialize<S: Serializer>(depth: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if depth.is_finite() {
            serializer.serialize_f64(*depth)
        } else {
            serializer.serialize_str("infinite")
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(match Depth::deserialize(deserializer)? {
            Depth::Metres(metres) => metres,
            Depth::Word(Word::Infinite) => f64::INFINITY,
        })
    }
}

/// Reading, writing and checking.
impl Scene {
    /// Reads a scene from the text of a scene file and checks it.
    ///
    /// # Errors
    ///
    /// [`Error::Parse`] with line and key, or what [`Scene::validate`] finds.
    pub fn from_toml(text: &str) -> Result<Self> {
        let scene: Self = toml::from_str(text).map_err(|e| Error::Parse {
            message: e.to_string().trim().to_owned(),
        })?;
        scene.validate()?;
        Ok(scene)
    }

    /// Reads a scene file and checks it.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if the file cannot be read, else as [`Scene::from_toml`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::File {
            action: "read",
            path: path.to_owned(),
            message: e.to_string(),
        })?;
        Self::from_toml(&text)
    }

    /// The scene as the text of a scene file.
    ///
    /// # Errors
    ///
    /// [`Error::Parse`] if a value has no form in TOML (a seed above 2⁶³ − 1).
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string(self).map_err(|e| Error::Parse {
            message: e.to_string(),
        })
    }

    /// The scene with assignments such as `ship.speed=10` made, in order, then checked.
    ///
    /// The value is TOML; a bare word is a string. Setting a key of a ship where there is none makes the
    /// default ship first.
    ///
    /// # Errors
    ///
    /// [`Error::Assignment`] for a text without `=`, an unknown key or a wrong type, else as
    /// [`Scene::validate`].
    pub fn with_assignments<S: AsRef<str>>(&self, assignments: &[S]) -> Result<Self> {
        let mut scene = self.clone();
        for text in assignments {
            scene = scene.assigned(text.as_ref())?;
        }
        scene.validate()?;
        Ok(scene)
    }

    fn assigned(&self, assignment: &str) -> Result<Self> {
        let fail = |message: String| Error::Assignment {
            assignment: assignment.to_owned(),
            message,
        };
        let (key, value) = assignment
            .split_once('=')
            .ok_or_else(|| fail("there is no '='".to_owned()))?;
        let value = toml_value(value.trim()).ok_or_else(|| fail("there is no value".to_owned()))?;
        let mut root = toml::Table::try_from(self).map_err(|e| fail(e.to_string()))?;
        let path: Vec<&str> = key.trim().split('.').collect();
        let (last, tables) = path.split_last().unwrap_or((&"", &[]));
        let mut table = &mut root;
        for name in tables {
            let entry = table
                .entry((*name).to_owned())
                .or_insert_with(|| toml::Table::new().into());
            table = entry
                .as_table_mut()
                .ok_or_else(|| fail(format!("{name} is no table")))?;
        }
        table.insert((*last).to_owned(), value);
        root.try_into()
            .map_err(|e: toml::de::Error| fail(e.message().trim().to_owned()))
    }

    /// Checks every value against its closed range.
    ///
    /// # Errors
    ///
    /// The first value found outside, with name, value and range.
    pub fn validate(&self) -> Result<()> {
        self.grid.validate()?;
        self.sea.validate()?;
        if let Some(ship) = &self.ship {
            ship.validate()?;
        }
        self.radar.validate()?;
        in_range("model.tolerance", self.model.tolerance, 1e-6, 0.1, "")
    }
}

/// Parses a TOML value; what is no TOML value is a string; nothing is `None`.
fn toml_value(text: &str) -> Option<toml::Value> {
    if text.is_empty() {
        return None;
    }
    let mut table: toml::Table = toml::from_str(&format!("value = {text}"))
        .unwrap_or_else(|_| toml::Table::from_iter([("value".to_owned(), text.into())]));
    table.remove("value")
}

impl Grid {
    fn validate(&self) -> Result<()> {
        in_range("grid.rows", self.rows as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.columns", self.columns as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.spacing", self.spacing, 0.1, 100.0, "m")
    }
}

impl Sea {
    fn validate(&self) -> Result<()> {
        in_range("sea.wind_speed", self.wind_speed, 0.0, 30.0, "m/s")?;
        finite("sea.wind_toward", self.wind_toward, "degrees")?;
        in_range("sea.fetch", self.fetch, 100.0, 1e7, "m")?;
        in_range("sea.depth", self.depth, 1.0, f64::INFINITY, "m")?;
        in_range("sea.time", self.time, 0.0, 1e5, "s")?;
        in_range("sea.temperature", self.temperature, -2.0, 40.0, "°C")?;
        in_range("sea.salinity", self.salinity, 0.0, 45.0, "psu")
    }
}

impl Ship {
    fn validate(&self) -> Result<()> {
        in_range("ship.length", self.length, 1.0, 500.0, "m")?;
        in_range("ship.beam", self.beam, 0.2, 100.0, "m")?;
        in_range("ship.draft", self.draft, 0.1, 40.0, "m")?;
        for (name, value) in [("ship.beam", self.beam), ("ship.draft", self.draft)] {
            if value >= self.length {
                return Err(Error::Conflict {
                    name: name.to_owned(),
                    value: format!("{value} m"),
                    requirement: format!("but must be below ship.length, {} m", self.length),
                });
            }
        }
        in_range("ship.speed", self.speed, 0.0, 40.0, "m/s")?;
        finite("ship.heading", self.heading, "degrees")?;
        finite("ship.position[0]", self.position[0], "m")?;
        finite("ship.position[1]", self.position[1], "m")?;
        in_range("ship.filter_depth", self.filter_depth, 0.0, 20.0, "m")?;
        match (self.hull, self.block_coefficient) {
            (HullForm::Wigley, Some(value)) => Err(Error::Conflict {
                name: "ship.block_coefficient".to_owned(),
                value: value.to_string(),
                requirement: "but the Wigley hull has 4/9; set ship.hull = \"full\" to choose it"
                    .to_owned(),
            }),
            (HullForm::Full, Some(value)) => {
                in_range("ship.block_coefficient", value, 0.45, 0.9, "")
            }
            (_, None) => Ok(()),
        }
    }
}

impl Radar {
    fn validate(&self) -> Result<()> {
        in_range("radar.frequency", self.frequency, 1e9, 2e10, "Hz")?;
        in_range("radar.incidence", self.incidence, 5.0, 75.0, "degrees")?;
        in_range(
            "radar.range_to_velocity",
            self.range_to_velocity,
            0.0,
            200.0,
            "s",
        )?;
        in_range("radar.resolution", self.resolution, 0.5, 100.0, "m")?;
        in_range("radar.looks", f64::from(self.looks), 1.0, 1000.0, "")?;
        match self.relaxation_rate {
            Some(rate) => in_range("radar.relaxation_rate", rate, 0.01, 100.0, "1/s"),
            None => Ok(()),
        }
    }
}

/// The 3,456 scenes of the parameter grid of Kamirul, Pappas and Achim: ship 195 × 26 m; speed 6, 8, 10,
/// 12 m/s; heading 0 to 315° by 45°; wind 3, 5, 7 m/s toward 0, 90, 180, 270°; fetch 10, 40, 70 km;
/// incidence 16, 24, 32°. All other values are defaults.
pub fn paper_grid() -> impl Iterator<Item = Scene> {
    const SPEEDS: [f64; 4] = [6.0, 8.0, 10.0, 12.0];
    const WINDS: [f64; 3] = [3.0, 5.0, 7.0];
    const FETCHES: [f64; 3] = [10e3, 40e3, 70e3];
    const INCIDENCES: [f64; 3] = [16.0, 24.0, 32.0];
    (0..4 * 8 * 3 * 4 * 3 * 3).map(|index| {
        let mut rest = index;
        let mut pick = |n: usize| {
            let i = rest % n;
            rest /= n;
            i
        };
        let mut scene = Scene::default();
        scene.radar.incidence = INCIDENCES[pick(3)];
        scene.sea.fetch = FETCHES[pick(3)];
        scene.sea.wind_toward = 90.0 * pick(4) as f64;
        scene.sea.wind_speed = WINDS[pick(3)];
        scene.ship = Some(Ship {
            heading: 45.0 * pick(8) as f64,
            speed: SPEEDS[pick(4)],
            ..Ship::default()
        });
        scene
    })
}
