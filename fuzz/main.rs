//! Attack on everything that reads what others wrote: mutated files and texts must give a value or one short sentence,
//! never a panic, a hang or a control character.
//!
//! ```text
//! cargo test --features train --test fuzz                                          # corpora, then a second each
//! FUZZ_SECONDS=600 cargo test --release --features train --test fuzz -- --nocapture   # for long; prints executions
//! FUZZ_EXECUTIONS=1000000 cargo test …                                             # so many, from seeds that a failure names
//! ARBTEST_SEED=…                                                                   # as a failure names it: in `attack`
//! ```
//!
//! An input that broke something is kept in `fuzz/corpus/TARGET/`, where every run replays it.

mod attack;
mod models;
mod mutation;

use std::path::Path;

use attack::{attack, said, said_harmlessly, with_file};
use burn::tensor::Device;
use serde_json::json;
use wake_dataset::{Folder, Recipe};
use wake_ldm::network::{PatchTransform, WakeModelConfig};
use wake_ldm::pipeline::Pipeline;
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::unet::UNetConfig;
use wake_nn::weights::{Layout, load};
use wake_physics::Scene;
use wake_text::{PartialScene, TOKENS, Tokenizer};
use wake_train::{Checkpoint, TrainLog};
use whole_files::{checksum, sealed};

/// Text as a file may hold it; what is no Unicode is refused before it is read.
fn text(input: &[u8]) -> String {
    String::from_utf8_lossy(input).into_owned()
}

#[test]
fn scenes() {
    attack("scene", |input| {
        let Some(scene) = said_harmlessly(Scene::from_toml(&text(input))) else {
            return;
        };
        let again =
            Scene::from_toml(&scene.to_toml().expect("a form in TOML")).expect("its own form");
        assert_eq!(again, scene);
    });
}

#[test]
fn assignments() {
    let recipe = Recipe::default();
    attack("assignment", |input| {
        let text = text(input);
        if let Some(scene) = said_harmlessly(Scene::default().with_assignments(&[&text])) {
            assert!(scene.validate().is_ok());
        }
        said_harmlessly(recipe.with_assignments(&[&text]));
    });
}

#[test]
fn prompts() {
    attack("prompt", |input| {
        said(PartialScene::read(&text(input)));
    });
}

#[test]
fn tokens() {
    attack("tokens", |input| {
        let text = text(input);
        let tokens = Tokenizer::clip().encode(&text);
        assert_eq!(tokens.ids.len(), TOKENS);
        assert!(tokens.ids.iter().all(|&id| id < 49_408));
        assert!(
            tokens
                .truncated_at
                .is_none_or(|at| text.is_char_boundary(at))
        );
        // The same text has the same tokens, whatever was read before.
        assert_eq!(Tokenizer::clip().encode(&text).ids, tokens.ids);
    });
}

#[test]
fn weights() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = Device::default();
    attack("weights", |input| {
        with_file(folder.path(), "model.safetensors", input, |path| {
            let empty = PatchTransform::zeros(4, &device);
            said(load(empty, Layout::Diffusers, path));
        });
    });
}

/// A folder of weights in shards whose index is the input.
#[test]
fn weights_in_shards() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = Device::default();
    let shard = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/weights/one.safetensors");
    std::fs::copy(shard, folder.path().join("a.safetensors")).expect("a shard");
    attack("shards", |input| {
        with_file(folder.path(), "model.safetensors.index.json", input, |_| {
            let empty = PatchTransform::zeros(4, &device);
            said(load(empty, Layout::Diffusers, folder.path()));
        });
    });
}

/// A folder of a pipeline whose `model_index.json` is the input; no model lies in it.
#[test]
fn pipelines() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = Device::default();
    attack("pipeline", |input| {
        with_file(folder.path(), "model_index.json", input, |_| {
            said(Pipeline::load(folder.path(), &device));
        });
    });
}

#[test]
fn configurations() {
    attack("config", |input| {
        let (text, path) = (text(input), Path::new("config.json"));
        said(SchedulerConfig::from_json(&text, path));
        said(UNetConfig::from_json(&text, path));
        said(WakeModelConfig::from_json(&text, path));
    });
}

/// A set of one image whose `metadata.jsonl` is the input.
#[test]
fn lines_of_data_sets() {
    let folder = tempfile::tempdir().expect("a folder");
    let recipe = Recipe::default();
    let manifest = wake_dataset::Manifest::new(recipe, 7, 1).expect("a manifest");
    let manifest = serde_json::to_string(&manifest).expect("JSON");
    let manifest = sealed(&manifest) + "\n";
    std::fs::write(folder.path().join("dataset.json"), manifest).expect("a file");
    attack("metadata", |input| {
        // What was written like that is looked at in full; else the checksum is wrong.
        let line = sealed(&text(input)) + "\n";
        for input in [input, line.as_bytes()] {
            with_file(folder.path(), "metadata.jsonl", input, |_| {
                if let Some(set) = said(Folder::open(folder.path())) {
                    said(set.pair(0));
                }
            });
        }
    });
}

#[test]
fn states_of_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let step = folder.path().join("step-00000001");
    std::fs::create_dir(&step).expect("a folder");
    attack("checkpoint", |input| {
        let state = sealed(&text(input)) + "\n";
        for input in [input, state.as_bytes()] {
            with_file(&step, "state.json", input, |_| {
                said(Checkpoint::newest(folder.path()))
            });
        }
        let state = json!({"step": 1, "applied": 1, "state": {}, "tensors": checksum(input)});
        let state = sealed(&state.to_string()) + "\n";
        with_file(&step, "state.json", state.as_bytes(), |_| ());
        with_file(&step, "tensors.safetensors", input, |path| {
            said(Checkpoint::newest(folder.path()));
            std::fs::remove_file(path).expect("a file that was written");
        });
        with_file(folder.path(), "log.jsonl", input, |path| {
            said(TrainLog::open(path, 3))
        });
    });
}
