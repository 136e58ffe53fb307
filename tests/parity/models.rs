//! The models against torch, and their weight files.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use burn::tensor::{Device, Int, Tensor, TensorData};
use serde_json::Value;
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::{UNetConfig, UNetInput};
use wake_ldm::weights::{self, Layout};
use wake_ldm::{Error, Mismatch};

use crate::golden::{Golden, devices, difference, folder, json, numbers, own_folder};

/// Ten times the noise floor of a model.
fn allowed(model: &Value, floor: &str) -> f64 {
    10.0 * model[floor].as_f64().unwrap()
}

fn expect(what: &str, ours: &[f32], expected: &[f32], allowed: f64) {
    let difference = difference(ours, expected);
    assert!(
        difference <= allowed,
        "{what}: differs by {difference:e}, allowed {allowed:e}"
    );
}

fn ids(golden: &Golden, device: &Device) -> Tensor<2, Int> {
    Tensor::from_data(
        TensorData::new(golden.i64s("input_ids"), golden.shape("input_ids")),
        device,
    )
}

fn check_unet(folder: &Path, model: &Value, cases: &[(String, Golden)], device: &Device) {
    let (unet, _) = weights::load_unet(folder, device).unwrap();
    for (name, golden) in cases {
        let timesteps: Vec<f32> = golden.i64s("timestep").iter().map(|&t| t as f32).collect();
        let count = timesteps.len();
        let out = unet.forward(UNetInput {
            sample: golden.tensor("sample", device),
            timesteps: Tensor::from_data(TensorData::new(timesteps, [count]), device),
            context: golden.tensor("encoder_hidden_states", device),
            condition: None,
        });
        expect(
            name,
            &numbers(&out),
            &golden.f32s("out_ref"),
            allowed(model, "noise_floor"),
        );
    }
}

fn check_autoencoder(folder: &Path, model: &Value, cases: &[(String, Golden)], device: &Device) {
    let (vae, _) = weights::load_autoencoder(folder, device).unwrap();
    let [encode, decode] =
        ["encode", "decode"].map(|way| allowed(model, &format!("noise_floor_{way}")));
    for (name, golden) in cases {
        let posterior = vae.encode(golden.tensor("image", device));
        let moments = vae.moments(golden.tensor("image", device));
        expect(
            &format!("{name} moments"),
            &numbers(&moments),
            &golden.f32s("moments_ref"),
            encode,
        );
        let sample = posterior.sample(golden.tensor("noise", device));
        for (what, ours) in [
            ("mean", posterior.mode()),
            ("std", posterior.std()),
            ("sample", sample),
        ] {
            expect(
                &format!("{name} {what}"),
                &numbers(&ours),
                &golden.f32s(what),
                encode,
            );
        }
        let decoded = vae.decode(golden.tensor("z_in", device));
        expect(
            &format!("{name} decoded"),
            &numbers(&decoded),
            &golden.f32s("decoded_ref"),
            decode,
        );
        let kl = numbers(&posterior.kl());
        for (ours, expected) in kl.iter().zip(golden.f32s("kl")) {
            // A sum of some hundred terms, each as near as the moments.
            assert!(
                (ours / expected - 1.0).abs() < 2e-5,
                "{name} kl: {ours} {expected}"
            );
        }
    }
}

fn check_text(folder: &Path, model: &Value, cases: &[(String, Golden)], device: &Device) {
    let (text, _) = weights::load_text_encoder(folder, device).unwrap();
    let allowed = allowed(model, "noise_floor");
    for (name, golden) in cases {
        let output = text.forward(ids(golden, device));
        let last = golden.f32s("last_hidden_state_ref");
        expect(name, &numbers(&output.last_hidden_state), &last, allowed);
        expect(
            &format!("{name} pooled"),
            &numbers(&output.pooled),
            &golden.f32s("pooler_output"),
            allowed,
        );
        for (k, state) in text.hidden_states(ids(golden, device)).iter().enumerate() {
            let expected = golden.f32s(&format!("hidden_states.{k}"));
            expect(
                &format!("{name} layer {k}"),
                &numbers(state),
                &expected,
                allowed,
            );
        }
    }
}

