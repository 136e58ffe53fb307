//! Prompt → stated values and unread parts.
//!
//! Every number with a unit and every compass word belongs to a subject: the one named right after it ("3 mps wind"),
//! else the last one named before it in the sentence ("a ship moving at 10 mps"), else the next one. Subject and unit
//! together determine the value; where they determine none, the number stays unread.

use crate::error::Result;
use crate::pieces::{Kind, Text};
use crate::sentence::Sentence;
use crate::statement::{PartialScene, Statement};
use serde::Serialize;
use std::fmt;
use std::ops::Range;

/// Result of reading a prompt: the stated values and the parts that were not understood.
///
/// Every number and word of a prompt is part of `scene`, is filler that changes no value ("a", "of", "image", "sea"),
/// or is listed in `unread`; so is every sign that is neither punctuation nor part of a number. A text without
/// numbers and without words of the field [states nothing](Self::states_nothing), and `unread` is empty.
///
/// | in a prompt | read as |
/// | --- | --- |
/// | speeds in m/s, mps, knots, km/h, mph, ft/s; lengths in m, km, nautical miles, miles, feet, yards; angles in degrees, radians | SI units and degrees |
/// | `10,000`, `10 000`, `7.5`, `7,5`, `8 1/2`, `8½`, `1e4`, "twenty-five", full-width digits | numbers; three digits after a single comma are thousands |
/// | north, NNE, north-easterly, southbound, westwards … | multiples of 22.5 degrees; north is 0 degrees, the azimuth direction, up in the image |
/// | "wind from 270 degrees", "wind from the west", "westerly wind", "west wind" | wind toward 90 degrees |
/// | "no ship", "without any vessels", "ship-free", "not a ship" | no ship |
/// | "no wind", "windless" | wind of 0 m/s |
/// | "stationary ship", "anchored", "at rest" | a ship of 0 m/s |
/// | "wake" | a ship, unless the prompt says that there is none |
/// | "5 ± 1 m/s" | 5 m/s; the margin stays unread |
/// | "5 to 7 m/s", numbers without a unit, negated values ("not at 10 m/s"), lists of thousands of degrees | unread |
/// | "at least 5 m/s", ">= 5 m/s", "twice 5 m/s", "half of 10 m/s", "opposite to north", "45 degrees to port" and other words that change a value | word and value unread |
/// | an unknown word right before a number, or bound to it by "of", "to" or a colon | word and value unread |
/// | "unless …", "if …", "except …", "instead …", up to the next comma | unread |
/// | "light wind", "a fast ferry" without a number | ship or wind; the strength stays unread |
///
/// A compass word and a number for one direction may differ by up to half a point (11.25 degrees); the number is used.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Reading {
    /// The values the prompt states.
    pub scene: PartialScene,
    /// Unread parts, in the order of the prompt.
    pub unread: Vec<Unread>,
}

/// A part of a prompt that was not understood.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unread {
    /// Byte range in the prompt.
    pub place: Range<usize>,
    /// Text of the part.
    pub text: String,
    #[serde(skip)]
    of_the_field: bool,
}

impl Unread {
    /// Whether its words include a number or a word of the field (ships, wind, directions, units and the like), so
    /// that it may state a value; other unread words are only descriptive.
    pub fn is_of_the_field(&self) -> bool {
        self.of_the_field
    }
}

