//! A prompt as numbers, words and punctuation.

use crate::cleaning::{Cleaned, clean};
use crate::numbers::{continues, digits, spelt, unsigned};
use std::ops::Range;

/// A prompt in lower case and usual forms, as CLIP's cleaning leaves it, with the origin of each byte.
#[derive(Debug)]
pub(crate) struct Text<'p> {
    prompt: &'p str,
    cleaned: Cleaned,
}

impl<'p> Text<'p> {
    pub(crate) fn of(prompt: &'p str) -> Self {
        Self {
            prompt,
            cleaned: clean(prompt),
        }
    }

    /// The byte range of the prompt that a range of the text came from.
    pub(crate) fn span(&self, range: Range<usize>) -> Range<usize> {
        self.cleaned.span(range, self.prompt)
    }

    /// Splits the text into pieces; hyphens between words are spaces.
    pub(crate) fn pieces(&self) -> Vec<Piece<'_>> {
        let text = self.cleaned.text.as_str();
        let mut found: Vec<Piece<'_>> = Vec::new();
        let mut at = 0;
        while let Some(c) = text[at..].chars().next() {
            let (kind, length) = if let Some(read) = number(text, at) {
                (Some(read.0), read.1)
            } else if let Some(length) = lettered(&text[at..]) {
                (Some(Kind::Figure), length)
            } else if let Some((word, length)) = word(&text[at..]) {
                (Some(Kind::Word(word)), length)
            } else {
                self.mark(at, c, found.last())
            };
            let place = at..at + length;
            at += length;
            match kind.map(|kind| Piece { kind, place }) {
                Some(piece) if !join_spelt(&mut found, &piece) => found.push(piece),
                _ => {}
            }
        }
        found
    }

    /// The mark at a place, if there is one, and its length.
    fn mark(&self, at: usize, c: char, last: Option<&Piece<'_>>) -> (Option<Kind<'static>>, usize) {
        let rest = &self.cleaned.text[at..];
        let dots = rest.len() - rest.trim_start_matches('.').len();
        let mark = LONG_MARKS.into_iter().find(|mark| rest.starts_with(mark));
        let length = mark.map_or(dots.max(c.len_utf8()), str::len);
        let before_number = || {
            let next = rest[length..].trim_start().chars().next();
            next.is_some_and(|c| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | '\u{2212}'))
        };
        let after_number = || last.is_some_and(|last| matches!(last.kind, Kind::Number(_)));
        let kind = match c {
            '.' if dots > 1 && before_number() => Some(Kind::Dash),
            '.' if self.is_abbreviation(at, last) => None,
            '<' | '>' | '=' | '!' if mark.is_some_and(|mark| mark != "==") => Some(Kind::Bound),
            '.' | '!' | '?' => Some(Kind::Stop),
            ',' | ';' | '(' | ')' | '[' | ']' | '{' | '}' | '|' => Some(Kind::Comma),
            ':' | '=' => Some(Kind::Colon),
            '-' | '\u{2010}'..='\u{2015}' | '\u{2212}' | '\u{2026}' => {
                before_number().then_some(Kind::Dash)
            }
            '~' if after_number() => before_number().then_some(Kind::Dash),
            '\u{B1}' => Some(Kind::PlusMinus),
            '+' if length > 1 => Some(Kind::PlusMinus),
            '<' | '>' | '\u{2260}' | '\u{2264}' | '\u{2265}' => Some(Kind::Bound),
            '/' | '\u{D7}' | '*' => Some(Kind::Cross),
            '@' => Some(Kind::Word("at")),
            _ if is_silent(c) => None,
            _ => Some(Kind::Symbol),
        };
        (kind, length)
    }

    /// Whether the full stop at a place belongs to an abbreviation and does not end the sentence: the next letter is
    /// not a capital.
    fn is_abbreviation(&self, at: usize, last: Option<&Piece<'_>>) -> bool {
        let Some(Piece {
            kind: Kind::Word(word),
            place,
        }) = last
        else {
            return false;
        };
        if place.end != at || !ABBREVIATIONS.contains(word) {
            return false;
        }
        let text = &self.cleaned.text;
        let next = text[at + 1..].find(|c: char| !c.is_whitespace());
        next.is_some_and(|next| {
            let origin = self.cleaned.origin(at + 1 + next);
            let capital = self.prompt[origin..].chars().next();
            !capital.is_some_and(char::is_uppercase)
        })
    }
}

/// Marks of several characters.
const LONG_MARKS: [&str; 11] = [
    "+/-", "+-", "<=", ">=", "=<", "=>", "<>", "!=", "==", "<<", ">>",
];