#[test]
fn every_model_and_case_agrees_with_torch() {
    let folder = folder().join("models");
    let manifest = json(&folder.join("manifest.json"));
    let models = manifest["models"].as_object().unwrap();
    assert!(!models.is_empty(), "no models in {}", folder.display());
    for (backend, device) in devices() {
        let mut count = 0;
        for (name, model) in models {
            let path = folder.join(name);
            let case = |case: &String| {
                (
                    format!("{backend} {name} {case}"),
                    Golden::read(&path.join(format!("{case}.safetensors"))),
                )
            };
            let cases: Vec<_> = model["cases"]
                .as_object()
                .unwrap()
                .keys()
                .map(case)
                .collect();
            count += cases.len();
            match model["class"].as_str().unwrap() {
                "UNet2DConditionModel" => check_unet(&path, model, &cases, &device),
                "AutoencoderKL" => check_autoencoder(&path, model, &cases, &device),
                "CLIPTextModel" => check_text(&path, model, &cases, &device),
                other => panic!("{name}: no such model, {other}"),
            }
        }
        println!("{backend}: {} models, {count} cases", models.len());
    }
}

/// Weights stored as f16, computed in f32.
#[test]
fn half_precision_files_are_widened() {
    let models = folder().join("models");
    let folders = std::fs::read_dir(&models)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let stored = "case00_weights_fp16_math_f32.safetensors";
    let (_, device) = devices().remove(0);
    let mut count = 0;
    for path in folders.filter(|path| path.join(stored).is_file()) {
        let config = AutoencoderKlConfig::read(&path.join("config.json")).unwrap();
        let half = path.join("diffusion_pytorch_model.fp16.safetensors");
        let vae = weights::load(config.init(&device), Layout::Diffusers, &half).unwrap();
        let golden = Golden::read(&path.join(stored));
        let decoded = vae.decode(golden.tensor("z_in", &device));
        expect("fp16", &numbers(&decoded), &golden.f32s("decoded"), 3e-5);
        count += 1;
    }
    assert!(count > 0, "no f16 files in {}", models.display());
}

/// The exact names and shapes of Stable Diffusion v1.4, without allocating its weights.
#[test]
fn stable_diffusion_has_its_known_tensors() {
    let file = std::fs::File::open(folder().join("sd14_state_dict.json.gz")).unwrap();
    let mut text = String::new();
    flate2::read::GzDecoder::new(file)
        .read_to_string(&mut text)
        .unwrap();
    let known: Value = serde_json::from_str(&text).unwrap();
    let (_, device) = devices().remove(0);
    let config = |name: &str| known["configs"][name].to_string();
    let path = Path::new("config.json");
    let unet = UNetConfig::from_json(&config("unet"), path)
        .unwrap()
        .init(&device);
    let vae = AutoencoderKlConfig::from_json(&config("vae"), path)
        .unwrap()
        .init(&device);
    let clip = ClipTextConfig::from_json(&config("text_encoder"), path)
        .unwrap()
        .init(&device);
    for (name, ours) in [
        ("unet", weights::shapes(&unet, Layout::Diffusers)),
        ("vae", weights::shapes(&vae, Layout::Diffusers)),
        ("text_encoder", weights::shapes(&clip, Layout::ClipText)),
    ] {
        let expected: BTreeMap<String, Vec<usize>> =
            serde_json::from_value(known["state_dict"][name].clone()).unwrap();
        assert_eq!(ours, expected, "{name}");
        let parameters: usize = ours
            .values()
            .map(|shape| shape.iter().product::<usize>())
            .sum();
        assert_eq!(
            Some(parameters as u64),
            known["meta"]["parameters"][name].as_u64(),
            "{name}"
        );
    }
}

/// Any model of the fixtures that stores its weights under today's names.
fn some_unet() -> PathBuf {
    let models = folder().join("models");
    let manifest = json(&models.join("manifest.json"));
    let found = manifest["models"].as_object().unwrap().iter();
    let unets = found.filter(|(_, model)| model["class"] == "UNet2DConditionModel");
    models.join(unets.map(|(name, _)| name).next().unwrap())
}