impl Reading {
    /// Reads a prompt: any [`Wording`](crate::Wording), or similar free text, in any case and spacing, with the
    /// sentences in any order.
    ///
    /// A text that states nothing is not an error; see [`Reading::states_nothing`].
    ///
    /// # Errors
    ///
    /// [`Impossible`](crate::Error::Impossible) for a value that no scene can have,
    /// [`Contradiction`](crate::Error::Contradiction) for two different values of the same quantity; both quote the
    /// words.
    ///
    /// # Examples
    ///
    /// ```
    /// use wake_text::Reading;
    ///
    /// let reading = Reading::of("A ship at 18 km/h heading north-east, in a swell of 2 m")?;
    /// assert_eq!(reading.scene.ship_speed, Some(5.0));
    /// assert_eq!(reading.scene.ship_heading, Some(45.0));
    /// assert_eq!(reading.unread[0].text, "swell of 2 m");
    /// assert!(Reading::of("a photo of a cat")?.states_nothing());
    /// # Ok::<(), wake_text::Error>(())
    /// ```
    pub fn of(prompt: &str) -> Result<Self> {
        let text = Text::of(prompt);
        let pieces = text.pieces();
        let mut statement = Statement::new(prompt, &text);
        let mut sentences = Vec::new();
        for pieces in pieces.split(|piece| piece.kind == Kind::Stop) {
            let mut sentence = Sentence::new(pieces);
            sentence.read(&mut statement)?;
            sentences.push(sentence);
        }
        let scene = statement.finish()?;
        let unread = sentences
            .iter()
            .flat_map(|sentence| sentence.unread(&scene));
        let unread = unread.map(|left| {
            let place = text.span(left.place);
            Unread {
                text: prompt[place.clone()].to_owned(),
                place,
                of_the_field: left.of_the_field,
            }
        });
        let mut unread: Vec<Unread> = unread.collect();
        // A text about something else states nothing and has no unread parts.
        if scene.is_empty() && !unread.iter().any(Unread::is_of_the_field) {
            unread.clear();
        }
        Ok(Self { scene, unread })
    }

    /// Whether the prompt states nothing about a scene.
    pub fn states_nothing(&self) -> bool {
        self.scene.is_empty()
    }
}

impl fmt::Display for Reading {
    /// Writes the stated values under their scene-file keys, one a line, and a line with the unread parts.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.states_nothing() {
            write!(f, "the prompt states nothing about a scene")?;
        } else {
            write!(f, "{}", self.scene)?;
        }
        if !self.unread.is_empty() {
            let parts: Vec<String> = self.unread.iter().map(Unread::to_string).collect();
            write!(f, "\nnot read: {}", parts.join(", "))?;
        }
        Ok(())
    }
}

impl fmt::Display for Unread {
    /// Writes the text in quotes, escaped and cut after 80 characters.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = self.text.char_indices().nth(80).map(|(at, _)| at);
        let more = if end.is_some() { " …" } else { "" };
        write!(
            f,
            "{:?}{more}",
            &self.text[..end.unwrap_or(self.text.len())]
        )
    }
}

