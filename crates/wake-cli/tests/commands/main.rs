//! The examples as a user starts them: bad input ends with exit code 2, one sentence, and nothing written.

#[cfg(feature = "train")]
mod detector;
#[cfg(feature = "ldm")]
mod evaluate;
mod faults;
#[cfg(feature = "ldm")]
mod generate;
#[cfg(feature = "train")]
mod dataset;
#[cfg(feature = "train")]
mod sea;
#[cfg(feature = "train")]
mod text_to_image;
#[cfg(feature = "train")]
mod train;

use std::collections::BTreeMap;
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

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in Unicode")
}

/// Runs an example that must go well; gives what it printed.
fn done(name: &str, arguments: &[&str], out: &Path) -> String {
    let output = run(name, &[arguments, &["--out", text(out)]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name} {arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("Unicode")
}

/// Runs an example that must refuse with exit code 2 and one sentence that says all of `words`, print no result, and
/// leave `out` as it is.
fn refused_into(name: &str, arguments: &[&str], words: &[&str], out: &Path) {
    let before = out.exists().then(|| files(out));
    let output = run(name, &[arguments, &["--out", text(out)]].concat());
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
    // What the parser of the command line refuses has a hint below its sentence.
    let (sentence, hint) = message.split_once("\n\n").unwrap_or((&message, "For"));
    assert_eq!(sentence.trim_end().lines().count(), 1, "{message}");
    assert!(
        hint.starts_with("For") || hint.starts_with("Usage"),
        "{message}"
    );
    for word in words {
        assert!(sentence.contains(word), "no '{word}' in: {message}");
    }
    let after = out.exists().then(|| files(out));
    assert!(before == after, "{arguments:?} changed the folder");
}

/// The same into a folder that does not exist, and must not afterwards.
fn refused_by(name: &str, arguments: &[&str], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    refused_into(name, arguments, words, &folder.path().join("out"));
}

/// Every file below a folder, and its content; a folder has none.
fn files(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            let below = files(&path).into_iter();
            let name = PathBuf::from(path.file_name().expect("a name"));
            found.extend(below.map(|(path, content)| (name.join(path), content)));
            found.insert(name, None);
        } else {
            let content = std::fs::read(&path).expect("a file");
            found.insert(path.file_name().expect("a name").into(), Some(content));
        }
    }
    found
}

fn refused(arguments: &[&str], words: &[&str]) {
    refused_by("simulate", arguments, words);
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
    refused(
        &["--scene", text(&path)],
        &["scene.toml", "line 2", "wind_sped", "wind_speed"],
    );
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
    if available.is_none_or(|kib| kib > 1600.0 * 1024.0 * 1024.0) {
        return;
    }
    refused(
        &[
            "--set",
            "grid.rows=16384",
            "--set",
            "grid.columns=16384",
            "--set",
            "grid.oversampling=16",
        ],
        &["16384 x 16384", "GiB", "lower grid.rows"],
    );
}

/// A folder inside a file can be made by nobody, root included.
fn cannot_write(name: &str, arguments: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "kept").expect("a file");
    refused_into(name, arguments, &["file/out"], &file.join("out"));
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "kept");
}

#[test]
fn an_unwritable_folder_is_named_and_nothing_is_written() {
    let small = ["--set", "grid.rows=8", "--set", "grid.columns=8"];
    cannot_write("simulate", &small);
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
    ];
    let printed = done("simulate", &arguments, &out);
    let report: serde_json::Value =
        serde_json::from_str(&printed).expect("a report and nothing else");
    assert!(report["seconds"]["total"].as_f64().is_some_and(|s| s > 0.0));
    assert!(report["plan"].is_array() && report["files"].is_array());
    assert_eq!(
        names(&out),
        [
            "fields.safetensors",
            "image.png",
            "labels.json",
            "report.json"
        ]
    );
}

/// What is asked for beside them.
#[test]
fn a_drawn_picture_and_fields_for_other_tools_are_written_where_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let size = ["--set", "grid.rows=24", "--set", "grid.columns=31"];
    let asked = ["--overlay", "--export", "npy,tiff"];
    done("simulate", &[&size[..], &asked].concat(), &out);
    let names = names(&out);
    let ending = |end: &str| names.iter().filter(|name| name.ends_with(end)).count();
    assert_eq!([ending(".npy"), ending(".tif")], [10, 10], "{names:?}");
    let overlay = image::open(out.join("overlay.png")).expect("a picture");
    assert_eq!((overlay.width(), overlay.height()), (31, 24));
}

/// Each has a folder of its own; the table has a line of each, and of every image that is no mask.
#[test]
fn several_scenes_are_compared_with_real_images_in_one_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    for name in ["here", "here/again", "real"] {
        std::fs::create_dir(at(name)).expect("a folder");
    }
    let size = "[grid]\nrows = 260\ncolumns = 256\n[ship]\nposition = [0, 200]\n";
    let scenes = ["here/one.toml", "here/two.toml", "here/again/one.toml"].map(at);
    for (seed, path) in scenes.iter().enumerate() {
        std::fs::write(path, format!("seed = {seed}\n{size}")).expect("a file");
    }
    let [one, two, again] = scenes.each_ref().map(|path| text(path));
    done("simulate", &["--scene", one], &at("alone"));
    for name in ["real/tile.png", "real/tile_mask.png"] {
        std::fs::copy(at("alone/image.png"), at(name)).expect("a copy");
    }
    let labels = r#"{"images": {"tile.png": {"wakes": [
        {"id": "x", "tip": [130, 40], "axis_deg": 225, "confidence": "clear"},
        {"id": "y", "tip": [90, 40], "axis_deg": 225, "confidence": "doubtful"}]}}}"#;
    std::fs::write(at("real/labels.json"), labels).expect("a file");
    let (real, out) = (at("real"), at("out"));
    let compare = ["--scene", one, two, "--compare", text(&real)];
    let printed = done("simulate", &compare, &out);
    let page = std::fs::read_to_string(out.join("comparison.md")).expect("a table");
    assert!(printed.contains(&page), "{printed}");
    for line in [
        "| one |",
        "| two |",
        "| tile |",
        "| one a |",
        "| two a |",
        "| tile x |",
    ] {
        assert_eq!(page.matches(line).count(), 1, "{line} in {page}");
    }
    assert!(!page.contains("mask") && !page.contains("tile y"), "{page}");
    for name in [
        "one/image.png",
        "two/labels.json",
        "comparison.json",
        "sheet.png",
    ] {
        assert!(out.join(name).is_file(), "{name}");
    }
    refused(&["--scene", one, again], &["one.toml", "rename"]);
    refused(&["--compare", text(&at("here"))], &["here", "PNG"]);
    refused(&["--compare", text(&at("nowhere"))], &["nowhere"]);
}

/// Names of all files below a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let names = files(folder).into_keys();
    names.map(|name| text(&name).to_owned()).collect()
}
