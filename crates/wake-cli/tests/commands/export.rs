//! `wake export`: files that other programs read.

use super::{cannot_write, files, names, run, text};

/// The ten samples have inputs and maps of fitting sizes, and the file is an ONNX model with the network's weights.
#[test]
fn a_network_is_written_for_other_programs() {
    let folder = tempfile::tempdir().expect("a folder");
    let [model, samples] =
        ["detector.onnx", "samples.safetensors"].map(|name| folder.path().join(name));
    let output = run(
        "export onnx",
        &["--out", text(&model), "--samples", text(&samples)],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let bytes = std::fs::read(&model).expect("a file");
    // Field 1 of a model: the version of the representation, a number.
    assert_eq!(bytes[..2], [8, 8]);
    // 0.85 million weights of four bytes, and little more.
    assert!(
        (3_300_000..3_500_000).contains(&bytes.len()),
        "{}",
        bytes.len()
    );
    let samples = std::fs::read(&samples).expect("a file");
    let samples = safetensors::SafeTensors::deserialize(&samples).expect("tensors");
    assert_eq!(samples.len(), 20);
    for n in 0..10 {
        let shape = |name: &str| {
            samples
                .tensor(&format!("{name}.{n}"))
                .expect("a tensor")
                .shape()
                .to_vec()
        };
        let [inputs, maps] = [shape("inputs"), shape("maps")];
        assert_eq!((inputs[1], maps[1]), (2, 8));
        assert_eq!([inputs[2] / 4, inputs[3] / 4], maps[2..]);
    }
}

/// A folder for a hub has a card with a licence, and weights that the programs read again.
#[test]
fn folders_for_a_hub_hold_what_they_say() {
    let folder = tempfile::tempdir().expect("a folder");
    for (model, expected) in [
        (
            "detector",
            &["README.md", "detector.onnx", "detector.safetensors"][..],
        ),
        (
            "wake-model",
            &[
                "README.md",
                "config.json",
                "flow.safetensors",
                "parser.safetensors",
                "patches.safetensors",
                "prior.safetensors",
            ],
        ),
    ] {
        let out = folder.path().join(model);
        let output = run("export hub", &[model, "--out", text(&out)]);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert_eq!(names(&out), expected);
        let card = std::fs::read_to_string(out.join("README.md")).expect("a card");
        assert!(
            card.starts_with("---\nlicense:\n- mit\n- apache-2.0\n"),
            "{card}"
        );
        assert!(!card.contains("VERSION"), "{card}");
        for name in expected.iter().filter(|name| !name.ends_with(".md")) {
            assert!(card.contains(&format!("`{name}`")), "{name}");
        }
    }
    let weights = folder.path().join("detector/detector.safetensors");
    let image = folder.path().join("image.png");
    image::GrayImage::from_pixel(64, 64, image::Luma([90]))
        .save(&image)
        .expect("an image");
    let out = folder.path().join("found");
    let output = run(
        "detect",
        &[
            text(&image),
            "--weights",
            text(&weights),
            "--out",
            text(&out),
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let model = folder.path().join("wake-model");
    let drawn = folder.path().join("drawn");
    let output = run(
        "generate",
        &[
            "--weights",
            text(&model),
            "--count",
            "1",
            "--out",
            text(&drawn),
        ],
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(!files(&drawn).is_empty());
    cannot_write("export hub", &["detector"]);
}
