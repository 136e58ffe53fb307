//! Cleans a prompt before it is split into words. The rules are in `cleaning.md`, shown at
//! [`Tokenizer::encode`](crate::Tokenizer::encode).

use std::ops::Range;
use unicode_normalization::{
    IsNormalized, UnicodeNormalization, char::canonical_combining_class, is_nfc_quick,
};

/// A cleaned prompt with the origin of each byte.
#[derive(Debug)]
pub(crate) struct Cleaned {
    pub(crate) text: String,
    /// Byte offset in the prompt of each byte of `text`; `None` if they are equal.
    origin: Option<Vec<usize>>,
}

impl Cleaned {
    /// The byte offset in the prompt from which the byte `at` of the text came.
    pub(crate) fn origin(&self, at: usize) -> usize {
        match &self.origin {
            Some(origin) => origin.get(at).copied().unwrap_or(at),
            None => at,
        }
    }
}

impl Cleaned {
    /// The byte range of the prompt from which a range of the text came; empty only if the range is.
    pub(crate) fn span(&self, range: Range<usize>, prompt: &str) -> Range<usize> {
        let Some(last) = range.end.checked_sub(1).filter(|_| !range.is_empty()) else {
            return 0..0;
        };
        let last = self.origin(last);
        let next = (range.end..self.text.len()).map(|at| self.origin(at));
        let end = next.into_iter().find(|&at| at > last);
        self.origin(range.start)..end.unwrap_or(prompt.len())
    }
}

/// A character and its byte offset in the prompt.
type Traced = (char, usize);

/// Cleans a prompt by the rules of this module.
pub(crate) fn clean(prompt: &str) -> Cleaned {
    if prompt.bytes().all(is_plain) {
        return Cleaned {
            text: prompt.to_ascii_lowercase(),
            origin: None,
        };
    }
    let traced = decode_entities(prompt);
    let traced = replace_forms(&traced);
    let mut traced = drop_terminal_codes(&traced);
    traced.retain(|&(c, _)| !is_control(c));
    let traced = compose(&traced);
    collect(lower(&traced))
}

/// Whether no rule changes this byte except lower case.
fn is_plain(byte: u8) -> bool {
    matches!(byte, b' '..=b'%' | b'\''..=b'~' | b'\t' | b'\n' | b'\r' | b'\x0C')
}

/// Decodes HTML entities until none is left, from the right, so that `&amp;lt;` takes one pass.
///
/// From the line of the first `<` onward the text is markup, and its entities stay.
fn decode_entities(prompt: &str) -> Vec<Traced> {
    let line_of = |at: usize| prompt[..at].rfind('\n').map_or(0, |end| end + 1);
    let markup = prompt.find('<').map_or(prompt.len(), line_of);
    // The text so far, reversed: its last element is the leftmost character.
    let mut stack: Vec<Traced> = Vec::with_capacity(prompt.len());
    for (at, c) in prompt.char_indices().rev() {
        stack.push((c, at));
        while at < markup
            && let Some((length, decoded)) = entity_on_top(&stack)
        {
            stack.truncate(stack.len() - length);
            stack.extend(decoded.chars().rev().map(|c| (c, at)));
        }
    }
    stack.reverse();
    stack
}

/// The entity that starts with the leftmost character, if there is one: its length and its replacement.
fn entity_on_top(stack: &[Traced]) -> Option<(usize, String)> {
    const LONGEST: usize = 27; // '&', '#', 24 letters or digits, ';'
    if stack.last()?.0 != '&' {
        return None;
    }
    let front: String = stack.iter().rev().take(LONGEST).map(|&(c, _)| c).collect();
    let entity = &front[..=front.find(';')?];
    let name = entity[1..].trim_end_matches(';');
    let name = name.strip_prefix('#').unwrap_or(name);
    if name.is_empty() || !name.bytes().all(|b| b.is_ascii_alphanumeric()) {
        return None;
    }
    let decoded = html_escape::decode_html_entities(entity);
    (decoded != entity).then(|| (entity.len(), decoded.into_owned()))
}

