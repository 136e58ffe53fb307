//! Words that change the number beside them: comparisons, fractions, multiples, reversals, relative bearings.
//!
//! None of them is evaluated: the value they change stays unread, together with the word. An unknown word right
//! before a number, or bound to it by "of", "to" or a colon, may be a modifier and is treated as one.

use crate::amounts::is_unit;
use crate::compass::may_be_compass;
use crate::pieces::{Kind, Piece, word_at};
use crate::subjects::{
    is_at_rest, is_attribute, is_filler, is_motion, is_strength, noun, says_nothing, word_before,
};

/// Number of pieces before or after a quantity that are searched for a modifier.
const REACH: usize = 8;

/// Index of the first piece of a modifier before a quantity, if there is one.
///
/// - `unknown_binds`: whether an unknown word right before the quantity counts as a modifier
pub(crate) fn modifier_before(
    sentence: &[Piece<'_>],
    start: usize,
    unknown_binds: bool,
) -> Option<usize> {
    // Whether all words so far bind the word before them to the quantity.
    let mut bound = unknown_binds;
    for at in (start.saturating_sub(REACH)..start).rev() {
        let word = match sentence[at].kind {
            Kind::Bound => return Some(at),
            Kind::Symbol => return bound.then_some(at),
            Kind::Colon => continue,
            Kind::Word(word) => word,
            _ => return None,
        };
        if changes(sentence, at, start) {
            let leads = match word_before(sentence, at) {
                Some("at") => matches!(
                    word,
                    "least" | "most" | "max" | "maximum" | "min" | "minimum"
                ),
                Some("no") => word != "both",
                _ => false,
            };
            return Some(at - usize::from(leads));
        }
        if is_filler(word) || matches!(word, "to" | "its" | "this" | "that" | "minus") {
            continue;
        }
        if !(joins(word) || noun(word).is_some() || is_attribute(word) || is_motion(word)) {
            return (bound && !is_known(word)).then_some(at);
        }
        bound = false;
    }
    None
}

/// Whether the word at `at` changes the quantity that starts at `start`.
fn changes(sentence: &[Piece<'_>], at: usize, start: usize) -> bool {
    let after_quantity = || {
        at > 0
            && match sentence[at - 1].kind {
                Kind::Number(_) | Kind::Figure => true,
                Kind::Word(word) => is_unit(word),
                _ => false,
            }
    };
    match word_at(sentence, at) {
        Some("minus") => after_quantity(),
        Some("as") => at + 1 == start,
        Some(word) => BEFORE.contains(&word) || compares(word),
        None => false,
    }
}

/// Index after the last piece of a modifier behind a quantity, if there is one; `turns`: whether the quantity may be
/// an angle.
pub(crate) fn modifier_after(sentence: &[Piece<'_>], end: usize, turns: bool) -> Option<usize> {
    let next = sentence.get(end)?;
    let touches = end > 0 && sentence[end - 1].place.end == next.place.start;
    if touches && matches!(next.kind, Kind::Symbol | Kind::Figure) {
        return Some(end + 1);
    }
    let mut found = None;
    for at in end..sentence.len().min(end + REACH) {
        let Some(word) = word_at(sentence, at) else {
            break;
        };
        if compares(word) || AFTER.contains(&word) || (turns && RELATIVE.contains(&word)) {
            found = Some(at + 1);
        } else if !(BRIDGES.contains(&word) || (at == end && is_unit(word))) {
            break;
        }
    }
    found
}

/// Whether a word is in any vocabulary, including filler.
fn is_known(word: &str) -> bool {
    says_nothing(word)
        || noun(word).is_some()
        || is_attribute(word)
        || is_strength(word)
        || is_at_rest(word)
        || is_unit(word)
        || may_be_compass(word)
}

/// Whether a word may stand between a quantity and its modifier.
fn joins(word: &str) -> bool {
    matches!(
        word,
        "toward" | "towards" | "from" | "at" | "by" | "with" | "than" | "in" | "on" | "are" | "was"
    )
}

/// Whether a word makes a number a bound or a fraction of another.
fn compares(word: &str) -> bool {
    COMPARISONS.contains(&word)
}

const COMPARISONS: [&str; 35] = [
    "least",
    "most",
    "than",
    "above",
    "below",
    "beyond",
    "exceeding",
    "exceeds",
    "maximum",
    "minimum",
    "max",
    "min",
    "maximal",
    "minimal",
    "within",
    "less",
    "more",
    "fewer",
    "greater",
    "higher",
    "lower",
    "slower",
    "faster",
    "smaller",
    "larger",
    "half",
    "third",
    "quarter",
    "times",
    "plus",
    "both",
    "each",
    "percent",
    "opposite",
    "respectively",
];

/// Words that change the quantity after them.
const BEFORE: [&str; 44] = [
    "up",
    "between",
    "top",
    "limit",
    "limited",
    "fraction",
    "part",
    "tenth",
    "fifth",
    "twice",
    "thrice",
    "double",
    "triple",
    "treble",
    "quadruple",
    "dozen",
    "opposing",
    "reverse",
    "reversed",
    "reciprocal",
    "inverse",
    "inverted",
    "contrary",
    "perpendicular",
    "orthogonal",
    "parallel",
    "antiparallel",
    "mirrored",
    "relative",
    "apparent",
    "magnetic",
    "port",
    "starboard",
    "left",
    "right",
    "either",
    "neither",
    "other",
    "unlike",
    "except",
    "instead",
    "rather",
    "difference",
    "away",
];

/// Words that change the quantity before them.
const AFTER: [&str; 14] = [
    "short", "shy", "tops", "minus", "squared", "cubed", "per", "apart", "halved", "doubled",
    "tripled", "reversed", "inverted", "either",
];

/// Words that make degrees an angle relative to something other than north.
const RELATIVE: [&str; 27] = [
    "port",
    "starboard",
    "left",
    "right",
    "bow",
    "bows",
    "stern",
    "beam",
    "abeam",
    "abaft",
    "astern",
    "aft",
    "ahead",
    "behind",
    "forward",
    "off",
    "relative",
    "clockwise",
    "counterclockwise",
    "anticlockwise",
    "counter",
    "anti",
    "windward",
    "leeward",
    "upwind",
    "downwind",
    "magnetic",
];

/// Words between a quantity and a modifier behind it.
const BRIDGES: [&str; 12] = [
    "to", "on", "of", "from", "the", "its", "a", "an", "your", "or", "at", "in",
];
