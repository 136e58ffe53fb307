//! Reads one sentence of a prompt.

use crate::amounts::{Amount, Dimension, Group, group, is_unit};
use crate::compass::{Compass, Form, POINT, compass, is_compass};
use crate::denials::{Denied, denials};
use crate::error::Result;
use crate::leftovers::{Left, Mark, Marked};
use crate::modifiers::{modifier_after, modifier_before};
use crate::pieces::{Kind, Piece, word_at};
use crate::statement::{PartialScene, Statement, Value};
use crate::subjects::{
    Named, Subject, is_approximate, is_at_rest, is_attribute, is_filler, is_link, is_motion,
    is_strength, leads, noun, subjects, word_before,
};
use std::ops::Range;

/// Subjects on each side that are searched for the owner of a number.
const NEAR: usize = 64;

/// Whether something moves toward a direction or comes from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Toward,
    From,
}

/// A sentence while it is being read.
pub(crate) struct Sentence<'t, 'a> {
    pieces: &'t [Piece<'a>],
    marks: Vec<Mark>,
    subjects: Vec<Named>,
}

impl<'t, 'a> Sentence<'t, 'a> {
    pub(crate) fn new(pieces: &'t [Piece<'a>]) -> Self {
        Self {
            pieces,
            marks: vec![Mark::Open; pieces.len()],
            subjects: subjects(pieces),
        }
    }

    pub(crate) fn read(&mut self, statement: &mut Statement<'_>) -> Result<()> {
        for denied in denials(self.pieces) {
            self.deny(&denied, statement)?;
        }
        for named in &self.subjects {
            statement.name(named.subject, self.place(named.at..named.at + 1));
        }
        let mut at = 0;
        while at < self.pieces.len() {
            if self.marks[at] != Mark::Open {
                at += 1;
            } else if let Some(group) = group(self.pieces, at) {
                if let Some(changed) = self.changed(at, &group) {
                    at = changed.end;
                    self.mark(changed, Mark::Unread);
                    continue;
                }
                at = match group {
                    Group::One(amount, end) => {
                        self.mark(amount.pieces.end..end, Mark::Unread);
                        self.measure(&amount, statement)?;
                        end
                    }
                    Group::NoValue(end) => {
                        let start = self.bounds(at).unwrap_or(at);
                        self.mark(start..end, Mark::Unread);
                        end
                    }
                };
            } else if let Some(compass) = compass(self.pieces, at) {
                at = self.point(&compass, statement)?;
            } else {
                self.rest(at, statement)?;
                at += 1;
            }
        }
        Ok(())
    }

    fn place(&self, pieces: Range<usize>) -> Range<usize> {
        self.pieces[pieces.start].place.start..self.pieces[pieces.end - 1].place.end
    }

    fn mark(&mut self, pieces: Range<usize>, mark: Mark) {
        self.marks[pieces].fill(mark);
    }

    /// The pieces of a group of numbers and the words that modify it, if there are any.
    fn changed(&self, at: usize, group: &Group) -> Option<Range<usize>> {
        let (turns, end) = match group {
            Group::One(amount, end) => (amount.dimension == Some(Dimension::Angle), *end),
            Group::NoValue(end) => (true, *end),
        };
        let before = modifier_before(self.pieces, at, true);
        let after = modifier_after(self.pieces, end, turns);
        before.or(after)?;
        Some(before.unwrap_or(at)..after.unwrap_or(end))
    }

    /// Index of the word that bounds a quantity, as in "wind under 5 m/s" (but not in "under 5 m/s wind").
    fn bounds(&self, start: usize) -> Option<usize> {
        let before = self.before(start)?;
        let word = word_at(self.pieces, before)?;
        matches!(word, "under" | "over" | "past" | "near").then_some(before)
    }

    /// Records a negation; its subjects own no numbers.
    fn deny(&mut self, denied: &Denied, statement: &mut Statement<'_>) -> Result<()> {
        self.subjects
            .retain(|named| !denied.pieces.contains(&named.at));
        let place = self.place(denied.pieces.clone());
        let mark = match denied.subject {
            None | Some(Subject::Wave) => Mark::Unread,
            Some(Subject::Wake) => Mark::NoWake,
            Some(_) => Mark::Used,
        };
        self.mark(denied.pieces.clone(), mark);
        match denied.subject {
            Some(Subject::Ship) => statement.deny_ship(place),
            Some(Subject::Wind) => statement.set(Value::WindSpeed, 0.0, 0.0, place)?,
            _ => {}
        }
        Ok(())
    }

    /// Records a number with its unit.
    fn measure(&mut self, amount: &Amount, statement: &mut Statement<'_>) -> Result<()> {
        let pieces = amount.pieces.clone();
        let owner = amount
            .dimension
            .and_then(|dimension| self.owner(pieces.clone(), dimension));
        let value = owner
            .zip(amount.dimension)
            .and_then(|((named, _), dimension)| Value::of(named.subject, dimension));
        let Some(((owner, right_after), value)) = owner.zip(value) else {
            if let Some((owner, right_after)) = owner.filter(|(owner, _)| is_own(owner.subject)) {
                // The unread part includes the subject that owns it.
                let end = if right_after {
                    owner.at + 1
                } else {
                    pieces.end
                };
                let near = owner.at < pieces.start && pieces.start - owner.at <= 3;
                self.mark(
                    if near { owner.at } else { pieces.start }..end,
                    Mark::Unread,
                );
            }
            self.mark(pieces, Mark::Unread);
            return Ok(());
        };
        if let Some(bound) = self.bounds(pieces.start).filter(|_| !right_after) {
            self.mark(bound..pieces.end, Mark::Unread);
            return Ok(());
        }
        let end = if right_after {
            owner.at + 1
        } else {
            pieces.end
        };
        let minus = word_before(self.pieces, pieces.start) == Some("minus");
        let sign = pieces.start - usize::from(minus);
        let (way, start) = self.way(sign);
        if let Some(from) = self
            .lost_from(sign)
            .filter(|_| value.is_direction() && way.is_none())
        {
            self.mark(from..pieces.end, Mark::Unread);
            return Ok(());
        }
        let turned = value.is_direction() && way == Some(Way::From);
        let number = if turned {
            amount.value + 180.0
        } else {
            amount.value
        };
        statement.set(value, number, 0.0, self.place(pieces.start..end))?;
        self.mark(
            if value.is_direction() { start } else { sign }..pieces.end,
            Mark::Used,
        );
        self.mark(owner.at..owner.at + 1, Mark::Used);
        Ok(())
    }

    /// Records a compass word; returns the index after it.
    fn point(&mut self, compass: &Compass, statement: &mut Statement<'_>) -> Result<usize> {
        let Range { start, end } = compass.pieces;
        let (way, from) = self.way(start);
        // An adjective before "north wind" describes the wind.
        let describes = way.is_none() && self.described(end).is_some();
        if let Some(changed) = modifier_before(self.pieces, start, !describes && way.is_some()) {
            self.mark(changed..end, Mark::Unread);
            return Ok(end);
        }
        if let Some(quadrant) = self.quadrant(end) {
            self.mark(start..quadrant, Mark::Unread);
            return Ok(quadrant);
        }
        let found = self.direction(compass, way);
        // "se" may be a word of another language; after "wind" or "5 m/s" it is a direction.
        let letters =
            end == start + 1 && word_at(self.pieces, start).is_some_and(|word| !is_compass(word));
        let leading = self.before(start).and_then(|at| word_at(self.pieces, at));
        let foreign = letters
            && !leading
                .is_some_and(|word| noun(word).is_some() || is_attribute(word) || is_unit(word));
        match found {
            Some((value, way)) => {
                let turn = if way == Way::From { 180.0 } else { 0.0 };
                let place = self.place(start..end);
                statement.set(value, compass.degrees + turn, 0.5 * POINT, place)?;
                self.mark(from..end, Mark::Used);
            }
            None if foreign && way.is_none() => {}
            None => {
                let heading =
                    |at: &usize| word_at(self.pieces, *at).and_then(noun) == Some(Subject::Heading);
                let leading = self.before(start).filter(heading).unwrap_or(start);
                self.mark(leading.min(from)..end, Mark::Unread);
            }
        }
        Ok(end)
    }

    /// The end of a quadrant bearing such as "north 45 degrees west", whose first compass word ends at `end`.
    fn quadrant(&self, end: usize) -> Option<usize> {
        let number = self.pieces.get(end)?;
        matches!(number.kind, Kind::Number(_)).then_some(())?;
        let unit = usize::from(word_at(self.pieces, end + 1).is_some_and(is_unit));
        Some(compass(self.pieces, end + 1 + unit)?.pieces.end)
    }

    /// The direction that a compass word states.
    fn direction(&self, found: &Compass, way: Option<Way>) -> Option<(Value, Way)> {
        let Range { start, end } = found.pieces.clone();
        if self.is_of_many(&found.pieces) {
            return None;
        }
        let next = self.described(end);
        let leading = self.before(start).and_then(|at| word_at(self.pieces, at));
        let moves = leading.is_some_and(leads);
        if let (Some(subject), None) = (next, way) {
            return match (subject, found.form) {
                // "heading north wind": of ship or wind?
                (Subject::Wind, _) if moves => None,
                (Subject::Wind, Form::Ward) => Some((Value::WindToward, Way::Toward)),
                (Subject::Wind, _) => Some((Value::WindToward, Way::From)),
                (Subject::Heading, _) | (Subject::Ship, Form::Ward) => {
                    Some((Value::ShipHeading, Way::Toward))
                }
                _ => None,
            };
        }
        let (owner, _) = self.owner(start..end, Dimension::Angle)?;
        let value = Value::of(owner.subject, Dimension::Angle)?;
        if next.is_none() && !self.may_follow(end) {
            return None;
        }
        let before = self.before(start);
        let of_wind = value == Value::WindToward;
        match (way, found.form) {
            (Some(Way::From), _)
                if of_wind
                    || before
                        .is_some_and(|at| word_before(self.pieces, at).is_some_and(is_motion)) =>
            {
                Some((value, Way::From))
            }
            (Some(Way::From), _) => None,
            (Some(Way::Toward), _) | (None, Form::Ward) => Some((value, Way::Toward)),
            (None, Form::Erly) if of_wind => Some((value, Way::From)),
            (None, Form::Ern) => None,
            (None, _) => moves.then_some((value, Way::Toward)),
        }
    }

    /// Whether a compass word is one of several: "north to east".
    fn is_of_many(&self, pieces: &Range<usize>) -> bool {
        let joins =
            |at: usize| matches!(word_at(self.pieces, at), Some("to" | "or" | "and" | "by"));
        let (start, end) = (pieces.start, pieces.end);
        let after = compass(self.pieces, end + usize::from(joins(end))).is_some();
        let join = start
            .checked_sub(1)
            .filter(|&at| joins(at))
            .unwrap_or(start);
        let before = (join.saturating_sub(3)..join).filter_map(|at| compass(self.pieces, at));
        after || before.into_iter().any(|before| before.pieces.end == join)
    }

    /// The subject that the words from a piece on describe, skipping strengths and numbers.
    fn described(&self, from: usize) -> Option<Subject> {
        let mut at = from;
        while let Some(Group::One(_, end)) = group(self.pieces, at) {
            at = end;
        }
        while word_at(self.pieces, at).is_some_and(|word| is_strength(word) || word == "steady") {
            at += 1;
        }
        let word = word_at(self.pieces, at)?;
        noun(word).filter(|_| !is_motion(word))
    }

    /// Whether a direction may end before a piece; "the north of" and "the North Sea" are places.
    fn may_follow(&self, at: usize) -> bool {
        match word_at(self.pieces, at) {
            None => true,
            Some(word) => {
                is_link(word)
                    || word.ends_with("ly")
                    || matches!(word, "direction" | "directions" | "course")
            }
        }
    }

    /// Index of the nearest piece before `at` that is not filler.
    fn before(&self, at: usize) -> Option<usize> {
        let fills = |at: &usize| {
            matches!(self.pieces[*at].kind, Kind::Colon)
                || word_at(self.pieces, *at).is_some_and(is_filler)
        };
        (0..at).rev().find(|at| !fills(at))
    }

    /// The preposition of the direction at a piece, and the piece where the phrase starts.
    fn way(&self, at: usize) -> (Option<Way>, usize) {
        let Some(before) = self.before(at) else {
            return (None, at);
        };
        match word_at(self.pieces, before) {
            Some("from") => (Some(Way::From), before),
            Some("out") if word_at(self.pieces, before + 1) == Some("of") => {
                (Some(Way::From), before)
            }
            Some("to" | "toward" | "towards") => (Some(Way::Toward), before),
            _ => (None, at),
        }
    }

    /// A "from" that describing words separate from its direction: "from a stormy 30 degrees".
    fn lost_from(&self, start: usize) -> Option<usize> {
        let describes = |at: &usize| {
            word_at(self.pieces, *at).is_some_and(|word| {
                is_filler(word)
                    || !(is_link(word) || is_unit(word) || is_attribute(word))
                        && noun(word).is_none()
            })
        };
        let from = (start.saturating_sub(NEAR)..start)
            .rev()
            .find(|at| !describes(at))?;
        (word_at(self.pieces, from) == Some("from")).then_some(from)
    }

    /// The subject that owns a quantity, and whether it stands right after the quantity.
    fn owner(&self, quantity: Range<usize>, dimension: Dimension) -> Option<(Named, bool)> {
        let able = |named: &&Named| named.subject.can_have(dimension);
        let start = self
            .subjects
            .partition_point(|named| named.at < quantity.start);
        let (before, after) = self.subjects.split_at(start);
        let before = before.iter().rev().take(NEAR).find(able);
        let next = after.iter().take(NEAR).find(able);
        let right_after = next
            .filter(|named| self.is_one_phrase(quantity.end..named.at) && !self.is_label(named.at));
        match right_after {
            Some(named) => Some((*named, true)),
            None => before.or(next).map(|named| (*named, false)),
        }
    }

    /// Whether a colon follows a word, possibly after two more words: "wind speed: 3 mps".
    fn is_label(&self, at: usize) -> bool {
        let mut next = self.pieces.iter().skip(at + 1).take(3);
        let mark = next.find(|piece| !matches!(piece.kind, Kind::Word(_)));
        mark.is_some_and(|piece| piece.kind == Kind::Colon)
    }

    /// Whether a unit and a noun are separated by at most two words, which describe the noun.
    fn is_one_phrase(&self, between: Range<usize>) -> bool {
        between.len() <= 2
            && between
                .into_iter()
                .all(|at| word_at(self.pieces, at).is_some_and(|word| !is_link(word)))
    }

    /// Records that a ship does not move.
    fn rest(&mut self, at: usize, statement: &mut Statement<'_>) -> Result<()> {
        let Some(word) = word_at(self.pieces, at) else {
            return Ok(());
        };
        let next = word_at(self.pieces, at + 1).unwrap_or_default();
        let no_motion = (word == "not" || word.ends_with("n't"))
            && matches!(next, "moving" | "sailing" | "underway");
        let two = (word == "at" && matches!(next, "rest" | "anchor")) || no_motion;
        let has_ship = self
            .subjects
            .iter()
            .any(|named| named.subject == Subject::Ship);
        if has_ship && (two || is_at_rest(word)) {
            let pieces = at..at + 1 + usize::from(two);
            if word_before(self.pieces, at).is_some_and(is_approximate) {
                self.mark(at - 1..pieces.end, Mark::Unread);
                return Ok(());
            }
            statement.set(Value::ShipSpeed, 0.0, 0.0, self.place(pieces.clone()))?;
            self.mark(pieces, Mark::Used);
        }
        Ok(())
    }

    /// Unread parts; neighbouring pieces are merged.
    pub(crate) fn unread(&self, scene: &PartialScene) -> Vec<Left> {
        let sentence = Marked {
            pieces: self.pieces,
            marks: &self.marks,
            subjects: &self.subjects,
        };
        sentence.left(scene)
    }
}

/// Whether a subject is reported as unread together with its numbers.
fn is_own(subject: Subject) -> bool {
    matches!(
        subject,
        Subject::Wave | Subject::Length | Subject::Degrees | Subject::Other
    )
}
