//! Whole pipelines written as folders, read again, and used by diffusers.

use std::path::{Path, PathBuf};

use burn::tensor::{Device, Tensor};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::pipeline::{Pipeline, PipelineParts, Request};
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::UNetConfig;
use wake_nn::weights::Precision;

use crate::golden::{Golden, devices, difference, folder, json, largest, numbers};

/// The files of a pipeline that diffusers reads.
const FILES: [&str; 12] = [
    "model_index.json",
    "scheduler/scheduler_config.json",
    "text_encoder/config.json",
    "text_encoder/model.safetensors",
    "tokenizer/merges.txt",
    "tokenizer/special_tokens_map.json",
    "tokenizer/tokenizer_config.json",
    "tokenizer/vocab.json",
    "unet/config.json",
    "unet/diffusion_pytorch_model.safetensors",
    "vae/config.json",
    "vae/diffusion_pytorch_model.safetensors",
];

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let below = |path: PathBuf| match path.is_dir() {
        true => files_below(&path),
        false => vec![path],
    };
    paths.flat_map(below).collect()
}

fn image(pipeline: &Pipeline) -> Vec<f32> {
    let request = Request::new("a ship and its wake").with_steps(3);
    let request = request.with_size(16, 24).with_seed(5);
    numbers(&pipeline.generate(&request).unwrap())
}

/// Every pipeline of the fixtures, saved and read again: the files of diffusers' layout and no others, the
/// tensors and the image bit for bit. With `WAKE_SAVED` the folder is kept there, for
/// `tests/fixtures/own/check_saved.py`, which lets diffusers read it.
#[test]
#[allow(clippy::float_cmp, reason = "nothing is computed in between")]
fn saved_pipelines_come_back() {
    let entries = std::fs::read_dir(folder()).expect("the folder of fixtures");
    let pipelines: Vec<PathBuf> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("model_index.json").is_file())
        .collect();
    assert!(
        !pipelines.is_empty(),
        "no pipeline in {}",
        folder().display()
    );
    let temporary = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("WAKE_SAVED").map(PathBuf::from);
    let (_, device) = devices().remove(0);
    for original in pipelines {
        let root = kept.as_deref().unwrap_or(temporary.path());
        let saved = root.join(original.file_name().unwrap());
        let pipeline = Pipeline::load(&original, &device).unwrap();
        pipeline.save(&saved, Precision::F32).unwrap();
        let mut files = files_below(&saved);
        files.sort_unstable();
        assert_eq!(files, FILES.map(|name| saved.join(name)));
        assert_eq!(
            json(&saved.join("scheduler/scheduler_config.json")),
            json(&original.join("scheduler/scheduler_config.json"))
        );
        for part in ["unet", "vae"] {
            let file = format!("{part}/diffusion_pytorch_model.safetensors");
            let [ours, theirs] =
                [&saved, &original].map(|folder| Golden::read(&folder.join(&file)));
            assert_eq!(ours.names().count(), theirs.names().count(), "{part}");
            for name in theirs.names() {
                assert_eq!(ours.f32s(name), theirs.f32s(name), "{part} {name}");
            }
        }
        let again = Pipeline::load(&saved, &device).unwrap();
        assert_eq!(image(&again), image(&pipeline), "{}", original.display());
    }
}

fn small(device: &Device) -> Pipeline {
    let text = ClipTextConfig::new()
        .with_hidden_size(32)
        .with_intermediate_size(64)
        .with_layers(1)
        .with_heads(2);
    let parts = PipelineParts {
        tokenizer: None,
        text_encoder: text.init(device),
        unet: UNetConfig::small(8, Some(32), None).init(device),
        autoencoder: AutoencoderKlConfig::small(8, 2).init(device),
        scheduler: SchedulerConfig::stable_diffusion("dpm++").unwrap(),
        latent_size: 4,
    };
    Pipeline::new(parts, device).unwrap()
}

/// Our own small models with random weights, the vocabulary from the crate. In f32 the image is the same but
/// for the order of sums (matrices come back as transposed views), 1e-6 through some thirty layers; in f16,
/// weights are rounded by 5e-4.
#[test]
fn small_models_come_back_in_every_precision() {
    let (_, device) = devices().remove(0);
    let pipeline = small(&device);
    let generate = |pipeline: &Pipeline| -> Tensor<4> {
        let request = Request::new("a ship").with_steps(2).with_seed(1);
        pipeline.generate(&request).unwrap()
    };
    let expected = generate(&pipeline);
    assert_eq!(expected.dims(), [1, 1, 32, 32]);
    let expected = numbers(&expected);
    for (precision, allowed) in [(Precision::F32, 1e-5), (Precision::F16, 0.02)] {
        let folder = tempfile::tempdir().unwrap();
        pipeline.save(folder.path(), precision).unwrap();
        let again = Pipeline::load(folder.path(), &device).unwrap();
        let ours = numbers(&generate(&again));
        let worst = difference(&ours, &expected) / largest(&expected);
        assert!(worst <= allowed, "{precision:?}: {worst:e}");
    }
}

/// An index that is no index, or that of another kind of pipeline, is refused by name; a pipe in the place of a file is not
/// waited for.
#[test]
fn a_folder_with_a_broken_index_is_refused() {
    let entries = std::fs::read_dir(folder()).expect("the folder of fixtures");
    let mut paths = entries.map(|entry| entry.unwrap().path());
    let original = paths.find(|path| path.join("model_index.json").is_file());
    let original = original.expect("a pipeline among the fixtures");
    let temporary = tempfile::tempdir().unwrap();
    let copy = temporary.path().join("pipeline");
    for file in files_below(&original) {
        let there = copy.join(file.strip_prefix(&original).unwrap());
        std::fs::create_dir_all(there.parent().unwrap()).unwrap();
        std::fs::copy(&file, &there).unwrap();
    }
    let (_, device) = devices().remove(0);
    let refused = |text: &str| {
        std::fs::write(copy.join("model_index.json"), text).unwrap();
        Pipeline::load(&copy, &device).unwrap_err().to_string()
    };
    for text in [
        "",
        "garbage",
        "[]",
        "{\"_class_name\": 3}",
        "{\"_class_name\": \"FluxPipeline\"}",
    ] {
        let message = refused(text);
        assert!(message.contains("model_index.json"), "{text}: {message}");
    }
    std::fs::remove_file(copy.join("model_index.json")).unwrap();
    assert!(Pipeline::load(&copy, &device).is_ok());
    #[cfg(unix)]
    for name in [
        "model_index.json",
        "unet/diffusion_pytorch_model.safetensors",
    ] {
        let pipe = copy.join(name);
        let _ = std::fs::remove_file(&pipe);
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let message = Pipeline::load(&copy, &device).unwrap_err().to_string();
        let file = name.rsplit('/').next().unwrap();
        assert!(message.contains(file), "{name}: {message}");
        std::fs::remove_file(&pipe).unwrap();
    }
}
