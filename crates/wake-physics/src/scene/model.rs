//! Terms of the physics that are computed, and their tolerance.

use serde::{Deserialize, Serialize};

/// Terms that are computed, and their tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Model {
    /// Terms of the physics that are computed.
    pub terms: Terms,
    /// Error tolerance \[1\], 1e-6 to 0.1: the largest error of every field relative to its root mean square,
    /// and the root mean square error of the image before speckle relative to its mean.
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
    /// Whether a term may be computed: only a list that lacks the term forbids it.
    #[must_use]
    pub fn allow(&self, term: Term) -> bool {
        match self {
            Self::Rule(_) => true,
            Self::List(list) => list.contains(&term),
        }
    }
}

/// Terms that are computed: by a rule, or a list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"needed\", \"all\" or a list of the terms sea, swell, kelvin, subpixel_wake, turbulent, bright_edge, slicks, tilt_average, specular, breaking, gusts, range_bunching, hydrodynamic, velocity_bunching, azimuth_smear, noise, impulse_response, speckle"
)]
pub enum Terms {
    /// By a rule.
    Rule(TermRule),
    /// Only the terms of a list.
    List(Vec<Term>),
}

/// Rule that selects the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TermRule {
    /// Terms that change the image by more than the tolerance.
    Needed,
    /// All terms of the scene.
    All,
}

/// The terms in the order of the data flow: each with its name in scene files and reports, and its older name if there is
/// one.
macro_rules! terms {
    ($($(#[doc = $doc:literal])* $term:ident = $name:literal $(| $first:literal)?,)*) => {
        /// One physical effect that can be computed or left out.
        ///
        /// Scene files may also use the older names of some terms: `unresolved`, `edge`, `bunching`, `coherence`, `response`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum Term {
            $($(#[doc = $doc])* #[serde(rename = $name $(, alias = $first)?)] $term,)*
        }

        impl Term {
            /// Every term, in the order of the data flow.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$term),*];

            /// Name in scene files and reports.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$term => $name,)*
                }
            }
        }
    };
}

terms! {
    /// The resolved wind waves.
    Sea = "sea",
    /// The swell.
    Swell = "swell",
    /// The Kelvin wake.
    Kelvin = "kelvin",
    /// The ship's waves too short for the computed pixels, as variances of slopes and velocities; only with an impulse
    /// response.
    SubpixelWake = "subpixel_wake" | "unresolved",
    /// The turbulent wake.
    Turbulent = "turbulent",
    /// The current of the turbulent wake and its bright edges.
    BrightEdge = "bright_edge" | "edge",
    /// Slicks.
    Slicks = "slicks",
    /// The average of σ⁰ over the slopes of subpixel waves.
    TiltAverage = "tilt_average",
    /// The quasi-specular return.
    Specular = "specular",
    /// The return of breaking waves.
    Breaking = "breaking",
    /// Gusts of the wind.
    Gusts = "gusts",
    /// Layover of elevated points toward the radar.
    RangeBunching = "range_bunching",
    /// Modulation of the Bragg waves by the currents of longer waves.
    Hydrodynamic = "hydrodynamic",
    /// Azimuth shift by the line-of-sight velocity.
    VelocityBunching = "velocity_bunching" | "bunching",
    /// Loss of azimuth resolution by subpixel and accelerated motion.
    AzimuthSmear = "azimuth_smear" | "coherence",
    /// Noise of the radar.
    Noise = "noise",
    /// The radar's impulse response in range and azimuth.
    ImpulseResponse = "impulse_response" | "response",
    /// Multi-look speckle.
    Speckle = "speckle",
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error of a wrong term lists all terms, and each is serialized as its name.
    #[test]
    fn terms_have_their_names() {
        let error = serde_json::from_str::<Terms>("3").unwrap_err().to_string();
        for term in Term::ALL {
            let name = term.name();
            assert!(error.contains(name), "{name}: {error}");
            assert_eq!(serde_json::to_value(term).unwrap(), name);
        }
    }
}
