//! `wake train sea`, and `wake generate`, `wake dataset` and `wake evaluate` on what it learnt.

use std::path::{Path, PathBuf};

use super::{dataset, done, files, refused_by, refused_into, text};

/// Two images of 8 and 16 bits, 200 pixels wide, of a rough sea with a bright target and a mask.
fn images(folder: &Path) -> PathBuf {
    let folder = folder.join("images");
    std::fs::create_dir(&folder).expect("a folder");
    let grey = |x: u32, y: u32| 60 + ((x * 7919 + y * 104_729 + x * y * 31) % 37) as u8;
    let mut small = image::GrayImage::from_fn(200, 140, |x, y| image::Luma([grey(x, y)]));
    small.put_pixel(2, 2, image::Luma([255]));
    small.save(folder.join("a.png")).expect("an image");
    let mask = image::GrayImage::from_fn(200, 140, |x, _| image::Luma([u8::from(x > 190)]));
    mask.save(folder.join("a_mask.png")).expect("a mask");
    let deep = image::ImageBuffer::from_fn(200, 140, |x, y| {
        image::Luma([150 * u16::from(grey(x + 9, y))])
    });
    deep.save(folder.join("b.tif")).expect("an image");
    folder
}

const SHORT: [&str; 4] = ["--batch", "2", "--every", "1"];

/// Stopped and resumed, a run writes what one in one go does; scenes are drawn on it, with the labels that they ever have.
#[test]
fn a_sea_is_learnt_resumed_and_drawn_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = images(folder.path());
    let out = |name: &str| folder.path().join(name);
    let train = |more: &[&str], out: &Path| {
        let common = ["sea", "--images", text(&images), "--spacing", "4"];
        done("train", &[&common[..], &SHORT, more].concat(), out)
    };
    train(&["--steps", "2"], &out("whole"));
    // Sizes of steps depend on how many there shall be: the last is begun anew as a kill leaves it.
    let killed = out("killed");
    train(&["--steps", "2"], &killed);
    let checkpoints = killed.join("checkpoints/sea");
    std::fs::remove_dir_all(checkpoints.join("step-00000002")).expect("a checkpoint");
    std::fs::write(killed.join("sea.safetensors"), "old").expect("a file");
    train(&["--steps", "2", "--resume"], &killed);
    let read = |out: &Path| std::fs::read(out.join("sea.safetensors")).expect("weights");
    assert!(read(&killed) == read(&out("whole")));
    assert!(killed.join("sea.png").is_file() && killed.join("sea.jsonl").is_file());
    let again = ["sea", "--images", text(&images), "--spacing", "4"];
    refused_into(
        "train",
        &[&again[..], &SHORT].concat(),
        &["stage sea has made 2 steps", "resume this one"],
        &killed,
    );
    let weights = killed.join("sea.safetensors");
    let sea = ["--sea", text(&weights)];
    done("generate", &["--seed", "3"], &out("plain"));
    done(
        "generate",
        &[&sea[..], &["--seed", "3"]].concat(),
        &out("drawn"),
    );
    let file = |place: &str| std::fs::read(folder.path().join(place)).expect(place);
    assert!(file("plain/labels.json") == file("drawn/labels.json"));
    assert!(file("plain/image.png") != file("drawn/image.png"));
    let size = [
        "--count",
        "2",
        "--set",
        "scene.grid.rows=48",
        "--set",
        "scene.grid.columns=48",
    ];
    done("dataset", &size, &out("set"));
    done("dataset", &[&sea[..], &size].concat(), &out("sea"));
    assert!(file("set/coco.json") == file("sea/coco.json"));
    assert!(file("set/images/000001.png") != file("sea/images/000001.png"));
    // Killed and continued, and run again when it is complete.
    let killed = out("killed-sea");
    let arguments = [&sea[..], &size].concat();
    dataset::killed_often(&arguments, &killed, 6, 150);
    for _ in 0..2 {
        done("dataset", &arguments, &killed);
        assert!(files(&killed) == files(&out("sea")));
    }
    // A set of one sea is no set of another.
    refused_into(
        "dataset",
        &size,
        &["dataset.json", "another recipe"],
        &out("sea"),
    );
    let coarse = [&sea[..], &size, &["--set", "scene.grid.spacing=10"]].concat();
    refused_by("dataset", &coarse, &["grid.spacing", "10 m", "4 m"]);
}

#[test]
fn what_is_no_sea_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = images(folder.path());
    let images = text(&images);
    refused_by("train", &["sea", "--images", "no/such"], &["no/such"]);
    refused_by("train", &["sea", "--images", "docs"], &["docs", "PNG"]);
    let given =
        |more: &[&'static str]| -> Vec<&str> { [&["sea", "--images", images], more].concat() };
    refused_by(
        "train",
        &given(&["--resume"]),
        &["resume is on", "no checkpoint"],
    );
    refused_by("train", &given(&["--rate=nan"]), &["rate is", "outside"]);
    refused_by("train", &given(&["--spacing=0"]), &["spacing is 0", "0.1"]);
    refused_by(
        "train",
        &given(&["--half", "left"]),
        &["open sea", "128 x 128"],
    );
    let reader = "crates/wake-ldm/assets/parser.safetensors";
    for (name, words) in [
        (reader, ["parser.safetensors", "does not fit"]),
        ("no/sea", ["no/sea", "cannot read"]),
    ] {
        refused_by("generate", &["--sea", name], &words);
        refused_by("dataset", &["--sea", name, "--count", "1"], &words);
        refused_by(
            "evaluate",
            &["sea", "--real", images, "--weights", name],
            &words,
        );
    }
    refused_by(
        "generate",
        &["--sea", reader, "--steps", "2"],
        &["--sea", "--steps"],
    );
    let other = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/fixtures/pipeline_a"
    );
    let layout = ["--weights", other, "--sea", reader];
    refused_by("generate", &layout, &["--sea", "wake model"]);
    assert_eq!(files(folder.path()).len(), 4);
}

/// Two images whose two halves have two windows of open sea each.
fn open_seas(folder: &Path) -> PathBuf {
    let folder = folder.join("seas");
    std::fs::create_dir(&folder).expect("a folder");
    for (name, step) in [("a.png", 7919), ("b.png", 7907)] {
        let grey = |x: u32, y: u32| {
            let bits = (x * step) ^ (y * 104_729) ^ (x * y * 31);
            100 + (bits.wrapping_mul(2_654_435_761) >> 27) as u8
        };
        let image = image::GrayImage::from_fn(264, 264, |x, y| image::Luma([grey(x, y)]));
        image.save(folder.join(name)).expect("an image");
    }
    folder
}

/// Simulated seas beside open water of images, by groups of features and by a network.
#[test]
fn simulated_seas_are_told_from_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let seas = open_seas(folder.path());
    let out = folder.path().join("out");
    let arguments = ["sea", "--real", text(&seas), "--recipe", "satellites"];
    done("evaluate", &arguments, &out);
    let report = std::fs::read(out.join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!(report["open_images"], 2);
    // A simulated sea is correlated, these images are not.
    let told = &report["recipes"][0]["network"]["accuracy"];
    assert!(told.as_f64().is_some_and(|told| told > 0.9), "{report}");
    assert_eq!(super::names(&out), ["report.json", "report.md"]);
}
