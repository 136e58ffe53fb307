//! `wake detect`, `wake train detector` and `wake evaluate detector`: what it refuses, what it prints, and a run that goes on.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use image::{GrayImage, ImageBuffer, Luma};
use serde_json::Value;

use super::{done, files, names, program, refused_by, refused_into, text};

/// A dark line of 300 pixels toward the right on noise, begun by a bright spot, in grey from 0 to 1.
fn wake(size: u32) -> impl Fn(u32, u32) -> f32 {
    // A small generator: sums of four uniform numbers are near normal.
    let noise = move |x: u32, y: u32| {
        let mut state = u64::from(y * size + x)
            .wrapping_add(1)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mut sum = 0.0;
        for _ in 0..4 {
            state = (state ^ (state >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            state ^= state >> 31;
            sum += (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5;
        }
        sum * 1.73
    };
    move |x, y| {
        let (right, down) = (x as f32 - 0.3 * size as f32, y as f32 - 0.5 * size as f32);
        let dark = match right > 0.0 && right < 300.0 {
            true => -0.13 * (-0.5 * (down / 4.0).powi(2)).exp() * (-right / 250.0).exp(),
            false => 0.0,
        };
        let ship = (-0.5 * ((right + 14.0).powi(2) / 20.0 + down.powi(2) / 6.0)).exp();
        (0.3 + 0.06 * noise(x, y) + dark + 2.0 * ship).clamp(0.0, 1.0)
    }
}

fn eight_bits(path: &Path, size: u32) -> PathBuf {
    let grey = wake(size);
    let image = GrayImage::from_fn(size, size, |x, y| Luma([(255.0 * grey(x, y)) as u8]));
    image.save(path).expect("a file");
    path.to_owned()
}

fn detections(folder: &Path, arguments: &[&str]) -> Value {
    let printed = done(
        "detect",
        &[&["--json"], arguments].concat(),
        &folder.join("out"),
    );
    serde_json::from_str(&printed).expect("JSON and nothing else")
}

#[test]
fn bad_images_and_options_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    refused_by(
        "detect",
        &["no/such/image.png"],
        &["no/such/image.png", "PNG"],
    );
    let corrupt = folder.path().join("corrupt.png");
    std::fs::write(&corrupt, b"\x89PNG\r\n\x1a\n and then nothing").expect("a file");
    refused_by("detect", &[text(&corrupt)], &["corrupt.png", "PNG"]);
    let long = folder.path().join("long.png");
    std::fs::File::create(&long)
        .and_then(|file| file.set_len(2_100_000_000))
        .expect("a file");
    refused_by(
        "detect",
        &[text(&long)],
        &["long.png", "2100000000 bytes", "cut"],
    );
    std::fs::remove_file(&long).expect("the file");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).expect("a folder");
    refused_by("detect", &[text(&empty)], &["empty", "PNG"]);
    let image = eight_bits(&folder.path().join("a.png"), 64);
    refused_by(
        "detect",
        &[text(&image), "--spacing", "0.1"],
        &["spacing", "0.1", "0.5 to 100 m"],
    );
    refused_by(
        "detect",
        &[text(&image), "--weights", "no/weights"],
        &["no/weights"],
    );
    for (options, words) in [
        (
            ["--geojson", "a.geojson"],
            ["--geojson", "product", "leave it out"],
        ),
        (["--coast", "500"], ["--coast", "product", "leave it out"]),
        (
            ["--polarization", "VV"],
            ["--polarization", "product", "leave it out"],
        ),
    ] {
        let arguments = [&[text(&image)][..], &options].concat();
        refused_by("detect", &arguments, &words);
    }
    for (option, value) in [
        ("--spacing", "10"),
        ("--least-score", "0.5"),
        ("--weights", "file"),
    ] {
        let arguments = [text(&image), "--method", "radon", option, value];
        refused_by(
            "detect",
            &arguments,
            &[option, "network", "leave it out with --method radon"],
        );
    }
    refused_by(
        "evaluate",
        &["detector", "--real", "no/tiles"],
        &["no/tiles", "labels.json"],
    );
}

/// The wake is told in the promised form, in eight bits as in sixteen, and drawn.
#[test]
fn a_wake_is_found_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let size = 500;
    let eight = eight_bits(&folder.path().join("eight.png"), size);
    let sixteen = folder.path().join("sixteen.png");
    let grey = wake(size);
    // Sixteen bits of another scaling.
    let deep = ImageBuffer::from_fn(size, size, |x, y| Luma([(9000.0 * grey(x, y)) as u16 + 40]));
    deep.save(&sixteen).expect("a file");
    for method in ["network", "radon"] {
        let told = detections(
            folder.path(),
            &[text(&eight), text(&sixteen), "--method", method],
        );
        for name in ["eight.png", "sixteen.png"] {
            let first = &told["images"][name][0];
            let number = |value: &Value| value.as_f64().expect("a number");
            let (column, row) = (number(&first["tip"][0]), number(&first["tip"][1]));
            // As the ray rule has it.
            assert!(
                (number(&first["axis_deg"]) - 90.0).abs() < 10.0,
                "{method}, {name}: {first}"
            );
            assert!(
                (column - 150.0).hypot(row - 250.0) < 60.0,
                "{method}, {name}: {first}"
            );
            assert!(number(&first["length_px"]) > 30.0 && number(&first["half_angle_deg"]) >= 0.0);
            assert_eq!(first["oriented_box"].as_array().map(Vec::len), Some(4));
        }
    }
    let drawn = names(&folder.path().join("out"));
    assert_eq!(drawn, ["eight.png.wakes.png", "sixteen.png.wakes.png"]);
}

