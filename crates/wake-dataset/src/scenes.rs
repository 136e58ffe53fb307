//! Scenes of a recipe as a pure function of their index.

use super::delivery::Delivery;
use super::recipe::{Draw, Recipe};
use crate::error::Result;
use crate::sea::Sea;
use crate::streams;
use std::sync::Arc;
use wake_nn::noise::NoiseSource;
use wake_physics::Scene;
use wake_physics::reference::paper_grid;
use wake_text::{PartialScene, Wording};

/// Number of scenes in the paper's grid.
pub const PAPER_SCENES: u64 = 3456;

/// Stride through the paper's grid: prime, so that every scene comes once, and near the golden section of the grid, so
/// that even the first scenes differ in every value.
const PAPER_STRIDE: u64 = 2137;

/// Endless data set of a recipe and a seed.
///
/// Pair `index` is a function of (recipe, seed, index) alone: its values come from a counter-based generator (see
/// [`wake_nn::noise`]). Drawn values are rounded like [`PartialScene::of`], so that the prompt states the scene exactly.
#[derive(Debug, Clone)]
pub struct Simulated {
    recipe: Recipe,
    seed: u64,
    sea: Option<Arc<dyn Sea>>,
}

/// Number of scenes that are checked before the first image.
const LOOKED_AT: u64 = 16;

impl Simulated {
    /// Makes the data set of a recipe and a seed.
    ///
    /// # Errors
    ///
    /// As [`Recipe::validate`].
    pub fn new(recipe: Recipe, seed: u64) -> Result<Self> {
        recipe.validate()?;
        Ok(Self {
            recipe,
            seed,
            sea: None,
        })
    }

    /// Replaces the simulator's sea by another, such as one learnt from real images. Images then include speckle, whatever the
    /// recipe's `speckle`.
    ///
    /// # Errors
    ///
    /// As [`Sea::check_spacing`], for the first 16 scenes; later scenes are refused when they are made.
    pub fn with_sea(self, sea: impl Sea) -> Result<Self> {
        for index in 0..LOOKED_AT {
            sea.check_spacing(self.scene(index)?.grid.spacing)?;
        }
        Ok(Self {
            sea: Some(Arc::new(sea)),
            ..self
        })
    }

    /// The sea that replaces the simulator's, if any.
    pub(super) fn sea(&self) -> Option<&dyn Sea> {
        self.sea.as_deref()
    }

    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Draws scene number `index`.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) or [`Error::Recipe`](crate::Error::Recipe) for values within their ranges
    /// that cannot be combined in a scene.
    pub fn scene(&self, index: u64) -> Result<Scene> {
        let (base, random) = (&self.recipe.scene, NoiseSource::new(self.seed));
        let drawn = match &self.recipe.draw {
            Draw::PaperGrid => paper_scene(index, base),
            Draw::Values(draws) => draws.scene(base, random, index)?,
        };
        drawn.validate()?;
        let mut scene = PartialScene::of(&drawn).onto(&drawn).unwrap_or(drawn);
        // 52 bits, which every JSON reader parses exactly.
        scene.seed = (random.uniform(streams::SEEDS, index) * (1u64 << 52) as f64) as u64;
        Ok(scene)
    }

    /// Gain and offset of image number `index`; `None` if it is not a quick-look.
    pub(super) fn quick_look(&self, index: u64) -> Option<[f64; 2]> {
        match &self.recipe.draw {
            Draw::PaperGrid => None,
            Draw::Values(draws) => draws.quick_look(NoiseSource::new(self.seed), index),
        }
    }

    /// Delivery of image number `index`; `None` if the image is the product itself.
    pub fn delivery(&self, index: u64) -> Option<Delivery> {
        match &self.recipe.draw {
            Draw::PaperGrid => None,
            Draw::Values(draws) => draws.delivery(NoiseSource::new(self.seed), index),
        }
    }

    /// Wording of the prompt of scene number `index`.
    pub(super) fn wording(&self, index: u64) -> Wording {
        if !self.recipe.paraphrase {
            return Wording::Paper;
        }
        let count = Wording::ALL.len();
        let draw = NoiseSource::new(self.seed).uniform(streams::WORDINGS, index);
        Wording::ALL[(draw * count as f64) as usize % count]
    }
}

