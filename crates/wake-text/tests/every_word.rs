//! Every word of a prompt is used, filler, or named as unread: words put into prompts of known values, at every place.

use proptest::prelude::*;
use wake_physics::{Scene, scene::Ship};
use wake_text::{PartialScene, Reading, Wording};

/// Prompts whose words are all read.
const PROMPTS: [&str; 16] = [
    "a ship at 8 m/s toward 135 degrees, wind 5 m/s toward 90 degrees",
    "Ship speed: 10 mps. Heading: 135 deg. Wind speed: 3 mps. Wind direction = 90 deg. Fetch: 10 km. Incidence angle: 32 deg",
    "a ship at 18 km/h heading north-east in a light westerly wind of 4 m/s",
    "10 km fetch under a wind from 30 degrees at 7,5 m/s",
    "The wind blows at 12 knots out of the south-west, fetch 20 nautical miles",
    "A vessel at ten knots sails to the west, wind from about 270 degrees",
    "no ship, wind 5 m/s, incidence of 25 degrees",
    "an open sea without any ships at 40 degree incidence",
    "a stationary ship in 5 m/s wind",
    "no wind, a ship at 10 m/s toward minus 45 degrees",
    "a southbound freighter at 12 kts, NW wind 5 m/s",
    "ship at 10m/s,45deg",
    "a windless night, the ship is not moving",
    "ships: none; wind of 6 m/s",
    "At 10 mps and toward 135 degrees a ship sails",
    "fetch 10 000 m, wind 8 1/2 knots",
];

/// Words of every kind that say something, but nothing that a scene can have.
const WORDS: [&str; 71] = [
    "abeam",
    "above",
    "across",
    "against",
    "into",
    "accelerating",
    "volte-face",
    "aft",
    "apparent",
    "backing",
    "barely",
    "below",
    "beyond",
    "both",
    "bow",
    "cargo",
    "contrary",
    "cubed",
    "decelerating",
    "double",
    "doubled",
    "drifting",
    "each",
    "either",
    "entire",
    "except",
    "faster",
    "few",
    "foggy",
    "former",
    "half",
    "hardly",
    "harbour",
    "hundredfold",
    "inverse",
    "knotty",
    "latter",
    "least",
    "less",
    "magnetic",
    "many",
    "max",
    "nearby",
    "opposite",
    "perhaps",
    "perpendicular",
    "polar",
    "port",
    "quarter",
    "quasi",
    "reciprocal",
    "red",
    "relative",
    "reverse",
    "seldom",
    "several",
    "short",
    "slower",
    "squared",
    "starboard",
    "thrice",
    "times",
    "towing",
    "triple",
    "twice",
    "unless",
    "unlike",
    "veering",
    "visibly",
    "zigzagging",
    "嵐",
];

/// Places of a prompt between its words.
fn gaps(prompt: &str) -> Vec<usize> {
    let spaces = prompt.match_indices(' ').map(|(at, _)| at);
    std::iter::once(0)
        .chain(spaces)
        .chain([prompt.len()])
        .collect()
}

/// A prompt with a word in a gap, and where the word begins.
fn with_word(prompt: &str, gap: usize, word: &str) -> (String, usize) {
    let (before, after) = prompt.split_at(gap);
    match gap {
        0 => (format!("{word} {after}"), 0),
        _ => (format!("{before} {word}{after}"), gap + 1),
    }
}

fn values(scene: &PartialScene) -> [Option<f64>; 7] {
    let ship = scene.ship.map(|ship| f64::from(u8::from(ship)));
    let PartialScene {
        ship_speed,
        ship_heading,
        wind_speed,
        wind_toward,
        fetch,
        incidence,
        ..
    } = *scene;
    [
        ship,
        ship_speed,
        ship_heading,
        wind_speed,
        wind_toward,
        fetch,
        incidence,
    ]
}

/// Why a word in a prompt passes in silence, if it does.
fn silence(prompt: &str, gap: usize, word: &str) -> Option<String> {
    let plain = Reading::of(prompt).ok()?;
    let (with, at) = with_word(prompt, gap, word);
    // An error is no silence.
    let reading = Reading::of(&with).ok()?;
    // The word's letters, its hyphens are spaces.
    let named = |at: usize| {
        reading
            .unread
            .iter()
            .any(|unread| unread.place.contains(&at))
    };
    if !named(at) || !named(at + word.len() - 1) {
        return Some(format!("{with}: {word} is not named in {reading:?}"));
    }
    // What is still stated is what was stated.
    let changed = values(&plain.scene).into_iter().zip(values(&reading.scene));
    let changed = changed
        .into_iter()
        .any(|(before, after)| after.is_some() && after != before);
    changed.then(|| format!("{with}: {reading:?} from {:?}", plain.scene))
}

