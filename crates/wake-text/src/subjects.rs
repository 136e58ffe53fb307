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
    let absent = negation(sentence, at).is_some();
    match word_at(sentence, at)? {
        "ship" | "ships" | "vessel" | "vessels" | "boat" | "boats" if absent => {
            Some(Subject::NoShip)
        }
        "ship" | "ships" | "vessel" | "vessels" | "boat" | "boats" => Some(Subject::Ship),
        "wind" | "winds" if absent => Some(Subject::NoWind),
        "windless" => Some(Subject::NoWind),
        "wind" | "winds" | "breeze" => Some(Subject::Wind),
        "heading" | "course" => match word_before(sentence, at) {
            Some("wind" | "winds" | "breeze") => None,
            _ => Some(Subject::Heading),
        },
        "fetch" => Some(Subject::Fetch),
        "incidence" | "incident" => Some(Subject::Incidence),
        "angle" if word_at(sentence, at + 2) == Some("incidence") => Some(Subject::Incidence),
        "angle" => match subject(sentence, at.checked_sub(1)?) {
            None => Some(Subject::Other),
            named => named,
        },
        "wave" | "waves" | "swell" | "current" | "currents" | "satellite" | "aircraft"
        | "platform" | "kelvin" | "wedge" | "latitude" | "longitude" | "temperature" => {
            Some(Subject::Other)
        }
        _ => None,
    }
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
