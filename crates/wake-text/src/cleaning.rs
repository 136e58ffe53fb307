//! Cleaning: what happens to a prompt before it is split into words.
//!
//! Stable Diffusion v1.4 feeds its prompts through `ftfy` and lower case. Of `ftfy`'s repairs those that
//! need no guess are made here, in this order:
//!
//! | rule | example |
//! | --- | --- |
//! | HTML entities become characters, repeatedly, unless the prompt holds a `<` | `&amp;lt;` → `<` |
//! | control characters (U+0000–0008, 000B, 000E–001F, 007F, 206A–206F, FEFF, FFF9–FFFC) go | `a\0b` → `ab` |
//! | curly quotes become straight | `“it’s”` → `"it's"` |
//! | Latin ligatures become letters | `ﬁn` → `fin` |
//! | full-width and half-width forms become the usual ones | `ＳＡＲ１` → `SAR1` |
//! | Unicode form NFC | `e` + U+0301 → `é` |
//! | lower case, by Unicode's default rules | `SAR` → `sar` |
//!
//! White space of any kind and length only separates words. Not done: undoing text that was decoded with
//! the wrong encoding (`Ã©` for `é`), terminal colour codes, C1 control characters, removing accents,
//! spacing out Chinese characters.
//!
//! A prompt of printable ASCII without `&` only becomes lower case, as with every CLIP tokenizer.

use unicode_normalization::{
    IsNormalized, UnicodeNormalization, char::canonical_combining_class, is_nfc_quick,
};

/// A cleaned prompt that remembers where its bytes came from.
#[derive(Debug)]
pub(crate) struct Cleaned {
    pub(crate) text: String,
    /// Byte in the prompt of each byte of `text`; `None`: the same.
    origin: Option<Vec<usize>>,
}

impl Cleaned {
    /// The byte offset in the prompt that the byte `at` of the text came from.
    pub(crate) fn origin(&self, at: usize) -> usize {
        match &self.origin {
            Some(origin) => origin.get(at).copied().unwrap_or(at),
            None => at,
        }
    }
}

/// A character and the byte offset in the prompt that it came from.
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
    let traced = compose(&traced);
    collect(lower(&traced))
}

/// Whether no rule but lower case changes this byte.
fn is_plain(byte: u8) -> bool {
    matches!(byte, b' '..=b'%' | b'\''..=b'~' | b'\t' | b'\n' | b'\r' | b'\x0C')
}

/// Decodes HTML entities until none is left, from the right, so that `&amp;lt;` takes one pass.
fn decode_entities(prompt: &str) -> Vec<Traced> {
    let keep = prompt.contains('<');
    // The text so far, backwards: its last element is the leftmost character.
    let mut stack: Vec<Traced> = Vec::with_capacity(prompt.len());
    for (at, c) in prompt.char_indices().rev() {
        stack.push((c, at));
        while !keep && let Some((length, decoded)) = entity_on_top(&stack) {
            stack.truncate(stack.len() - length);
            stack.extend(decoded.chars().rev().map(|c| (c, at)));
        }
    }
    stack.reverse();
    stack
}

/// The entity that starts with the leftmost character, if one does: its length and what it stands for.
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

/// Drops control characters and replaces quotes, ligatures and width forms.
fn replace_forms(text: &[Traced]) -> Vec<Traced> {
    let mut out = Vec::with_capacity(text.len());
    for &(c, at) in text {
        match c {
            '\0'..='\x08' | '\x0B' | '\x0E'..='\x1F' | '\x7F' => {}
            '\u{206A}'..='\u{206F}' | '\u{FEFF}' | '\u{FFF9}'..='\u{FFFC}' => {}
            '\u{2BC}' | '\u{2018}'..='\u{201B}' => out.push(('\'', at)),
            '\u{201C}'..='\u{201F}' => out.push(('"', at)),
            // Ligatures and letter pairs, ideographic space, full and half width.
            '\u{132}' | '\u{133}' | '\u{149}' | '\u{1C4}'..='\u{1CC}' | '\u{1F1}'..='\u{1F3}' => {
                out.extend(c.nfkc().map(|c| (c, at)));
            }
            '\u{FB00}'..='\u{FB06}' | '\u{3000}' | '\u{FF01}'..='\u{FFEF}' => {
                out.extend(c.nfkc().map(|c| (c, at)));
            }
            _ => out.push((c, at)),
        }
    }
    out
}

/// Unicode form NFC; what is composed comes from where its first character came from.
fn compose(text: &[Traced]) -> Vec<Traced> {
    if is_nfc_quick(text.iter().map(|&(c, _)| c)) == IsNormalized::Yes {
        return text.to_vec();
    }
    // Between two such groups nothing is composed or reordered.
    text.chunk_by(|_, &(next, _)| !starts_group(next))
        .flat_map(|group| {
            let at = group[0].1;
            group.iter().map(|&(c, _)| c).nfc().map(move |c| (c, at))
        })
        .collect()
}

/// Whether this character never joins with what stands before it.
fn starts_group(c: char) -> bool {
    canonical_combining_class(c) == 0 && is_nfc_quick(std::iter::once(c)) == IsNormalized::Yes
}

/// Lower case of the whole text: a final sigma depends on its neighbours.
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
