//! `wake simulate --product` and `wake detect PRODUCT`: from a map to a product, and back to a map.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{done, files, refused_by, refused_into, run, text};

const TEMPLATE: &str = "crates/wake-geo/tests/fixtures/S1A_IW_GRDH_1SDV_20210119T031653_20210119T031718_036201_043ED0_8255.zip";
const PART: [&str; 4] = ["--lines", "5000..5400", "--pixels", "14000..14500"];

/// A ship in the middle of the part.
fn ships(folder: &Path) -> PathBuf {
    let place = run("locate", &[TEMPLATE, "5200,14250", "--json"]).stdout;
    let place: Value = serde_json::from_slice(&place).expect("a place");
    let path = folder.join("ships.geojson");
    let text = format!(
        r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature", "geometry": {{"type": "Point",
        "coordinates": [{}, {}]}}, "properties": {{"heading": 120, "speed": 8, "length": 200}}}}]}}"#,
        place["longitude"], place["latitude"]
    );
    std::fs::write(&path, text).expect("a file");
    path
}

fn safe(folder: &Path) -> PathBuf {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths = entries.map(|entry| entry.expect("an entry").path());
    let is_safe = |path: &PathBuf| path.extension().is_some_and(|e| e == "SAFE");
    paths.find(is_safe).expect("a product")
}

#[test]
fn a_ship_on_the_map_is_found_on_the_map() {
    let folder = tempfile::tempdir().expect("a folder");
    let ships = ships(folder.path());
    let out = folder.path().join("product");
    let common = [
        "--product",
        TEMPLATE,
        "--ships",
        text(&ships),
        "--wind-speed",
        "4.5",
        "--json",
    ];
    let arguments = [&common[..], &PART].concat();
    let told: Value = serde_json::from_str(&done("simulate", &arguments, &out)).expect("JSON");
    assert_eq!(
        (&told["ships_inside"], &told["ships_given"]),
        (&1.into(), &1.into())
    );
    // The same seed makes the same product, and another folder is not written over.
    let again = folder.path().join("again");
    done("simulate", &arguments, &again);
    let all = |root: &Path| -> Vec<Option<Vec<u8>>> { files(root).into_values().collect() };
    assert!(all(&out) == all(&again), "another product of the same seed");
    refused_into(
        "simulate",
        &arguments,
        &["exists; choose another folder"],
        &out,
    );

    let found = folder.path().join("found");
    let map = folder.path().join("map.geojson");
    let product = safe(&out);
    let search = [
        text(&product),
        "--no-land",
        "--json",
        "--estimate",
        "--geojson",
        text(&map),
    ];
    let told: Value = serde_json::from_str(&done("detect", &search, &found)).expect("JSON");
    let best = &told["wakes"][0];
    assert!(best["sure"] == true, "{best}");
    let turn = best["heading"].as_f64().expect("a heading") - 120.0;
    assert!(turn.abs() < 5.0, "{best}");
    let ship = &best["ship"];
    let number = |name: &str| ship[name].as_f64().expect("a number");
    assert!(ship["identifiable"] == true, "{ship}");
    for (name, truth) in [("speed", 8.0), ("heading", 120.0), ("wind_speed", 4.5)] {
        let off = (number(name) - truth).abs();
        assert!(off < 3.0 * number(&format!("{name}_deviation")), "{ship}");
    }
    for name in [
        "report.html",
        "wakes.csv",
        "wakes.geojson",
        "wakes.json",
        "quicklook.png",
    ] {
        assert!(found.join(name).is_file(), "{name}");
    }
    assert!(
        !found.join("search.jsonl").exists(),
        "a search that is done"
    );
    assert_eq!(
        std::fs::read(&map).expect("a map"),
        std::fs::read(found.join("wakes.geojson")).expect("a map")
    );
    // The part lies 100 km inside Mozambique: with land left out there is nothing to search.
    let dry = folder.path().join("dry");
    let told: Value =
        serde_json::from_str(&done("detect", &[text(&product), "--json"], &dry)).expect("JSON");
    assert_eq!(told["wakes"].as_array().map(Vec::len), Some(0));
    // A search of something else is not gone on with.
    std::fs::write(found.join("search.jsonl"), "{\"product\": \"b\"}\n").expect("a file");
    refused_into(
        "detect",
        &search,
        &["belongs to another search", "remove it"],
        &found,
    );
}

#[test]
fn products_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let ships = ships(folder.path());
    let simulate = |more: &[&str], words: &[&str]| {
        refused_by(
            "simulate",
            &[&["--product", TEMPLATE][..], more].concat(),
            words,
        );
    };
    simulate(&["--lines", "0..10"], &["at least 64"]);
    simulate(&["--lines", "10"], &["two whole numbers"]);
    simulate(&["--polarization", "VH"], &["VH"]);
    simulate(&["--wind-speed", "70"], &["wind_speed"]);
    simulate(&["--set", "ship.colour=3"], &["colour"]);
    simulate(&["--ships", "no/such.geojson"], &["no/such.geojson"]);
    simulate(&["--overlay"], &["cannot be used with"]);
    std::fs::write(&ships, "{\"features\": [{}]}").expect("a file");
    simulate(&["--ships", text(&ships)], &["feature 1", "Point"]);
    refused_by(
        "simulate",
        &["--product", "no/such.SAFE"],
        &["no/such.SAFE"],
    );
    // Annotation alone has no pixels to search.
    refused_by("detect", &[TEMPLATE], &["measurement"]);
    refused_by(
        "detect",
        &[TEMPLATE, "--method", "radon"],
        &["--method radon", "product"],
    );
    refused_by(
        "detect",
        &[TEMPLATE, "--land", "no/such.geojson"],
        &["no/such.geojson"],
    );
    refused_by(
        "detect",
        &[TEMPLATE, "--coast", "1e9"],
        &["buffer", "50000"],
    );
}
