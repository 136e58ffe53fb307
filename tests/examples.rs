//! Every example runs once, in a folder of its own, as a reader would start it.

use std::path::Path;
use std::process::Command;

/// An example that `cargo test` has built beside this test.
fn run(name: &str, arguments: &[&str], folder: &Path) -> String {
    let test = std::env::current_exe().expect("a running test has a path");
    let target = test.ancestors().nth(2).expect("a target folder");
    let program = target.join("examples").join(name);
    let program = program.with_extension(std::env::consts::EXE_EXTENSION);
    let output = Command::new(&program)
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}", program.display()));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {message}");
    String::from_utf8(output.stdout).expect("Unicode")
}

/// Runs an example, which must print `words` and write `files`.
fn teaches(name: &str, arguments: &[&str], words: &str, files: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let printed = run(name, arguments, folder.path());
    assert!(printed.contains(words), "no '{words}' in: {printed}");
    for file in files {
        assert!(folder.path().join(file).is_file(), "{name}: no {file}");
    }
}

#[test]
fn simulate() {
    let files = ["out/simulate/image.png", "out/simulate/labels.json"];
    let small = ["grid.rows=64", "grid.columns=64"];
    teaches("simulate", &small, "wake from pixel", &files);
}

#[test]
fn generate() {
    let prompt = "a ship at 8 m/s toward 135 degrees, wind 5 m/s";
    let files = ["out/generate/image.png", "out/generate/labels.json"];
    teaches("generate", &[prompt], "8 mps toward 135", &files);
}

#[test]
fn dataset() {
    let files = ["out/dataset/metadata.jsonl", "out/dataset/coco.json"];
    teaches("dataset", &[], "12 images", &files);
}

#[test]
fn detect() {
    teaches("detect", &[], "wakes, drawn", &["out/detect/wakes.png"]);
}

#[test]
fn own_source() {
    teaches("own_source", &[], "images [4, 1, 64, 64]", &[]);
}

#[test]
fn training_loop() {
    teaches("training_loop", &["2"], "step 1: loss", &[]);
}

#[test]
fn stable_diffusion_lora() {
    let files = ["out/stable_diffusion_lora/image.png"];
    teaches("stable_diffusion_lora", &[], "pytorch_lora_weights", &files);
}

/// Each fits on a page and stands alone.
#[test]
fn examples_are_short() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let (mut count, tests) = (0, include_str!("examples.rs"));
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy();
        let text = std::fs::read_to_string(&path).expect("a file, no folder");
        assert!(text.lines().count() <= 60, "{name}: above 60 lines");
        assert!(!text.contains("\nmod "), "{name}: shares code");
        assert!(tests.contains(&format!("fn {name}()")), "{name} is not run");
        count += 1;
    }
    assert!(count >= 7, "only {count} examples");
}
