//! Subjects of a sentence, and classes of words.

use crate::amounts::Dimension;
use crate::filler::is_listed;
use crate::pieces::{Piece, word_at};

/// Subject that a number can belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subject {
    Ship,
    Wake,
    Heading,
    Wind,
    Fetch,
    Incidence,
    /// An angle without an owner.
    Angle,
    /// Waves, which a scene derives from its wind.
    Wave,
    /// Something with a length, such as the depth.
    Length,
    /// Something with an angle or a temperature, such as the latitude.
    Degrees,
    /// Anything else that a prompt cannot state, such as a current.
    Other,
    /// Anything else that a prompt may mention without a value, such as the satellite.
    Bystander,
}

impl Subject {
    /// Whether this subject can have a quantity of a dimension.
    pub(crate) fn can_have(self, dimension: Dimension) -> bool {
        match self {
            Self::Incidence | Self::Angle | Self::Degrees => dimension == Dimension::Angle,
            Self::Heading => dimension != Dimension::Length,
            Self::Wake | Self::Length => dimension == Dimension::Length,
            _ => true,
        }
    }
}

/// A subject named in a sentence.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Named {
    pub(crate) subject: Subject,
    /// Index of its word in the sentence.
    pub(crate) at: usize,
}

/// The subjects that a sentence names, in order.
pub(crate) fn subjects(sentence: &[Piece<'_>]) -> Vec<Named> {
    let named = |at: usize| {
        Some(Named {
            subject: subject(sentence, at)?,
            at,
        })
    };
    (0..sentence.len()).filter_map(named).collect()
}

/// The subject that the word at a place names.
fn subject(sentence: &[Piece<'_>], at: usize) -> Option<Subject> {
    let noun = noun(word_at(sentence, at)?)?;
    let owner = word_before(sentence, at).and_then(self::noun);
    match noun {
        // In "wind heading toward" the subject is the wind, in "incidence angle" the incidence.
        Subject::Heading if owner == Some(Subject::Wind) => None,
        Subject::Heading
            if word_before(sentence, at) == Some("of")
                && word_at(sentence, at) == Some("course") =>
        {
            None
        }
        Subject::Heading
            if owner.is_some_and(|owner| !matches!(owner, Subject::Ship | Subject::Wake)) =>
        {
            Some(Subject::Other)
        }
        Subject::Angle if word_at(sentence, at + 2) == Some("incidence") => {
            Some(Subject::Incidence)
        }
        Subject::Angle => Some(
            owner
                .filter(|&owner| owner != Subject::Wake)
                .unwrap_or(Subject::Other),
        ),
        noun => Some(noun),
    }
}

/// The subject that a word names by itself.
pub(crate) fn noun(word: &str) -> Option<Subject> {
    Some(match word {
        "ship" | "ships" | "vessel" | "vessels" | "boat" | "boats" | "freighter" | "freighters"
        | "tanker" | "tankers" | "ferry" | "ferries" | "trawler" | "trawlers" | "frigate"
        | "yacht" | "shipless" => Subject::Ship,
        "wake" | "wakes" => Subject::Wake,
        "wind" | "winds" | "breeze" | "windless" => Subject::Wind,
        "heading" | "headed" | "course" => Subject::Heading,
        "fetch" => Subject::Fetch,
        "incidence" | "incident" => Subject::Incidence,
        "angle" => Subject::Angle,
        "wave" | "waves" => Subject::Wave,
        "length" | "beam" | "draft" | "draught" | "depth" | "height" | "width" | "distance"
        | "wavelength" | "wavelengths" | "resolution" | "spacing" | "altitude" | "hs" => {
            Subject::Length
        }
        "latitude" | "longitude" | "temperature" | "bearing" | "salinity" => Subject::Degrees,
        "swell" | "swells" | "current" | "currents" | "tide" | "tides" | "gust" | "gusts"
        | "gusting" | "gusty" | "beaufort" | "rain" | "band" | "polarization" | "polarisation"
        | "hh" | "vv" | "hv" | "vh" | "speckle" | "looks" | "turn" | "turns" | "turning"
        | "slick" | "slicks" | "gale" | "storm" | "squall" | "submarine" | "iceberg" => {
            Subject::Other
        }
        "satellite" | "aircraft" | "platform" | "kelvin" | "wedge" | "radar" => Subject::Bystander,
        _ => return None,
    })
}

/// Whether a word means that a ship does not move.
pub(crate) fn is_at_rest(word: &str) -> bool {
    matches!(
        word,
        "stationary" | "anchored" | "moored" | "motionless" | "stopped" | "halted" | "unmoving"
    )
}

pub(crate) fn word_before<'a>(sentence: &[Piece<'a>], at: usize) -> Option<&'a str> {
    word_at(sentence, at.checked_sub(1)?)
}