fn assert_named(prompt: &str, words: &[&str]) {
    let tries = gaps(prompt)
        .into_iter()
        .flat_map(|gap| words.iter().map(move |word| (gap, word)));
    let silent: Vec<String> = tries
        .filter_map(|(gap, word)| silence(prompt, gap, word))
        .collect();
    assert!(
        silent.is_empty(),
        "{} silent:\n{}",
        silent.len(),
        silent.join("\n")
    );
}

#[test]
fn the_prompts_are_read_whole() {
    for prompt in PROMPTS {
        let reading = Reading::of(prompt).unwrap();
        assert_eq!(reading.unread, [], "{prompt}");
    }
}

#[test]
fn a_word_at_any_place_is_named_and_states_no_other_value() {
    for prompt in PROMPTS {
        assert_named(prompt, &WORDS);
    }
}

#[test]
fn a_word_in_the_wordings_of_a_scene_is_named() {
    let open = Scene {
        ships: Vec::new(),
        ..Scene::default()
    };
    let mut calm = open.clone();
    calm.sea.wind_speed = 0.0;
    calm.ships.push(Ship::default());
    for scene in [Scene::default(), open, calm] {
        for wording in Wording::ALL {
            assert_named(&wording.prompt(&scene).unwrap(), &WORDS);
        }
    }
}

/// A word that changes a number takes its value with it; nothing is computed.
#[test]
fn a_changed_number_is_unread() {
    let before = [
        "twice",
        "half of",
        "a third of",
        "at most",
        "no more than",
        ">=",
        "<",
        "!=",
        "up to",
        "under",
        "double the",
        "minus",
        "the reciprocal of",
        "opposite to",
        "blorp",
        "blorp of",
        "blorp:",
        "2 times",
        "50% of",
        "as much as",
        "%",
    ];
    let after = [
        "or more",
        "at most",
        "to port",
        "off the bow",
        "to the left",
        "per cent",
        "%",
        "²",
        "squared",
        "max",
    ];
    for (start, number, end) in [
        ("a ship at ", "10 m/s", ""),
        ("a ship toward ", "45 degrees", ", wind 3 m/s"),
        ("wind of ", "5 m/s", ", fetch 20 km"),
        ("wind, ship 5 m/s, fetch of ", "20 km", ""),
        ("incidence: ", "32 degrees", ""),
    ] {
        let changed = before
            .iter()
            .map(|word| format!("{start}{word} {number}{end}"));
        let turned = after.iter().filter(|word| {
            number.ends_with("degrees")
                || !matches!(**word, "to port" | "off the bow" | "to the left")
        });
        let changed = changed.chain(turned.map(|word| match word {
            &"%" | &"²" => format!("{start}{number}{word}{end}"),
            word => format!("{start}{number} {word}{end}"),
        }));
        for prompt in changed.filter(|prompt| {
            !prompt.contains("minus 45")
                && !prompt.contains("minus 5")
                && !prompt.contains("minus 1")
        }) {
            let Ok(reading) = Reading::of(&prompt) else {
                assert!(prompt.contains("minus"), "{prompt}");
                continue;
            };
            let at = prompt.find(number).unwrap();
            assert!(
                reading
                    .unread
                    .iter()
                    .any(|unread| unread.place.contains(&at) && unread.text.len() > number.len()),
                "{prompt}: {reading:?}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Words of no language, at one or two places.
    #[test]
    fn an_unknown_word_is_named(
        prompt in prop::sample::select(PROMPTS.to_vec()),
        words in ["[b-df-hj-np-tv-z]{4,8}", "[b-df-hj-np-tv-z]{4,8}"], places in [any::<prop::sample::Index>(), any::<prop::sample::Index>()],
    ) {
        let gap = places[0].get(&gaps(prompt)).to_owned();
        prop_assert_eq!(silence(prompt, gap, &words[0]), None);
        let (twice, _) = with_word(prompt, gap, &words[0]);
        let gap = places[1].get(&gaps(&twice)).to_owned();
        prop_assert_eq!(silence(&twice, gap, &words[1]), None);
    }
}
