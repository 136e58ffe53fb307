//! `wake generate`: what it refuses, and what it writes with the model in the crate.

use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use serde_json::Value;
use wake_physics::labels::Labels;

use super::{cannot_write, done, names, refused_by, text};

fn refused(arguments: &[&str], words: &[&str]) {
    refused_by("generate", arguments, words);
}

#[test]
fn wrong_options_are_named() {
    for (arguments, words) in [
        (["--count", "0"], ["--count", "is 0", "[1, 256]"]),
        (["--steps", "0"], ["steps", "is 0", "[1, 1000]"]),
        (["--device", "tpu"], ["'tpu'", "flex", "features"]),
        (["--device", "flex:1"], ["'flex:1'", "flex", "features"]),
        (
            ["--scheduler", "ddim"],
            ["--scheduler", "diffusers", "--weights"],
        ),
        (
            ["--guidance", "3"],
            ["--guidance", "diffusers", "--weights"],
        ),
        (
            ["--negative", "land"],
            ["--negative", "diffusers", "--weights"],
        ),
        (
            ["--scene", "no/scene.toml"],
            ["no/scene.toml", "cannot read", ""],
        ),
        (
            ["--scene", "assets/scenes/default.toml"],
            ["512 × 512", "2.5 m", "256 × 256 pixels"],
        ),
        (
            ["--weights", "no/such/folder"],
            ["--weights", "no/such/folder", "no model"],
        ),
        (
            ["--weights", "assets/scenes"],
            ["--weights", "assets/scenes", "no model"],
        ),
    ] {
        refused(&arguments, &words);
    }
    for (option, value) in [("--overlay", None), ("--sea", Some("a.safetensors"))] {
        let arguments: Vec<&str> = ["--weights", "tests/fixtures/pipeline_a", option]
            .into_iter()
            .chain(value)
            .collect();
        refused(&arguments, &[option, "wake model", "leave it out"]);
    }
    cannot_write("generate", &["--steps", "1"]);
}

#[test]
fn a_prompt_that_contradicts_itself_is_refused() {
    let twice = "a ship at 8 m/s, ship speed 9 m/s";
    refused(
        &["--prompt", twice],
        &["contradicts itself", "8 m/s", "9 m/s"],
    );
    refused(
        &["--prompt", "a ship at 900 m/s"],
        &["900 m/s", "ship.speed", "0 to 40"],
    );
}

/// A copy of the model in the crate, with another content of its largest file.
fn with_weights(folder: &Path, change: impl FnOnce(Vec<u8>) -> Vec<u8>) -> String {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../wake-ldm/assets");
    let mut largest = (0, String::new());
    for entry in std::fs::read_dir(assets).expect("the model") {
        let from = entry.expect("an entry").path();
        let name = from
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let length = std::fs::copy(&from, folder.join(&name)).expect("a copy");
        largest = largest.max((length, name));
    }
    let path = folder.join(&largest.1);
    let bytes = std::fs::read(&path).expect("weights");
    std::fs::write(path, change(bytes)).expect("a file");
    largest.1
}

#[test]
fn foreign_and_broken_weights_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let weights = ["--weights", text(folder.path()), "--steps", "1"];
    let name = with_weights(folder.path(), |_| {
        let numbers = [0; 8];
        let tensor = TensorView::new(Dtype::F32, vec![2], &numbers).expect("a tensor");
        safetensors::serialize([("foreign.weight", tensor)], None).expect("a file")
    });
    refused(
        &weights,
        &[&name, "does not fit", "missing", "foreign.weight"],
    );
    with_weights(folder.path(), |bytes| bytes[..bytes.len() / 2].to_vec());
    refused(&weights, &[&name, "not a valid safetensors file"]);
    with_weights(folder.path(), |bytes| bytes);
    done("generate", &weights, &folder.path().join("out"));
}

#[test]
fn two_images_have_a_sheet_labels_and_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let arguments = [
        "--count",
        "2",
        "--steps",
        "1",
        "--seed",
        "5",
        "--json",
        "--overlay",
    ];
    let printed = done("generate", &arguments, &out);
    assert_eq!(
        names(&out),
        [
            "image-0.png",
            "image-1.png",
            "labels-0.json",
            "labels-1.json",
            "overlay.png",
            "report.json",
            "sheet.png"
        ]
    );
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect(name);
    let report: Value = serde_json::from_str(&printed).expect("a report and nothing else");
    assert_eq!(
        serde_json::from_str::<Value>(&read("report.json")).expect("JSON"),
        report
    );
    let [load, text, denoise, decode, total] = ["load", "text", "denoise", "decode", "total"]
        .map(|stage| report["seconds"][stage].as_f64().expect(stage));
    assert!(load > 0.0 && text > 0.0 && denoise > 0.0 && decode > 0.0);
    assert!(total >= load.max(text).max(denoise).max(decode));
    assert_eq!(
        [&report["count"], &report["steps"], &report["seed"]].map(Value::as_u64),
        [2, 1, 5].map(Some)
    );
    for name in ["labels-0.json", "labels-1.json"] {
        let labels: Labels = serde_json::from_str(&read(name)).expect("labels of one image");
        assert_eq!(labels.ships.len(), 1);
    }
    let [first, second, sheet] = ["image-0.png", "image-1.png", "sheet.png"]
        .map(|name| image::open(out.join(name)).expect(name).into_luma8());
    assert_ne!(first, second);
    // Beside each other with a gap, below a line of text each.
    let [top, right] = [sheet.height() - 256, sheet.width() - 256];
    for (image, left) in [(&first, 0), (&second, right)] {
        let part = image::imageops::crop_imm(&sheet, left, top, 256, 256).to_image();
        assert!(part == *image, "the image at column {left}");
    }
    let overlay = image::open(out.join("overlay.png"))
        .expect("a picture")
        .into_rgb8();
    assert!(
        overlay.pixels().any(|p| p.0 == [255, 176, 0]),
        "no box is drawn"
    );
}

/// Keys of a scene instead of a prompt; other keys keep the values of the scene that the model was trained on.
#[test]
fn a_scene_is_asked_for_by_its_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let arguments = ["--set", "ship.speed=9", "--steps", "1", "--json"];
    let report: Value = serde_json::from_str(&done("generate", &arguments, &out)).expect("JSON");
    assert_eq!(report["scene"]["ship"]["speed"], 9.0);
    assert_eq!(report["scene"]["seed"], 7);
    let labels = std::fs::read_to_string(out.join("labels.json")).expect("labels");
    let labels: Labels = serde_json::from_str(&labels).expect("labels of one image");
    assert!((labels.ships[0].ship.speed - 9.0).abs() < 1e-12);
    refused(&["--set", "ship.sped=9"], &["sped", "speed"]);
    refused(
        &["--set", "ship.speed=9", "--prompt", "a ship"],
        &["--set", "--prompt"],
    );
}