/// A scene of the paper's grid, with all values that the grid does not state from `base`.
fn paper_scene(index: u64, base: &Scene) -> Scene {
    let at = (index % PAPER_SCENES) * PAPER_STRIDE % PAPER_SCENES;
    let stated = paper_grid().nth(at as usize).unwrap_or_default();
    PartialScene::of(&stated)
        .onto(base)
        .unwrap_or_else(|_| base.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;
    use wake_physics::scene::{Radar, Recovery, Ship};

    fn simulated(changes: &[String], seed: u64) -> Simulated {
        let recipe = Recipe::default().with_assignments(changes).unwrap();
        Simulated::new(recipe, seed).unwrap()
    }

    /// Strategy for a range within [min, max].
    fn range(min: f64, max: f64) -> impl Strategy<Value = [f64; 2]> {
        (min..=max, min..=max).prop_map(|(a, b)| [a.min(b), a.max(b)])
    }

    /// Random ranges of values of a scene.
    #[derive(Debug)]
    struct Ranges {
        speed: [f64; 2],
        heading: [f64; 2],
        length: [f64; 2],
        wind: [f64; 2],
        fetch: [f64; 2],
        incidence: [f64; 2],
        anywhere: bool,
    }

    prop_compose! {
        fn ranges()(
            speed in range(0.0, 40.0),
            heading in range(-400.0, 400.0),
            length in range(30.0, 500.0),
            wind in range(0.0, 30.0),
            fetch in range(100.0, 1e7),
            incidence in range(5.0, 75.0),
            anywhere in any::<bool>(),
        ) -> Ranges {
            Ranges { speed, heading, length, wind, fetch, incidence, anywhere }
        }
    }

    impl Ranges {
        fn simulated(&self, seed: u64) -> Simulated {
            let place = if self.anywhere {
                "\"anywhere\""
            } else {
                "[0, 0]"
            };
            let fetch = format!("{{ log = {:?} }}", self.fetch);
            let changes = [
                format!("draw.ship.speed = {:?}", self.speed),
                format!("draw.ship.heading = {:?}", self.heading),
                format!("draw.ship.length = {:?}", self.length),
                format!("draw.sea.wind_speed = {:?}", self.wind),
                format!("draw.sea.fetch = {fetch}"),
                format!("draw.radar.incidence = {:?}", self.incidence),
                format!("draw.ship.position = {place}"),
            ];
            let changes = if self.anywhere {
                &changes[..]
            } else {
                &changes[..6]
            };
            simulated(changes, seed)
        }
    }

    /// Whether a value lies in a range, up to rounding to a step.
    fn within(value: f64, [low, high]: [f64; 2], step: f64) -> bool {
        let slack = 0.5 * step * (1.0 + 1e-9) + 1e-9;
        (low - slack..=high + slack).contains(&value)
    }

    /// Whether a direction lies in a range, up to full turns and half a degree.
    fn turned_within(value: f64, range: [f64; 2]) -> bool {
        (-3..=3).any(|turn| within(value + 360.0 * f64::from(turn), range, 1.0))
    }

    proptest! {
        #[test]
        fn drawn_values_lie_in_their_ranges(ranges in ranges(), seed in any::<u64>(), index in any::<u64>()) {
            let scene = ranges.simulated(seed).scene(index).unwrap();
            prop_assert!(scene.validate().is_ok());
            prop_assert!(within(scene.sea.wind_speed, ranges.wind, 0.1));
            prop_assert!(within(scene.sea.fetch, ranges.fetch, 1.0));
            prop_assert!(within(scene.radar.incidence, ranges.incidence, 1.0));
            for ship in &scene.ships {
                prop_assert!(within(ship.speed, ranges.speed, 0.1));
                prop_assert!(turned_within(ship.heading, ranges.heading));
                prop_assert!(within(ship.length, ranges.length, 0.1));
                prop_assert!((ship.beam / ship.length - 26.0 / 195.0).abs() < 0.5e-4 / 30.0 + 1e-12);
                // 256 pixels of 4 m around pixel 128.
                for coordinate in [ship.position[0], -ship.position[1]] {
                    prop_assert!(within(coordinate, [-512.0, 508.0], 0.1));
                }
            }
        }

        /// A scene depends only on recipe, seed and index; every wording states all drawn values.
        #[test]
        fn scenes_repeat_and_are_fully_stated(ranges in ranges(), seed in any::<u64>(), index in any::<u64>()) {
            let source = ranges.simulated(seed);
            let scene = source.scene(index).unwrap();
            let _others: Vec<_> = (0..3).map(|i| source.scene(i)).collect();
            prop_assert_eq!(&ranges.simulated(seed).scene(index).unwrap(), &scene);
            // JSON preserves every bit.
            let line = serde_json::to_string(&scene).unwrap();
            prop_assert_eq!(&serde_json::from_str::<Scene>(&line).unwrap(), &scene);
            for wording in Wording::ALL {
                let said = PartialScene::read(&wording.prompt(&scene).unwrap()).unwrap();
                prop_assert_eq!(&said.onto(&scene).unwrap(), &scene);
            }
        }
    }

    #[test]
    fn draws_are_independent_and_even() {
        let source = simulated(&[], 3);
        let n = 4000;
        let scenes: Vec<Scene> = (0..n).map(|i| source.scene(i).unwrap()).collect();
        let ships: Vec<_> = scenes.iter().flat_map(|s| s.ships.clone()).collect();
        // Five standard deviations of a binomial count.
        let empty = (n as usize - ships.len()) as f64;
        assert!((empty - 0.2 * n as f64).abs() < 5.0 * (0.16 * n as f64).sqrt());
        let share = |values: &[f64], [low, high]: [f64; 2]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (mean - low) / (high - low)
        };
        // Five standard errors of the mean of n uniform numbers, √(1/12 n).
        let even = |values: Vec<f64>, range| {
            let allowed = 5.0 / (12.0 * values.len() as f64).sqrt();
            assert!((share(&values, range) - 0.5).abs() < allowed, "{range:?}");
        };
        even(ships.iter().map(|s| s.speed).collect(), [6.0, 12.0]);
        even(
            ships.iter().map(|s| s.position[0]).collect(),
            [-512.0, 508.0],
        );
        even(
            ships.iter().map(|s| s.position[1]).collect(),
            [-508.0, 512.0],
        );
        even(
            scenes.iter().map(|s| s.sea.wind_speed).collect(),
            [3.0, 7.0],
        );
        even(
            scenes.iter().map(|s| s.radar.incidence).collect(),
            [16.0, 32.0],
        );
        let fetch = scenes.iter().map(|s| s.sea.fetch.ln()).collect();
        even(fetch, [10e3_f64.ln(), 70e3_f64.ln()]);
        // Uncorrelated: the mean of a product of two centred uniform numbers is within 5 of its √(1/144 n).
        let products = ships
            .iter()
            .map(|s| (s.speed - 9.0) / 6.0 * (s.heading / 360.0 - 0.5));
        let mean = products.sum::<f64>() / ships.len() as f64;
        assert!(mean.abs() < 5.0 / (144.0 * ships.len() as f64).sqrt());
        let seeds: BTreeSet<u64> = scenes.iter().map(|s| s.seed).collect();
        assert_eq!(seeds.len(), n as usize);
        assert!(seeds.iter().all(|&seed| seed < 1 << 53));
    }

    #[test]
    fn other_seeds_make_other_scenes() {
        let [one, two] = [1, 2].map(|seed| simulated(&[], seed));
        assert!((0..50).all(|i| one.scene(i).unwrap() != two.scene(i).unwrap()));
    }

    /// Adding a key, or changing its distribution, changes only its own value.
    #[test]
    fn keys_are_drawn_apart() {
        let changes = ["draw.ship.speed = [1, 2]", "draw.radar.looks = [1, 9]"];
        let other = simulated(&changes.map(str::to_owned), 3);
        for index in 0..40 {
            let (one, mut scene) = (
                simulated(&[], 3).scene(index).unwrap(),
                other.scene(index).unwrap(),
            );
            for (ship, own) in scene.ships.iter_mut().zip(&one.ships) {
                assert!(ship.speed <= 2.0);
                ship.speed = own.speed;
            }
            scene.radar.looks = one.radar.looks;
            assert_eq!(scene, one);
        }
    }

    /// Sensors come in proportion to their weights, each with the other values of its table; the radar is the same as in a scene
    /// file that names the sensor.
    #[test]
    fn values_that_belong_together_come_together() {
        let text = r#"
            [draw]
            together = [
                { weight = 3, "radar.sensor" = "sentinel-1-iw", "radar.incidence" = [33, 33] },
                { "radar.sensor" = "ers-2-pri", "grid.spacing" = 25, "radar.incidence" = 23 },
            ]
        "#;
        let source = Simulated::new(Recipe::from_toml(text).unwrap(), 4).unwrap();
        let scenes: Vec<Scene> = (0..400).map(|i| source.scene(i).unwrap()).collect();
        let written = |text: &str| Scene::from_toml(text).unwrap();
        let [sentinel, ers] = [
            written("[radar]\nsensor = \"sentinel-1-iw\"\nincidence = 33"),
            written("[grid]\nspacing = 25\n[radar]\nsensor = \"ers-2-pri\"\nincidence = 23"),
        ];
        let count = scenes.iter().filter(|s| s.radar == sentinel.radar).count();
        for scene in &scenes {
            let expected = if scene.radar == sentinel.radar {
                &sentinel
            } else {
                &ers
            };
            assert_eq!(scene.radar, expected.radar);
            assert_eq!(
                scene.grid.spacing.to_bits(),
                expected.grid.spacing.to_bits()
            );
        }
        // Five standard deviations of a binomial count of 400 at 3/4.
        assert!(count.abs_diff(300) < 44, "{count}");
    }

    /// Every scene of the grid comes once, with all other values at their defaults; the next round differs only in its seas.
    #[test]
    fn the_papers_grid_is_complete_and_mixed() {
        let source = Simulated::new(Recipe::paper(), 5).unwrap();
        let text = |scene: &Scene| {
            Scene {
                seed: 7,
                ..scene.clone()
            }
            .to_toml()
            .unwrap()
        };
        let walked: Vec<Scene> = (0..PAPER_SCENES)
            .map(|i| source.scene(i).unwrap())
            .collect();
        let all: BTreeSet<String> = walked.iter().map(text).collect();
        assert_eq!(all, paper_grid().map(|s| text(&s)).collect());
        let again = source.scene(PAPER_SCENES + 17).unwrap();
        assert_eq!(text(&again), text(&walked[17]));
        assert_ne!(again.seed, walked[17].seed);
        // The first 24 already have every speed, heading, wind, direction, fetch and incidence.
        let distinct = |value: fn(&Scene) -> f64| {
            let values: BTreeSet<u64> = walked[..24].iter().map(|s| value(s).to_bits()).collect();
            values.len()
        };
        let counts = [
            distinct(|s| s.ships[0].speed),
            distinct(|s| s.ships[0].heading),
            distinct(|s| s.sea.wind_speed),
            distinct(|s| s.sea.wind_toward),
            distinct(|s| s.sea.fetch),
            distinct(|s| s.radar.incidence),
        ];
        assert_eq!(counts, [4, 8, 3, 4, 3, 3]);
    }

    #[test]
    fn paraphrases_take_every_wording() {
        let source = simulated(&["paraphrase = true".to_owned()], 1);
        let count = |wording| (0..400).filter(|&i| source.wording(i) == wording).count();
        // Five standard deviations of a binomial count of 400 at 1/4.
        assert!(Wording::ALL.iter().all(|&w| count(w).abs_diff(100) < 44));
    }

    #[test]
    fn a_recipe_file_changes_what_it_names() {
        let text = "speckle = true\n[scene.grid]\nrows = 96\n[draw.ship]\nspeed = [8, 9]\nposition = \"anywhere\"";
        let recipe = Recipe::from_toml(text).unwrap();
        let same = Recipe::from_toml("[draw]\n\"ship.speed\" = [8.0, 9.0]").unwrap();
        assert_eq!(recipe.draw, same.draw);
        assert_ne!(recipe.draw, Recipe::default().draw);
        assert!(recipe.speckle);
        let grid = &recipe.scene.grid;
        assert_eq!((grid.rows, grid.columns), (96, 256));
        assert_eq!(Recipe::from_toml("").unwrap(), Recipe::default());
        let paper = Recipe::from_toml("draw = \"paper-grid\"").unwrap();
        assert_eq!(paper.draw, Draw::PaperGrid);
        assert_eq!(
            Recipe::from_toml("base = \"paper\"").unwrap(),
            Recipe::paper()
        );
        for recipe in [recipe, paper, Recipe::detector().unwrap()] {
            let json = serde_json::to_string(&recipe).unwrap();
            assert_eq!(serde_json::from_str::<Recipe>(&json).unwrap(), recipe);
        }
    }

    /// Echo and roll, and edges and their response time, are drawn independently, but a ship without an echo has no roll, and one
    /// without edges no response time, as a scene requires.
    #[test]
    fn a_ship_has_only_the_keys_that_act() {
        let changes = [
            "draw.count = 1",
            "draw.ship.roll = [0.1, 0.4]",
            "draw.ship.edge_time = [100, 200]",
            "draw.ship.echo = { one_of = [true, false] }",
            "draw.ship.edge = { one_of = [false, true] }",
        ];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        let source = Simulated::new(recipe, 1).unwrap();
        let mut seen = BTreeSet::new();
        for index in 0..40 {
            let ship = &source.scene(index).unwrap().ships[0];
            assert_eq!(
                (ship.roll > 0.0, ship.edge_time.is_some()),
                (ship.echo, ship.edge)
            );
            seen.insert((ship.echo, ship.edge));
        }
        assert_eq!(seen.len(), 4);
    }

    /// Both names of a key draw the same scenes, and manifests contain the first name.
    #[test]
    fn keys_of_two_names_draw_the_same_scenes() {
        let [first, new] = [
            [
                "draw.radar.noise_floor=[-28, -16]",
                "scene.radar.resolution=7",
                "draw.together=[{ \"radar.resolution\" = [4, 8] }]",
            ],
            [
                "draw.radar.nesz=[-28, -16]",
                "scene.radar.azimuth_resolution=7",
                "draw.together=[{ \"radar.azimuth_resolution\" = [4, 8] }]",
            ],
        ]
        .map(|changes| Recipe::default().with_assignments(&changes).unwrap());
        assert_eq!(first, new);
        let text = serde_json::to_string(&new).unwrap();
        for key in [
            "\"radar.noise_floor\"",
            "\"radar.resolution\"",
            "\"resolution\":7",
        ] {
            assert!(text.contains(key), "{key}: {text}");
        }
        assert!(!text.contains("nesz") && !text.contains("azimuth_resolution"));
        let scene = Simulated::new(new, 3).unwrap().scene(0).unwrap();
        assert!((4.0..=8.0).contains(&scene.radar.azimuth_resolution));
        assert!((-28.0..=-16.0).contains(&scene.radar.nesz.unwrap()));
    }

    #[test]
    fn assignments_take_toml_values_and_bare_words() {
        let changes = [
            "speckle=true",
            "draw.sea.fetch=[1e4, 2e4]",
            "scene.ship.hull=full",
            "draw.ship.echo = { one_of = [true, false] }",
        ];
        let recipe = Recipe::default().with_assignments(&changes).unwrap();
        assert!(recipe.speckle);
        let source = Simulated::new(recipe, 1).unwrap();
        let fetches = (0..50).map(|i| source.scene(i).unwrap().sea.fetch);
        assert!(
            fetches
                .into_iter()
                .all(|fetch| (1e4..=2e4).contains(&fetch))
        );
        assert_eq!(
            Recipe::default()
                .with_assignments(&["draw=paper-grid"])
                .unwrap()
                .draw,
            Draw::PaperGrid
        );
        for bad in [
            "speckle",
            "=3",
            "speckle=maybe",
            "scene.sea",
            "draw=fast",
            "base=paper",
        ] {
            assert!(Recipe::default().with_assignments(&[bad]).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_name_that_is_neither_recipe_nor_file_is_refused_with_both() {
        let message = Recipe::named_or_read("papers").unwrap_err().to_string();
        assert!(
            message.contains("recipe is papers")
                && message.contains("detector, model or an existing TOML file"),
            "{message}"
        );
    }

    #[test]
    fn bad_recipes_are_refused_by_name() {
        for (text, word) in [
            ("speckles = true", "speckles"),
            ("draw = \"papers\"", "papers"),
            (
                "base = \"papers\"",
                "paper, ranges, satellites, detector or model",
            ),
            ("base = 3", "paper, ranges, satellites, detector or model"),
            ("[draw.ship]\nsped = [1, 2]", "sped"),
            ("[draw]\nseed = [1, 2]", "its own seed"),
            ("[draw.grid]\nrows = [16, 32]", "the same size"),
            ("[draw.ship]\nspeed = [9, 8]", "draw.ship.speed is [9, 8]"),
            ("[draw.ship]\nspeed = [1, nan]", "draw.ship.speed"),
            (
                "[draw.ship]\nspeed = [1, 41]",
                "ship.speed is 41, outside 0 to 40",
            ),
            ("[draw.ship]\nlength = [0.5, 20]", "ship.length is 0.5"),
            ("[draw.ship]\nposition = \"left\"", "left"),
            ("[draw.sea]\nfetch = { log = [1, 1e4] }", "sea.fetch"),
            (
                "[draw.sea]\nfetch = { log = [0, 1] }",
                "two positive numbers",
            ),
            ("[draw.radar]\nlooks = [0, 4]", "radar.looks"),
            ("[draw.radar]\nsensor = \"sputnik\"", "sputnik"),
            (
                "[draw.radar]\nwindow = \"uniform\"",
                "radar.range_resolution",
            ),
            ("[draw]\ncount = [0, 1.5]", "whole numbers from 0 to 100"),
            ("[draw]\ncount = -1", "whole numbers from 0 to 100"),
            (
                "[draw]\ncount = 150",
                "draw.count is 150, expected whole numbers from 0 to 100",
            ),
            (
                "[draw]\n\"quick_look.gain\" = [0, 1]",
                "draw.quick_look.gain",
            ),
            ("[draw]\ntogether = [{ weight = 0 }]", "weight"),
            (
                "[draw]\ntogether = [{ \"sea.depth\" = 0.5 }]",
                "sea.depth is 0.5",
            ),
            ("[scene.ship]\nposition = [1, 2, 3]", "3 numbers"),
            ("[scene.sea]\nwind = 3", "wind"),
            ("[scene.grid]\nrows = 0", "grid.rows"),
            ("speckle = [", "line 1"),
        ] {
            let message = Recipe::from_toml(text).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
            assert_eq!(message.lines().count(), 1, "{message}");
        }
        let message = Recipe::read(std::path::Path::new("no/such.toml")).unwrap_err();
        assert!(message.to_string().contains("no/such.toml"), "{message}");
    }

    /// Half of the scenes of `model` have the values of `ranges`, the other half the values of `satellites`.
    #[test]
    fn the_recipe_of_the_model_has_the_scenes_of_both() {
        let source = Simulated::new(Recipe::model().unwrap(), 3).unwrap();
        assert!(!source.recipe().speckle && source.quick_look(0).is_none());
        let scenes: Vec<Scene> = (0..400).map(|n| source.scene(n).unwrap()).collect();
        let (narrow, wide): (Vec<_>, Vec<_>) = scenes
            .into_iter()
            .partition(|scene| scene.radar.sensor.is_none());
        // Four standard errors of 0.025 for 400 draws.
        assert!((narrow.len() as f64 / 400.0 - 0.5).abs() < 0.1);
        let ranges = Recipe::default().scene;
        for scene in narrow {
            let told = (&scene.grid, &scene.radar.polarization, &scene.model);
            assert_eq!(
                told,
                (&ranges.grid, &ranges.radar.polarization, &ranges.model)
            );
            assert!(!scene.sea.breaking && scene.sea.gust_strength == 0.0 && scene.ships.len() < 2);
            assert!((3.0..=7.0).contains(&scene.sea.wind_speed));
            assert_eq!(scene.radar.nesz, None);
        }
        let satellites = Recipe::satellites().unwrap().scene;
        let mut sensors = BTreeSet::new();
        for scene in wide {
            assert_eq!((scene.grid.rows, scene.grid.oversampling), (256, Some(2)));
            assert_eq!(scene.model, satellites.model);
            assert!(scene.sea.breaking && scene.ships.iter().all(|ship| ship.echo && ship.edge));
            assert!(scene.radar.nesz.is_some());
            sensors.insert(format!("{:?}", scene.radar.sensor));
        }
        assert_eq!(sensors.len(), 7);
    }

    #[test]
    fn the_recipe_of_satellites_covers_what_they_deliver() {
        let source = Simulated::new(Recipe::satellites().unwrap(), 9).unwrap();
        assert!((0..300).all(|i| source.delivery(i).is_none()));
        let scenes: Vec<Scene> = (0..300).map(|i| source.scene(i).unwrap()).collect();
        let sensors: BTreeSet<String> = scenes
            .iter()
            .map(|s| format!("{:?}", s.radar.sensor))
            .collect();
        assert_eq!(sensors.len(), 7, "{sensors:?}");
        let some = |is: &dyn Fn(&Scene) -> bool| scenes.iter().filter(|s| is(s)).count();
        assert!(
            scenes
                .iter()
                .all(|s| (5.0..=25.0).contains(&s.grid.spacing))
        );
        assert!(scenes.iter().all(|s| s.radar.nesz.is_some()));
        for count in [
            some(&|s| s.ships.is_empty() && s.sea.slick_damping > 0.0),
            some(&|s| s.ships.is_empty() && s.sea.swell_height > 0.0),
            some(&|s| s.sea.depth < 100.0),
            some(&|s| s.sea.gust_strength > 0.1),
            some(&|s| s.ships.iter().any(|ship| ship.length < 60.0)),
            some(&|s| s.ships.len() > 2),
            some(&|s| s.ships.iter().any(|ship| ship.length > 200.0)),
        ] {
            assert!(count > 3, "{count}");
        }
    }

    /// The recipe `detector` has the scenes of `satellites`, except for the values that it changes, such as the spacing.
    #[test]
    fn the_recipe_of_a_detector_delivers_the_satellites() {
        let source = Simulated::new(Recipe::detector().unwrap(), 9).unwrap();
        let plain = Simulated::new(Recipe::satellites().unwrap(), 9).unwrap();
        let count = 400;
        let (mut fine, mut turning, mut hardly_dark, mut mottled) = (0, 0, 0, 0);
        for index in 0..count {
            let (scene, other) = (source.scene(index).unwrap(), plain.scene(index).unwrap());
            let radar = Radar {
                paired_echoes: None,
                ..scene.radar.clone()
            };
            assert_eq!(radar, other.radar);
            assert_eq!(scene.ships.len(), other.ships.len());
            let gain = source.quick_look(index).unwrap()[0];
            assert!((0.15..=0.4).contains(&gain));
            let cell = |scene: &Scene| {
                let range = scene.radar.range_resolution.unwrap();
                (range * scene.radar.azimuth_resolution).sqrt() / scene.grid.spacing
            };
            if scene.grid.spacing.to_bits() != other.grid.spacing.to_bits() {
                fine += 1;
                // The spacing is rounded to 1 cm, and is at least 1.5 m.
                assert!((0.99..=3.83).contains(&cell(&scene)), "{}", cell(&scene));
            }
            let ships = || scene.ships.iter();
            assert!(
                ships().all(|ship| ship.recovery == Recovery::Wind && ship.steepness.is_some())
            );
            let points = |ship: &Ship| ship.scatterers.is_some_and(|n| (200..=600).contains(&n));
            assert!(ships().all(|ship| points(ship) && ship.halo.is_some()));
            assert!(scene.radar.paired_echoes.is_some());
            turning += usize::from(ships().any(|ship| ship.turn_rate != 0.0));
            hardly_dark += usize::from(ships().any(|ship| ship.damping < 0.21));
            mottled += usize::from(scene.sea.mottle_strength > 0.0);
        }
        // Five standard deviations of a binomial count.
        let share = |found: usize, share: f64| {
            let error = (share * (1.0 - share) / count as f64).sqrt();
            assert!(
                (found as f64 / count as f64 - share).abs() < 5.0 * error,
                "{found}"
            );
        };
        share(fine, 0.75);
        share(mottled, 0.5);
        // Out of the eight in ten images with ships, some with several.
        assert!(turning > count as usize / 8 && hardly_dark > count as usize / 8);
        let deliveries: Vec<_> = (0..count).map(|index| source.delivery(index)).collect();
        let some = deliveries.iter().flatten();
        // A sixteenth is neither resized nor compressed.
        share(some.clone().count(), 15.0 / 16.0);
        share(some.clone().filter(|d| d.quality.is_some()).count(), 0.75);
        for delivery in some {
            assert!((0.8..=1.6).contains(&delivery.resize));
            assert!(delivery.quality.is_none_or(|q| (80..=95).contains(&q)));
            assert!(delivery.phase.iter().all(|&phase| phase < 8));
        }
    }

    #[test]
    fn pixels_of_a_cell_need_a_resolution() {
        let refused = |text: &str| Recipe::from_toml(text).unwrap_err().to_string();
        let message = refused("[draw]\n\"delivery.pixels\" = [1, 3]");
        assert!(message.contains("radar.range_resolution"), "{message}");
        for (key, value) in [
            ("pixels", "17"),
            ("resize", "0.2"),
            ("quality", "101"),
            ("quality", "0.5"),
        ] {
            let message = refused(&format!("[draw]\n\"delivery.{key}\" = {value}"));
            assert!(
                message.contains(&format!("draw.delivery.{key}")),
                "{message}"
            );
        }
    }
}
