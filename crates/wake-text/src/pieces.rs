//! A prompt as numbers, words and punctuation.

use std::ops::Range;

/// A number, a word or a mark, and its place in the prompt.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece<'a> {
    pub(crate) kind: Kind<'a>,
    pub(crate) place: Range<usize>,
}

/// What a piece is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind<'a> {
    Number(f64),
    /// Letters, with slashes between them; or `°`.
    Word(&'a str),
    /// Punctuation within a sentence.
    Comma,
    /// A colon or an equals sign.
    Colon,
    /// The end of a sentence.
    Stop,
}

/// The pieces of a text in lower case; hyphens between words are spaces.
pub(crate) fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let before = text[..at].chars().next_back();
        let (kind, length) = if let Some((value, length)) = number(rest, before) {
            (Some(Kind::Number(value)), length)
        } else if let Some(length) = word(rest) {
            (Some(Kind::Word(&rest[..length])), length)
        } else {
            (mark(c), c.len_utf8())
        };
        let place = at..at + length;
        found.extend(kind.map(|kind| Piece { kind, place }));
        at += length;
    }
    found
}

fn mark(c: char) -> Option<Kind<'static>> {
    match c {
        '.' | '!' | '?' => Some(Kind::Stop),
        ',' | ';' | '(' | ')' => Some(Kind::Comma),
        ':' | '=' => Some(Kind::Colon),
        _ => None,
    }
}

/// The number a text starts with, and its length. A sign counts where no letter or digit stands before it.
fn number(text: &str, before: Option<char>) -> Option<(f64, usize)> {
    let after_word = before.is_some_and(char::is_alphanumeric);
    let sign = ['-', '+', '\u{2212}']
        .into_iter()
        .find(|&sign| !after_word && text.starts_with(sign));
    let sign_length = sign.map_or(0, char::len_utf8);
    let unsigned = &text[sign_length..];
    let length = unsigned_length(unsigned)?;
    let value: f64 = unsigned[..length].replace(',', "").parse().ok()?;
    let negative = sign.is_some_and(|sign| sign != '+');
    Some((if negative { -value } else { value }, sign_length + length))
}

/// Length of `12`, `1,200`, `1.5`, `.5` or `1.5e3`.
fn unsigned_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut length = digits(bytes);
    while (1..=3).contains(&length) || bytes.get(..length)?.contains(&b',') {
        let [b',', group @ ..] = &bytes[length..] else {
            break;
        };
        if digits(group) != 3 {
            break;
        }
        length += 4;
    }
    if let [b'.', decimals @ ..] = &bytes[length..] {
        let count = digits(decimals);
        length += if count > 0 { 1 + count } else { 0 };
    }
    (length > 0).then(|| length + exponent_length(&bytes[length..]))
}

fn exponent_length(text: &[u8]) -> usize {
    let (sign, power) = match text {
        [b'e', b'-' | b'+', power @ ..] => (1, power),
        [b'e', power @ ..] => (0, power),
        _ => return 0,
    };
    match digits(power) {
        0 => 0,
        count => 1 + sign + count,
    }
}

fn digits(text: &[u8]) -> usize {
    text.iter().take_while(|byte| byte.is_ascii_digit()).count()
}

/// Length of the word a text starts with.
fn word(text: &str) -> Option<usize> {
    if text.starts_with('°') {
        return Some('°'.len_utf8());
    }
    let end = text.find(|c: char| !(c.is_alphabetic() || c == '/'));
    let length = text[..end.unwrap_or(text.len())]
        .trim_end_matches('/')
        .len();
    (length > 0 && !text.starts_with('/')).then_some(length)
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

    fn kinds(text: &str) -> Vec<Kind<'_>> {
        pieces(text).into_iter().map(|piece| piece.kind).collect()
    }

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
            ("1e4", 1e4),
            ("2.5e-3", 2.5e-3),
            ("1e400", f64::INFINITY),
        ];
        for (text, value) in cases {
            assert_eq!(kinds(text), [Kind::Number(value)], "{text}");
        }
    }

    #[test]
    fn a_hyphen_between_words_is_a_space() {
        let expected = [
            Kind::Number(32.0),
            Kind::Word("degree"),
            Kind::Number(5.0),
            Kind::Number(10.0),
        ];
        assert_eq!(kinds("32-degree 5-10"), expected);
    }

    #[test]
    fn punctuation_does_not_stick_to_numbers_and_units() {
        use Kind::{Comma, Number, Stop, Word};
        let expected = [
            Number(10.0),
            Word("m/s"),
            Comma,
            Number(32.0),
            Word("°"),
            Stop,
        ];
        assert_eq!(kinds("10m/s, 32°."), expected);
        assert_eq!(kinds("at 10."), [Word("at"), Number(10.0), Stop]);
        assert_eq!(kinds("1,2"), [Number(1.0), Comma, Number(2.0)]);
        assert_eq!(
            kinds("10mps/ 3e"),
            [Number(10.0), Word("mps"), Number(3.0), Word("e")]
        );
    }

    #[test]
    fn places_are_those_in_the_text() {
        let text = "é 1,000 m\u{2019}s 3";
        for piece in pieces(text) {
            match piece.kind {
                Kind::Word(word) => assert_eq!(&text[piece.place], word),
                Kind::Number(value) => {
                    assert_eq!(text[piece.place].replace(',', "").parse(), Ok(value));
                }
                _ => {}
            }
        }
    }
}