/// Images with nothing in them are searched without a word of complaint, and nothing is found.
#[test]
fn flat_tiny_narrow_and_half_saturated_images_are_searched() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = folder.path().join("images");
    std::fs::create_dir(&images).expect("a folder");
    let save = |name: &str, width: u32, height: u32, grey: &dyn Fn(u32, u32) -> u8| {
        let image = GrayImage::from_fn(width, height, |x, y| Luma([grey(x, y)]));
        image.save(images.join(name)).expect("a file");
    };
    let noise = wake(4096);
    save("flat.png", 300, 200, &|_, _| 99);
    save("one.png", 1, 1, &|_, _| 3);
    save("narrow.png", 17, 4000, &|x, y| (255.0 * noise(x, y)) as u8);
    save("half.png", 400, 400, &|x, y| {
        if x < 200 {
            255
        } else {
            (255.0 * noise(x, y)) as u8
        }
    });
    for method in ["network", "radon"] {
        let told = detections(folder.path(), &[text(&images), "--method", method]);
        for name in ["flat.png", "one.png", "narrow.png", "half.png"] {
            let found = told["images"][name].as_array().expect("a list");
            let sure = found
                .iter()
                .filter(|one| one["score"].as_f64().is_some_and(|score| score > 0.5));
            if method == "network" {
                assert_eq!(sure.count(), 0, "{name}: {found:?}");
            }
            assert!(
                name != "flat.png" && name != "one.png" || found.is_empty(),
                "{method}, {name}: {found:?}"
            );
        }
    }
}

/// Two steps, killed in a way that leaves a checkpoint, and two more: the same as four at once.
#[test]
fn a_training_run_goes_on_where_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let train = |more: &[&str]| {
        let train = [
            "detector", "--steps", "2", "--recipe", "painted", "--every", "1",
        ];
        done("train", &[&train, more].concat(), &out);
    };
    train(&[]);
    let whole = files(&out);
    // As if the run had been killed after its first step.
    let last = out.join("checkpoints/detector/step-00000002");
    std::fs::remove_dir_all(last).expect("the last checkpoint");
    std::fs::remove_file(out.join("detector.safetensors")).expect("weights");
    train(&["--resume"]);
    let again = files(&out);
    let weights = Path::new("detector.safetensors");
    assert!(whole[weights].is_some() && whole[weights] == again[weights]);
    let log = std::fs::read_to_string(out.join("detector.jsonl")).expect("a log");
    assert_eq!(log.lines().count(), 2, "{log}");
    // The new weights can be used.
    let image = eight_bits(&folder.path().join("a.png"), 100);
    let weights = out.join(weights);
    detections(folder.path(), &[text(&image), "--weights", text(&weights)]);
}

