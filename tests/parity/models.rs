//! The models against torch, and their weight files.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use burn::tensor::{Device, Int, Tensor, TensorData};
use serde_json::Value;
use wake_ldm::autoencoder::{AutoencoderKl, AutoencoderKlConfig};
use wake_ldm::text::{ClipText, ClipTextConfig};
use wake_ldm::unet::{UNet, UNetConfig, UNetInput};
use wake_nn::weights::{self, Layout};

use crate::golden::{Golden, devices, expect, folder, json, numbers};

/// Ten times the noise floor of a model.
fn allowed(model: &Value, floor: &str) -> f64 {
    10.0 * model[floor].as_f64().unwrap()
}

fn ids(golden: &Golden, device: &Device) -> Tensor<2, Int> {
    Tensor::from_data(
        TensorData::new(golden.i64s("input_ids"), golden.shape("input_ids")),
        device,
    )
}

fn check_unet(folder: &Path, model: &Value, cases: &[(String, Golden)], device: &Device) {
    let unet = UNet::from_folder(folder, device).unwrap();
    for (name, golden) in cases {
        let timesteps: Vec<f32> = golden.i64s("timestep").iter().map(|&t| t as f32).collect();
        let count = timesteps.len();
        let out = unet.forward(UNetInput {
            sample: golden.tensor("sample", device),
            timesteps: Tensor::from_data(TensorData::new(timesteps, [count]), device),
            context: Some(golden.tensor("encoder_hidden_states", device)),
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
    let vae = AutoencoderKl::from_folder(folder, device).unwrap();
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
    let text = ClipText::from_folder(folder, device).unwrap();
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
