//! `wake locate`: what it prints, beside an independent program, and what it refuses.

use serde_json::Value;

use super::run;

const FIXTURES: &str = "crates/wake-geo/tests/fixtures";
const NAMES: [&str; 2] = [
    "S1A_IW_GRDH_1SDV_20150222T170750_20150222T170815_004739_005DD8_3768",
    "S1A_IW_GRDH_1SDV_20210119T031653_20210119T031718_036201_043ED0_8255",
];

fn product(name: &str) -> String {
    format!("{FIXTURES}/{name}.zip")
}

fn printed(arguments: &[&str]) -> String {
    let output = run("locate", arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("Unicode")
}

fn refused(arguments: &[&str], words: &[&str]) {
    let output = run("locate", arguments);
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    let sentence = message.split("\n\n").next().unwrap_or_default();
    assert_eq!(sentence.trim_end().lines().count(), 1, "{message}");
    for word in words {
        assert!(sentence.contains(word), "no '{word}' in: {message}");
    }
}

/// Every golden point of both products in two calls of the program.
#[test]
fn json_has_the_golden_values() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let text =
        std::fs::read_to_string(format!("{root}/{FIXTURES}/golden.json")).expect("the golden file");
    let golden: Value = serde_json::from_str(&text).expect("JSON");
    for name in NAMES {
        let points = golden[format!("{name}.SAFE")]["points"]
            .as_array()
            .expect("points");
        let places: Vec<String> = points
            .iter()
            .map(|point| format!("{},{}", point["line"], point["pixel"]))
            .collect();
        let path = product(name);
        let mut arguments = vec![path.as_str(), "--json", "--dn", "100"];
        arguments.extend(places.iter().map(String::as_str));
        let text = printed(&arguments);
        assert_eq!(text.lines().count(), points.len());
        for (line, point) in text.lines().zip(points) {
            let record: Value = serde_json::from_str(line).expect("an object a line");
            // Printed numbers are read back to the last bit, and the formulas are the same.
            for (key, golden_key, tolerance) in [
                ("line", "line", 0.0),
                ("pixel", "pixel", 0.0),
                ("latitude", "latitude", 1e-13),
                ("longitude", "longitude", 1e-13),
                ("incidence", "incidenceAngle", 1e-13),
                ("slant_range_time", "slantRangeTime", 1e-17),
                ("sigma_nought_lut", "sigma_nought_lut", 1e-12),
                ("noise", "noise", 1e-11),
                ("sigma0", "sigma0_of_dn_100", 1e-16),
            ] {
                let [found, expected] = [&record[key], &point[golden_key]]
                    .map(|value| value.as_f64().expect("a number"));
                assert!((found - expected).abs() <= tolerance, "{key} of {line}");
            }
            assert_eq!(record.as_object().map(serde_json::Map::len), Some(9));
        }
    }
}

#[test]
fn without_a_measurement_there_is_no_sigma_nought() {
    let path = product(NAMES[1]);
    let text = printed(&[&path, "0,0", "--json"]);
    let record: Value = serde_json::from_str(&text).expect("an object");
    assert_eq!(record.as_object().map(serde_json::Map::len), Some(8));
    assert!(record.get("sigma0").is_none());
    let line = printed(&[&path, "7894,12983", "--dn", "100"]);
    assert_eq!(line.lines().count(), 1);
    for word in ["line 7894, pixel 12983", "18.1276609° S", "incidence", "dB"] {
        assert!(line.contains(word), "no '{word}' in: {line}");
    }
}

#[test]
fn bad_places_and_products_are_named() {
    let path = product(NAMES[1]);
    refused(&[&path, "0,0", "16854,0"], &["line", "16854", "16853"]);
    refused(&[&path, "0,25931"], &["pixel", "25931", "25930"]);
    refused(&[&path, "12"], &["12", "two whole numbers"]);
    refused(&[&path, "1.5,2"], &["1.5,2", "two whole numbers"]);
    refused(&[&path, "0,0", "--dn", "-1"], &["digital number", "-1"]);
    refused(&[&path, "0,0", "--polarization", "XX"], &["XX", "VV"]);
    refused(&[&path, "0,0", "--polarization", "HH"], &["HH", "VV"]);
    refused(&["no/such.SAFE", "0,0"], &["no/such.SAFE"]);
    refused(&["README.md", "0,0"], &["README.md", "as a product"]);
    refused(&["crates", "0,0"], &["crates", "annotation"]);
}