/// A step on the training pairs of a data set; the run of another set is not gone on with.
#[test]
fn a_data_set_is_trained_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let sets = ["3", "4"].map(|seed| {
        let set = folder.path().join(seed);
        done(
            "dataset",
            &["--count", "2", "--val-share", "0", "--seed", seed],
            &set,
        );
        set
    });
    let out = folder.path().join("run");
    let step = |data: &Path, steps: &'static str| {
        let data = text(data).to_owned();
        [
            "detector", "--data", &data, "--batch", "2", "--steps", steps, "--every", "1",
        ]
        .map(str::to_owned)
    };
    let one = step(&sets[0], "1");
    done("train", &one.each_ref().map(String::as_str), &out);
    assert!(out.join("detector.safetensors").is_file());
    let run = std::fs::read_to_string(out.join("run.json")).expect("a run");
    assert!(
        run.contains("\"pairs\":2") || run.contains("\"pairs\": 2"),
        "{run}"
    );
    let other = step(&sets[1], "2");
    let other = [&other.each_ref().map(String::as_str)[..], &["--resume"]].concat();
    refused_into("train", &other, &["set.seed", "3", "4"], &out);
    // A set and a recipe at once, and images of another size.
    let both = ["detector", "--data", "set", "--recipe", "painted"];
    refused_by("train", &both, &["--data", "--recipe"]);
    let small = folder.path().join("small");
    let pixels = ["--set", "scene.grid.rows=64"];
    done(
        "dataset",
        &[&["--count", "1", "--val-share", "0"], &pixels[..]].concat(),
        &small,
    );
    refused_by(
        "train",
        &["detector", "--data", text(&small)],
        &["grid.rows", "64", "256"],
    );
}

/// A few labelled images: a network is trained without two of three, and evaluated on images that it has not seen.
#[test]
fn labelled_images_are_trained_on_and_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("real")).expect("a folder");
    let names = ["a.png", "b.png", "c.png"];
    let mut images = Vec::new();
    for (name, grey) in names.iter().zip([90u8, 100, 110]) {
        let line = |x: u32, y: u32| {
            if x.abs_diff(y) < 4 {
                30
            } else {
                grey + ((x * y) % 23) as u8
            }
        };
        let image = GrayImage::from_fn(256, 256, |x, y| Luma([line(x, y)]));
        image.save(at("real").join(name)).expect("an image");
        images.push(format!(
            r#""{name}": {{"width": 256, "height": 256, "wakes": [
                {{"tip": [20, 20], "axis_deg": 135, "length_px": 300, "confidence": "clear"}}]}}"#
        ));
    }
    let labels = format!(r#"{{"images": {{{}}}}}"#, images.join(", "));
    std::fs::write(at("real/labels.json"), labels).expect("labels");
    // Without open sea there are no classifiers to train.
    for name in ["a", "b", "c"] {
        let mask = GrayImage::from_pixel(256, 256, Luma([255]));
        let path = at("real").join(format!("{name}_mask.png"));
        mask.save(path).expect("a mask");
    }
    let real = at("real");
    let train = [
        "detector",
        "--labelled",
        text(&real),
        "--without",
        "a.png,c.png",
        "--batch",
        "2",
        "--steps",
        "1",
        "--every",
        "1",
    ];
    done("train", &train, &at("run"));
    let run = std::fs::read_to_string(at("run/run.json")).expect("a run");
    assert!(
        run.contains("a.png") && run.contains("c.png") && !run.contains("b.png"),
        "{run}"
    );
    let beside = [&train[..], &["--recipe", "painted", "--distinct", "16"]].concat();
    done("train", &beside, &at("both"));
    let both = std::fs::read_to_string(at("both/run.json")).expect("a run");
    assert!(
        both.contains("a.png") && both.contains("painted") && !run.contains("painted"),
        "{both}"
    );
    for name in ["a", "b", "c"] {
        std::fs::create_dir_all(at("left_out").join(name)).expect("a folder");
        let weights = at("left_out").join(name).join("detector.safetensors");
        std::fs::copy(at("run/detector.safetensors"), weights).expect("a copy");
    }
    let rows = format!("few={}", text(&at("left_out")));
    let evaluate = [
        "detector",
        "--images",
        "1",
        "--real",
        text(&real),
        "--left-out",
        &rows,
    ];
    let printed = done("evaluate", &evaluate, &at("report"));
    assert!(
        printed.contains("| real, clear wakes | 3 | 3 | few |"),
        "{printed}"
    );
    assert!(
        printed.contains("--left-out NAME=DIR") && printed.contains("- few: each tile"),
        "{printed}"
    );
    // One simulated image may hold no wake.
    assert!(!printed.contains("NaN"), "{printed}");
    std::fs::remove_file(at("left_out/b/detector.safetensors")).expect("a file less");
    refused_by("evaluate", &evaluate, &["left_out/b/detector.safetensors"]);
}

