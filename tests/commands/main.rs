//! The examples as a user starts them: bad input ends with exit code 2, one sentence, and nothing written.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An example that `cargo test` has built beside this test.
fn example(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a running test has a path");
    let folder = test.parent().and_then(Path::parent).expect("target folder");
    let path = folder
        .join("examples")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(
        path.exists(),
        "{} is not built: run `cargo build --examples` with the same features first",
        path.display()
    );
    path
}

fn run(name: &str, arguments: &[&str]) -> Output {
    Command::new(example(name))
        .args(arguments)
        .output()
        .expect("an example that starts")
}

/// Runs `simulate` into a fresh folder and checks that it refuses, saying all of `words`.
fn refused(arguments: &[&str], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut all = arguments.to_vec();
    let out_text = out.to_str().expect("a path in Unicode").to_owned();
    all.extend(["--out", &out_text]);
    let output = run("simulate", &all);
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    for word in words {
        assert!(message.contains(word), "no '{word}' in: {message}");
    }
    assert!(!out.exists(), "{arguments:?} left a folder behind");
}

#[test]
fn values_out_of_range_are_named_with_their_range() {
    refused(
        &["--set", "sea.wind_speed=30.001"],
        &["sea.wind_speed", "30.001", "0 to 30 m/s"],
    );
    refused(
        &["--set", "radar.incidence=4.9"],
        &["radar.incidence", "4.9", "5 to 75"],
    );
    refused(
        &["--set", "ship.speed=nan"],
        &["ship.speed", "NaN", "0 to 40"],
    );
    refused(&["--set", "ship.heading=inf"], &["ship.heading", "inf"]);
    refused(
        &["--set", "grid.rows=100000"],
        &["grid.rows", "100000", "1 to 16384"],
    );
}

#[test]
fn unknown_keys_and_wrong_types_are_named() {
    refused(&["--set", "ship.sped=3"], &["sped", "speed"]);
    refused(&["--set", "ship.speed=fast"], &["ship.speed", "fast"]);
    refused(&["--set", "sea"], &["'sea'", "KEY=VALUE"]);
}

#[test]
fn a_missing_or_broken_scene_file_is_named() {
    refused(&["--scene", "no/such/scene.toml"], &["no/such/scene.toml"]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, "[sea]\nwind_sped = 3\n").expect("a file");
    let path = path.to_str().expect("a path in Unicode");
    let output = run("simulate", &["--scene", path, "--out", path]);
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    for word in ["scene.toml", "line 2", "wind_sped", "wind_speed"] {
        assert!(message.contains(word), "no '{word}' in: {message}");
    }
}

/// Fields that cannot fit in the memory of any machine this runs on, asked for within the range of the keys.
#[test]
fn a_grid_that_does_not_fit_says_what_it_needs() {
    if !Path::new("/proc/meminfo").exists() {
        return;
    }
    let free = std::fs::read_to_string("/proc/meminfo").expect("meminfo");
    let kib = |line: &str| line.split_whitespace().nth(1)?.parse::<f64>().ok();
    let available = free
        .lines()
        .find(|l| l.starts_with("MemAvailable"))
        .and_then(kib);
    if available.is_none_or(|kib| kib > 38.0 * 1024.0 * 1024.0) {
        return;
    }
    refused(
        &["--set", "grid.rows=16384", "--set", "grid.columns=16384"],
        &["16384 x 16384", "GiB", "lower grid.rows"],
    );
}

/// A folder inside a file can be made by nobody, root included.
#[test]
fn an_unwritable_folder_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "kept").expect("a file");
    let out = file.join("out");
    let small = ["--set", "grid.rows=8", "--set", "grid.columns=8", "--out"];
    let mut arguments = small.to_vec();
    arguments.push(out.to_str().expect("a path in Unicode"));
    let output = run("simulate", &arguments);
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("file/out"), "{message}");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "kept");
}

/// What a good run writes, and the report it prints.
#[test]
fn a_scene_gives_four_files_and_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let arguments = [
        "--json",
        "--set",
        "grid.rows=24",
        "--set",
        "grid.columns=31",
        "--out",
        out.to_str().expect("a path in Unicode"),
    ];
    let output = run("simulate", &arguments);
    assert!(output.status.success());
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("a report and nothing else");
    assert!(report["seconds"]["total"].as_f64().is_some_and(|s| s > 0.0));
    assert!(report["plan"].is_array() && report["files"].is_array());
    let names: Vec<String> = std::fs::read_dir(&out)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    for name in [
        "image.png",
        "fields.safetensors",
        "labels.json",
        "report.json",
    ] {
        assert!(names.iter().any(|n| n == name), "no {name} in {names:?}");
    }
    assert_eq!(names.len(), 4, "{names:?}");
}
