//! Prompt → the values it states.
//!
//! Every number with a unit belongs to a subject: to the one named right after it ("3 mps wind"), else to
//! the last one named before it in its sentence ("a ship moving at 10 mps"), else to the next one. Subject
//! and unit together say which value it is; where they say none, nothing is stated.

use crate::error::{Error, Result};
use crate::pieces::{Kind, Piece, pieces, word_at};
use crate::quantities::{Dimension, Quantity, owner, quantity};
use crate::statement::PartialScene;
use crate::subjects::{Named, Subject, subjects};
use std::ops::Range;

impl PartialScene {
    /// The values a prompt states.
    ///
    /// Understands every [`Wording`](crate::Wording) and free text like it: any case and spacing, the
    /// sentences in any order, speeds in `mps`, `m/s` or knots, directions in degrees, a fetch in metres or
    /// kilometres. "Wind from 270 degrees" blows toward 90. A text that states nothing is no error.
    ///
    /// # Errors
    ///
    /// [`Error::Impossible`] for a value that no scene can have, [`Error::Contradiction`] for two different
    /// values of the same thing; both quote the words.
    ///
    /// # Examples
    ///
    /// ```
    /// use wake_text::PartialScene;
    ///
    /// let said = PartialScene::read("A ship at 7.5 m/s, heading 20 deg, in a light breeze")?;
    /// assert_eq!(said.ship_speed, Some(7.5));
    /// assert_eq!(said.ship_heading, Some(20.0));
    /// assert_eq!(said.wind_speed, None);
    /// # Ok::<(), wake_text::Error>(())
    /// ```
    pub fn read(prompt: &str) -> Result<Self> {
        let lower = prompt.to_ascii_lowercase();
        let pieces = pieces(&lower);
        let mut reading = Reading::new(prompt);
        for sentence in pieces.split(|piece| piece.kind == Kind::Stop) {
            let mut subjects = subjects(sentence);
            for subject in &subjects {
                reading.name(subject)?;
            }
            let absent = [Subject::NoShip, Subject::NoWind];
            subjects.retain(|named| !absent.contains(&named.subject));
            for at in 0..sentence.len() {
                if let Some(quantity) = quantity(sentence, at) {
                    reading.measure(sentence, &subjects, quantity)?;
                }
            }
        }
        reading.finish()
    }
}

/// One of the values a prompt can state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Value {
    ShipSpeed,
    ShipHeading,
    WindSpeed,
    WindToward,
    Fetch,
    Incidence,
}

impl Value {
    fn of(subject: Subject, dimension: Dimension) -> Option<Self> {
        match (subject, dimension) {
            (Subject::Ship | Subject::Heading, Dimension::Speed) => Some(Self::ShipSpeed),
            (Subject::Ship | Subject::Heading, Dimension::Angle) => Some(Self::ShipHeading),
            (Subject::Wind | Subject::Fetch, Dimension::Speed) => Some(Self::WindSpeed),
            (Subject::Wind | Subject::Fetch, Dimension::Angle) => Some(Self::WindToward),
            (Subject::Fetch, Dimension::Length) => Some(Self::Fetch),
            (Subject::Incidence, Dimension::Angle) => Some(Self::Incidence),
            _ => None,
        }
    }

    fn slot(self, said: &mut PartialScene) -> &mut Option<f64> {
        match self {
            Self::ShipSpeed => &mut said.ship_speed,
            Self::ShipHeading => &mut said.ship_heading,
            Self::WindSpeed => &mut said.wind_speed,
            Self::WindToward => &mut said.wind_toward,
            Self::Fetch => &mut said.fetch,
            Self::Incidence => &mut said.incidence,
        }
    }
}

/// The values found so far and the words that state them.
struct Reading<'a> {
    prompt: &'a str,
    said: PartialScene,
    values: Vec<(Value, Range<usize>)>,
    /// Words that speak of a ship, and words that say there is none.
    ship: [Option<Range<usize>>; 2],
}

impl<'a> Reading<'a> {
    fn new(prompt: &'a str) -> Self {
        Self {
            prompt,
            said: PartialScene::default(),
            values: Vec::new(),
            ship: [None, None],
        }
    }

