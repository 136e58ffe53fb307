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
    expecting = "\"needed\", \"all\" or a list of the terms sea, swell, kelvin, unresolved, turbulent, edge, slicks, tilt_average, specular, breaking, gusts, range_bunching, hydrodynamic, bunching, coherence, noise, response, speckle"
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
    /// The swell.
    Swell,
    /// The Kelvin wake.
    Kelvin,
    /// The ship's waves that the computed pixels do not carry, as slopes and velocities of a variance: with an impulse
    /// response.
    Unresolved,
    /// The turbulent wake.
    Turbulent,
    /// The current of the turbulent wake and its bright edges.
    Edge,
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
    Bunching,
    /// Loss of azimuth resolution by unresolved and accelerated motion.
    Coherence,
    /// Noise of the radar.
    Noise,
    /// The radar's impulse response in range and azimuth.
    Response,
    /// Multi-look speckle.
    Speckle,
}

impl Term {
    /// Every term, in the order of the data flow.
    pub const ALL: [Self; 18] = [
        Self::Sea,
        Self::Swell,
        Self::Kelvin,
        Self::Unresolved,
        Self::Turbulent,
        Self::Edge,
        Self::Slicks,
        Self::TiltAverage,
        Self::Specular,
        Self::Breaking,
        Self::Gusts,
        Self::RangeBunching,
        Self::Hydrodynamic,
        Self::Bunching,
        Self::Coherence,
        Self::Noise,
        Self::Response,
        Self::Speckle,
    ];

    /// Name in scene files and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sea => "sea",
            Self::Swell => "swell",
            Self::Kelvin => "kelvin",
            Self::Unresolved => "unresolved",
            Self::Turbulent => "turbulent",
            Self::Edge => "edge",
            Self::Slicks => "slicks",
            Self::TiltAverage => "tilt_average",
            Self::Specular => "specular",
            Self::Breaking => "breaking",
            Self::Gusts => "gusts",
            Self::RangeBunching => "range_bunching",
            Self::Hydrodynamic => "hydrodynamic",
            Self::Bunching => "bunching",
            Self::Coherence => "coherence",
            Self::Noise => "noise",
            Self::Response => "response",
            Self::Speckle => "speckle",
        }
    }
}
