//! Foreign text in error messages: one line of limited length, without control characters.

/// Text that somebody else wrote, as it may stand in a sentence: at most 80 characters, control characters escaped.
///
/// ```
/// assert_eq!(whole_files::quoted("a\u{1b}[31mb"), "a\\u{1b}[31mb");
/// assert_eq!(whole_files::quoted(&"x".repeat(81)).chars().count(), 80);
/// ```
pub fn quoted(text: &str) -> String {
    shortened(text, 80)
}

/// A message that may quote foreign text: one line of at most 400 characters, of which the middle is left out.
pub fn sentence(text: &str) -> String {
    let text = text.trim();
    // A character becomes ten at most; what cannot stay need not be looked at.
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

/// The first `longest` characters, escaped where they would not be one printed character.
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

/// Characters that turn the direction of a line, or are nothing to see.
fn is_invisible(character: char) -> bool {
    matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}
