//! `wake dataset`: what it refuses, and that shards, jobs and kills change no byte.

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use super::{cannot_write, done, files, names, program, refused_by, refused_into, text};

/// A quick recipe.
const SMALL: [&str; 4] = [
    "--set",
    "scene.grid.rows=32",
    "--set",
    "scene.grid.columns=32",
];

fn make(arguments: &[&str], out: &Path) -> String {
    done("dataset", &[&SMALL, arguments].concat(), out)
}

#[test]
fn wrong_recipes_shares_and_numbers_are_named() {
    for (arguments, words) in [
        (["--grid", "papper"], ["--grid", "papper", "detector"]),
        (["--set", "speckel=true"], ["recipe", "speckel", "speckle"]),
        (
            ["--set", "scene.sea.wind_sped=3"],
            ["wind_sped", "wind_speed", "fetch"],
        ),
        (
            ["--set", "scene.radar.looks=0"],
            ["radar.looks", "is 0", "1 to"],
        ),
        (
            ["--set", "draw.ship.speed=[12,6]"],
            ["draw.ship.speed", "[12, 6]", "lower first"],
        ),
        (
            ["--set", "draw.sea.gust_strength=\"x\""],
            ["\"x\"", "sea.gust_strength", "expected f64"],
        ),
        (["--val-share", "2"], ["val_share", "is 2", "[0, 1]"]),
        (["--shard", "5/3"], ["--shard", "5/3", "from 0 to N"]),
        (["--shard", "half"], ["--shard", "half", "such as 0/4"]),
        (["--count", "0"], ["--count", "'0'", "1..="]),
        (["--jobs", "0"], ["--jobs", "'0'", "1..="]),
        (["--license", "a: b"], ["--license", "a: b", "cc0-1.0"]),
        (["--per-tar", "0"], ["--per-tar", "'0'", "1..="]),
    ] {
        refused_by("dataset", &arguments, &words);
    }
    refused_by(
        "dataset",
        &["--merge"],
        &["shard-0", "missing", "make it in the same folder"],
    );
    cannot_write("dataset", &["--count", "1"]);
}

#[test]
fn a_file_does_not_hide_a_recipe_of_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("detector"), [0xff, 0xfe]).expect("a file");
    let made = program("dataset")
        .args(["--grid", "detector", "--count", "1", "--out", "set"])
        .args(SMALL)
        .current_dir(folder.path())
        .output()
        .expect("a program that runs");
    let message = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success(), "{message}");
    assert!(folder.path().join("set/dataset.json").is_file());
}

#[test]
fn shards_made_on_other_threads_merge_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, joined) = (folder.path().join("whole"), folder.path().join("joined"));
    make(&["--count", "4", "--jobs", "1"], &whole);
    make(&["--count", "4", "--jobs", "3", "--shard", "1/2"], &joined);
    // A share is missing: nothing is merged, nothing is lost.
    refused_into("dataset", &["--merge"], &["shard-0", "missing"], &joined);
    make(&["--count", "4", "--shard", "0/2"], &joined);
    done("dataset", &["--merge"], &joined);
    assert!(files(&joined) == files(&whole));
    let images = names(&whole)
        .into_iter()
        .filter(|name| name.ends_with(".png"));
    assert_eq!(images.count(), 4);
}

#[test]
fn a_killed_run_goes_on_and_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    let arguments = [&SMALL[..], &["--count", "150", "--jobs", "1"]].concat();
    let mut child = program("dataset")
        .args(&arguments)
        .args(["--out", text(&killed)])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("a program that starts");
    let lines = || {
        let metadata = std::fs::read(killed.join("metadata.jsonl")).unwrap_or_default();
        metadata.iter().filter(|&&byte| byte == b'\n').count()
    };
    while lines() < 5 && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("a kill");
    child.wait().expect("an end");
    let made = lines();
    assert!((5..150).contains(&made), "killed after {made} images");
    let printed = done("dataset", &arguments, &killed);
    assert!(printed.starts_with("150 images"), "{printed}");
    assert!(!printed.contains("150 of them"), "began anew: {printed}");
    done("dataset", &arguments, &whole);
    assert!(files(&killed) == files(&whole));
}