impl PartialScene {
    /// Reads the values that a prompt states: the scene of [`Reading::of`], which also lists the unread parts.
    ///
    /// # Errors
    ///
    /// As [`Reading::of`].
    pub fn read(prompt: &str) -> Result<Self> {
        Reading::of(prompt).map(|reading| reading.scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
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
            "A vessel heads toward 135° at 10m/s in a 3-mps westerly wind toward 90°, fetch 10,000 m, \
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
            assert!(Reading::of(prompt).unwrap().states_nothing());
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

    /// A reading in the notation of `tests/prompts.txt`.
    fn in_short(reading: Result<Reading>) -> String {
        let reading = match reading {
            Ok(reading) => reading,
            Err(Error::Contradiction { .. }) => return "!contradiction".to_owned(),
            Err(_) => return "!impossible".to_owned(),
        };
        let said = reading.scene;
        let ship = said
            .ship
            .map(|ship| if ship { "ship" } else { "no-ship" }.to_owned());
        let values = [
            ("v", said.ship_speed),
            ("h", said.ship_heading),
            ("w", said.wind_speed),
            ("d", said.wind_toward),
            ("f", said.fetch),
            ("i", said.incidence),
        ];
        // Rounded to three decimals, as the values of the file are.
        let values = values
            .into_iter()
            .filter_map(|(key, value)| Some(format!("{key}={:.3}", value?)));
        let mut words: Vec<String> = ship.into_iter().chain(values).collect();
        words.sort();
        let unread = reading
            .unread
            .into_iter()
            .map(|unread| format!(" | {}", unread.text));
        words.join(" ") + &unread.collect::<String>()
    }

    #[test]
    fn a_corpus_of_prompts_is_read_as_by_hand() {
        let (mut count, mut wrong) = (0, Vec::new());
        for line in include_str!("../tests/prompts.txt").lines() {
            let Some((prompt, expected)) =
                line.split_once(" =>").filter(|_| !line.starts_with('#'))
            else {
                continue;
            };
            let (said, unread) = expected.split_once('|').unwrap_or((expected, ""));
            let number = |word: &str| match word.split_once('=') {
                Some((key, value)) => format!("{key}={:.3}", value.parse::<f64>().unwrap()),
                None => word.to_owned(),
            };
            let mut said: Vec<String> = said.split_whitespace().map(number).collect();
            said.sort();
            let unread = unread
                .split('|')
                .map(str::trim)
                .filter(|part| !part.is_empty());
            let expected =
                said.join(" ") + &unread.map(|part| format!(" | {part}")).collect::<String>();
            let found = in_short(Reading::of(prompt));
            if found != expected {
                wrong.push(format!("{prompt}\n  by hand {expected}\n  read    {found}"));
            }
            count += 1;
        }
        assert!(
            wrong.is_empty(),
            "{} of {count}:\n{}",
            wrong.len(),
            wrong.join("\n")
        );
        assert!(count >= 80, "only {count} prompts");
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(prompt in any::<String>()) {
            let _ = PartialScene::read(&prompt);
        }

        /// Values read are within the ranges of a scene; errors quote the prompt.
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
                Ok(said) => prop_assert!(said.onto(&Scene { ships: Vec::new(), ..Scene::default() }).is_ok(), "{}", prompt),
                Err(Error::Impossible { words, .. }) => prop_assert!(prompt.contains(&words)),
                Err(Error::Contradiction { first, second }) => {
                    prop_assert!(prompt.contains(&first) && prompt.contains(&second));
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    /// A number that is not listed as unread affects the result: replacing it changes the reading.
    #[test]
    fn no_number_is_dropped_in_silence() {
        let words = "[1-9][0-9]?(\\.5|,5)?|mps|m/s|km/h|knots|km|miles|degrees|deg\\.|°|±|to|between|and|ship|no|not|\
                     without|a|wind|fetch|of|incidence|angle|heading|from|toward|the|north|westerly|waves|length|at|[.,:-]";
        let prompts = prop::collection::vec(words, 0..12);
        // Before one or two digits, 18 and 36 add whole turns, which leave a direction unchanged.
        let extras = (3..40_u32).prop_filter("no whole turn", |extra| extra % 18 != 0);
        proptest!(ProptestConfig::with_cases(2000), |(words in prompts, extra in extras)| {
            let prompt = words.join(" ");
            let reading = Reading::of(&prompt);
            for (at, word) in words.iter().enumerate().filter(|(_, word)| word.starts_with(|c: char| c.is_ascii_digit())) {
                let start = words[..at].iter().map(|word| word.len() + 1).sum::<usize>();
                let is_named = |reading: &Reading| reading.unread.iter().any(|unread| unread.place.contains(&start));
                if reading.as_ref().is_ok_and(is_named) {
                    continue;
                }
                let mut others = words.clone();
                others[at] = format!("{}{}", extra, word);
                let other = Reading::of(&others.join(" "));
                prop_assert!(reading.is_err() || reading != other, "{} and {}: {:?}", prompt, others.join(" "), reading);
            }
        });
    }

    /// Speeds as people write them, with their values in m/s.
    fn speeds() -> impl Strategy<Value = (String, f64)> {
        let units = [
            (" m/s", 1.0),
            ("mps", 1.0),
            (" knots", 1852.0 / 3600.0),
            (" kts", 1852.0 / 3600.0),
            (" km/h", 1.0 / 3.6),
            (" kilometres per hour", 1.0 / 3.6),
            (" mph", 0.44704),
            (" m s-1", 1.0),
        ];
        let numbers = (0..=25_u32, 0..10_u32, prop::sample::select(vec![".", ","]));
        (numbers, prop::sample::select(units.to_vec())).prop_map(
            |((whole, tenth, point), (unit, factor))| {
                let value = f64::from(whole) + f64::from(tenth) / 10.0;
                (format!("{whole}{point}{tenth}{unit}"), value * factor)
            },
        )
    }

    fn fetches() -> impl Strategy<Value = (String, f64)> {
        let units = [
            (" m", 1.0),
            (" km", 1e3),
            (" nautical miles", 1852.0),
            (" miles", 1609.344),
            (" ft", 0.3048),
        ];
        (400..5000_u32, prop::sample::select(units.to_vec())).prop_map(|(value, (unit, factor))| {
            (format!("{value}{unit}"), f64::from(value) * factor)
        })
    }

    /// Directions toward which something moves, with their degrees.
    fn goals() -> impl Strategy<Value = (String, f64)> {
        let names = [
            "north",
            "north-northeast",
            "NE",
            "east-north-east",
            "east",
            "ESE",
            "south-east",
            "south southeast",
            "south",
            "SSW",
            "southwest",
            "west-southwest",
            "west",
            "WNW",
            "north west",
            "NNW",
        ];
        let points =
            (0..16_usize).prop_map(move |rank| (names[rank].to_owned(), 22.5 * rank as f64));
        let degrees = (
            0..360_u32,
            prop::sample::select(vec![" degrees", "°", " deg."]),
        );
        let degrees =
            degrees.prop_map(|(value, unit)| (format!("{value}{unit}"), f64::from(value)));
        prop_oneof![points, degrees]
    }

    proptest! {
        /// Units and compass words in free text are read as numbers.
        #[test]
        fn units_and_compass_words_go_round(
            (ship, ship_speed) in speeds(), (wind, wind_speed) in speeds(), (goal, heading) in goals(),
            (origin, from) in goals(), (fetch, metres) in fetches(), incidence in 5..=75_u32, order in 0..3_usize
        ) {
            let wind_first = [
                format!("Wind of {wind} from {origin} over a fetch of {fetch}"),
                format!("The wind blows at {wind} out of the {origin}, fetch {fetch}"),
                format!("{fetch} fetch under a wind from {origin} at {wind}"),
            ];
            let ship_words = [
                format!("a ship moving toward {goal} at {ship}"),
                format!("A vessel at {ship} sails to the {goal}"),
                format!("ship speed: {ship}, heading: {goal}"),
            ];
            let seen = format!("Incidence of {incidence} degrees");
            let mut sentences = [wind_first[order].clone(), ship_words[(order + incidence as usize) % 3].clone(), seen];
            sentences.rotate_left(order);
            let prompt = sentences.join(". ").replace(".. ", ". ");
            let reading = Reading::of(&prompt);
            let reading = reading.map_err(|e| TestCaseError::fail(format!("{prompt}: {e}")))?;
            let said = reading.scene;
            prop_assert!(reading.unread.is_empty(), "{}: {:?}", prompt, reading);
            prop_assert_eq!(said.ship, Some(true));
            // Products in another order differ by a few units in the last place.
            let near = |found: Option<f64>, value: f64| found.is_some_and(|found| (found - value).abs() <= 1e-12 * value.abs());
            prop_assert!(near(said.ship_speed, ship_speed) && near(said.wind_speed, wind_speed), "{}: {:?}", prompt, said);
            prop_assert!(near(said.fetch, metres), "{}: {:?}", prompt, said);
            prop_assert_eq!(said.ship_heading, Some(heading));
            prop_assert_eq!(said.wind_toward, Some((from + 180.0) % 360.0));
            prop_assert_eq!(said.incidence, Some(f64::from(incidence)));
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
    fn a_reading_prints_its_keys_and_what_it_left() {
        let reading = Reading::of("ship at 8 m/s in a swell of 2 m\u{1b}").unwrap();
        let expected = "there is a ship\nship.speed = 8 m/s\nnot read: \"swell of 2 m\\u{1b}\"";
        assert_eq!(reading.to_string(), expected);
        let nothing = Reading::of("a photo of a cat").unwrap();
        assert_eq!(
            nothing.to_string(),
            "the prompt states nothing about a scene"
        );
        let long = Reading::of(&"depth ".repeat(100)).unwrap();
        assert!(long.to_string().chars().count() < 140, "{long}");
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
