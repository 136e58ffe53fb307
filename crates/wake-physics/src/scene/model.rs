//! Which terms are computed, and how well.

use serde::{Deserialize, Serialize};

/// Which terms are computed, and how well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Model {
    /// The terms.
    pub terms: Terms,
    /// Largest error asked for \[1\], 1e-6 to 0.1: for every field relative to its root mean square, for the
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

impl Terms {
    /// Whether a term may be computed: a list that does not name it forbids it.
    #[must_use]
    pub fn allow(&self, term: Term) -> bool {
        match self {
            Self::Rule(_) => true,
            Self::List(list) => list.contains(&term),
        }
    }
}

/// Which terms are computed: a rule, or a list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "\"needed\", \"all\" or a list of the terms sea, swell, kelvin, subpixel_wake, turbulent, bright_edge, slicks, tilt_average, specular, breaking, gusts, range_bunching, hydrodynamic, velocity_bunching, azimuth_smear, noise, impulse_response, speckle"
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
///
/// Scene files may also name the terms as they were named first: `unresolved`, `edge`, `bunching`, `coherence`, `response`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    /// The resolved wind waves.
    Sea,
    /// The swell.
    Swell,
    /// The Kelvin wake.
    Kelvin,
    /// The ship's waves that the computed pixels do not carry, as slopes and velocities of a variance: with an impulse
    /// response.
    #[serde(alias = "unresolved")]
    SubpixelWake,
    /// The turbulent wake.
    Turbulent,
    /// The current of the turbulent wake and its bright edges.
    #[serde(alias = "edge")]
    BrightEdge,
    /// Slicks.
    Slicks,
    /// The average of σ⁰ over the slopes of unresolved waves.
    TiltAverage,
    /// The quasi-specular return.
    Specular,
    /// The return of breaking waves.
    Breaking,
    /// Gusts of the wind.
    Gusts,
    /// Layover of elevated points toward the radar.
    RangeBunching,
    /// Modulation of the Bragg waves by the currents of longer ones.
    Hydrodynamic,
    /// Azimuth shift by the line-of-sight velocity.
    #[serde(alias = "bunching")]
    VelocityBunching,
    /// Loss of azimuth resolution by subpixel and accelerated motion.
    #[serde(alias = "coherence")]
    AzimuthSmear,
    /// Noise of the radar.
    Noise,
    /// The radar's impulse response in range and azimuth.
    #[serde(alias = "response")]
    ImpulseResponse,
    /// Multi-look speckle.
    Speckle,
}

impl Term {
    /// Every term, in the order of the data flow.
    pub const ALL: [Self; 18] = [
        Self::Sea,
        Self::Swell,
        Self::Kelvin,
        Self::SubpixelWake,
        Self::Turbulent,
        Self::BrightEdge,
        Self::Slicks,
        Self::TiltAverage,
        Self::Specular,
        Self::Breaking,
        Self::Gusts,
        Self::RangeBunching,
        Self::Hydrodynamic,
        Self::VelocityBunching,
        Self::AzimuthSmear,
        Self::Noise,
        Self::ImpulseResponse,
        Self::Speckle,
    ];

    /// Name in scene files and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sea => "sea",
            Self::Swell => "swell",
            Self::Kelvin => "kelvin",
            Self::SubpixelWake => "subpixel_wake",
            Self::Turbulent => "turbulent",
            Self::BrightEdge => "bright_edge",
            Self::Slicks => "slicks",
            Self::TiltAverage => "tilt_average",
            Self::Specular => "specular",
            Self::Breaking => "breaking",
            Self::Gusts => "gusts",
            Self::RangeBunching => "range_bunching",
            Self::Hydrodynamic => "hydrodynamic",
            Self::VelocityBunching => "velocity_bunching",
            Self::AzimuthSmear => "azimuth_smear",
            Self::Noise => "noise",
            Self::ImpulseResponse => "impulse_response",
            Self::Speckle => "speckle",
        }
    }
}