/// Reads a C1 control character (U+0080 to U+009F) as Windows-1252, where five are undefined.
fn from_windows_1252(c: char) -> char {
    const MEANT: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8D}Ž\u{8F}\u{90}‘’“”•–—˜™š›œ\u{9D}žŸ";
    match u32::from(c) {
        code @ 0x80..=0x9F => MEANT.chars().nth(code as usize - 0x80).unwrap_or(c),
        _ => c,
    }
}

/// Replaces C1 control characters, ligatures, width forms and quotes.
fn replace_forms(text: &[Traced]) -> Vec<Traced> {
    let mut out = Vec::with_capacity(text.len());
    for &(c, at) in text {
        let c = from_windows_1252(c);
        if has_usual_form(c) {
            out.extend(c.nfkc().map(|c| (straight(c), at)));
        } else {
            out.push((straight(c), at));
        }
    }
    out
}

/// Whether a character is a Latin ligature or letter pair, the ideographic space, or of full or half width.
fn has_usual_form(c: char) -> bool {
    matches!(c, '\u{132}' | '\u{133}' | '\u{149}' | '\u{1C4}'..='\u{1CC}' | '\u{1F1}'..='\u{1F3}'
        | '\u{FB00}'..='\u{FB06}' | '\u{3000}' | '\u{FF01}'..='\u{FFEF}')
}

/// Straightens a curly quote.
fn straight(c: char) -> char {
    match c {
        '\u{2BC}' | '\u{2018}'..='\u{201B}' => '\'',
        '\u{201C}'..='\u{201F}' => '"',
        _ => c,
    }
}

/// Removes terminal colour codes: escape, `[`, digits and semicolons, a letter.
fn drop_terminal_codes(text: &[Traced]) -> Vec<Traced> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text;
    while let [first, after @ ..] = rest {
        rest = match terminal_code(rest) {
            Some(length) => &rest[length..],
            None => {
                out.push(*first);
                after
            }
        };
    }
    out
}

/// Length of the terminal code at the start of a text.
fn terminal_code(text: &[Traced]) -> Option<usize> {
    let [('\x1B', _), ('[', _), after @ ..] = text else {
        return None;
    };
    let numbers = after
        .iter()
        .take_while(|(c, _)| c.is_ascii_digit() || *c == ';')
        .count();
    let (last, _) = after.get(numbers)?;
    last.is_ascii_alphabetic().then_some(numbers + 3)
}

/// Whether a control character has no use in a prompt.
fn is_control(c: char) -> bool {
    matches!(c, '\0'..='\x08' | '\x0B' | '\x0E'..='\x1F' | '\x7F' | '\u{206A}'..='\u{206F}'
        | '\u{FEFF}' | '\u{FFF9}'..='\u{FFFC}')
}

/// Composes to Unicode form NFC; a composed character has the origin of its first character.
fn compose(text: &[Traced]) -> Vec<Traced> {
    if is_nfc_quick(text.iter().map(|&(c, _)| c)) == IsNormalized::Yes {
        return text.to_vec();
    }
    // Nothing is composed or reordered across the border of two groups.
    text.chunk_by(|_, &(next, _)| !starts_group(next))
        .flat_map(|group| {
            let at = group[0].1;
            group.iter().map(|&(c, _)| c).nfc().map(move |c| (c, at))
        })
        .collect()
}

/// Whether this character never combines with the one before it.
fn starts_group(c: char) -> bool {
    canonical_combining_class(c) == 0 && is_nfc_quick(std::iter::once(c)) == IsNormalized::Yes
}

/// Converts the whole text to lower case at once, because a final sigma depends on its neighbours.
fn lower(text: &[Traced]) -> impl Iterator<Item = Traced> {
    let whole: String = text.iter().map(|&(c, _)| c).collect();
    let lower: Vec<char> = whole.to_lowercase().chars().collect();
    let origins = text
        .iter()
        .flat_map(|&(c, at)| c.to_lowercase().map(move |_| at));
    lower.into_iter().zip(origins)
}