/// Whether a character other than a letter or digit has no meaning: white space, quotes, signs of "about", bullets.
fn is_silent(c: char) -> bool {
    c.is_whitespace()
        || c.is_control()
        || matches!(
            c,
            '"' | '\'' | '`' | '&' | '_' | '~' | '-' | '\u{AD}' | '\u{B4}' | '\u{AB}' | '\u{BB}'
        )
        || matches!(
            c,
            '\u{2248}' | '\u{2245}' | '\u{223C}' | '\u{2022}' | '\u{B7}' | '\u{FE0F}'
        )
        || matches!(c, '\u{200B}'..='\u{200F}' | '\u{2010}'..='\u{201F}' | '\u{2026}' | '\u{2060}'..='\u{2064}')
}

/// Words that a full stop may follow within a sentence.
const ABBREVIATIONS: [&str; 32] = [
    "deg", "degs", "kt", "kts", "kn", "m", "km", "nm", "nmi", "mi", "ft", "m/s", "km/h", "kmh",
    "kph", "mph", "mps", "sec", "s", "hr", "h", "approx", "ca", "incl", "inc", "incid", "dir",
    "spd", "vel", "max", "min", "avg",
];

/// Dotted abbreviations without their dots.
const DOTTED: [&str; 26] = [
    "mph", "kph", "kmh", "mps", "nm", "nmi", "kt", "kts", "kn", "fps", "n", "e", "s", "w", "ne",
    "se", "sw", "nw", "nne", "ene", "ese", "sse", "ssw", "wsw", "wnw", "nnw",
];

/// A number, a word or a mark, and its place in the text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece<'a> {
    pub(crate) kind: Kind<'a>,
    pub(crate) place: Range<usize>,
}

/// Kind of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind<'a> {
    Number(f64),
    /// Digits that do not form one number, such as `1.2.3` and `l0`.
    Figure,
    /// Letters, possibly with slashes and apostrophes between them; or `°`.
    Word(&'a str),
    /// Punctuation within a sentence.
    Comma,
    /// A colon or an equals sign.
    Colon,
    /// The end of a sentence.
    Stop,
    /// A dash or dots before a number.
    Dash,
    PlusMinus,
    /// `<`, `>=`, `≤`, `≠` and similar signs.
    Bound,
    /// `×`, `*`, or a slash that does not join words.
    Cross,
    /// Any other sign, such as `%` and `→`.
    Symbol,
}

/// Marks after which `.5` is a number.
const OPENING: &str = "([{,;:=<>\u{2264}\u{2265}\u{B1}~+-\u{2212}\u{2013}/@|";

/// The number at a place of a text, and its length. A sign counts unless a letter or digit precedes it.
fn number(text: &str, at: usize) -> Option<(Kind<'static>, usize)> {
    let rest = &text[at..];
    let after_word = text[..at]
        .chars()
        .next_back()
        .is_some_and(char::is_alphanumeric);
    let sign = ['-', '+', '\u{2212}']
        .into_iter()
        .find(|&sign| !after_word && rest.starts_with(sign));
    let sign_length = sign.map_or(0, char::len_utf8);
    // A point right after a word, a unit or a bracket ends it and does not start a number.
    let opens = |c: char| c.is_whitespace() || OPENING.contains(c);
    if rest.starts_with('.') && !text[..at].chars().next_back().is_none_or(opens) {
        return None;
    }
    let (value, length) = unsigned(&rest[sign_length..])?;
    let value = if sign.is_some_and(|sign| sign != '+') {
        -value
    } else {
        value
    };
    let kind = if value.is_nan() {
        Kind::Figure
    } else {
        Kind::Number(value)
    };
    Some((kind, sign_length + length))
}

/// Reads a word that spells a number, or continues one ("twenty-five", "ten thousand"); returns whether it does.
fn join_spelt<'a>(found: &mut Vec<Piece<'a>>, piece: &Piece<'a>) -> bool {
    let Kind::Word(word) = piece.kind else {
        return false;
    };
    let last = found.last_mut().and_then(|last| match &mut last.kind {
        Kind::Number(value) => Some((value, &mut last.place.end)),
        _ => None,
    });
    let factor = match word {
        "hundred" => 100.0,
        "thousand" => 1000.0,
        _ => 0.0,
    };
    match (last, spelt(word)) {
        (Some((value, end)), _) if factor > 0.0 => {
            (*value, *end) = (*value * factor, piece.place.end);
        }
        (Some((value, end)), Some(more)) if continues(*value, more) => {
            (*value, *end) = (*value + more, piece.place.end);
        }
        (_, Some(value)) if word != "one" => found.push(Piece {
            kind: Kind::Number(value),
            place: piece.place.clone(),
        }),
        _ => return false,
    }
    true
}

