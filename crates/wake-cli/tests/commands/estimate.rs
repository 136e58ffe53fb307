//! `wake estimate`: bounds that follow the scene, and what is refused.

use serde_json::Value;

use super::run;

const SMALL: [&str; 8] = [
    "--bound",
    "--json",
    "--set",
    "grid.rows=64",
    "--set",
    "grid.columns=64",
    "--set",
    "model.tolerance=1e-2",
];

fn bound(arguments: &[&str]) -> Value {
    let output = run("estimate", &[&SMALL[..], arguments].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// More looks tell more, an unknown brightness less; without a ship there is the wind alone.
#[test]
fn bounds_follow_the_scene() {
    let of = |value: &Value, name: &str| value["bound"][name].as_f64().expect("a number");
    let here = bound(&[]);
    let looks = bound(&["--set", "radar.looks=16"]);
    let uncalibrated = bound(&["--uncalibrated"]);
    for name in ["speed_sd", "heading_sd", "length_sd", "wind_speed_sd"] {
        assert!(of(&looks, name) < of(&here, name), "{name}");
    }
    assert!(of(&uncalibrated, "wind_speed_sd") > 1.1 * of(&here, "wind_speed_sd"));
    assert!(here["wake_to_noise"].as_f64() > Some(0.0));
    let folder = tempfile::tempdir().expect("a folder");
    let open = folder.path().join("open.toml");
    std::fs::write(&open, "ship = []\n").expect("a file");
    let open = bound(&["--scene", open.to_str().expect("Unicode")]);
    assert_eq!(open["bound"]["speed_sd"], Value::Null);
    assert!(of(&open, "wind_speed_sd") > 0.0);
}

#[test]
fn bad_arguments_are_named() {
    for (arguments, word) in [
        (
            &["--bound", "--set", "sea.wind_speed=0"][..],
            "sea.wind_speed",
        ),
        (&["--at", "3,4"], "--image"),
        (&["--bound", "--image", "sea.tif"], "--image"),
        (
            &["--bound", "--set", "ship.turn_rate=0.5"],
            "ship.turn_rate",
        ),
    ] {
        let output = run("estimate", arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert!(message.contains(word), "no '{word}' in: {message}");
    }
}

/// An image that `wake simulate` wrote, and a window of it, are read around place and heading of the ship; one of another size names the way out.
#[test]
fn an_image_is_read_around_a_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| {
        folder
            .path()
            .join(name)
            .to_str()
            .expect("Unicode")
            .to_owned()
    };
    let keys = |rows: usize, speed: f64| -> Vec<String> {
        let keys = [
            format!("grid.rows={rows}"),
            format!("grid.columns={rows}"),
            "grid.spacing=4".to_owned(),
            "ship.position=[60, 40]".to_owned(),
            "ship.heading=60".to_owned(),
            format!("ship.speed={speed}"),
            "model.tolerance=1e-2".to_owned(),
        ];
        keys.into_iter()
            .flat_map(|k| ["--set".to_owned(), k])
            .collect()
    };
    let call = |program: &str, arguments: &[String], keys: &[String]| {
        let all: Vec<&str> = arguments.iter().chain(keys).map(String::as_str).collect();
        run(program, &all)
    };
    let strings =
        |words: &[&str]| -> Vec<String> { words.iter().map(|w| (*w).to_owned()).collect() };
    let out = at("sea");
    let made = call(
        "simulate",
        &strings(&["--out", &out, "--export", "tiff"]),
        &keys(96, 8.0),
    );
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let image = at("sea/speckled.tif");
    let read = call(
        "estimate",
        &strings(&["--image", &image, "--json"]),
        &keys(96, 8.03),
    );
    assert!(
        read.status.success(),
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
    let found: Value = serde_json::from_slice(&read.stdout).expect("JSON");
    let wake = &found["wakes"][0];
    let number = |name: &str| wake[name].as_f64().expect("a number");
    let off = (number("speed") - 8.0).abs();
    assert!(off < 4.0 * number("speed_sd"), "{wake}");
    assert!(number("speed_sd") < 0.3, "{wake}");
    let other = call("estimate", &strings(&["--image", &image]), &keys(64, 8.0));
    let message = String::from_utf8_lossy(&other.stderr);
    assert!(
        message.contains("--at") && message.contains("96 x 96"),
        "{message}"
    );
    let window = call(
        "estimate",
        &strings(&["--image", &image, "--at", "16,16", "--json"]),
        &keys(64, 8.0),
    );
    assert!(
        window.status.success(),
        "{}",
        String::from_utf8_lossy(&window.stderr)
    );
    let beyond = call(
        "estimate",
        &strings(&["--image", &image, "--at", "60,0"]),
        &keys(64, 8.0),
    );
    assert_eq!(beyond.status.code(), Some(2), "{beyond:?}");
}
