//! What a sentence speaks of, and what it denies.

use crate::amounts::Dimension;
use crate::compass::is_compass;
use crate::filler::is_listed;
use crate::pieces::{Kind, Piece, word_at};
use std::ops::Range;

/// What a number can belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subject {
    Ship,
    Wake,
    Heading,
    Wind,
    Fetch,
    Incidence,
    /// An angle of its own.
    Angle,
    /// Waves: a scene has them from its wind.
    Wave,
    /// Something that has a length, such as the depth.
    Length,
    /// Something that has an angle or a temperature, such as the latitude.
    Degrees,
    /// Something else that no prompt can state, such as a current.
    Other,
    /// Something else that a prompt may name for its own sake, such as the satellite.
    Bystander,
}

impl Subject {
    /// Whether a quantity may be one of this subject.
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

/// Something denied in a sentence.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Denied {
    /// `None`: not understood.
    pub(crate) subject: Option<Subject>,
    pub(crate) pieces: Range<usize>,
}

/// The subjects a sentence names, in their order.
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
        // "wind heading toward" is about the wind, "incidence angle" about the incidence.
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

/// What a sentence denies, in its order.
pub(crate) fn denials(sentence: &[Piece<'_>]) -> Vec<Denied> {
    let mut found: Vec<Denied> = Vec::new();
    let mut at = 0;
    while at < sentence.len() {
        match denial(sentence, at) {
            Some(denied) => {
                at = denied.pieces.end.max(at + 1);
                found.push(denied);
                while let Some(denied) = further(sentence, at) {
                    at = denied.pieces.end;
                    found.push(denied);
                }
            }
            None => at += 1,
        }
    }
    found
}

/// Pieces that a denial reaches at most.
const REACH: usize = 8;

/// What is denied from a piece on.
fn denial(sentence: &[Piece<'_>], at: usize) -> Option<Denied> {
    let word = word_at(sentence, at);
    if word.is_some_and(opens_condition) {
        return Some(condition(sentence, at));
    }
    let named = word.and_then(noun);
    if let Some(subject) = named.filter(|subject| matches!(subject, Subject::Ship | Subject::Wind))
    {
        let understood = denied_after(sentence, at).map(|length| (Some(subject), length));
        let (subject, length) =
            understood.or_else(|| Some((None, perhaps_denied_after(sentence, at)?)))?;
        let pieces = at..at + length;
        return Some(Denied { subject, pieces });
    }
    let none =
        sentence[at].kind == Kind::Number(0.0) && noun_after(sentence, at) == Some(Subject::Ship);
    let start = at + opening(sentence, at).or(none.then_some(1))?;
    let is_not = word.is_some_and(|word| word == "not" || word.ends_with("n't"));
    if is_not && word_at(sentence, start) == Some("only") {
        return None;
    }
    let (mut plain, mut understood) = (0, true);
    for end in start..sentence.len().min(start + REACH) {
        let Some(word) = word_at(sentence, end) else {
            let ends = matches!(sentence[end].kind, Kind::Comma | Kind::Stop | Kind::Colon);
            if ends {
                return denied_nothing(sentence, at..end);
            }
            understood = false;
            continue;
        };
        // "no lack of ships", "not windless": denied twice.
        understood &= !denies(word);
        match noun(word) {
            Some(subject) if subject != Subject::Heading && subject != Subject::Bystander => {
                let compound = noun_after(sentence, end)
                    .filter(|s| matches!(s, Subject::Wake | Subject::Wave));
                let subject = compound
                    .filter(|&head| head == Subject::Wave)
                    .unwrap_or(subject);
                let known = matches!(
                    subject,
                    Subject::Ship | Subject::Wind | Subject::Wake | Subject::Wave
                );
                let end = end + 1 + usize::from(compound.is_some());
                understood &= !is_taken_back(sentence, at, end);
                let others = (start..end).any(|at| word_at(sentence, at).is_some_and(is_further));
                let subject = if others { Subject::Bystander } else { subject };
                let subject = (understood && known).then_some(subject);
                return Some(Denied {
                    subject,
                    pieces: at..end,
                });
            }
            _ if matches!(word, "but" | "while" | "with" | "because") => {
                return denied_nothing(sentence, at..end);
            }
            _ if is_article(word) => understood &= plain == 0,
            _ if matches!(
                word,
                "of" | "sign" | "signs" | "trace" | "traces" | "kind" | "evidence"
            ) =>
            {
                plain = 0;
            }
            _ if is_link(word) || is_at_rest(word) || is_compass(word) => understood = false,
            _ => {
                understood &= is_plain(word);
                plain += 1;
            }
        }
    }
    denied_nothing(sentence, at..sentence.len().min(start + REACH))
}

/// Whether what follows a denied noun takes the denial back: "not ship-free", "no ships but one".
fn is_taken_back(sentence: &[Piece<'_>], at: usize, end: usize) -> bool {
    let counted = |at: usize| {
        sentence.get(at).is_some_and(|piece| {
            matches!(
                piece.kind,
                Kind::Number(_) | Kind::Figure | Kind::Word("one")
            )
        })
    };
    denied_after(sentence, end - 1).is_some()
        || (word_at(sentence, at) != Some("not")
            && matches!(word_at(sentence, end), Some("but" | "save"))
            && counted(end + 1))
}

/// Whether a word denies or tells of an absence.
fn denies(word: &str) -> bool {
    matches!(
        word,
        "no" | "not"
            | "without"
            | "neither"
            | "never"
            | "cannot"
            | "lacking"
            | "sans"
            | "non"
            | "none"
            | "free"
            | "devoid"
            | "absence"
            | "lack"
            | "shortage"
            | "empty"
            | "clear"
    ) || word.ends_with("n't")
        || word.ends_with("less")
}

/// Whether a word between "no" and a noun leaves the noun denied: "no visible ship", "no large ships".
fn is_plain(word: &str) -> bool {
    says_nothing(word)
        || is_further(word)
        || matches!(
            word,
            "large" | "big" | "small" | "detectable" | "apparent" | "discernible" | "nearby"
        )
}

/// Whether a word makes what follows, up to the next comma, a condition or an exception.
fn opens_condition(word: &str) -> bool {
    matches!(
        word,
        "unless"
            | "if"
            | "except"
            | "excepting"
            | "excluding"
            | "instead"
            | "rather"
            | "until"
            | "lest"
    )
}

/// A condition or an exception, up to the next comma: nothing of it is stated.
fn condition(sentence: &[Piece<'_>], at: usize) -> Denied {
    let ends = |piece: &Piece<'_>| matches!(piece.kind, Kind::Comma | Kind::Stop);
    let length = sentence[at..].iter().position(ends);
    Denied {
        subject: None,
        pieces: at..length.map_or(sentence.len(), |length| at + length),
    }
}

/// A denial of no subject, which matters where it denies numbers or directions.
fn denied_nothing(sentence: &[Piece<'_>], pieces: Range<usize>) -> Option<Denied> {
    let says = |at: usize| match sentence[at].kind {
        Kind::Number(_) | Kind::Figure => true,
        Kind::Word(word) => is_compass(word) || noun(word).is_some() || is_at_rest(word),
        _ => false,
    };
    pieces.clone().any(says).then_some(Denied {
        subject: None,
        pieces,
    })
}

/// Number of pieces of the denial that starts at a piece: "no", "free of".
fn opening(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    let word = word_at(sentence, at)?;
    let of = word_at(sentence, at + 1) == Some("of");
    match word {
        "no" | "not" | "without" | "neither" | "nor" | "never" | "cannot" | "lacking" | "sans"
        | "non" => Some(1),
        "free" | "devoid" | "absence" | "lack" | "empty" | "clear" if of => Some(2),
        _ => word.ends_with("n't").then_some(1),
    }
}

/// Number of pieces of a noun and what denies it: "shipless", "ship-free", "ships: none", "ship is not visible".
fn denied_after(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    if word_at(sentence, at)?.ends_with("less") {
        return Some(1);
    }
    let mut end = at + 1;
    let links = |piece: &Piece<'_>| {
        piece.kind == Kind::Colon || matches!(piece.kind, Kind::Word("is" | "are" | "was" | "were"))
    };
    while sentence.get(end).is_some_and(links) {
        end += 1;
    }
    let last = match word_at(sentence, end)? {
        "free" if word_at(sentence, end + 1) != Some("of") => end,
        "none" | "absent" | "false" | "missing" => end,
        "no" if word_at(sentence, end + 1).is_none() && end > at + 1 => end,
        word if word == "not" || word.ends_with("n't") => {
            word_at(sentence, end + 1).filter(|word| is_presence(word))?;
            end + 1
        }
        _ => return None,
    };
    Some(last + 1 - at)
}

/// Number of pieces from a noun to a denial that other words keep from being understood: "ship is hardly ever absent".
fn perhaps_denied_after(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    let mut not = false;
    for end in at + 1..sentence.len().min(at + REACH) {
        let word = match sentence[end].kind {
            Kind::Colon => continue,
            Kind::Word(word) => word,
            _ => return None,
        };
        let absent = matches!(word, "none" | "absent" | "missing" | "false");
        if absent || (not && is_presence(word)) {
            return Some(end + 1 - at);
        }
        if noun(word).is_some() {
            return None;
        }
        not |= word == "not" || word.ends_with("n't");
    }
    None
}

/// Whether a word says that something is there.
fn is_presence(word: &str) -> bool {
    matches!(
        word,
        "visible" | "present" | "seen" | "there" | "detected" | "included" | "shown"
    )
}

/// What "or" adds to a denial: "no wind or ship".
fn further(sentence: &[Piece<'_>], at: usize) -> Option<Denied> {
    matches!(word_at(sentence, at)?, "or" | "nor").then_some(())?;
    let article = usize::from(word_at(sentence, at + 1).is_some_and(is_article));
    let noun_at = (at + 1 + article..at + 3 + article)
        .find(|&at| word_at(sentence, at).and_then(noun).is_some())?;
    let between = (at + 1..noun_at).all(|at| word_at(sentence, at).is_some_and(is_plain));
    between.then_some(())?;
    let subject = word_at(sentence, noun_at).and_then(noun);
    let pieces = at..noun_at + 1;
    let subject = subject.filter(|s| {
        matches!(
            s,
            Subject::Ship | Subject::Wind | Subject::Wake | Subject::Wave
        )
    });
    Some(Denied { subject, pieces })
}

/// Whether "no" before this word denies only more of the same.
fn is_further(word: &str) -> bool {
    matches!(
        word,
        "other" | "others" | "further" | "second" | "more" | "additional"
    )
}

fn is_article(word: &str) -> bool {
    matches!(word, "a" | "an" | "any" | "the" | "its" | "single" | "one")
}

/// Whether a word says that a ship makes no way.
pub(crate) fn is_at_rest(word: &str) -> bool {
    matches!(
        word,
        "stationary" | "anchored" | "moored" | "motionless" | "stopped" | "halted" | "unmoving"
    )
}

fn noun_after(sentence: &[Piece<'_>], at: usize) -> Option<Subject> {
    word_at(sentence, at + 1).and_then(noun)
}

pub(crate) fn word_before<'a>(sentence: &[Piece<'a>], at: usize) -> Option<&'a str> {
    word_at(sentence, at.checked_sub(1)?)
}

/// Whether this word ends what is said of the noun before it.
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

/// Whether a word says that a ship moves.
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

/// Whether a word tells how much without a number: "light wind", "a fast ferry".
pub(crate) fn is_strength(word: &str) -> bool {
    [
        "light", "gentle", "moderate", "fresh", "strong", "stiff", "weak", "high", "low", "heavy",
        "faint", "slight", "brisk", "fast", "slow", "quick", "swift", "rapid", "slowly", "quickly",
        "swiftly", "rapidly", "gently", "strongly",
    ]
    .contains(&word)
}

/// Whether a word between "from" and a direction says nothing.
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

/// Whether a word speaks of speed or direction, and so of a number nearby.
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

/// Whether a word speaks of sea or radar, but of nothing a prompt can state.
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

/// Whether a compass word after this one says where something goes.
pub(crate) fn leads(word: &str) -> bool {
    is_motion(word) || matches!(word, "heading" | "course" | "blowing" | "blows")
}
