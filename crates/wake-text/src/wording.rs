//! Scene → prompt.

use crate::error::Result;
use crate::statement::PartialScene;
use wake_physics::Scene;

/// Wording of a prompt.
///
/// All wordings state the same values, and [`PartialScene::read`] reads all of them back. Training on several keeps a
/// text encoder from memorising one sentence.
///
/// With several ships they state the number of ships, and speed and heading of the first: "wakes from 2 ships, the
/// first moving at 10 mps toward 135 degrees". The number stays unread when the prompt is read back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wording {
    /// The words of Kamirul, Pappas and Achim:
    ///
    /// ```text
    /// Simulated SAR image of wakes from a ship moving at 10 mps toward 135 degrees. Ocean waves are shaped
    /// by 3 mps wind directing toward 90 degrees and 10000 meter fetch. Captured at 32 degree incidence.
    /// ```
    #[default]
    Paper,
    /// Wind first:
    ///
    /// ```text
    /// Wind of 3 mps blows toward 90 degrees over a fetch of 10000 meter. A ship moves toward 135 degrees
    /// at 10 mps and leaves a wake. Simulated SAR image at 32 degree incidence.
    /// ```
    WindFirst,
    /// Radar first:
    ///
    /// ```text
    /// SAR simulation at an incidence of 32 degrees. The wake of a ship with speed 10 mps and heading 135
    /// degrees. Sea under a wind of 3 mps toward 90 degrees, fetch 10000 meter.
    /// ```
    RadarFirst,
    /// As few words as possible:
    ///
    /// ```text
    /// SAR ship wake, ship 10 mps toward 135 degrees, wind 3 mps toward 90 degrees, fetch 10000 meter,
    /// incidence 32 degrees.
    /// ```
    Brief,
}

impl Wording {
    /// Every wording, the paper's first.
    pub const ALL: [Self; 4] = [Self::Paper, Self::WindFirst, Self::RadarFirst, Self::Brief];

    /// The prompt of a scene: ASCII, at most 77 tokens.
    ///
    /// Numbers are rounded as in [`PartialScene::of`]. Without a ship the prompt says "open sea without a ship";
    /// where the wind rounds to 0 m/s it says "no wind" or "without wind" and states neither direction nor fetch.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) if the scene is not valid.
    pub fn prompt(self, scene: &Scene) -> Result<String> {
        scene.validate()?;
        let said = PartialScene::of(scene);
        let ship = said.ship_speed.zip(said.ship_heading);
        let ship = ship.map(|(speed, heading)| Ships {
            count: scene.ships.len(),
            speed,
            heading,
        });
        let wind = said.wind_toward.zip(said.fetch);
        let wind = said.wind_speed.zip(wind);
        let wind = wind.map(|(speed, (toward, fetch))| [speed, toward, fetch]);
        let incidence = said.incidence.unwrap_or_default();
        Ok(match self {
            Self::Paper => paper(ship, wind, incidence),
            Self::WindFirst => wind_first(ship, wind, incidence),
            Self::RadarFirst => radar_first(ship, wind, incidence),
            Self::Brief => brief(ship, wind, incidence),
        })
    }
}

/// The prompt of a scene in the paper's words, [`Wording::Paper`].
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) if the scene is not valid.
///
/// # Examples
///
/// ```
/// let mut scene = wake_physics::Scene::default();
/// scene.ships.clear();
/// assert_eq!(
///     wake_text::prompt(&scene)?,
///     "Simulated SAR image of open sea without a ship. Ocean waves are shaped by 5 mps wind directing \
///      toward 90 degrees and 40000 meter fetch. Captured at 32 degree incidence."
/// );
/// # Ok::<(), wake_text::Error>(())
/// ```
pub fn prompt(scene: &Scene) -> Result<String> {
    Wording::Paper.prompt(scene)
}

/// Number of ships, at least one; speed and heading of the first.
struct Ships {
    count: usize,
    speed: f64,
    heading: f64,
}

impl Ships {
    /// Name of the first ship: `alone`, or as one of several.
    fn first(&self, alone: &str, of_several: impl Fn(usize) -> String) -> String {
        match self.count {
            1 => alone.to_owned(),
            count => of_several(count),
        }
    }
}

/// The ships, if there are any.
type Ship = Option<Ships>;
/// Speed, direction and fetch, if there is wind.
type Wind = Option<[f64; 3]>;

