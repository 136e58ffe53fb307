//! What a sentence speaks of.

use crate::pieces::{Piece, word_at};
use std::ops::Range;

/// What a number can belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Subject {
    Ship,
    Heading,
    Wind,
    Fetch,
    Incidence,
    NoShip,
    NoWind,
    /// An angle of its own.
    Angle,
    /// Something a scene does not hold, such as a current.
    Other,
}

/// A subject named in a sentence.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) subject: Subject,
    /// Index of its word in the sentence.
    pub(crate) at: usize,
    pub(crate) place: Range<usize>,
}

/// The subjects a sentence names, in their order.
pub(crate) fn subjects(sentence: &[Piece<'_>]) -> Vec<Named> {
    let named = |at: usize| {
        let subject = subject(sentence, at)?;
        let absent = [Subject::NoShip, Subject::NoWind].contains(&subject);
        let negation = negation(sentence, at).filter(|_| absent);
        let start = sentence[negation.unwrap_or(at)].place.start;
        let place = start..sentence[at].place.end;
        Some(Named { subject, at, place })
    };
    (0..sentence.len()).filter_map(named).collect()
}

/// The subject that the word at a place names.
fn subject(sentence: &[Piece<'_>], at: usize) -> Option<Subject> {
    let noun = noun(word_at(sentence, at)?)?;
    let before = word_before(sentence, at);
    let owner = before.and_then(self::noun);
    match noun {
        Subject::Ship if negation(sentence, at).is_some() => Some(Subject::NoShip),
        Subject::Wind if negation(sentence, at).is_some() => Some(Subject::NoWind),
        // "wind heading toward" is about the wind, "incidence angle" about the incidence.
        Subject::Heading if owner == Some(Subject::Wind) => None,
        Subject::Angle if word_at(sentence, at + 2) == Some("incidence") => {
            Some(Subject::Incidence)
        }
        Subject::Angle => Some(owner.unwrap_or(Subject::Other)),
        noun => Some(noun),
    }
}

/// The subject that a word names by itself.
fn noun(word: &str) -> Option<Subject> {
    Some(match word {
        "ship" | "ships" | "vessel" | "vessels" | "boat" | "boats" => Subject::Ship,
        "wind" | "winds" | "breeze" => Subject::Wind,
        "windless" => Subject::NoWind,
        "heading" | "course" => Subject::Heading,
        "fetch" => Subject::Fetch,
        "incidence" | "incident" => Subject::Incidence,
        "angle" => Subject::Angle,
        "wave" | "waves" | "swell" | "current" | "currents" | "satellite" | "aircraft"
        | "platform" | "kelvin" | "wedge" | "latitude" | "longitude" | "temperature" => {
            Subject::Other
        }
        _ => return None,
    })
}

/// The index of "no" or "without" before a noun, with or without an article between them.
fn negation(sentence: &[Piece<'_>], noun: usize) -> Option<usize> {
    let article = matches!(
        word_before(sentence, noun),
        Some("a" | "an" | "any" | "the")
    );
    let at = noun.checked_sub(if article { 2 } else { 1 })?;
    matches!(word_at(sentence, at), Some("no" | "without")).then_some(at)
}

fn word_before<'a>(sentence: &[Piece<'a>], at: usize) -> Option<&'a str> {
    word_at(sentence, at.checked_sub(1)?)
}
