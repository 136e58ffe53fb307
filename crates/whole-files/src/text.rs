//! Escaping of untrusted text in error messages: one line of limited length, without control characters.

/// Escapes untrusted text for an error message and cuts it to at most 80 characters.
///
/// ```
/// assert_eq!(whole_files::quoted("a\u{1b}[31mb"), "a\\u{1b}[31mb");
/// assert_eq!(whole_files::quoted(&"x".repeat(81)).chars().count(), 80);
/// ```
pub fn quoted(text: &str) -> String {
    shortened(text, 80)
}

/// Shortens a message that may quote untrusted text to one line of at most 400 characters, cutting its middle.
pub fn sentence(text: &str) -> String {
    let text = text.trim();
    // Cut long texts before escaping.
    if text.len() <= 400 {
        return shortened(text, 400);
    }
    let (head, tail) = (
        text.floor_char_boundary(200),
        text.ceil_char_boundary(text.len() - 180),
    );
    format!(
        "{} … {}",
        shortened(&text[..head], 200),
        shortened(&text[tail..], 180)
    )
}

/// Escapes control and invisible characters, and cuts the result to `longest` characters.
fn shortened(text: &str, longest: usize) -> String {
    let mut short = String::new();
    let mut count = 0;
    for character in text.chars() {
        let escaped = match character {
            '\n' | '\r' | '\t' => " ".to_owned(),
            c if c.is_control() || is_invisible(c) => c.escape_unicode().to_string(),
            c => c.to_string(),
        };
        count += escaped.chars().count();
        if count > longest {
            while short.chars().count() >= longest {
                short.pop();
            }
            short.push('…');
            break;
        }
        short.push_str(&escaped);
    }
    short
}

/// Whether a character is invisible or changes the direction of a line.
fn is_invisible(character: char) -> bool {
    matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_text_is_short_and_harmless() {
        assert_eq!(quoted("ship.speed=8"), "ship.speed=8");
        assert_eq!(quoted("a\nb\u{7}\0"), "a b\\u{7}\\u{0}");
        assert_eq!(quoted("\u{202e}gnp"), "\\u{202e}gnp");
        for text in ["x".repeat(1 << 20), "\u{1b}".repeat(500), "é".repeat(81)] {
            let short = quoted(&text);
            assert!(
                short.chars().count() <= 80 && short.ends_with('…'),
                "{short}"
            );
        }
        assert_eq!(quoted(&"é".repeat(80)), "é".repeat(80));
    }

    #[test]
    fn a_sentence_keeps_its_ends() {
        let long = format!(
            "unknown variant `{}`, expected one of `a`, `b`",
            "é".repeat(1 << 20)
        );
        let short = sentence(&long);
        assert!(
            short.starts_with("unknown variant `é") && short.ends_with("`a`, `b`"),
            "{short}"
        );
        assert!(short.chars().count() <= 400, "{}", short.chars().count());
        assert_eq!(sentence("as it\nwas "), "as it was");
    }
}