fn paper(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some(ships) => {
            let first = ships.first("a ship", |n| format!("{n} ships, the first"));
            let Ships { speed, heading, .. } = ships;
            format!("wakes from {first} moving at {speed} mps toward {heading} degrees")
        }
        None => "open sea without a ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => format!(
            "Ocean waves are shaped by {speed} mps wind directing toward {toward} degrees and {fetch} meter fetch"
        ),
        None => "The ocean is flat without wind".to_owned(),
    };
    format!("Simulated SAR image of {ship}. {wind}. Captured at {incidence} degree incidence.")
}

fn wind_first(ship: Ship, wind: Wind, incidence: f64) -> String {
    let wind = match wind {
        Some([speed, toward, fetch]) => format!(
            "Wind of {speed} mps blows toward {toward} degrees over a fetch of {fetch} meter"
        ),
        None => "No wind blows".to_owned(),
    };
    let ship = match ship {
        Some(ships) => {
            let first = ships.first("A ship", |n| format!("The first of {n} ships"));
            let Ships { speed, heading, .. } = ships;
            format!("{first} moves toward {heading} degrees at {speed} mps and leaves a wake")
        }
        None => "Open sea without a ship".to_owned(),
    };
    format!("{wind}. {ship}. Simulated SAR image at {incidence} degree incidence.")
}

fn radar_first(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some(ships) => {
            let first = ships.first("a ship", |n| format!("the first of {n} ships"));
            let Ships { speed, heading, .. } = ships;
            format!("The wake of {first} with speed {speed} mps and heading {heading} degrees")
        }
        None => "Open sea without a ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => {
            format!("Sea under a wind of {speed} mps toward {toward} degrees, fetch {fetch} meter")
        }
        None => "Flat sea without wind".to_owned(),
    };
    format!("SAR simulation at an incidence of {incidence} degrees. {ship}. {wind}.")
}