#[test]
fn what_is_written_is_what_was_read() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let (unet, _) = weights::load_unet(&folder, &device).unwrap();
    let written = tempfile::tempdir().unwrap();
    let path = written.path().join("diffusion_pytorch_model.safetensors");
    weights::save(&unet, Layout::Diffusers, &path).unwrap();
    let [ours, original] =
        [&path, &folder.join("diffusion_pytorch_model.safetensors")].map(|p| Golden::read(p));
    let mut names: Vec<&str> = original.names().collect();
    names.sort_unstable();
    for name in &names {
        assert_eq!(ours.shape(name), original.shape(name), "{name}");
        assert!(ours.f32s(name) == original.f32s(name), "{name}");
    }
    assert_eq!(ours.names().count(), names.len());
}

/// A file with one tensor gone, one too many and one of another shape: all named, nothing loaded.
#[test]
fn files_that_do_not_fit_are_refused_with_every_name() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let golden = Golden::read(&folder.join("diffusion_pytorch_model.safetensors"));
    let mut tensors: Vec<(String, Vec<usize>, Vec<u8>)> = golden
        .names()
        .filter(|name| *name != "conv_in.bias")
        .map(|name| {
            let bytes = golden
                .f32s(name)
                .iter()
                .flat_map(|x| x.to_le_bytes())
                .collect();
            (name.to_owned(), golden.shape(name), bytes)
        })
        .collect();
    tensors.push(("stranger".to_owned(), vec![1], vec![0; 4]));
    for (name, shape, _) in &mut tensors {
        if name == "conv_out.weight" {
            shape.reverse();
        }
    }
    let views = tensors.iter().map(|(name, shape, bytes)| {
        let view =
            safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape.clone(), bytes);
        (name, view.unwrap())
    });
    let path = tempfile::tempdir().unwrap().keep().join("odd.safetensors");
    safetensors::serialize_to_file(views, None, &path).unwrap();
    let error = weights::load(config.init(&device), Layout::Diffusers, &path).unwrap_err();
    let Error::WeightsMismatch { mismatch, .. } = error else {
        panic!("{error}")
    };
    let Mismatch {
        missing,
        unexpected,
        misshapen,
    } = *mismatch;
    assert_eq!(
        (missing, unexpected),
        (vec!["conv_in.bias".to_owned()], vec!["stranger".to_owned()])
    );
    assert_eq!(misshapen.len(), 1);
    assert_eq!(misshapen[0].name, "conv_out.weight");
}

