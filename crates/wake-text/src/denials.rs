//! Negations and conditions of a sentence.

use crate::compass::is_compass;
use crate::pieces::{Kind, Piece, word_at};
use crate::subjects::{
    Subject, is_approximate, is_at_rest, is_link, noun, says_nothing, word_before,
};
use std::ops::Range;

/// Something that a sentence denies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Denied {
    /// `None` if not understood.
    pub(crate) subject: Option<Subject>,
    pub(crate) pieces: Range<usize>,
}

/// The negations of a sentence, in order.
pub(crate) fn denials(sentence: &[Piece<'_>]) -> Vec<Denied> {
    let mut found: Vec<Denied> = Vec::new();
    let mut at = 0;
    while at < sentence.len() {
        match denial(sentence, at) {
            Some(mut denied) => {
                // "almost no wind" is some wind.
                if word_before(sentence, at).is_some_and(is_approximate) {
                    denied.subject = None;
                    denied.pieces.start = at - 1;
                }
                at = denied.pieces.end.max(at + 1);
                found.push(denied);
                while let Some(denied) = further(sentence, at) {
                    at = denied.pieces.end;
                    found.push(denied);
                }
            }
            None => at += 1,
        }
    }
    found
}

/// Most pieces that a negation covers.
const REACH: usize = 8;

/// The negation or condition that starts at a piece, if there is one.
fn denial(sentence: &[Piece<'_>], at: usize) -> Option<Denied> {
    let word = word_at(sentence, at);
    if word.is_some_and(opens_condition) {
        return Some(condition(sentence, at));
    }
    let named = word.and_then(noun);
    if let Some(subject) = named.filter(|subject| matches!(subject, Subject::Ship | Subject::Wind))
    {
        let understood = denied_after(sentence, at).map(|length| (Some(subject), length));
        let (subject, length) =
            understood.or_else(|| Some((None, perhaps_denied_after(sentence, at)?)))?;
        let pieces = at..at + length;
        return Some(Denied { subject, pieces });
    }
    let none =
        sentence[at].kind == Kind::Number(0.0) && noun_after(sentence, at) == Some(Subject::Ship);
    let start = at + opening(sentence, at).or(none.then_some(1))?;
    let is_not = word.is_some_and(|word| word == "not" || word.ends_with("n't"));
    if is_not && word_at(sentence, start) == Some("only") {
        return None;
    }
    let (mut plain, mut understood) = (0, true);
    for end in start..sentence.len().min(start + REACH) {
        let Some(word) = word_at(sentence, end) else {
            let ends = matches!(sentence[end].kind, Kind::Comma | Kind::Stop | Kind::Colon);
            if ends {
                return denied_nothing(sentence, at..end);
            }
            understood = false;
            continue;
        };
        // "no lack of ships", "not windless": double negation.
        understood &= !denies(word);
        match noun(word) {
            Some(subject) if subject != Subject::Heading && subject != Subject::Bystander => {
                let compound = noun_after(sentence, end)
                    .filter(|s| matches!(s, Subject::Wake | Subject::Wave));
                let subject = compound
                    .filter(|&head| head == Subject::Wave)
                    .unwrap_or(subject);
                let known = matches!(
                    subject,
                    Subject::Ship | Subject::Wind | Subject::Wake | Subject::Wave
                );
                let end = end + 1 + usize::from(compound.is_some());
                understood &= !is_taken_back(sentence, at, end);
                let others = (start..end).any(|at| word_at(sentence, at).is_some_and(is_further));
                let subject = if others { Subject::Bystander } else { subject };
                let subject = (understood && known).then_some(subject);
                return Some(Denied {
                    subject,
                    pieces: at..end,
                });
            }
            _ if matches!(word, "but" | "while" | "with" | "because") => {
                return denied_nothing(sentence, at..end);
            }
            _ if is_article(word) => understood &= plain == 0,
            _ if matches!(
                word,
                "of" | "sign" | "signs" | "trace" | "traces" | "kind" | "evidence"
            ) =>
            {
                plain = 0;
            }
            _ if is_link(word) || is_at_rest(word) || is_compass(word) => understood = false,
            _ => {
                understood &= is_plain(word);
                plain += 1;
            }
        }
    }
    denied_nothing(sentence, at..sentence.len().min(start + REACH))
}

/// Whether the words after a denied noun cancel the negation: "not ship-free", "no ships but one".
fn is_taken_back(sentence: &[Piece<'_>], at: usize, end: usize) -> bool {
    let counted = |at: usize| {
        sentence.get(at).is_some_and(|piece| {
            matches!(
                piece.kind,
                Kind::Number(_) | Kind::Figure | Kind::Word("one")
            )
        })
    };
    denied_after(sentence, end - 1).is_some()
        || (word_at(sentence, at) != Some("not")
            && matches!(word_at(sentence, end), Some("but" | "save"))
            && counted(end + 1))
}

/// Whether a word negates or means absence.
fn denies(word: &str) -> bool {
    matches!(
        word,
        "no" | "not"
            | "without"
            | "neither"
            | "never"
            | "cannot"
            | "lacking"
            | "sans"
            | "non"
            | "none"
            | "free"
            | "devoid"
            | "absence"
            | "lack"
            | "shortage"
            | "empty"
            | "clear"
    ) || word.ends_with("n't")
        || word.ends_with("less")
}

/// Whether a word between "no" and a noun leaves the noun denied: "no visible ship", "no large ships".
fn is_plain(word: &str) -> bool {
    says_nothing(word) || is_further(word) || matches!(word, "large" | "detectable" | "discernible")
}

/// Whether a word makes the text up to the next comma a condition or an exception.
fn opens_condition(word: &str) -> bool {
    matches!(
        word,
        "unless"
            | "if"
            | "except"
            | "excepting"
            | "excluding"
            | "instead"
            | "rather"
            | "until"
            | "lest"
    )
}

/// A condition or an exception, up to the next comma, which states nothing.
fn condition(sentence: &[Piece<'_>], at: usize) -> Denied {
    let ends = |piece: &Piece<'_>| matches!(piece.kind, Kind::Comma | Kind::Stop);
    let length = sentence[at..].iter().position(ends);
    Denied {
        subject: None,
        pieces: at..length.map_or(sentence.len(), |length| at + length),
    }
}

/// A negation without a subject, which matters only if it covers numbers, directions or other words of the field.
fn denied_nothing(sentence: &[Piece<'_>], pieces: Range<usize>) -> Option<Denied> {
    let says = |at: usize| match sentence[at].kind {
        Kind::Number(_) | Kind::Figure => true,
        Kind::Word(word) => is_compass(word) || noun(word).is_some() || is_at_rest(word),
        _ => false,
    };
    pieces.clone().any(says).then_some(Denied {
        subject: None,
        pieces,
    })
}

/// Number of pieces of the negation that starts at a piece: "no", "free of".
fn opening(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    let word = word_at(sentence, at)?;
    let of = word_at(sentence, at + 1) == Some("of");
    match word {
        "no" | "not" | "without" | "neither" | "nor" | "never" | "cannot" | "lacking" | "sans"
        | "non" => Some(1),
        "free" | "devoid" | "absence" | "lack" | "empty" | "clear" if of => Some(2),
        _ => word.ends_with("n't").then_some(1),
    }
}

/// Number of pieces of a noun and its negation: "shipless", "ship-free", "ships: none", "ship is not visible".
fn denied_after(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    if word_at(sentence, at)?.ends_with("less") {
        return Some(1);
    }
    let mut end = at + 1;
    let links = |piece: &Piece<'_>| {
        piece.kind == Kind::Colon || matches!(piece.kind, Kind::Word("is" | "are" | "was" | "were"))
    };
    while sentence.get(end).is_some_and(links) {
        end += 1;
    }
    let last = match word_at(sentence, end)? {
        "free" if word_at(sentence, end + 1) != Some("of") => end,
        "none" | "absent" | "false" | "missing" => end,
        "no" if word_at(sentence, end + 1).is_none() && end > at + 1 => end,
        word if word == "not" || word.ends_with("n't") => {
            word_at(sentence, end + 1).filter(|word| is_presence(word))?;
            end + 1
        }
        _ => return None,
    };
    Some(last + 1 - at)
}

/// Number of pieces from a noun to a negation that is not understood because of other words: "ship is hardly ever
/// absent".
fn perhaps_denied_after(sentence: &[Piece<'_>], at: usize) -> Option<usize> {
    let mut not = false;
    for (end, piece) in sentence.iter().enumerate().skip(at + 1).take(REACH) {
        let word = match piece.kind {
            Kind::Colon => continue,
            Kind::Word(word) => word,
            _ => return None,
        };
        let absent = matches!(word, "none" | "absent" | "missing" | "false");
        if absent || (not && is_presence(word)) {
            return Some(end + 1 - at);
        }
        if noun(word).is_some() {
            return None;
        }
        not |= word == "not" || word.ends_with("n't");
    }
    None
}

/// Whether a word means presence.
fn is_presence(word: &str) -> bool {
    matches!(
        word,
        "visible" | "present" | "seen" | "there" | "detected" | "included" | "shown"
    )
}

/// The negation that "or" continues: "no wind or ship".
fn further(sentence: &[Piece<'_>], at: usize) -> Option<Denied> {
    matches!(word_at(sentence, at)?, "or" | "nor").then_some(())?;
    let article = usize::from(word_at(sentence, at + 1).is_some_and(is_article));
    let noun_at = (at + 1 + article..at + 3 + article)
        .find(|&at| word_at(sentence, at).and_then(noun).is_some())?;
    let between = (at + 1..noun_at).all(|at| word_at(sentence, at).is_some_and(is_plain));
    between.then_some(())?;
    let subject = word_at(sentence, noun_at).and_then(noun);
    let pieces = at..noun_at + 1;
    let subject = subject.filter(|s| {
        matches!(
            s,
            Subject::Ship | Subject::Wind | Subject::Wake | Subject::Wave
        )
    });
    Some(Denied { subject, pieces })
}

/// Whether "no" before this word denies only further instances.
fn is_further(word: &str) -> bool {
    matches!(
        word,
        "other" | "others" | "further" | "second" | "more" | "additional"
    )
}

fn is_article(word: &str) -> bool {
    matches!(word, "a" | "an" | "any" | "the" | "its" | "single" | "one")
}

fn noun_after(sentence: &[Piece<'_>], at: usize) -> Option<Subject> {
    word_at(sentence, at + 1).and_then(noun)
}
