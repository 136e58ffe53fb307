//! Numbers with a unit, and what they belong to.

use crate::pieces::{Kind, Piece, word_at};
use crate::subjects::Named;
use std::ops::Range;

/// What a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dimension {
    Speed,
    Angle,
    Length,
}

/// A number with its unit.
#[derive(Debug)]
pub(crate) struct Quantity {
    pub(crate) dimension: Dimension,
    /// In m/s, degrees or metres.
    pub(crate) value: f64,
    /// Index of the number and of the first piece after the unit.
    pub(crate) pieces: Range<usize>,
}

/// The number with a unit that starts at a piece, if there is one.
pub(crate) fn quantity(sentence: &[Piece<'_>], at: usize) -> Option<Quantity> {
    let Kind::Number(number) = sentence[at].kind else {
        return None;
    };
    let unit = word_at(sentence, at + 1)?;
    let next = word_at(sentence, at + 2).unwrap_or_default();
    let per_second = next == "per" && word_at(sentence, at + 3) == Some("second");
    let (dimension, factor, words) = match unit {
        "m" | "meter" | "meters" | "metre" | "metres" if per_second => (Dimension::Speed, 1.0, 3),
        "mps" | "m/s" => (Dimension::Speed, 1.0, 1),
        "knot" | "knots" | "kn" | "kt" => (Dimension::Speed, 1852.0 / 3600.0, 1),
        "deg" | "degs" | "degree" | "degrees" | "°" if !is_scale(next) => {
            (Dimension::Angle, 1.0, 1)
        }
        "m" | "meter" | "meters" | "metre" | "metres" => (Dimension::Length, 1.0, 1),
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => {
            (Dimension::Length, 1000.0, 1)
        }
        _ => return None,
    };
    Some(Quantity {
        dimension,
        value: number * factor + 0.0, // +0.0: never −0
        pieces: at..at + 1 + words,
    })
}

/// Whether this word after "degrees" makes them a temperature or a position.
fn is_scale(word: &str) -> bool {
    matches!(
        word,
        "c" | "f"
            | "celsius"
            | "fahrenheit"
            | "n"
            | "s"
            | "e"
            | "w"
            | "north"
            | "south"
            | "east"
            | "west"
    )
}

/// The subject that a quantity belongs to, and whether it stands right after it.
pub(crate) fn owner<'a>(
    sentence: &[Piece<'_>],
    subjects: &'a [Named],
    quantity: &Quantity,
) -> Option<(&'a Named, bool)> {
    let (before, after) =
        subjects.split_at(subjects.partition_point(|named| named.at < quantity.pieces.start));
    let end = quantity.pieces.end;
    let next = after.first();
    let right_after = next
        .filter(|named| is_one_phrase(sentence, end..named.at) && !is_label(sentence, named.at));
    match right_after {
        Some(named) => Some((named, true)),
        None => before.last().or(next).map(|named| (named, false)),
    }
}

/// Whether a colon follows a word, perhaps after two more: "wind speed: 3 mps".
fn is_label(sentence: &[Piece<'_>], at: usize) -> bool {
    let mut next = sentence.iter().skip(at + 1).take(3);
    let mark = next.find(|piece| !matches!(piece.kind, Kind::Word(_)));
    mark.is_some_and(|piece| piece.kind == Kind::Colon)
}

/// Whether what stands between a unit and a noun is at most two words that describe the noun.
fn is_one_phrase(sentence: &[Piece<'_>], between: Range<usize>) -> bool {
    between.len() <= 2
        && between
            .into_iter()
            .all(|at| word_at(sentence, at).is_some_and(|word| !is_link(word)))
}

/// Whether this word ends what is said of the noun before it.
fn is_link(word: &str) -> bool {
    matches!(
        word,
        "a" | "an"
            | "the"
            | "and"
            | "or"
            | "but"
            | "while"
            | "with"
            | "without"
            | "at"
            | "in"
            | "on"
            | "by"
            | "to"
            | "toward"
            | "towards"
            | "from"
            | "under"
            | "over"
            | "into"
            | "for"
            | "is"
            | "are"
            | "as"
            | "its"
            | "that"
            | "which"
            | "moving"
            | "sailing"
            | "heading"
            | "blowing"
    )
}