#[test]
fn a_broken_line_or_another_set_is_named_and_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("set");
    make(&["--count", "3"], &out);
    let same = [&SMALL[..], &["--count", "3"]].concat();
    let other = [&SMALL[..], &["--count", "4"]].concat();
    refused_into(
        "dataset",
        &other,
        &["dataset.json", "another recipe, seed, count"],
        &out,
    );
    let metadata = out.join("metadata.jsonl");
    let good = std::fs::read_to_string(&metadata).expect("lines");
    let second = good.lines().nth(1).expect("a second line");
    std::fs::write(&metadata, good.replace(second, r#"{"file_name": 3}"#)).expect("a file");
    refused_into("dataset", &same, &["metadata.jsonl, line 2"], &out);
    let data = ["patches", "--data", text(&out)];
    refused_by("train wake-model", &data, &["metadata.jsonl, line 2"]);
}

/// A second process on the same folder is refused by name, and takes nothing from the first.
#[test]
fn two_processes_do_not_share_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let [whole, shared] = ["whole", "shared"].map(|name| folder.path().join(name));
    let arguments = [&SMALL[..], &["--count", "60", "--jobs", "1"]].concat();
    let mut first = program("dataset")
        .args(&arguments)
        .args(["--out", text(&shared)])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("a program that starts");
    while !shared.join("metadata.jsonl").exists() {
        assert!(first.try_wait().expect("a child").is_none(), "ended early");
        std::thread::sleep(Duration::from_millis(1));
    }
    let output = super::run(
        "dataset",
        &[&arguments[..], &["--out", text(&shared)]].concat(),
    );
    let message = String::from_utf8(output.stderr).expect("Unicode");
    if first.try_wait().expect("a child").is_none() {
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("another process"), "{message}");
    }
    assert!(first.wait().expect("an end").success());
    done("dataset", &arguments, &whole);
    assert!(files(&shared) == files(&whole));
}

/// Starts `wake dataset` again and again into a folder, and kills it after 2 to 62 ms and `longer` \[ms\].
pub(super) fn killed_often(arguments: &[&str], folder: &Path, kills: u64, longer: u64) {
    for k in 0..kills {
        let mut child = program("dataset")
            .args(arguments)
            .args(["--out", text(folder)])
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("a program that starts");
        std::thread::sleep(Duration::from_millis(longer + 2 + k * 7919 % 60));
        // It may have ended.
        let _ = child.kill();
        child.wait().expect("an end");
    }
}

/// Killed at random moments again and again, and run again when it is complete, a set of any recipe ends with the bytes of
/// one run.
#[test]
fn many_kills_change_no_byte() {
    let quick_look = ["--set", "draw.quick_look.gain=[0.1,0.4]"];
    for (grid, more) in [
        ("ranges", &[][..]),
        ("paper", &[]),
        ("detector", &[]),
        ("model", &[]),
        ("ranges", &quick_look),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
        let count = ["--grid", grid, "--count", "40", "--jobs", "2"];
        let arguments = [&SMALL[..], &count, more].concat();
        killed_often(&arguments, &killed, 12, 0);
        done("dataset", &arguments, &killed);
        let printed = done("dataset", &arguments, &killed);
        assert!(printed.contains(", 0 of them made"), "{grid}: {printed}");
        done("dataset", &arguments, &whole);
        assert!(files(&killed) == files(&whole), "{grid} {more:?}");
    }
}

/// Damage to an image or a line ends a run and a training with the name of the file, and nothing is changed.
#[test]
fn damage_is_named_and_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("set");
    let arguments = [&SMALL[..], &["--grid", "detector", "--count", "4"]].concat();
    done("dataset", &arguments, &out);
    let (image, lines) = (out.join("images/000002.png"), out.join("metadata.jsonl"));
    let (whole, text_of_lines) = (files(&out), std::fs::read(&lines).expect("lines"));
    std::fs::copy(out.join("images/000001.png"), &image).expect("a copy");
    let words = [
        "images/000002.png",
        "line 3 of metadata.jsonl",
        "remove the file",
    ];
    refused_into("dataset", &arguments, &words, &out);
    let data = ["patches", "--data", text(&out)];
    std::fs::remove_file(&image).expect("an image");
    done("dataset", &arguments, &out);
    assert!(files(&out) == whole);
    let mut changed = text_of_lines;
    let at = changed.len() / 2;
    changed[at] ^= 1;
    std::fs::write(&lines, changed).expect("a file");
    refused_into("dataset", &arguments, &["metadata.jsonl, line "], &out);
    refused_by("train wake-model", &data, &["metadata.jsonl, line "]);
}

/// A set is the same with a card and shards beside it, and its shards are all written or refused.
#[test]
fn a_card_and_shards_stand_beside_a_set() {
    let folder = tempfile::tempdir().expect("a folder");
    let [plain, carded, shards] =
        ["plain", "carded", "shards"].map(|name| folder.path().join(name));
    make(&["--count", "4"], &plain);
    let arguments = [
        "--count",
        "4",
        "--card",
        "--webdataset",
        text(&shards),
        "--per-tar",
        "2",
    ];
    make(&arguments, &carded);
    let mut found = files(&carded);
    let card = found
        .remove(Path::new("README.md"))
        .flatten()
        .expect("a card");
    let card = String::from_utf8(card).expect("Unicode");
    assert!(card.starts_with("---\nlicense: cc0-1.0\n"), "{card}");
    assert!(found == files(&plain));
    let expected = ["README.md", "train-000000.tar", "train-000001.tar"];
    let names: Vec<String> = names(&shards)
        .into_iter()
        .filter(|name| !name.starts_with("val"))
        .collect();
    assert_eq!(names, expected);
    let again = [&SMALL[..], &arguments].concat();
    refused_into(
        "dataset",
        &again,
        &["shards", "already has tar files"],
        &carded,
    );
}