/// Runs the program in a folder, with its standard output somewhere else.
fn inside(folder: &Path, arguments: &[&str], stdout: Stdio) -> Output {
    let child = program("")
        .args(arguments)
        .current_dir(folder)
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .expect("a program that starts");
    child.wait_with_output().expect("an end")
}

/// Every subcommand of the detector, in a folder that holds `a.png`.
const PRINTING: [&[&str]; 4] = [
    &["detect", "a.png", "--out", "out"],
    &["detect", "a.png", "--json", "--out", "out"],
    &["evaluate", "detector", "--images", "1", "--out", "out"],
    &[
        "train", "detector", "--steps", "1", "--recipe", "painted", "--out", "run",
    ],
];

/// The reader of a pipe leaves: the work is done all the same, and ends well.
#[test]
fn a_closed_pipe_is_no_error_for_any_subcommand() {
    let folder = tempfile::tempdir().expect("a folder");
    eight_bits(&folder.path().join("a.png"), 64);
    for arguments in PRINTING {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = inside(folder.path(), arguments, writer.into());
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {message}");
        assert_eq!(message, "", "{arguments:?}");
    }
    for written in [
        "out/a.png.wakes.png",
        "out/report.md",
        "run/detector.safetensors",
    ] {
        assert!(folder.path().join(written).is_file(), "no {written}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_one_sentence_for_every_subcommand() {
    let folder = tempfile::tempdir().expect("a folder");
    eight_bits(&folder.path().join("a.png"), 64);
    for arguments in PRINTING {
        let full = std::fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("a full device");
        let output = inside(folder.path(), arguments, full.into());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
        assert!(
            message.contains("standard output") && message.lines().count() == 1,
            "{arguments:?}: {message}"
        );
    }
    // What was computed lies there all the same.
    assert!(folder.path().join("out/report.md").is_file());
}

/// Names that differ in their ending alone, or only in bytes that are no UTF-8, each have results of their own.
#[test]
fn every_image_of_a_folder_has_its_own_picture_and_its_own_entry() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = folder.path().join("images");
    std::fs::create_dir(&images).expect("a folder");
    let first = eight_bits(&images.join("a.png"), 64);
    for name in odd_names() {
        std::fs::copy(&first, images.join(name)).expect("a copy");
    }
    let told = detections(folder.path(), &[text(&images)]);
    let told: Vec<&String> = told["images"].as_object().expect("images").keys().collect();
    let drawn = files(&folder.path().join("out"));
    let count = 1 + odd_names().len();
    assert_eq!(
        (told.len(), drawn.len()),
        (count, count),
        "{told:?} {drawn:?}"
    );
    assert!(told.iter().any(|name| *name == "a.tif"), "{told:?}");
    #[cfg(unix)]
    assert!(told.iter().any(|name| *name == r"b\xFF.png"), "{told:?}");
}

#[cfg(unix)]
fn odd_names() -> Vec<std::ffi::OsString> {
    use std::os::unix::ffi::OsStringExt;
    let names = [&b"a.tif"[..], b"b\xFF.png", b"b\xFE.png", b"b\xC3\x28.png"];
    names
        .map(|name| std::ffi::OsString::from_vec(name.to_vec()))
        .into()
}

#[cfg(not(unix))]
fn odd_names() -> Vec<std::ffi::OsString> {
    vec!["a.tif".into()]
}

/// Files that cannot be read are named with their reasons; the others are searched.
#[test]
fn broken_images_of_a_folder_are_told_and_the_others_are_searched() {
    let folder = tempfile::tempdir().expect("a folder");
    let images = folder.path().join("images");
    std::fs::create_dir_all(images.join("folder.png")).expect("a folder");
    for name in ["a.png", "c.png"] {
        eight_bits(&images.join(name), 64);
    }
    std::fs::write(images.join("b.png"), "no image").expect("a file");
    #[cfg(unix)]
    {
        let made = Command::new("mkfifo").arg(images.join("d.tif")).status();
        assert!(made.expect("mkfifo").success());
    }
    let broken = if cfg!(unix) {
        vec!["b.png", "d.tif"]
    } else {
        vec!["b.png"]
    };
    let output = inside(
        folder.path(),
        &["detect", "images", "--json", "--out", "out"],
        Stdio::piped(),
    );
    let message = String::from_utf8(output.stderr).expect("Unicode");
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert_eq!(message.lines().count(), broken.len() + 1, "{message}");
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let keys =
        |part: &str| -> Vec<&String> { told[part].as_object().expect("names").keys().collect() };
    assert_eq!(keys("images"), ["a.png", "c.png"]);
    assert_eq!(keys("unread"), broken);
    for name in broken {
        assert!(message.contains(name), "no {name} in {message}");
    }
    let drawn = names(&folder.path().join("out"));
    assert_eq!(drawn, ["a.png.wakes.png", "c.png.wakes.png"]);
    // Nothing that can be read: no results and no folder.
    for name in ["a.png", "c.png"] {
        std::fs::write(images.join(name), "").expect("a file");
    }
    let output = inside(
        folder.path(),
        &["detect", "images", "--out", "none"],
        Stdio::piped(),
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty() && !folder.path().join("none").exists());
}

/// With `--out` in the searched folder a second run searches what the first did.
#[test]
fn pictures_of_wakes_are_not_searched_again() {
    let folder = tempfile::tempdir().expect("a folder");
    eight_bits(&folder.path().join("a.png"), 64);
    let run = || {
        let output = inside(
            folder.path(),
            &["detect", ".", "--json", "--out", "."],
            Stdio::piped(),
        );
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{message}");
        output.stdout
    };
    assert_eq!(run(), run());
    assert_eq!(names(folder.path()), ["a.png", "a.png.wakes.png"]);
}

/// Weights of equal numbers find nothing in any image: they are refused instead of telling so.
#[test]
fn weights_that_find_nothing_anywhere_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = eight_bits(&folder.path().join("a.png"), 64);
    let shipped =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../wake-detector/assets/detector.safetensors");
    let bytes = std::fs::read(shipped).expect("weights");
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().expect("a length")) as usize;
    let weights = folder.path().join("weights.safetensors");
    // 60,000, 0.01 and 0 in 16 bits.
    for number in [0x7B53_u16, 0x211F, 0] {
        let mut bytes = bytes.clone();
        for value in bytes[header..].chunks_exact_mut(2) {
            value.copy_from_slice(&number.to_le_bytes());
        }
        std::fs::write(&weights, bytes).expect("a file");
        let words = ["weights.safetensors", "obvious wake", "train"];
        refused_by(
            "detect",
            &[text(&image), "--weights", text(&weights)],
            &words,
        );
        refused_by("train", &["detector", "--weights", text(&weights)], &words);
    }
}