    /// Takes in that a subject is named.
    fn name(&mut self, named: &Named) -> Result<()> {
        match named.subject {
            Subject::Ship => self.ship[0] = Some(named.place.clone()),
            Subject::NoShip => self.ship[1] = Some(named.place.clone()),
            Subject::NoWind => {
                return self.set(Value::WindSpeed, 0.0, named.place.clone());
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes in a quantity.
    fn measure(
        &mut self,
        sentence: &[Piece<'_>],
        subjects: &[Named],
        quantity: Quantity,
    ) -> Result<()> {
        let Some((owner, right_after)) = owner(sentence, subjects, &quantity) else {
            return Ok(());
        };
        let Some(value) = Value::of(owner.subject, quantity.dimension) else {
            return Ok(());
        };
        let Range { start, end } = quantity.pieces;
        let last = if right_after { owner.at } else { end - 1 };
        let first = sentence[start].place.start;
        let from = start > 0 && word_at(sentence, start - 1) == Some("from");
        let turn = if from && value == Value::WindToward {
            180.0
        } else {
            0.0
        };
        self.set(
            value,
            quantity.value + turn,
            first..sentence[last].place.end,
        )
    }

    /// Notes a value, which must be possible and the same as one noted before.
    fn set(&mut self, value: Value, number: f64, place: Range<usize>) -> Result<()> {
        let mut alone = PartialScene::default();
        *value.slot(&mut alone) = Some(number);
        alone.check(&self.prompt[place.clone()])?;
        let number = match value {
            Value::ShipHeading | Value::WindToward => number.rem_euclid(360.0) % 360.0,
            _ => number,
        };
        match value.slot(&mut self.said).replace(number) {
            Some(old) if (old - number).abs() > 1e-9 * old.abs() => {
                let first = self.values.iter().find(|(other, _)| *other == value);
                let first = first.map_or(place.clone(), |(_, place)| place.clone());
                Err(self.contradiction(first, place))
            }
            _ => {
                self.values.push((value, place));
                Ok(())
            }
        }
    }

    fn finish(mut self) -> Result<PartialScene> {
        let [named, absent] = self.ship.clone();
        let of_ship = [Value::ShipSpeed, Value::ShipHeading];
        let stated = self
            .values
            .iter()
            .find(|(value, _)| of_ship.contains(value));
        let present = stated.map(|(_, place)| place.clone()).or(named);
        match (present, absent) {
            (Some(present), Some(absent)) => return Err(self.contradiction(absent, present)),
            (Some(_), None) => self.said.ship = Some(true),
            (None, Some(_)) => self.said.ship = Some(false),
            (None, None) => {}
        }
        Ok(self.said)
    }

    fn contradiction(&self, first: Range<usize>, second: Range<usize>) -> Error {
        Error::Contradiction {
            first: self.prompt[first].to_owned(),
            second: self.prompt[second].to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use wake_physics::Scene;

    fn read(prompt: &str) -> PartialScene {
        PartialScene::read(prompt).unwrap()
    }

    const NOTHING: PartialScene = PartialScene {
        ship: None,
        ship_speed: None,
        ship_heading: None,
        wind_speed: None,
        wind_toward: None,
        fetch: None,
        incidence: None,
    };

    const ALL: PartialScene = PartialScene {
        ship: Some(true),
        ship_speed: Some(10.0),
        ship_heading: Some(135.0),
        wind_speed: Some(3.0),
        wind_toward: Some(90.0),
        fetch: Some(10_000.0),
        incidence: Some(32.0),
    };

    #[test]
    fn the_same_scene_in_many_words() {
        let prompts = [
            "Simulated SAR image of wakes from a ship moving at 10 mps toward 135 degrees. Ocean waves are \
             shaped by 3 mps wind directing toward 90 degrees and 10000 meter fetch. Captured at 32 degree \
             incidence.",
            "CAPTURED AT 32 DEGREE INCIDENCE.  OCEAN WAVES ARE SHAPED BY 3 MPS WIND DIRECTING TOWARD 90 \
             DEGREES AND 10 KM FETCH. WAKES FROM A SHIP MOVING AT 10 M/S TOWARD 135 DEG.",
            "A vessel heads toward 135° at 10m/s in a 3-mps northerly wind toward 90°, fetch 10,000 m, \
             incidence angle 32 deg",
            "Wind 3 meters per second toward 90 deg over 10 kilometres of fetch; ship speed 10.0 mps, \
             heading 135 degrees; angle of incidence 32 degrees",
            "At 10 mps and toward 135 degrees a ship sails. Wind from 270 degrees at 3 m/s.\nFetch: 1e1 km. \
             Incidence: 32 deg",
            "Ship speed: 10 mps\nHeading: 135 deg\nWind speed: 3 mps\nWind direction = 90 deg\nFetch: 10 km\n\
             Incidence angle: 32 deg\n",
            "ship 10mps toward -225 degrees, wind 3mps toward 450 degrees, fetch 10km, 32degree incidence",
        ];
        for prompt in prompts {
            assert_eq!(read(prompt), ALL, "{prompt}");
        }
    }

    #[test]
    fn free_text_states_nothing() {
        let prompts = [
            "",
            "a photo of a cat",
            "10 mps toward 135 degrees",
            "waves of 3 m, 45 degrees latitude, temperature 20 degrees C",
            "10 20 30 mps. mps. degrees 12",
            "SAR image, Kelvin angle 19.5 degrees",
            "嵐の海 🚢 \u{200B}\0",
        ];
        for prompt in prompts {
            assert_eq!(read(prompt), NOTHING, "{prompt}");
            assert!(read(prompt).is_empty());
        }
    }

    #[test]
    fn what_is_not_said_stays_open() {
        let ship = PartialScene {
            ship: Some(true),
            ..NOTHING
        };
        assert_eq!(read("a ship of 195 m, wake angle 39 degrees"), ship);
        let said = read("SAR image of a ship wake, Kelvin angle 19.5 degrees, wind 7 m/s");
        assert_eq!(
            said,
            PartialScene {
                wind_speed: Some(7.0),
                ..ship
            }
        );
        let said = read("A ship sails against a current of 2 mps toward 10 degrees");
        assert_eq!(said, ship);
        let said = read("a ship in 5 mps wind");
        assert_eq!(
            said,
            PartialScene {
                wind_speed: Some(5.0),
                ..ship
            }
        );
        let said = read("wind heading toward 20 degrees");
        assert_eq!(
            said,
            PartialScene {
                wind_toward: Some(20.0),
                ..NOTHING
            }
        );
    }

    #[test]
    fn absence_is_a_statement() {
        let said = read("Open sea without a ship. No wind.");
        let expected = PartialScene {
            ship: Some(false),
            wind_speed: Some(0.0),
            ..NOTHING
        };
        assert_eq!(said, expected);
        assert_eq!(read("no ships").ship, Some(false));
        assert_eq!(read("a windless night").wind_speed, Some(0.0));
        assert_eq!(read("no wind at all, wind 0 mps").wind_speed, Some(0.0));
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(prompt in any::<String>()) {
            let _ = PartialScene::read(&prompt);
        }

        /// What is read lies in the ranges of a scene; what is refused is quoted from the prompt.
        #[test]
        fn any_words_of_the_field_are_read_or_refused(
            words in prop::collection::vec(
                "-?[0-9]{1,3}(\\.[0-9])?|mps|m/s|km|meter|degrees|°|ship|no|without|a|wind|fetch|of|incidence|angle|\
                 heading|from|toward|[.,;:]|É",
                0..30,
            )
        ) {
            let prompt = words.join(" ");
            match PartialScene::read(&prompt) {
                Ok(said) => prop_assert!(said.onto(&Scene { ship: None, ..Scene::default() }).is_ok(), "{}", prompt),
                Err(Error::Impossible { words, .. }) => prop_assert!(prompt.contains(&words)),
                Err(Error::Contradiction { first, second }) => {
                    prop_assert!(prompt.contains(&first) && prompt.contains(&second));
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    #[test]
    fn long_hostile_prompts_are_read_in_linear_time() {
        for unit in [
            "angle ",
            "3 mps wind ",
            "ship 1 ",
            "no ship ",
            "1,000",
            "- ",
            "a/",
            "no no a ",
        ] {
            let prompt = unit.repeat(30_000);
            let _ = PartialScene::read(&prompt);
        }
    }

    #[test]
    fn knots_are_nautical_miles_per_hour() {
        let speed = read("ship at 20 knots").ship_speed.unwrap();
        assert!((speed - 10.288_89).abs() < 1e-5, "{speed}");
    }

    #[test]
    fn contradictions_quote_both_words() {
        let cases = [
            (
                "ship at 10 mps. The ship moves at 12 m/s",
                "10 mps",
                "12 m/s",
            ),
            (
                "Open sea without a ship, ship at 10 mps",
                "without a ship",
                "10 mps",
            ),
            ("NO SHIP here, but a ship", "NO SHIP", "ship"),
            ("no wind; 5 mps wind", "no wind", "5 mps wind"),
            ("fetch 10 km. 9000 meter fetch", "10 km", "9000 meter fetch"),
            ("incidence 32°, 33° incidence", "32°", "33° incidence"),
        ];
        for (prompt, first, second) in cases {
            let expected = Error::Contradiction {
                first: first.into(),
                second: second.into(),
            };
            assert_eq!(PartialScene::read(prompt), Err(expected), "{prompt}");
        }
        assert_eq!(read("10 km fetch, fetch of 10000 m").fetch, Some(10_000.0));
    }

    #[test]
    fn impossible_values_quote_the_words_and_the_range() {
        let cases = [
            (
                "a ship moving at -1 mps",
                "'-1 mps', but ship.speed is -1, outside 0 to 40 m/s",
            ),
            (
                "50 mps wind",
                "'50 mps wind', but sea.wind_speed is 50, outside 0 to 30 m/s",
            ),
            (
                "0 meter fetch",
                "'0 meter fetch', but sea.fetch is 0, outside 100 to 10000000 m",
            ),
            (
                "Incidence of 80 deg.",
                "'80 deg', but radar.incidence is 80, outside 5 to 75 degrees",
            ),
            (
                "heading 1e999 degrees",
                "'1e999 degrees', but ship.heading is inf",
            ),
        ];
        for (prompt, expected) in cases {
            let message = PartialScene::read(prompt).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