/// Whether this word ends the description of the noun before it.
pub(crate) fn is_link(word: &str) -> bool {
    [
        "a", "an", "the", "and", "or", "but", "while", "with", "without", "at", "in", "on", "by",
        "to", "toward", "towards", "from", "under", "over", "into", "for", "is", "are", "as",
        "its", "that", "which", "against", "through", "across", "no",
    ]
    .contains(&word)
        || is_motion(word)
        || matches!(word, "heading" | "blowing" | "blows")
}

/// Whether a word means that a ship moves.
pub(crate) fn is_motion(word: &str) -> bool {
    [
        "moving",
        "moves",
        "move",
        "sailing",
        "sails",
        "sail",
        "steaming",
        "steams",
        "travelling",
        "traveling",
        "travels",
        "going",
        "goes",
        "cruising",
        "cruises",
        "running",
        "runs",
        "proceeding",
        "proceeds",
        "coming",
        "comes",
        "bound",
        "heads",
        "head",
        "headed",
    ]
    .contains(&word)
}

/// Whether a word changes no value of a scene.
pub(crate) fn says_nothing(word: &str) -> bool {
    is_listed(word) || is_filler(word) || is_motion(word)
}

/// Whether a word marks what follows as approximate.
pub(crate) fn is_approximate(word: &str) -> bool {
    matches!(
        word,
        "about"
            | "approximately"
            | "approx"
            | "around"
            | "roughly"
            | "nearly"
            | "almost"
            | "ca"
            | "circa"
            | "mainly"
            | "generally"
    )
}

/// Whether a word gives a strength without a number: "light wind", "a fast ferry".
pub(crate) fn is_strength(word: &str) -> bool {
    [
        "light", "gentle", "moderate", "fresh", "strong", "stiff", "weak", "high", "low", "heavy",
        "faint", "slight", "brisk", "fast", "slow", "quick", "swift", "rapid", "slowly", "quickly",
        "swiftly", "rapidly", "gently", "strongly",
    ]
    .contains(&word)
}

/// Whether a word between "from" and a direction has no meaning.
pub(crate) fn is_filler(word: &str) -> bool {
    [
        "about",
        "approximately",
        "approx",
        "around",
        "roughly",
        "nearly",
        "almost",
        "some",
        "ca",
        "circa",
        "a",
        "an",
        "the",
        "direction",
        "directions",
        "bearing",
        "of",
        "true",
        "due",
        "exactly",
        "is",
        "mainly",
        "generally",
    ]
    .contains(&word)
}

/// Whether a word names speed or direction, and so refers to a number nearby.
pub(crate) fn is_attribute(word: &str) -> bool {
    [
        "speed",
        "speeds",
        "velocity",
        "direction",
        "directions",
        "directed",
        "directing",
        "toward",
        "towards",
        "angles",
        "bound",
    ]
    .contains(&word)
}

/// Whether a word is about sea or radar, but a prompt cannot state it.
pub(crate) fn is_unstated(word: &str) -> bool {
    [
        "calm",
        "rough",
        "beaufort",
        "bft",
        "drifting",
        "polarization",
        "polarisation",
        "polarized",
        "polarised",
        "frequency",
        "ghz",
        "looks",
        "windy",
        "breezy",
        "wavy",
        "offshore",
        "downwind",
        "upwind",
        "crosswind",
        "leeward",
        "nadir",
        "northeasterlies",
        "westerlies",
        "easterlies",
        "trades",
        "hurricane",
        "buoy",
        "island",
        "coast",
        "ice",
    ]
    .contains(&word)
}

/// Whether a compass word after this one is the direction in which something moves.
pub(crate) fn leads(word: &str) -> bool {
    is_motion(word) || matches!(word, "heading" | "course" | "blowing" | "blows")
}
