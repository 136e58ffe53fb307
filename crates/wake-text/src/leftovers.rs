//! Parts of a sentence that were not read.

use crate::amounts::is_unit;
use crate::compass::is_compass;
use crate::pieces::{Kind, Piece};
use crate::statement::PartialScene;
use crate::subjects::{
    Named, Subject, is_at_rest, is_attribute, is_strength, is_unstated, noun, says_nothing,
};
use std::ops::Range;

/// State of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Open,
    Used,
    Unread,
    /// Denies the wake: counts as used if there is no ship.
    NoWake,
}

/// A part of a sentence that was not read.
pub(crate) struct Left {
    pub(crate) place: Range<usize>,
    /// Whether it contains a number or a word of the field.
    pub(crate) of_the_field: bool,
}

/// A sentence that has been read.
pub(crate) struct Marked<'s, 'a> {
    pub(crate) pieces: &'s [Piece<'a>],
    pub(crate) marks: &'s [Mark],
    /// Subjects that the sentence names and does not deny.
    pub(crate) subjects: &'s [Named],
}

impl Marked<'_, '_> {
    /// Unread parts; neighbouring pieces are merged.
    pub(crate) fn left(&self, scene: &PartialScene) -> Vec<Left> {
        let mut found: Vec<Left> = Vec::new();
        let mut last = usize::MAX;
        for at in 0..self.pieces.len() {
            let of_the_field = self.is_unread(at, scene);
            if !of_the_field && !self.is_unknown(at, scene) {
                continue;
            }
            let place = self.pieces[at].place.clone();
            match found.last_mut() {
                Some(before) if last == at => {
                    before.place.end = place.end;
                    before.of_the_field |= of_the_field;
                }
                _ => found.push(Left {
                    place,
                    of_the_field,
                }),
            }
            last = at + 1;
        }
        found
    }

    /// Whether a piece is a sign or an unknown word, or a strength ("light") whose value no number states.
    fn is_unknown(&self, at: usize, scene: &PartialScene) -> bool {
        let word = match (self.marks[at], self.pieces[at].kind) {
            (Mark::Open, Kind::Symbol | Kind::Bound) => return true,
            (Mark::Open, Kind::Word(word)) => word,
            _ => return false,
        };
        if word == "flat" {
            return scene.wind_speed != Some(0.0);
        }
        if is_strength(word) {
            let is_ship = self.strong(at) == Some(Subject::Ship);
            let speed = if is_ship {
                scene.ship_speed
            } else {
                scene.wind_speed
            };
            return speed.is_none();
        }
        noun(word).is_none() && !is_attribute(word) && !says_nothing(word)
    }

    /// The subject to which the strength at a place refers: the next one nearby, else the last one.
    fn strong(&self, at: usize) -> Option<Subject> {
        let next = self.subjects.partition_point(|named| named.at < at);
        let (before, after) = self.subjects.split_at(next);
        let near = after.first().filter(|named| named.at - at <= 4);
        near.or(before.last()).map(|named| named.subject)
    }

    fn is_unread(&self, at: usize, scene: &PartialScene) -> bool {
        let word = match (self.marks[at], self.pieces[at].kind) {
            (Mark::Used, _) => return false,
            (Mark::NoWake, _) => return scene.ship != Some(false),
            (Mark::Unread, _) | (_, Kind::Number(_) | Kind::Figure | Kind::PlusMinus) => {
                return true;
            }
            (Mark::Open, Kind::Word(word)) => word,
            _ => return false,
        };
        let near = |way: usize| {
            let near = at.saturating_sub(way)..self.pieces.len().min(at + way + 1);
            self.marks[near].contains(&Mark::Used)
        };
        match noun(word) {
            Some(Subject::Ship | Subject::Wake | Subject::Bystander) => false,
            Some(Subject::Wind) => scene.wind_speed.or(scene.wind_toward).is_none(),
            Some(Subject::Wave) => scene.wind_speed.is_none(),
            Some(Subject::Fetch) => scene.fetch.is_none(),
            Some(Subject::Incidence) => scene.incidence.is_none(),
            Some(Subject::Heading | Subject::Angle) => !near(4),
            Some(_) => true,
            None if is_attribute(word) => !near(4),
            None => is_unit(word) || is_compass(word) || is_at_rest(word) || is_unstated(word),
        }
    }
}