fn collect(text: impl Iterator<Item = Traced>) -> Cleaned {
    let mut out = String::new();
    let mut origin = Vec::new();
    for (c, at) in text {
        out.push(c);
        origin.resize(out.len(), at);
    }
    Cleaned {
        text: out,
        origin: Some(origin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_rule_does_what_its_table_says() {
        let cases = [
            ("&amp;lt; &#39;x&#x27; &nosuch; &;", "< 'x' &nosuch; &;"),
            ("&amp;\na < b &amp; c\n&amp;", "&\na < b &amp; c\n&amp;"),
            ("\x1B[1;31mred\x1B[m \x1B[31 \x1B[;", "red [31 [;"),
            ("it\u{92}s \u{80}\u{81}\u{9F}\u{A0}", "it's €\u{81}ÿ\u{A0}"),
            ("a\0b\u{B}c\x1B\x7F\u{FEFF}d", "abcd"),
            ("\u{201C}it\u{2019}s\u{201D} \u{2BC}", "\"it's\" '"),
            ("\u{FB01}n \u{FB04}", "fin ffl"),
            ("\u{FF33}\u{FF21}\u{FF32}\u{3000}\u{FF11}", "sar 1"),
            ("e\u{301}", "\u{E9}"),
            ("\u{1100}\u{1161}\u{11A8}", "\u{AC01}"),
            ("\u{39F}\u{394}\u{39F}\u{3A3} \u{3A3}", "οδος σ"),
            ("\u{130}", "i\u{307}"),
        ];
        for (prompt, expected) in cases {
            assert_eq!(clean(prompt).text, expected, "{prompt:?}");
        }
    }

    #[test]
    fn nested_entities_are_decoded_in_linear_time() {
        let prompt = format!("&{}", "amp;".repeat(100_000));
        assert_eq!(clean(&prompt).text, "&");
    }

    #[test]
    fn the_origin_is_where_a_byte_came_from() {
        let cleaned = clean("&amp; e\u{301}\u{FB01}x");
        assert_eq!(cleaned.text, "& \u{E9}fix");
        let origins: Vec<usize> = (0..=cleaned.text.len())
            .map(|at| cleaned.origin(at))
            .collect();
        // '&' 0, ' ' 5, the two bytes of 'é' 6, 'f' and 'i' 9, 'x' 12; past the end, the offset itself.
        assert_eq!(origins, [0, 5, 6, 6, 9, 9, 12, 7]);
    }

    proptest! {
        #[test]
        fn composing_by_groups_is_composing_at_once(
            text in "(\\PC|[\u{300}-\u{330}\u{1100}-\u{11FF}\u{9BE}\u{9C7}\u{9D7}]){0,40}"
        ) {
            let traced: Vec<Traced> = text.char_indices().map(|(at, c)| (c, at)).collect();
            let composed: String = compose(&traced).iter().map(|&(c, _)| c).collect();
            prop_assert_eq!(composed, text.nfc().collect::<String>());
        }

        #[test]
        fn plain_ascii_becomes_lower_case_only(text in "[ -%'-~\t\n\r]{0,80}") {
            let slow = collect(lower(&compose(&replace_forms(&decode_entities(&text)))));
            let fast = clean(&text);
            prop_assert_eq!(&fast.text, &text.to_lowercase());
            prop_assert_eq!(&slow.text, &fast.text);
            prop_assert!((0..text.len()).all(|at| slow.origin(at) == at && fast.origin(at) == at));
        }

        #[test]
        fn origins_rise_and_are_character_boundaries(prompt in any::<String>()) {
            let cleaned = clean(&prompt);
            let origins: Vec<usize> =
                (0..cleaned.text.len()).map(|at| cleaned.origin(at)).collect();
            prop_assert!(origins.is_sorted());
            prop_assert!(origins.iter().all(|&at| prompt.is_char_boundary(at)));
        }
    }
}
