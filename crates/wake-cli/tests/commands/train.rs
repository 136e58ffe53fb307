//! `wake train`: what it refuses, and every stage on toys, through to a generated image.

use std::path::Path;

use std::process::Stdio;
use std::time::Duration;

use wake_dataset::{Recipe, Simulated};
use wake_ldm::network::{TrainingRanges, WakeModelConfig};
use wake_physics::Scene;

use super::{done, files, program, refused_by, refused_into, text};

/// Data of 64 × 64 pixels, and a model that fits it, in a folder.
fn toys(folder: &Path) {
    let set = folder.join("set");
    let size = [
        "--set",
        "scene.grid.rows=64",
        "--set",
        "scene.grid.columns=64",
    ];
    done("dataset", &[&size[..], &["--count", "10"]].concat(), &set);
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
    let data = ["patches", "--data", "no/such/folder"];
    refused_by(
        "train wake-model",
        &data,
        &["no/such/folder", "wake dataset"],
    );
    let device = ["patches", "--device", "tpu"];
    refused_by("train wake-model", &device, &["tpu", "flex"]);
    for stage in ["parser", "prior", "flow"] {
        refused_by(
            "train wake-model",
            &[stage, "--resume"],
            &["resume is on", "no checkpoint"],
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
        done("train wake-model", &[arguments, &common].concat(), &out)
    };
    train(&["parser", "--steps", "2"]);
    train(&["prior", "--steps", "2"]);
    train(&["flow", "--steps", "2"]);
    train(&["flow", "--steps", "3", "--resume"]);
    let log = std::fs::read_to_string(out.join("flow.jsonl")).expect("a log");
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
    let weights = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/fixtures/pipeline_a"
    );
    let set = folder.path().join("set");
    for (name, rank) in [("whole", None), ("changes", Some("2"))] {
        let out = folder.path().join(name);
        let fine_tune = |more: &[&str], out: &Path| {
            let mut arguments = vec!["fine-tune", "--weights", weights, "--data", text(&set)];
            arguments.extend(["--batch", "2", "--rate", "1e-3"]);
            arguments.extend(more);
            arguments.extend(rank.iter().flat_map(|rank| ["--rank", *rank]));
            done("train", &arguments, out);
        };
        // Two steps, then two more from the checkpoint; beside it the first two again, from the same seed.
        fine_tune(&["--steps", "2"], &out);
        let again = folder.path().join(format!("{name}-again"));
        fine_tune(&["--steps", "2"], &again);
        let learnt = Path::new(match rank {
            None => "unet/diffusion_pytorch_model.safetensors",
            Some(_) => "pytorch_lora_weights.safetensors",
        });
        assert!(files(&out)[learnt] == files(&again)[learnt], "{name}");
        fine_tune(&["--steps", "4", "--resume"], &out);
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

/// A folder, its data and its model, with the arguments that name them.
struct Toys {
    folder: tempfile::TempDir,
}

impl Toys {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        toys(folder.path());
        Self { folder }
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    fn arguments(&self, stage: &[&str]) -> Vec<String> {
        let (set, config) = (self.path("set"), self.path("model.json"));
        let common = [
            "--data",
            text(&set),
            "--config",
            text(&config),
            "--batch",
            "2",
        ];
        stage
            .iter()
            .chain(&common)
            .map(ToString::to_string)
            .collect()
    }

    fn train(&self, stage: &[&str]) -> String {
        let arguments = self.arguments(stage);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        done("train wake-model", &arguments, &self.path("run"))
    }

    fn refused(&self, stage: &[&str], words: &[&str]) {
        let arguments = self.arguments(stage);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        refused_into("train wake-model", &arguments, words, &self.path("run"));
    }
}

/// Weights of one run never come out of another: a folder is of one run, and what differs is named.
#[test]
fn a_folder_belongs_to_one_run() {
    let toys = Toys::new();
    toys.train(&["parser", "--steps", "3"]);
    let out = toys.path("run");
    toys.refused(
        &["parser", "--steps", "2"],
        &["stage parser has made 3 steps", "resume this one"],
    );
    toys.refused(
        &["parser", "--steps", "4", "--resume", "--rate", "1e-2"],
        &["rate = 0.001", "expected 0.01"],
    );
    toys.refused(
        &["parser", "--steps", "4", "--resume", "--seed", "5"],
        &["seed = 7", "expected 5"],
    );
    toys.train(&["prior", "--steps", "1"]);
    let other = toys.path("other");
    let size = [
        "--set",
        "scene.grid.rows=64",
        "--set",
        "scene.grid.columns=64",
    ];
    done(
        "dataset",
        &[&size[..], &["--count", "4", "--seed", "9"]].concat(),
        &other,
    );
    let config = toys.path("model.json");
    let arguments = [
        "prior",
        "--resume",
        "--data",
        text(&other),
        "--config",
        text(&config),
    ];
    refused_into(
        "train wake-model",
        &arguments,
        &["data.set.count = 10", "expected 4"],
        &out,
    );
}

/// Whatever was lost after the last checkpoint, a resumed run makes what it promised.
#[test]
fn results_are_made_again_from_the_last_checkpoint() {
    let toys = Toys::new();
    toys.train(&["parser", "--steps", "2"]);
    toys.train(&["prior", "--steps", "2"]);
    toys.train(&["flow", "--steps", "2", "--every", "1"]);
    let out = toys.path("run");
    let before = files(&out);
    let results = [
        "flow.safetensors",
        "sheet.png",
        "prior.safetensors",
        "parser.safetensors",
    ];
    for name in results {
        // As a kill leaves them: one is missing, the others are of an earlier checkpoint.
        std::fs::remove_file(out.join(name)).expect("a result");
    }
    let record = std::fs::read_to_string(out.join("run.json")).expect("a record");
    let stale = record.replace("\"results_after\": 2", "\"results_after\": 1");
    assert_ne!(record, stale);
    std::fs::write(out.join("run.json"), stale).expect("a file");
    std::fs::write(out.join("flow.safetensors"), "old").expect("a file");
    toys.train(&["flow", "--steps", "2", "--resume"]);
    let after = files(&out);
    for name in results {
        assert!(after[Path::new(name)] == before[Path::new(name)], "{name}");
    }
}

/// Killed at random moments until it is done, a run ends with the weights of one that nobody killed.
#[test]
fn many_kills_change_no_weight() {
    let toys = Toys::new();
    let (whole, killed) = (toys.path("whole"), toys.path("run"));
    // A rate with all digits that a number can have.
    let rate = "--rate=0.0012345678901234567";
    let arguments = toys.arguments(&["parser", "--steps", "30", "--every", "2", rate]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    done("train wake-model", &arguments, &whole);
    let resumed = [&arguments[..], &["--resume"]].concat();
    let has_begun = || {
        let checkpoints = std::fs::read_dir(killed.join("checkpoints/parser"));
        checkpoints.is_ok_and(|entries| {
            let names = entries.filter_map(|entry| Some(entry.ok()?.file_name()));
            names
                .into_iter()
                .any(|name| name.to_string_lossy().starts_with("step-"))
        })
    };
    for k in 0..12_u64 {
        let arguments = if has_begun() { &resumed } else { &arguments };
        let mut child = program("train wake-model")
            .args(arguments)
            .args(["--out", text(&killed)])
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("a program that starts");
        std::thread::sleep(Duration::from_millis(50 + k * 7919 % 400));
        // It may have ended.
        let _ = child.kill();
        child.wait().expect("an end");
    }
    let last = if has_begun() { &resumed } else { &arguments };
    done("train wake-model", last, &killed);
    let file = |folder: &Path, name: &str| std::fs::read(folder.join(name)).expect("a file");
    let name = "parser.safetensors";
    assert!(file(&whole, name) == file(&killed, name));
    let temporary = files(&killed)
        .into_keys()
        .find(|path| text(path).ends_with(".tmp"));
    assert_eq!(temporary, None);
}

/// One byte of a checkpoint that differs ends the run that would go on from it; without this checkpoint it goes on from the
/// one before, and images that changed are not learnt from.
#[test]
fn a_damaged_checkpoint_or_image_is_named() {
    let toys = Toys::new();
    toys.train(&["prior", "--steps", "4", "--every", "2"]);
    let out = toys.path("run");
    let weights = std::fs::read(out.join("prior.safetensors")).expect("weights");
    let newest = out.join("checkpoints/prior/step-00000004");
    for name in ["tensors.safetensors", "state.json"] {
        let file = newest.join(name);
        let whole = std::fs::read(&file).expect("a file");
        let mut damaged = whole.clone();
        damaged[whole.len() / 2] ^= 4;
        std::fs::write(&file, damaged).expect("a file");
        let words = [name, "checksum", "remove the folder step-00000004"];
        toys.refused(&["prior", "--steps", "4", "--resume"], &words);
        std::fs::write(&file, whole).expect("a file");
    }
    std::fs::remove_dir_all(newest).expect("a checkpoint");
    toys.train(&["prior", "--steps", "4", "--every", "2", "--resume"]);
    assert!(std::fs::read(out.join("prior.safetensors")).expect("weights") == weights);
    let images = toys.path("set/images");
    std::fs::copy(images.join("000001.png"), images.join("000000.png")).expect("a copy");
    toys.refused(
        &["prior", "--steps", "6", "--resume"],
        &["000000.png", "damaged or was replaced"],
    );
}

#[test]
fn data_and_numbers_that_do_not_fit_are_refused_by_name() {
    let toys = Toys::new();
    let config = toys.path("model.json");
    for (rows, columns) in [("8", "8"), ("32", "96"), ("128", "128")] {
        let set = toys.path(&format!("{rows}x{columns}"));
        let (rows_set, columns_set) = (
            format!("scene.grid.rows={rows}"),
            format!("scene.grid.columns={columns}"),
        );
        done(
            "dataset",
            &["--set", &rows_set, "--set", &columns_set, "--count", "1"],
            &set,
        );
        let pixels = format!("{rows} × {columns} pixels");
        for stage in ["patches", "prior", "flow"] {
            let arguments = [stage, "--data", text(&set), "--config", text(&config)];
            refused_by("train wake-model", &arguments, &[&pixels, "64 × 64"]);
        }
    }
    // Grey in another mapping than the model's.
    let set = toys.path("amplitude");
    let changes = [
        "scene.grid.rows=64",
        "scene.grid.columns=64",
        "grey.mapping=amplitude",
    ];
    let mut arguments = vec!["--count", "1"];
    arguments.extend(changes.iter().flat_map(|change| ["--set", *change]));
    done("dataset", &arguments, &set);
    let arguments = ["prior", "--data", text(&set), "--config", text(&config)];
    refused_by(
        "train wake-model",
        &arguments,
        &["grey", "amplitude", "decibels"],
    );
    for rate in ["nan", "inf", "1e300", "0", "-1"] {
        let rate = format!("--rate={rate}");
        for stage in ["parser", "prior", "flow"] {
            refused_by("train wake-model", &[stage, &rate], &["rate is", "outside"]);
        }
    }
    let count = ["prior", "--count", "18446744073709551615"];
    refused_by("train wake-model", &count, &["--count", "10000000"]);
}

/// Fewer pairs than a sheet shows are pairs to learn from, too.
#[test]
fn a_set_of_three_images_is_learnt() {
    let toys = Toys::new();
    let (set, out) = (toys.path("three"), toys.path("run"));
    let size = [
        "--set",
        "scene.grid.rows=64",
        "--set",
        "scene.grid.columns=64",
    ];
    done("dataset", &[&size[..], &["--count", "3"]].concat(), &set);
    let config = toys.path("model.json");
    let common = ["--data", text(&set), "--config", text(&config)];
    done(
        "train wake-model",
        &[&["prior", "--steps", "1", "--batch", "2"], &common[..]].concat(),
        &out,
    );
    assert!(out.join("sheet.png").is_file());
}

/// A model is told of no polarisation: images of another than its own would teach it what nobody can ask for.
#[test]
fn scenes_that_the_model_is_not_told_of_are_refused_by_name() {
    let toys = Toys::new();
    let set = toys.path("other");
    let changes = [
        "scene.grid.rows=64",
        "scene.grid.columns=64",
        "scene.radar.polarization=HH",
    ];
    let mut arguments = vec!["--count", "1"];
    arguments.extend(changes.iter().flat_map(|change| ["--set", *change]));
    done("dataset", &arguments, &set);
    let recipe = Recipe::default().with_assignments(&changes[..2]).unwrap();
    let simulated = Simulated::new(recipe, 1).unwrap();
    let scenes: Vec<Scene> = (0..200).map(|n| simulated.scene(n).unwrap()).collect();
    let model = WakeModelConfig::read(&toys.path("model.json")).unwrap();
    let model = WakeModelConfig {
        training_ranges: TrainingRanges::of(&scenes).unwrap(),
        ..model
    };
    let config = toys.path("told.json");
    std::fs::write(&config, serde_json::to_vec(&model).unwrap()).unwrap();
    let arguments = ["prior", "--data", text(&set), "--config", text(&config)];
    refused_by(
        "train wake-model",
        &arguments,
        &["radar.polarization", "HH", "VV"],
    );
}