/// Length of a letter and the digits right after it, as in `l0` and `u10`.
fn lettered(text: &str) -> Option<usize> {
    let letter = text.chars().next().filter(|c| c.is_alphabetic())?;
    let digits = digits(&text.as_bytes()[letter.len_utf8()..]);
    (digits > 0).then_some(letter.len_utf8() + digits)
}

/// The word at the start of a text, and its length: without the dots of `m.p.h.` or the `'s` of `ship's`, with the
/// power of `s-1`.
fn word(text: &str) -> Option<(&str, usize)> {
    if let Some(sign) = text.chars().next().filter(|c| matches!(c, '°' | 'º' | '˚')) {
        return Some(("°", sign.len_utf8()));
    }
    if let Some(found) = dotted(text).or_else(|| shortened(text)) {
        return Some(found);
    }
    let end = text.find(|c: char| !(c.is_alphabetic() || matches!(c, '/' | '\'')));
    let whole = text[..end.unwrap_or(text.len())].trim_end_matches(['/', '\'']);
    if whole.is_empty() || whole.starts_with(['/', '\'']) {
        return None;
    }
    let rest = &text[whole.len()..];
    let powers = ["-1", "^-1", "\u{2212}1", "\u{207B}\u{B9}"];
    let means = [("s", "/s"), ("ms", "m/s"), ("h", "/h"), ("kmh", "km/h")];
    let power = powers.iter().find_map(|power| {
        let after = rest.strip_prefix(power)?.chars().next();
        let ends = !after.is_some_and(char::is_alphanumeric);
        let (_, per) = means.into_iter().find(|(unit, _)| ends && *unit == whole)?;
        Some((per, whole.len() + power.len()))
    });
    Some(power.unwrap_or((whole.strip_suffix("'s").unwrap_or(whole), whole.len())))
}

/// Reads `w/` and `w/o`; returns the full word and the length read.
fn shortened(text: &str) -> Option<(&'static str, usize)> {
    let ends = |length: usize| !text[length..].starts_with(|c: char| c.is_alphabetic() || c == '/');
    match text.strip_prefix("w/")? {
        rest if rest.starts_with('o') && ends(3) => Some(("without", 3)),
        rest if rest.starts_with("out") && ends(5) => Some(("without", 5)),
        _ => ends(2).then_some(("with", 2)),
    }
}

/// An abbreviation such as `m.p.h.` or `n.e.`, and its length.
fn dotted(text: &str) -> Option<(&'static str, usize)> {
    let mut length = 0;
    for pair in text.as_bytes().chunks_exact(2).take(5) {
        if !pair[0].is_ascii_lowercase() || pair[1] != b'.' {
            break;
        }
        length += 2;
    }
    let after = text[length..].chars().next();
    let last = usize::from(after.is_some_and(|c| c.is_ascii_lowercase()));
    let ends = !text[length + last..].starts_with(char::is_alphanumeric);
    if length + last < 3 || !ends {
        return None;
    }
    let letters = || text[..length + last].bytes().filter(|&byte| byte != b'.');
    let word = DOTTED.into_iter().find(|word| word.bytes().eq(letters()))?;
    Some((word, length + last))
}

