//! Numbers keep every bit through the files of a set.

use super::super::annotations::Objects;
use super::super::metadata::{Row, line, parse};
use super::*;
use proptest::prelude::*;
use wake_physics::Scene;
use wake_physics::labels::Labels;

/// Any finite number.
fn finite() -> impl Strategy<Value = f64> {
    let numbers = any::<u64>().prop_map(f64::from_bits);
    numbers.prop_filter("finite", |number| number.is_finite())
}

/// Draws of every form with given numbers; ranges need the lower number first, logarithms and weights positive numbers.
fn draws(numbers: [f64; 6]) -> Draws {
    let [a, b, c, d, e, f] = numbers.map(toml::Value::from);
    let list = |a: &toml::Value, b: &toml::Value| toml::Value::from(vec![a.clone(), b.clone()]);
    let (low, high) = (numbers[1].min(numbers[2]), numbers[1].max(numbers[2]));
    let weight = toml::Value::from(numbers[3].abs().max(f64::MIN_POSITIVE));
    let mut log = toml::Table::new();
    log.insert("log".to_owned(), list(&weight, &f64::MAX.into()));
    let mut choice = toml::Table::new();
    choice.insert("one_of".to_owned(), list(&c, &e));
    choice.insert("weights".to_owned(), list(&weight, &1.0.into()));
    let mut case = toml::Table::new();
    case.insert("weight".to_owned(), weight);
    case.insert("grid.spacing".to_owned(), f);
    let values = [
        ("sea.depth", a),
        ("ship.speed", list(&low.into(), &high.into())),
        ("sea.fetch", log.into()),
        ("radar.looks", choice.into()),
        ("ship.roll", list(&b, &b)),
        ("sea.salinity", d),
        ("together", vec![toml::Value::from(case)].into()),
    ];
    let values = values.map(|(key, value)| (key.to_owned(), value));
    Draws::default()
        .with(&values.into_iter().collect())
        .unwrap()
}

fn manifest_of(numbers: [f64; 12]) -> Manifest {
    let mut manifest = manifest();
    let [a, b, c, d, e, f, rest @ ..] = numbers;
    let recipe = &mut manifest.recipe;
    recipe.draw = Draw::Values(draws(rest));
    (recipe.grey.darkest_db, recipe.grey.brightest_db) = (a, b);
    recipe.scene = scene_of([c, d, e]);
    (manifest.grey, manifest.val_share) = (manifest.recipe.grey, f);
    manifest
}

fn scene_of([a, b, c]: [f64; 3]) -> Scene {
    let mut scene = Scene::default();
    (scene.sea.wind_speed, scene.radar.nesz) = (a, Some(b));
    scene.ships[0].position = [b, c];
    scene
}

proptest! {
    /// Equal texts imply equal bits: each number has one shortest text, and −0 keeps its sign.
    #[test]
    fn manifests_and_recipes(numbers in prop::array::uniform12(finite())) {
        let manifest = manifest_of(numbers);
        let folder = TempDir::new().unwrap();
        let text = manifest.text().unwrap();
        fs::write(folder.path().join("dataset.json"), &text).unwrap();
        let read = Manifest::read(folder.path()).unwrap().unwrap();
        prop_assert_eq!(&read.text().unwrap(), &text);
        let recipe = toml::to_string(&manifest.recipe).unwrap();
        let recipe = toml::from_str(&recipe).unwrap();
        prop_assert_eq!(Manifest { recipe, ..manifest }.text().unwrap(), text);
    }

    #[test]
    fn lines(scene in prop::array::uniform3(finite()), ends in prop::array::uniform2(finite()), boxes in prop::array::uniform4(finite())) {
        let pair = Pair {
            index: 0,
            image: Grey::of_levels(&[], 0, 0),
            prompt: "a \"ship\", {1}".to_owned(),
            scene: scene_of(scene),
            labels: Labels::default(),
            amplitudes: Some(ends),
        };
        let mut row = Row::of(&pair, "00000000".to_owned());
        row.objects = Objects { bbox: vec![boxes], ..Objects::default() };
        let text = line(&row).unwrap();
        let rows = parse(Path::new("metadata.jsonl"), text.as_bytes(), &manifest()).unwrap();
        prop_assert_eq!(line(&rows[0].1).unwrap(), text);
        let bits = rows[0].1.amplitudes.unwrap().map(f64::to_bits);
        prop_assert_eq!(bits, ends.map(f64::to_bits));
    }
}
