//! `train`: what it refuses, and every stage on toys, through to a generated image.

use std::path::Path;

use super::{done, files, refused_by, text};

/// Data of 64 × 64 pixels, and a model that fits it, in a folder.
fn toys(folder: &Path) {
    let set = folder.join("set");
    let size = [
        "--set",
        "scene.grid.rows=64",
        "--set",
        "scene.grid.columns=64",
    ];
    done(
        "make_dataset",
        &[&size[..], &["--count", "10"]].concat(),
        &set,
    );
    let vocabulary: Vec<u32> = (0..40).collect();
    let config = serde_json::json!({
        "image_size": 64, "spacing": 4.0, "latent_channels": 4, "fold": 2, "widths": [16, 32],
        "attention": [false, true], "text_width": 16, "prior_width": 16, "map_channels": 8,
        "norm_groups": 8, "vocabulary": vocabulary,
    });
    std::fs::write(folder.join("model.json"), config.to_string()).expect("a file");
}

#[test]
fn wrong_data_devices_and_folders_are_named() {
    let data = ["autoencoder", "--data", "no/such/folder"];
    refused_by("train", &data, &["no/such/folder", "make_dataset"]);
    let device = ["autoencoder", "--device", "tpu"];
    refused_by("train", &device, &["tpu", "flex"]);
    for stage in ["words", "mean", "diffusion"] {
        refused_by(
            "train",
            &[stage, "--resume"],
            &["--resume", "no checkpoint"],
        );
    }
    let weights = [
        "fine-tune",
        "--weights",
        "no/such/model",
        "--data",
        "no/such/folder",
    ];
    refused_by("train", &weights, &["no/such/folder"]);
}

#[test]
fn the_stages_make_a_model_that_generates_and_a_stopped_run_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    toys(folder.path());
    let (set, config) = (folder.path().join("set"), folder.path().join("model.json"));
    let out = folder.path().join("run");
    let train = |arguments: &[&str]| {
        let common = [
            "--data",
            text(&set),
            "--config",
            text(&config),
            "--batch",
            "2",
        ];
        done("train", &[arguments, &common].concat(), &out)
    };
    train(&["words", "--steps", "2"]);
    train(&["mean", "--steps", "2"]);
    train(&["diffusion", "--steps", "2"]);
    train(&["diffusion", "--steps", "3", "--resume"]);
    let log = std::fs::read_to_string(out.join("diffusion.jsonl")).expect("a log");
    assert_eq!(log.lines().count(), 3, "{log}");
    let images = folder.path().join("images");
    done(
        "generate",
        &["--weights", text(&out), "--steps", "1"],
        &images,
    );
    assert!(images.join("image.png").is_file());
}

#[test]
fn a_model_in_diffusers_layout_is_fine_tuned_whole_and_by_low_rank_changes() {
    let folder = tempfile::tempdir().expect("a folder");
    toys(folder.path());
    let weights = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/pipeline_a");
    let set = folder.path().join("set");
    for (name, rank) in [("whole", None), ("changes", Some("2"))] {
        let out = folder.path().join(name);
        // Two steps, then two more from the checkpoint.
        for more in [&["--steps", "2"][..], &["--steps", "4", "--resume"]] {
            let mut arguments = vec!["fine-tune", "--weights", weights, "--data", text(&set)];
            arguments.extend(["--batch", "2", "--rate", "1e-3"]);
            arguments.extend(more);
            arguments.extend(rank.iter().flat_map(|rank| ["--rank", *rank]));
            done("train", &arguments, &out);
        }
        let metrics = std::fs::read_to_string(out.join("fine_tune.jsonl")).expect("metrics");
        assert_eq!(metrics.lines().count(), 4);
        let written = files(&out);
        let has = |path: &str| written.contains_key(Path::new(path));
        assert!(has("unet/diffusion_pytorch_model.safetensors") && has("model_index.json"));
        assert_eq!(has("pytorch_lora_weights.safetensors"), rank.is_some());
        let drawn = folder.path().join(format!("{name}-images"));
        done(
            "generate",
            &["--weights", text(&out), "--steps", "1"],
            &drawn,
        );
    }
}