fn brief(ship: Ship, wind: Wind, incidence: f64) -> String {
    let ship = match ship {
        Some(ships) => {
            let first = ships.first("ship wake, ship", |n| {
                format!("wakes of {n} ships, the first")
            });
            let Ships { speed, heading, .. } = ships;
            format!("SAR {first} {speed} mps toward {heading} degrees")
        }
        None => "SAR open sea, no ship".to_owned(),
    };
    let wind = match wind {
        Some([speed, toward, fetch]) => {
            format!("wind {speed} mps toward {toward} degrees, fetch {fetch} meter")
        }
        None => "no wind".to_owned(),
    };
    format!("{ship}, {wind}, incidence {incidence} degrees.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Reading, TOKENS, Tokenizer};
    use proptest::prelude::*;
    use wake_physics::reference::paper_grid;
    use wake_physics::scene::Ship;

    /// Valid scenes that vary in everything a prompt states.
    fn scenes() -> impl Strategy<Value = Scene> {
        let angle = || prop_oneof![-720.0..720.0_f64, prop::num::f64::NORMAL];
        let ship = prop::option::of((0.0..=40.0_f64, angle()));
        let wind = prop_oneof![4 => 0.0..=30.0_f64, 1 => 0.0..0.1_f64];
        let fetch = (2.0..=7.0_f64).prop_map(|power| 10_f64.powf(power).clamp(100.0, 1e7));
        (ship, wind, angle(), fetch, 5.0..=75.0_f64).prop_map(
            |(ship, wind, toward, fetch, incidence)| {
                let mut scene = Scene {
                    ships: Vec::from_iter(ship.map(|(speed, heading)| Ship {
                        speed,
                        heading,
                        ..Ship::default()
                    })),
                    ..Scene::default()
                };
                (scene.sea.wind_speed, scene.sea.wind_toward) = (wind, toward);
                (scene.sea.fetch, scene.radar.incidence) = (fetch, incidence);
                scene
            },
        )
    }

    /// Angle between two directions, 0 to 180 degrees.
    fn turn(a: f64, b: f64) -> f64 {
        let turn = (a - b.rem_euclid(360.0)).rem_euclid(360.0);
        turn.min(360.0 - turn)
    }

    /// Whether `stated` is `value` rounded to `step`: at most half a step apart, plus a few units in the last place
    /// for the arithmetic.
    fn is_rounded(stated: f64, value: f64, step: f64) -> bool {
        (stated - value).abs() <= 0.5 * step * (1.0 + 1e-12) + 1e-12 * value.abs()
    }

    fn assert_states(said: &PartialScene, scene: &Scene) {
        assert_eq!(said.ship, Some(!scene.ships.is_empty()));
        match scene.ships.first() {
            Some(ship) => {
                assert!(
                    is_rounded(said.ship_speed.unwrap(), ship.speed, 0.1),
                    "{said:?}"
                );
                assert!(
                    turn(said.ship_heading.unwrap(), ship.heading) <= 0.5,
                    "{said:?}"
                );
            }
            None => assert_eq!((said.ship_speed, said.ship_heading), (None, None)),
        }
        let wind_speed = said.wind_speed.unwrap();
        assert!(
            is_rounded(wind_speed, scene.sea.wind_speed, 0.1),
            "{said:?}"
        );
        assert_eq!(
            wind_speed > 0.0,
            said.wind_toward.is_some() && said.fetch.is_some()
        );
        if wind_speed > 0.0 {
            assert!(
                turn(said.wind_toward.unwrap(), scene.sea.wind_toward) <= 0.5,
                "{said:?}"
            );
            assert!(
                is_rounded(said.fetch.unwrap(), scene.sea.fetch, 1.0),
                "{said:?}"
            );
        }
        assert!(
            is_rounded(said.incidence.unwrap(), scene.radar.incidence, 1.0),
            "{said:?}"
        );
    }

    fn assert_round_trip(scene: &Scene) {
        for wording in Wording::ALL {
            let prompt = wording.prompt(scene).unwrap();
            assert!(prompt.is_ascii() && !prompt.contains('&'), "{prompt}");
            let tokens = Tokenizer::clip().encode(&prompt);
            assert!(
                tokens.token_count <= TOKENS,
                "{} tokens: {prompt}",
                tokens.token_count
            );
            let reading = Reading::of(&prompt).unwrap();
            assert_eq!(reading.unread, [], "{prompt}");
            let said = reading.scene;
            assert_eq!(said, PartialScene::of(scene), "{prompt}");
            assert_states(&said, scene);
            let again = said.onto(&Scene::default()).unwrap();
            assert_eq!(PartialScene::of(&again), said, "{prompt}");
        }
    }

    /// Several ships are not silently reduced to one: their number stays unread, and nothing else does.
    #[test]
    fn of_several_ships_the_number_and_the_first_are_stated() {
        for count in [2, 17, 100] {
            let mut scene = Scene::default();
            scene.ships[0].heading = 359.0;
            scene.ships[0].speed = 12.3;
            scene.sea.fetch = 123_456.0;
            scene.ships.resize(count, Ship::default());
            for wording in Wording::ALL {
                let prompt = wording.prompt(&scene).unwrap();
                let tokens = Tokenizer::clip().encode(&prompt).token_count;
                assert!(tokens <= TOKENS, "{tokens} tokens: {prompt}");
                let reading = Reading::of(&prompt).unwrap();
                assert_eq!(reading.scene, PartialScene::of(&scene), "{prompt}");
                let unread: Vec<&str> = reading.unread.iter().map(|u| u.text.as_str()).collect();
                assert_eq!(unread, [count.to_string()], "{prompt}");
                // The other ships stay unchanged.
                assert_eq!(reading.scene.onto(&scene).unwrap(), scene, "{prompt}");
            }
        }
        let two = Reading::of("two ships at 8 mps").unwrap();
        assert_eq!(two.unread[0].text, "two");
    }

    #[test]
    fn the_paper_grid_goes_round_in_every_wording() {
        let scenes: Vec<Scene> = paper_grid().collect();
        assert_eq!(scenes.len(), 3456);
        scenes.iter().for_each(assert_round_trip);
    }

    #[test]
    fn the_grid_is_stated_exactly() {
        for scene in paper_grid() {
            let ship = &scene.ships[0];
            let expected = PartialScene {
                ship: Some(true),
                ship_speed: Some(ship.speed),
                ship_heading: Some(ship.heading),
                wind_speed: Some(scene.sea.wind_speed),
                wind_toward: Some(scene.sea.wind_toward),
                fetch: Some(scene.sea.fetch),
                incidence: Some(scene.radar.incidence),
            };
            assert_eq!(PartialScene::read(&prompt(&scene).unwrap()), Ok(expected));
        }
    }

    proptest! {
        #[test]
        fn random_scenes_go_round(scene in scenes()) {
            assert_round_trip(&scene);
        }

        /// Spelling, spacing and the order of the sentences do not matter.
        #[test]
        fn the_same_words_otherwise_spelt_state_the_same(
            scene in scenes(), swap in 0..6_usize, upper in any::<bool>()
        ) {
            let prompt = prompt(&scene).unwrap();
            let mut sentences: Vec<&str> = prompt.split_inclusive(". ").collect();
            sentences.rotate_left(swap % 3);
            sentences.swap(0, swap / 3);
            let text = sentences.join(". ").replace(" mps", "m/s").replace("degrees", "deg").replace(' ', " \t ");
            let text = if upper { text.to_uppercase() } else { text };
            prop_assert_eq!(PartialScene::read(&text), Ok(PartialScene::of(&scene)), "{}", text);
        }
    }

    fn scene(assignments: &[&str]) -> Scene {
        Scene::default().with_assignments(assignments).unwrap()
    }

    #[test]
    fn the_papers_example_is_word_for_word() {
        let scene = scene(&["ship.heading=135", "sea.wind_speed=3", "sea.fetch=10000"]);
        let expected = "Simulated SAR image of wakes from a ship moving at 10 mps toward 135 degrees. Ocean \
                        waves are shaped by 3 mps wind directing toward 90 degrees and 10000 meter fetch. \
                        Captured at 32 degree incidence.";
        assert_eq!(prompt(&scene).unwrap(), expected);
        assert_eq!(Tokenizer::clip().encode(expected).token_count, 50);
    }

    /// Each documented example is the wording's prompt for the paper's example.
    #[test]
    fn the_documented_examples_are_true() {
        let scene = scene(&["ship.heading=135", "sea.wind_speed=3", "sea.fetch=10000"]);
        let source = include_str!("wording.rs").replace("///", " ");
        let words: Vec<&str> = source.split_whitespace().collect();
        let documentation = words.join(" ");
        for wording in Wording::ALL {
            let prompt = wording.prompt(&scene).unwrap();
            assert!(
                documentation.contains(&format!("```text {prompt} ```")),
                "{prompt}"
            );
        }
    }

    #[test]
    fn no_ship_and_no_wind_have_their_own_words() {
        let mut scene = scene(&["sea.wind_speed=0.04"]);
        scene.ships.clear();
        let expected = "Simulated SAR image of open sea without a ship. The ocean is flat without wind. \
                        Captured at 32 degree incidence.";
        assert_eq!(prompt(&scene).unwrap(), expected);
        assert_round_trip(&scene);
    }

    #[test]
    fn numbers_are_short_and_rounded() {
        let cases = [
            ("ship.speed=10", "at 10 mps"),
            ("ship.speed=7.25", "at 7.3 mps"),
            ("ship.speed=0.04", "at 0 mps"),
            ("sea.wind_speed=2.999", "by 3 mps"),
            ("ship.heading=359.7", "toward 0 degrees. "),
            ("ship.heading=-1e-20", "toward 0 degrees. "),
            ("ship.heading=-90", "toward 270 degrees. "),
            ("ship.heading=719.4", "toward 359 degrees. "),
            ("sea.fetch=1e7", "and 10000000 meter"),
            ("radar.incidence=31.5", "at 32 degree"),
        ];
        for (assignment, words) in cases {
            let prompt = prompt(&scene(&[assignment])).unwrap();
            assert!(prompt.contains(words), "{assignment}: {prompt}");
        }
    }

    #[test]
    fn the_longest_numbers_fit() {
        let longest = [
            "ship.speed=39.9",
            "ship.heading=359",
            "sea.wind_speed=29.9",
            "sea.fetch=1e7",
        ];
        let mut scene = scene(&longest);
        scene.sea.wind_toward = 359.0;
        let counts = Wording::ALL.map(|wording| {
            Tokenizer::clip()
                .encode(&wording.prompt(&scene).unwrap())
                .token_count
        });
        // The paper's example has 50; these numbers have nine more digits and points.
        assert_eq!(counts[0], 59);
        assert!(counts.iter().all(|&count| count <= TOKENS), "{counts:?}");
    }

    #[test]
    fn an_invalid_scene_has_no_prompt() {
        let mut scene = Scene::default();
        scene.sea.wind_speed = f64::NAN;
        let message = prompt(&scene).unwrap_err().to_string();
        assert!(message.starts_with("sea.wind_speed is NaN"), "{message}");
    }
}
