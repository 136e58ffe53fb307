//! `wake simulate`: what it refuses, and what it writes.

use std::path::Path;

use super::{cannot_write, done, names, refused_by, text};

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

#[test]
fn an_unwritable_folder_is_named_and_nothing_is_written() {
    let small = ["--set", "grid.rows=8", "--set", "grid.columns=8"];
    cannot_write("simulate", &small);
}

/// A run writes its four files and prints a report.
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

/// Optional files are written under the names that were asked for.
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

/// The image alone is the same as among all results, and nothing is written beside it.
#[test]
fn only_the_image_is_written_where_only_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let [all, image] = ["all", "image"].map(|name| folder.path().join(name));
    let size = ["--set", "grid.rows=24", "--set", "grid.columns=31"];
    done("simulate", &size, &all);
    done("simulate", &[&size[..], &["--only-image"]].concat(), &image);
    assert_eq!(names(&image), ["image.png"]);
    let [all, image] = [all, image].map(|folder| std::fs::read(folder.join("image.png")));
    assert!(all.expect("a file") == image.expect("a file"));
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