/// The word at a place of a sentence, if there is one.
pub(crate) fn word_at<'a>(sentence: &[Piece<'a>], at: usize) -> Option<&'a str> {
    match sentence.get(at)?.kind {
        Kind::Word(word) => Some(word),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_pieces<T>(text: &str, check: impl Fn(Vec<Piece<'_>>) -> T) -> T {
        check(Text::of(text).pieces())
    }

    fn assert_kinds(text: &str, expected: &[Kind<'_>]) {
        let text_of = Text::of(text);
        let kinds: Vec<Kind<'_>> = text_of
            .pieces()
            .into_iter()
            .map(|piece| piece.kind)
            .collect();
        assert_eq!(kinds, expected, "{text}");
    }

    use Kind::{Colon, Comma, Cross, Dash, Figure, Number, PlusMinus, Stop, Word};

    #[test]
    fn numbers_in_all_their_forms() {
        let cases = [
            ("10", 10.0),
            ("7.5", 7.5),
            (".5", 0.5),
            ("-1", -1.0),
            ("\u{2212}1", -1.0),
            ("+3", 3.0),
            ("10,000", 10_000.0),
            ("1,000,000.5", 1_000_000.5),
            ("10 000", 10_000.0),
            ("1\u{202F}000\u{A0}000", 1_000_000.0),
            ("7,5", 7.5),
            ("0,125", 0.125),
            ("1000,5", 1000.5),
            ("1e4", 1e4),
            ("2.5e-3", 2.5e-3),
            ("1e400", f64::INFINITY),
            ("8 1/2", 8.5),
            ("8\u{BD}", 8.5),
            ("8 \u{BE}", 8.75),
            ("8-1/2", 8.5),
            ("1/2", 0.5),
            ("\u{BC}", 0.25),
            ("ten", 10.0),
            ("twenty-five", 25.0),
            ("ten thousand", 10_000.0),
            ("two hundred thirty one", 231.0),
            ("\u{FF11}\u{FF10}\u{FF0E}\u{FF15}", 10.5),
        ];
        for (text, value) in cases {
            assert_kinds(text, &[Number(value)]);
        }
    }

    #[test]
    fn digits_that_are_no_one_number_are_figures() {
        for text in [
            "1.2.3",
            "1,2,3",
            "1.000,5",
            "1.000.000",
            "10^4",
            "10\u{2074}",
            "1/2/2024",
            "5/7",
            "\u{663}",
        ] {
            assert_kinds(text, &[Figure]);
        }
    }

    #[test]
    fn a_hyphen_between_words_is_a_space_and_between_numbers_a_dash() {
        assert_kinds(
            "north-easterly 32-degree 5-10 5\u{2013}7 5...7 5 - 7",
            &[
                Word("north"),
                Word("easterly"),
                Number(32.0),
                Word("degree"),
                Number(5.0),
                Dash,
                Number(10.0),
                Number(5.0),
                Dash,
                Number(7.0),
                Number(5.0),
                Dash,
                Number(7.0),
                Number(5.0),
                Dash,
                Number(7.0),
            ],
        );
        assert_kinds("5 +/- 1", &[Number(5.0), PlusMinus, Number(1.0)]);
        assert_kinds(
            "5\u{B1}1 2 \u{D7} 3",
            &[
                Number(5.0),
                PlusMinus,
                Number(1.0),
                Number(2.0),
                Cross,
                Number(3.0),
            ],
        );
    }

    #[test]
    fn punctuation_does_not_stick_to_numbers_and_units() {
        assert_kinds(
            "10m/s, 32°.",
            &[
                Number(10.0),
                Word("m/s"),
                Comma,
                Number(32.0),
                Word("°"),
                Stop,
            ],
        );
        assert_kinds("at 10.", &[Word("at"), Number(10.0), Stop]);
        assert_kinds("1, 2", &[Number(1.0), Comma, Number(2.0)]);
        assert_kinds(
            "10mps/ 3e",
            &[Number(10.0), Word("mps"), Cross, Number(3.0), Word("e")],
        );
        assert_kinds("ship's: isn't", &[Word("ship"), Colon, Word("isn't")]);
    }

    #[test]
    fn stops_of_abbreviations_end_no_sentence() {
        assert_kinds("45 deg. at", &[Number(45.0), Word("deg"), Word("at")]);
        assert_kinds("45 deg. At", &[Number(45.0), Word("deg"), Stop, Word("at")]);
        assert_kinds("45 deg.", &[Number(45.0), Word("deg"), Stop]);
        assert_kinds(
            "12 m.p.h. N.E. wind",
            &[Number(12.0), Word("mph"), Word("ne"), Word("wind")],
        );
        assert_kinds("12 M.P.H", &[Number(12.0), Word("mph")]);
        assert_kinds(
            "5 m s-1, 5 ms\u{207B}\u{B9}",
            &[
                Number(5.0),
                Word("m"),
                Word("/s"),
                Comma,
                Number(5.0),
                Word("m/s"),
            ],
        );
    }

    #[test]
    fn places_are_those_in_the_text() {
        with_pieces("é 1,000 m\u{2019}s 3", |pieces| {
            let places: Vec<Range<usize>> = pieces.into_iter().map(|piece| piece.place).collect();
            assert_eq!(places, [0..2, 3..8, 9..12, 13..14]);
        });
        let text = Text::of("\u{FF11} &amp; e\u{301}x");
        assert_eq!(text.span(0..1), 0..3);
        let places: Vec<Range<usize>> = text
            .pieces()
            .into_iter()
            .map(|piece| text.span(piece.place))
            .collect();
        assert_eq!(places, [0..3, 10..14]);
    }
}
