//! `detector`: what it refuses, what it prints, and a run that goes on.

use std::path::{Path, PathBuf};

use image::{GrayImage, ImageBuffer, Luma};
use serde_json::Value;

use super::{done, files, names, refused_by, text};

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
        "detector",
        &[&["detect", "--json"], arguments].concat(),
        &folder.join("out"),
    );
    serde_json::from_str(&printed).expect("JSON and nothing else")
}

#[test]
fn bad_images_and_options_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    refused_by(
        "detector",
        &["detect", "no/such/image.png"],
        &["no/such/image.png", "PNG"],
    );
    let corrupt = folder.path().join("corrupt.png");
    std::fs::write(&corrupt, b"\x89PNG\r\n\x1a\n and then nothing").expect("a file");
    refused_by(
        "detector",
        &["detect", text(&corrupt)],
        &["corrupt.png", "PNG"],
    );
    let long = folder.path().join("long.png");
    std::fs::File::create(&long)
        .and_then(|file| file.set_len(2_100_000_000))
        .expect("a file");
    refused_by(
        "detector",
        &["detect", text(&long)],
        &["long.png", "2100000000 bytes", "cut"],
    );
    std::fs::remove_file(&long).expect("the file");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).expect("a folder");
    refused_by("detector", &["detect", text(&empty)], &["empty", "PNG"]);
    let image = eight_bits(&folder.path().join("a.png"), 64);
    refused_by(
        "detector",
        &["detect", text(&image), "--spacing", "0.1"],
        &["spacing", "0.1", "0.5 to 100 m"],
    );
    refused_by(
        "detector",
        &["detect", text(&image), "--weights", "no/weights"],
        &["no/weights"],
    );
    refused_by(
        "detector",
        &["evaluate", "--real", "no/tiles"],
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
    assert_eq!(drawn, ["eight.wakes.png", "sixteen.wakes.png"]);
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
    let train = [
        "train", "--images", "32", "--recipe", "painted", "--every", "1",
    ];
    done("detector", &train, &out);
    let whole = files(&out);
    // As if the run had been killed after its first step.
    std::fs::remove_dir_all(out.join("checkpoints/step-00000002")).expect("the last checkpoint");
    std::fs::remove_file(out.join("detector.safetensors")).expect("weights");
    done("detector", &train, &out);
    let again = files(&out);
    let weights = Path::new("detector.safetensors");
    assert!(whole[weights].is_some() && whole[weights] == again[weights]);
    let log = std::fs::read_to_string(out.join("train.jsonl")).expect("a log");
    assert_eq!(log.lines().count(), 2, "{log}");
    // The new weights can be used.
    let image = eight_bits(&folder.path().join("a.png"), 100);
    let weights = out.join(weights);
    detections(folder.path(), &[text(&image), "--weights", text(&weights)]);
}
