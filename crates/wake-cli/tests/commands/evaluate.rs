//! `wake evaluate`: what it refuses, and one run of the model and of the simulator.

use super::{cannot_write, done, names, refused_by};

#[test]
fn wrong_options_are_named() {
    for (arguments, words) in [
        (["--count", "0"], ["--count", "'0'", "1..=65536"]),
        (["--steps", "0"], ["steps", "is 0", "[1, 1000]"]),
        (["--device", "tpu"], ["'tpu'", "flex", "features"]),
        (
            ["--weights", "no/such/folder"],
            ["cannot read", "no/such/folder", "config.json"],
        ),
    ] {
        refused_by("evaluate", &arguments, &words);
    }
    let lpips = [
        "--lpips-backbone",
        "no/backbone",
        "--lpips-linear",
        "no/linear",
    ];
    refused_by("evaluate", &lpips, &["no/backbone"]);
    cannot_write("evaluate", &["--count", "1"]);
}

/// Every figure and picture is made, though one scene says nothing; less than four images have no two-sample test.
#[test]
fn one_scene_is_judged() {
    for arguments in [&["--count", "1"][..], &["--count", "1", "--simulator-only"]] {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        let printed = done("evaluate", arguments, &out);
        assert!(printed.contains("## Seconds per image"), "{printed}");
        assert_eq!(
            names(&out),
            [
                "ablation.png",
                "report.json",
                "report.md",
                "spectrum.svg",
                "wake_correlation.svg"
            ]
        );
    }
}

/// One scene of a recipe: the table has all kinds of image and no two-sample test.
#[test]
fn one_scene_of_a_recipe_is_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let arguments = ["domain", "--count", "1", "--recipe", "ranges"];
    let printed = done("evaluate", &arguments, &out);
    for kind in ["expected", "Gaussian", "model", "other sea"] {
        assert!(printed.contains(kind), "{kind}: {printed}");
    }
    assert_eq!(names(&out), ["domain.json", "domain.md", "domain.png"]);
}

/// One image is estimated by one of two jobs; a second run reads it from the first's lines.
#[test]
fn estimates_are_compared_with_the_truth() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let arguments = [
        "estimate",
        "--count",
        "1",
        "--satellites",
        "0",
        "--others",
        "0",
        "--jobs",
        "2",
    ];
    let printed = done("evaluate", &arguments, &out);
    assert!(
        printed.contains("paper's ranges") && printed.contains("| paper | 1 | "),
        "{printed}"
    );
    assert_eq!(names(&out), ["estimates.jsonl", "report.json", "report.md"]);
    let lines = || std::fs::read_to_string(out.join("estimates.jsonl")).expect("lines");
    let first = lines();
    assert_eq!(first.lines().count(), 1);
    assert_eq!(done("evaluate", &arguments, &out), printed);
    assert_eq!(lines(), first, "estimated again");
}
