//! Numbers at the start of a text, in digits and in words.

/// Value and length of `12`, `1,200`, `12 000`, `1.5`, `1,5`, `.5`, `1.5e3`, `1/2`, `8 1/2` or `8½`; NaN for digits
/// joined in any other way.
pub(crate) fn unsigned(text: &str) -> Option<(f64, usize)> {
    let (whole, mut length) = match decimal(text) {
        Some(read) => read,
        None => vulgar(text).or_else(|| other_digits(text))?,
    };
    let (mut value, rest) = (whole, &text[length..]);
    let is_whole = text[..length].bytes().all(|byte| byte.is_ascii_digit());
    if is_whole && let Some((fraction, more)) = slashed(text) {
        (value, length) = (fraction, more);
    } else if is_whole && let Some((fraction, more)) = fraction_after(rest) {
        (value, length) = (whole + fraction, length + more);
    }
    let rest = &text[length..];
    let raised = |c: char| c.is_numeric() && !c.is_ascii_digit();
    let tail = match rest.strip_prefix('^') {
        Some(power) => 1 + digits(power.as_bytes()),
        None => rest.find(|c| !raised(c)).unwrap_or(rest.len()),
    };
    Some(if tail > 0 {
        (f64::NAN, length + tail)
    } else {
        (value, length)
    })
}

/// Digits with points, commas and spaces between them, and an exponent.
fn decimal(text: &str) -> Option<(f64, usize)> {
    let bytes = text.as_bytes();
    let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
    // `.5` is a number; `,5` is a comma and a number.
    let mut length = usize::from(bytes.first() == Some(&b'.') && digit(1));
    while digit(length)
        || (length > 0 && matches!(bytes.get(length), Some(b'.' | b',')) && digit(length + 1))
    {
        length += 1;
    }
    if length == 0 {
        return None;
    }
    let mut number = text[..length].to_owned();
    if length <= 3 && number.bytes().all(|byte| byte.is_ascii_digit()) {
        while let Some(group) = spaced_group(&text[length..]) {
            length += group;
            number.push_str(&text[length - 3..length]);
        }
    }
    let exponent = exponent_length(&bytes[length..]);
    let value = plain_number(&number).map(|number| number + &text[length..length + exponent]);
    let value = value.and_then(|number| number.parse().ok());
    Some((value.unwrap_or(f64::NAN), length + exponent))
}

/// Length of a space and three digits that continue a number such as `10 000`.
fn spaced_group(text: &str) -> Option<usize> {
    let space = text
        .chars()
        .next()
        .filter(|c| matches!(c, ' ' | '\u{A0}' | '\u{2009}' | '\u{202F}'))?;
    let group = &text.as_bytes()[space.len_utf8()..];
    let is_group = digits(group) == 3 && !matches!(group.get(3), Some(b'.' | b',' | b'/'));
    is_group.then(|| space.len_utf8() + 3)
}

/// Digits in Rust's notation: commas between groups of three are removed; any other single comma is a decimal point.
fn plain_number(number: &str) -> Option<String> {
    let (whole, decimals) = number.split_once('.').unwrap_or((number, ""));
    let groups: Vec<&str> = whole.split(',').collect();
    let grouped = groups[0].len() <= 3
        && groups[0] != "0"
        && groups[1..].iter().all(|group| group.len() == 3);
    if decimals.contains(['.', ',']) {
        None
    } else if groups.len() == 1 || grouped {
        Some(number.replace(',', ""))
    } else {
        (groups.len() == 2 && !number.contains('.')).then(|| number.replace(',', "."))
    }
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

/// Number of digits at the start of a text.
pub(crate) fn digits(text: &[u8]) -> usize {
    text.iter().take_while(|byte| byte.is_ascii_digit()).count()
}

/// Reads `1/2` and other halves, thirds, quarters and eighths; any other digits with slashes, such as dates, are NaN.
fn slashed(text: &str) -> Option<(f64, usize)> {
    let length = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '/' | '\u{2044}')));
    let all = &text[..length.unwrap_or(text.len())];
    let all = all.trim_end_matches(['/', '\u{2044}']);
    let (above, below) = all.split_once(['/', '\u{2044}'])?;
    let (above, below): (f64, f64) = match (above.parse(), below) {
        (Ok(above), "2" | "3" | "4" | "8") => (above, below.parse().ok()?),
        _ => (1.0, 0.0),
    };
    let value = if above < below {
        above / below
    } else {
        f64::NAN
    };
    Some((value, all.len()))
}

/// Reads a fraction below one right after a whole number, or after a space or hyphen.
fn fraction_after(text: &str) -> Option<(f64, usize)> {
    let space = usize::from(text.starts_with([' ', '-']));
    let (value, length) =
        vulgar(&text[space..]).or_else(|| slashed(&text[space..]).filter(|_| space > 0))?;
    (value < 1.0).then_some((value, space + length))
}

/// Reads `½` and similar characters.
fn vulgar(text: &str) -> Option<(f64, usize)> {
    let c = text.chars().next()?;
    let eighths = [
        ('¼', 2.0),
        ('½', 4.0),
        ('¾', 6.0),
        ('⅛', 1.0),
        ('⅜', 3.0),
        ('⅝', 5.0),
        ('⅞', 7.0),
    ];
    let (_, count) = eighths.into_iter().find(|&(sign, _)| sign == c)?;
    Some((count / 8.0, c.len_utf8()))
}

/// Digits of other scripts and superscripts, read as NaN.
fn other_digits(text: &str) -> Option<(f64, usize)> {
    let length = text.find(|c: char| !c.is_numeric() || c.is_ascii_digit());
    let length = length.unwrap_or(text.len());
    (length > 0).then_some((f64::NAN, length))
}

/// Numbers in words.
const SPELT: [&str; 28] = [
    "zero",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
    "thirteen",
    "fourteen",
    "fifteen",
    "sixteen",
    "seventeen",
    "eighteen",
    "nineteen",
    "twenty",
    "thirty",
    "forty",
    "fifty",
    "sixty",
    "seventy",
    "eighty",
    "ninety",
];

/// The number that a word spells, including `one`, which callers take for an article unless it continues a number.
pub(crate) fn spelt(word: &str) -> Option<f64> {
    let rank = SPELT.iter().position(|&spelt| spelt == word)?;
    Some(if rank < 20 {
        rank as f64
    } else {
        10.0 * (rank - 18) as f64
    })
}

/// Whether `more` continues the number `value`: "five" after "twenty", "thirty" after "two hundred".
pub(crate) fn continues(value: f64, more: f64) -> bool {
    let step = if more < 10.0 { 10.0 } else { 100.0 };
    more > 0.0 && value >= step + 10.0 && value % step == 0.0
}