/// Truncated, oversized, overlapping and senseless files end in an error, not in a panic.
#[test]
fn hostile_files_are_refused() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let whole = std::fs::read(folder.join("diffusion_pytorch_model.safetensors")).unwrap();
    let with_header = |header: &str, data: usize| {
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.as_bytes());
        bytes.resize(bytes.len() + data, 0);
        bytes
    };
    let entry = |shape: &str, from: usize, to: usize| {
        format!(r#"{{"dtype":"F32","shape":{shape},"data_offsets":[{from},{to}]}}"#)
    };
    let one = |shape: &str, from, to| format!(r#"{{"a":{}}}"#, entry(shape, from, to));
    let overlapping = format!(
        r#"{{"a":{},"b":{}}}"#,
        entry("[2]", 0, 8),
        entry("[2]", 4, 12)
    );
    let mut padded = whole.clone();
    padded.extend([0; 64]);
    let files = [
        vec![],
        whole[..7].to_vec(),
        whole[..whole.len() / 2].to_vec(),
        whole[..whole.len() - 1].to_vec(),
        padded,
        u64::MAX.to_le_bytes().repeat(4),
        (1_u64 << 60).to_le_bytes().to_vec(),
        with_header("{", 0),
        with_header("[]", 0),
        with_header(&one("[1]", 0, usize::MAX), 4),
        with_header(&one("[9223372036854775807, 4]", 0, 4), 4),
        with_header(&one("[2]", 8, 0), 8),
        with_header(&one("[2]", 0, 4), 4),
        with_header(&overlapping, 12),
        with_header(&"[".repeat(200_000), 0),
    ];
    let temporary = tempfile::tempdir().unwrap();
    for (i, bytes) in files.into_iter().enumerate() {
        let path = temporary.path().join(format!("{i}.safetensors"));
        std::fs::write(&path, bytes).unwrap();
        let error = weights::load(config.init(&device), Layout::Diffusers, &path).unwrap_err();
        assert!(
            matches!(error, Error::InvalidSafetensors { .. }),
            "{i}: {error}"
        );
    }
    let missing = weights::load(config.init(&device), Layout::Diffusers, temporary.path());
    assert!(matches!(missing, Err(Error::MissingFile { .. })));
}

/// The same weights in two files with an index; an index that leaves the folder is refused.
#[test]
fn shards_are_read_through_their_index() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let golden = Golden::read(&folder.join("diffusion_pytorch_model.safetensors"));
    let temporary = tempfile::tempdir().unwrap();
    let mut map = serde_json::Map::new();
    for shard in 0..2 {
        let file = format!("part-{shard}.safetensors");
        let chosen: Vec<(&str, Vec<usize>, Vec<u8>)> = golden
            .names()
            .filter(|name| name.len() % 2 == shard)
            .map(|name| {
                let bytes = golden
                    .f32s(name)
                    .iter()
                    .flat_map(|x| x.to_le_bytes())
                    .collect();
                (name, golden.shape(name), bytes)
            })
            .collect();
        let views = chosen.iter().map(|(name, shape, bytes)| {
            map.insert((*name).to_owned(), file.clone().into());
            let view =
                safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape.clone(), bytes);
            (*name, view.unwrap())
        });
        safetensors::serialize_to_file(views, None, &temporary.path().join(&file)).unwrap();
    }
    let index = temporary
        .path()
        .join("diffusion_pytorch_model.safetensors.index.json");
    let write =
        |map: Value| std::fs::write(&index, serde_json::json!({"weight_map": map}).to_string());
    write(Value::Object(map)).unwrap();
    let load = || weights::load(config.init(&device), Layout::Diffusers, temporary.path());
    let sharded = load().unwrap();
    let whole = weights::load_unet(&folder, &device).unwrap().0;
    let input = |x: f64| UNetInput {
        sample: Tensor::full([1, config.in_channels, 8, 8], x, &device),
        timesteps: Tensor::full([1], 7.0, &device),
        context: Tensor::full([1, 3, config.cross_attention_dim], 0.5, &device),
        condition: None,
    };
    assert!(numbers(&sharded.forward(input(0.3))) == numbers(&whole.forward(input(0.3))));
    write(serde_json::json!({"a": "../../etc/passwd"})).unwrap();
    assert!(matches!(load(), Err(Error::InvalidSafetensors { .. })));
}

/// A low-rank adaptation at full and at half strength, against diffusers with peft.
#[test]
fn low_rank_adaptations_are_merged() {
    let folder = own_folder().join("lora");
    let file = folder.join("pytorch_lora_weights.safetensors");
    let golden = Golden::read(&folder.join("case.safetensors"));
    let models = own_folder().with_file_name("pipeline_a");
    for (backend, device) in devices() {
        for (scale, name) in [(1.0, "out"), (0.5, "out_half"), (0.0, "out_plain")] {
            let (unet, _) = weights::load_unet(&models.join("unet"), &device).unwrap();
            let unet = weights::merge_lora(unet, Layout::Diffusers, "unet", &file, scale).unwrap();
            let out = unet.forward(UNetInput {
                sample: golden.tensor("sample", &device),
                timesteps: Tensor::full([1], golden.i64s("timestep")[0] as f64, &device),
                context: golden.tensor("encoder_hidden_states", &device),
                condition: None,
            });
            // Ten times the noise floor of the fixtures' U-Nets; merging rounds once more.
            expect(
                &format!("{backend} {name}"),
                &numbers(&out),
                &golden.f32s(name),
                2e-5,
            );
        }
        let (unet, config) = weights::load_unet(&models.join("unet"), &device).unwrap();
        let absent = weights::merge_lora(unet, Layout::Diffusers, "text_encoder", &file, 1.0);
        assert!(matches!(absent, Err(Error::WeightsMismatch { .. })));
        let other = UNetConfig {
            cross_attention_dim: 5,
            ..config
        }
        .init(&device);
        let misfit = weights::merge_lora(other, Layout::Diffusers, "unet", &file, 1.0);
        let Err(Error::WeightsMismatch { mismatch, .. }) = misfit else {
            panic!("it fitted")
        };
        assert!(!mismatch.misshapen.is_empty());
    }
}
