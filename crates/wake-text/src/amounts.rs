//! Numbers with their units, alone or in ranges.

use crate::pieces::{Kind, Piece, word_at};
use std::ops::Range;

/// Quantity that a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dimension {
    Speed,
    Angle,
    Length,
}

/// A number with its unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Amount {
    /// `None` without a unit.
    pub(crate) dimension: Option<Dimension>,
    /// Value in m/s, degrees or metres; NaN for digits that do not form a number.
    pub(crate) value: f64,
    /// Indices of the number and its unit.
    pub(crate) pieces: Range<usize>,
}

/// Result of reading a group of numbers.
#[derive(Debug, PartialEq)]
pub(crate) enum Group {
    /// One number. What follows it up to the given end, such as "± 1 m/s", is not part of it.
    One(Amount, usize),
    /// A range, a list, a bound or a number without a unit, up to the given end: no value.
    NoValue(usize),
}

/// The group of numbers that starts at a piece, if there is one.
///
/// "5 to 7 m/s", "5 m/s - 7 m/s", "between 5 and 7 m/s", "5 x 7 m" and "5 7 m/s" are ranges and lists; "at least 5
/// m/s" is a bound; "5 ± 1 m/s" is 5 m/s with a margin.
pub(crate) fn group(sentence: &[Piece<'_>], at: usize) -> Option<Group> {
    let mut first = amount(sentence, at)?;
    let mut end = first.pieces.end;
    let (mut many, mut margin) = (false, end);
    while let Some((next, is_margin)) = joined(sentence, &first, end) {
        end = next.pieces.end;
        if is_margin && !many {
            if first.dimension.is_none()
                && let Some(unit) = unit(sentence, next.pieces.start + 1)
            {
                first.dimension = Some(unit.dimension);
                first.value *= unit.factor;
            }
            margin = end;
        } else {
            many = true;
        }
        if next.dimension.is_some() && first.dimension.is_none() && many {
            break;
        }
    }
    let has_value = first.dimension.is_some() && !first.value.is_nan();
    Some(if many || !has_value || is_bound(sentence, at) {
        Group::NoValue(end)
    } else {
        Group::One(first, margin)
    })
}

/// The next number of the group that `first` begins, and whether it is a margin of error.
fn joined(sentence: &[Piece<'_>], first: &Amount, end: usize) -> Option<(Amount, bool)> {
    let kind = sentence.get(end)?.kind;
    let start = first.pieces.start;
    let between = start > 0 && matches!(word_at(sentence, start - 1), Some("between" | "from"));
    let unitless = first.dimension.is_none();
    let plus_minus = kind == Kind::PlusMinus
        || (kind == Kind::Word("plus")
            && sentence[end + 1..]
                .iter()
                .take(2)
                .map(|p| p.kind)
                .eq([Kind::Word("or"), Kind::Word("minus")]));
    let next = match kind {
        Kind::PlusMinus => end + 1,
        Kind::Word("plus") if plus_minus => end + 3,
        Kind::Number(_) | Kind::Figure if unitless => end,
        Kind::Dash
        | Kind::Cross
        | Kind::Word("to" | "x" | "by" | "or" | "through" | "till" | "until") => end + 1,
        Kind::Word("and") if between || unitless => end + 1,
        Kind::Comma | Kind::Colon if unitless => end + 1,
        _ => return None,
    };
    let next = amount(sentence, next)?;
    let alike = unitless || next.dimension.is_none() || next.dimension == first.dimension;
    alike.then_some((next, plus_minus))
}

/// Whether words or marks before a number make it a bound.
fn is_bound(sentence: &[Piece<'_>], at: usize) -> bool {
    let Some(before) = at.checked_sub(1) else {
        return false;
    };
    match sentence[before].kind {
        Kind::Bound => true,
        Kind::Word("to") => before > 0 && word_at(sentence, before - 1) == Some("up"),
        Kind::Word(word) => matches!(
            word,
            "least"
                | "most"
                | "than"
                | "above"
                | "below"
                | "beyond"
                | "exceeding"
                | "maximum"
                | "minimum"
                | "max"
                | "min"
                | "within"
        ),
        _ => false,
    }
}

/// The number at a piece, if there is one, with its unit.
fn amount(sentence: &[Piece<'_>], at: usize) -> Option<Amount> {
    let number = match sentence.get(at)?.kind {
        Kind::Number(number) => number,
        Kind::Figure => f64::NAN,
        _ => return None,
    };
    let word = |back: usize| word_at(sentence, at.checked_sub(back)?);
    let minus = word(1) == Some("minus") && !matches!(word(2), Some("or" | "plus"));
    let number = if minus { -number } else { number };
    let unit = unit(sentence, at + 1);
    let (dimension, factor, words) =
        unit.map_or((None, 1.0, 0), |u| (Some(u.dimension), u.factor, u.words));
    let value = number * factor + 0.0; // +0.0: never −0
    // "45 100 degrees" and "5,270 degrees" are lists that look like numbers with thousands separators.
    let is_list = dimension == Some(Dimension::Angle) && (1000.0..f64::INFINITY).contains(&value);
    Some(Amount {
        dimension,
        value: if is_list { f64::NAN } else { value },
        pieces: at..at + 1 + words,
    })
}

/// A unit: quantity, size in SI units (degrees for angles), number of words.
struct Unit {
    dimension: Dimension,
    factor: f64,
    words: usize,
}

/// The unit that starts at a piece, if there is one.
fn unit(sentence: &[Piece<'_>], at: usize) -> Option<Unit> {
    let word = |i: usize| word_at(sentence, at + i).unwrap_or_default();
    let of = |dimension, factor, words| {
        Some(Unit {
            dimension,
            factor,
            words,
        })
    };
    let nautical =
        usize::from(word(0) == "nautical" && length_unit(word(1)) == length_unit("mile"));
    let length = if nautical == 1 {
        Some(NAUTICAL_MILE)
    } else {
        length_unit(word(0))
    };
    let rest = nautical + 1;
    if let Some(factor) = speed_unit(word(0)) {
        return of(Dimension::Speed, factor, 1);
    }
    if let Some(factor) = length {
        if let Some(time) = word(rest).strip_prefix('/').and_then(time_unit) {
            return of(Dimension::Speed, factor / time, rest + 1);
        }
        let per = word(rest) == "per"
            || sentence
                .get(at + rest)
                .is_some_and(|piece| piece.kind == Kind::Cross);
        return match time_unit(word(rest + 1)).filter(|_| per) {
            Some(time) => of(Dimension::Speed, factor / time, rest + 2),
            None if per => None,
            None => of(Dimension::Length, factor, rest),
        };
    }
    let factor = angle_unit(word(0))?;
    let toward = at > 1 && matches!(word_at(sentence, at - 2), Some("to" | "toward" | "towards"));
    let relative = makes_no_direction(word(1)) || (word(1) == "from" && !toward);
    (!relative).then_some(())?;
    of(Dimension::Angle, factor, 1)
}

const NAUTICAL_MILE: f64 = 1852.0;
const MILE: f64 = 1609.344;
const FOOT: f64 = 0.3048;
const HOUR: f64 = 3600.0;

/// Size of a one-word unit of speed \[m/s\].
fn speed_unit(word: &str) -> Option<f64> {
    Some(match word {
        "mps" => 1.0,
        "knot" | "knots" | "kn" | "kns" | "kt" | "kts" => NAUTICAL_MILE / HOUR,
        "kmh" | "kph" | "kmph" => 1000.0 / HOUR,
        "mph" => MILE / HOUR,
        "fps" => FOOT,
        _ => {
            let (length, time) = word.split_once('/')?;
            length_unit(length)? / time_unit(time)?
        }
    })
}

/// Size of a unit of length \[m\].
fn length_unit(word: &str) -> Option<f64> {
    Some(match word {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "km" | "kms" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => 1000.0,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 0.01,
        "nm" | "nmi" => NAUTICAL_MILE,
        "mi" | "mile" | "miles" => MILE,
        "ft" | "foot" | "feet" => FOOT,
        "yd" | "yard" | "yards" => 3.0 * FOOT,
        _ => return None,
    })
}

/// Size of a unit of time \[s\].
fn time_unit(word: &str) -> Option<f64> {
    Some(match word {
        "s" | "sec" | "second" | "seconds" => 1.0,
        "min" | "minute" | "minutes" => 60.0,
        "h" | "hr" | "hour" | "hours" => HOUR,
        _ => return None,
    })
}

/// Size of a unit of angle \[degrees\].
fn angle_unit(word: &str) -> Option<f64> {
    Some(match word {
        "deg" | "degs" | "degree" | "degrees" | "°" => 1.0,
        "rad" | "radian" | "radians" => 180.0 / std::f64::consts::PI,
        _ => return None,
    })
}

/// Whether this word after "degrees" marks a temperature, a position, a rate or an angle relative to something else.
fn makes_no_direction(word: &str) -> bool {
    matches!(
        word,
        "c" | "f"
            | "k"
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
            | "latitude"
            | "longitude"
            | "per"
            | "/s"
            | "off"
            | "relative"
            | "left"
            | "right"
            | "port"
            | "starboard"
            | "between"
            | "counterclockwise"
            | "anticlockwise"
    )
}

/// Whether a word is a unit by itself.
pub(crate) fn is_unit(word: &str) -> bool {
    let unit = speed_unit(word).or(length_unit(word)).or(angle_unit(word));
    unit.is_some() && word.chars().count() > 1 || word == "nautical" || word == "°"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pieces::Text;

    fn group_of(text: &str) -> Option<Group> {
        let text = Text::of(text);
        let pieces = text.pieces();
        let at = pieces
            .iter()
            .position(|piece| matches!(piece.kind, Kind::Number(_) | Kind::Figure))?;
        group(&pieces, at)
    }

    /// International values: the nautical mile of 1,852 m (1929), the foot of 0.3048 m (1959), the mile of 5,280
    /// feet.
    #[test]
    fn units_have_their_international_sizes() {
        use Dimension::{Angle, Length, Speed};
        let cases = [
            ("1 m/s", Speed, 1.0),
            ("1 mps", Speed, 1.0),
            ("1 ms-1", Speed, 1.0),
            ("1 m s⁻¹", Speed, 1.0),
            ("1 metre per second", Speed, 1.0),
            ("1 meter/sec", Speed, 1.0),
            ("36 km/h", Speed, 10.0),
            ("36 kph", Speed, 10.0),
            ("36 kilometres per hour", Speed, 10.0),
            ("36 km / h", Speed, 10.0),
            ("900 knots", Speed, 463.0),
            ("900 kts", Speed, 463.0),
            ("900 nautical miles per hour", Speed, 463.0),
            ("900 nm/h", Speed, 463.0),
            ("100 mph", Speed, 44.704),
            ("100 miles per hour", Speed, 44.704),
            ("100 m.p.h.", Speed, 44.704),
            ("10 ft/s", Speed, 3.048),
            ("600 m/min", Speed, 10.0),
            ("2 km", Length, 2000.0),
            ("2 nm", Length, 3704.0),
            ("2 nautical miles", Length, 3704.0),
            ("5 miles", Length, 8046.72),
            ("1000 ft", Length, 304.8),
            ("100 yards", Length, 91.44),
            ("45 deg", Angle, 45.0),
            ("45°", Angle, 45.0),
            ("3.141592653589793 rad", Angle, 180.0),
        ];
        for (text, dimension, value) in cases {
            let Some(Group::One(amount, end)) = group_of(text) else {
                panic!("{text}");
            };
            assert_eq!(amount.dimension, Some(dimension), "{text}");
            // One product and one quotient of inexact numbers: two half units in the last place.
            assert!(
                (amount.value - value).abs() <= 2.0 * f64::EPSILON * value,
                "{text}: {}",
                amount.value
            );
            assert_eq!(amount.pieces.end, end, "{text}");
        }
    }

    #[test]
    fn ranges_lists_and_bounds_have_no_value() {
        let texts = [
            "5 to 7 m/s",
            "5-7 m/s",
            "5 m/s to 7 m/s",
            "between 5 and 7 m/s",
            "between 5 m/s and 7 m/s",
            "5 or 7 m/s",
            "5, 7, 9 m/s",
            "5 x 7 km",
            "5 7 m/s",
            "5...7 m/s",
            "12:30 m/s",
            "at least 5 m/s",
            "up to 5 m/s",
            "< 5 m/s",
            "more than 5 m/s",
            "5",
            "5 apples",
            "1.2.3 m/s",
            "20 degrees C",
            "54 degrees north",
            "5 deg per second",
            "30 degrees off the bow",
            "5 m per cat",
            "10^4 m",
        ];
        for text in texts {
            assert!(matches!(group_of(text), Some(Group::NoValue(_))), "{text}");
        }
    }

    #[test]
    fn numbers_of_different_kinds_are_no_range() {
        for text in [
            "45 degrees to 10 m/s",
            "45 degrees - 10 m/s",
            "5 m/s and 7 m/s",
        ] {
            assert!(matches!(group_of(text), Some(Group::One(..))), "{text}");
        }
    }

    #[test]
    fn a_margin_of_error_leaves_the_middle() {
        for (text, end) in [
            ("5 ± 1 m/s", 4),
            ("5 m/s ± 1 m/s", 5),
            ("5 +/- 1 m/s", 4),
            ("5 plus or minus 1 m/s", 6),
        ] {
            let Some(Group::One(amount, margin)) = group_of(text) else {
                panic!("{text}");
            };
            assert_eq!(
                (amount.dimension, amount.value, margin),
                (Some(Dimension::Speed), 5.0, end),
                "{text}"
            );
        }
    }
}
