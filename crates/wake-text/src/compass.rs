//! Compass words: the sixteen points in all their forms.

use crate::pieces::{Piece, word_at};
use std::ops::Range;

/// Angle between neighbouring points \[degrees\].
pub(crate) const POINT: f64 = 22.5;

/// The points clockwise from north, in words and in letters.
const POINTS: [(&str, &str); 16] = [
    ("north", "n"),
    ("northnortheast", "nne"),
    ("northeast", "ne"),
    ("eastnortheast", "ene"),
    ("east", "e"),
    ("eastsoutheast", "ese"),
    ("southeast", "se"),
    ("southsoutheast", "sse"),
    ("south", "s"),
    ("southsouthwest", "ssw"),
    ("southwest", "sw"),
    ("westsouthwest", "wsw"),
    ("west", "w"),
    ("westnorthwest", "wnw"),
    ("northwest", "nw"),
    ("northnorthwest", "nnw"),
];

/// Ending of a compass word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// "north", "NE".
    Point,
    /// "northerly".
    Erly,
    /// "northward", "northbound".
    Ward,
    /// "northern".
    Ern,
}

const ENDINGS: [(&str, Form); 6] = [
    ("bound", Form::Ward),
    ("going", Form::Ward),
    ("wards", Form::Ward),
    ("ward", Form::Ward),
    ("erly", Form::Erly),
    ("ern", Form::Ern),
];

/// A compass word, which may span several pieces.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Compass {
    /// Degrees clockwise from north.
    pub(crate) degrees: f64,
    pub(crate) form: Form,
    pub(crate) pieces: Range<usize>,
}

/// Longest compass word that starts at a piece, such as "north" or "north-east"; `None` for "nor-".
pub(crate) fn compass(sentence: &[Piece<'_>], at: usize) -> Option<Compass> {
    let mut joined = String::new();
    let mut found = None;
    for end in at + 1..=at + 4 {
        let Some(word) = word_at(sentence, end - 1) else {
            break;
        };
        joined.push_str(word);
        match read(&joined) {
            Some((degrees, form)) => {
                let pieces = at..end;
                found = Some(Compass {
                    degrees,
                    form,
                    pieces,
                });
            }
            None if end == at + 1 => break,
            None => {}
        }
    }
    found
}

/// Degrees and form of a compass word written as one word.
fn read(word: &str) -> Option<(f64, Form)> {
    let ending = ENDINGS
        .iter()
        .find_map(|(ending, form)| Some((word.strip_suffix(ending)?, *form)));
    let (root, form) = ending.unwrap_or((word, Form::Point));
    let is =
        |(name, letters): &(&str, &str)| *name == root || (form == Form::Point && *letters == root);
    let rank = POINTS.iter().position(is)?;
    Some((POINT * rank as f64, form))
}

/// Whether a word or abbreviation may be a compass word.
pub(crate) fn may_be_compass(word: &str) -> bool {
    read(word).is_some()
}

/// Whether a word is a compass word by itself; one or two letters are not.
pub(crate) fn is_compass(word: &str) -> bool {
    word.len() > 2 && read(word).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pieces::Text;

    fn compass_of(text: &str) -> Option<(f64, Form, usize)> {
        let text = Text::of(text);
        let found = compass(&text.pieces(), 0)?;
        Some((found.degrees, found.form, found.pieces.end))
    }

    #[test]
    fn every_point_is_read_in_words_and_letters() {
        for (rank, (name, letters)) in POINTS.into_iter().enumerate() {
            let degrees = 22.5 * rank as f64;
            assert_eq!(compass_of(name), Some((degrees, Form::Point, 1)), "{name}");
            assert_eq!(
                compass_of(&letters.to_uppercase()),
                Some((degrees, Form::Point, 1)),
                "{letters}"
            );
            assert_eq!(
                compass_of(&format!("{name}erly")),
                Some((degrees, Form::Erly, 1)),
                "{name}"
            );
        }
    }

    #[test]
    fn hyphens_spaces_and_endings_belong_to_the_word() {
        let cases = [
            ("north-easterly wind", 45.0, Form::Erly, 2),
            ("south-south-west", 202.5, Form::Point, 3),
            ("north north east", 22.5, Form::Point, 3),
            ("southbound ship", 180.0, Form::Ward, 1),
            ("west-going ship", 270.0, Form::Ward, 2),
            ("westwards", 270.0, Form::Ward, 1),
            ("northern", 0.0, Form::Ern, 1),
            ("north south", 0.0, Form::Point, 1),
            ("N.E. wind", 45.0, Form::Point, 1),
        ];
        for (text, degrees, form, end) in cases {
            assert_eq!(compass_of(text), Some((degrees, form, end)), "{text}");
        }
        for text in ["nor", "wester", "northy", "sea", "nnn"] {
            assert_eq!(compass_of(text), None, "{text}");
        }
    }
}
