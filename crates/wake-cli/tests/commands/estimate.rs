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
        (&[][..], "--bound"),
        (&["--bound", "--set", "sea.wind_speed=0"], "sea.wind_speed"),
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
