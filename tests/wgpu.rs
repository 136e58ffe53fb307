//! A small part of the parity suite on wgpu: the models, one whole run, and the self-checks, which draw an image of the wake model,
//! run the detector and compute the gradients of a training step.
//!
//! Runs wherever wgpu finds a device; Mesa's software OpenGL is one (`.ci/wgpu` installs it), some hundred times slower
//! than flex, so only the smallest cases of the fixtures are taken. Differences are allowed up to 1e-3 of the largest
//! value: GPUs may multiply matrices in half-precision fragments.
#![allow(clippy::unwrap_used, reason = "in tests, a panic is the report")]

#[allow(dead_code, reason = "written for the whole suite")]
#[path = "parity/golden.rs"]
mod golden;

use std::path::{Path, PathBuf};

use burn::tensor::{Device, DeviceKind, Int, Tensor, TensorData};
use golden::{Golden, difference, folder, json, largest, numbers};
use serde_json::Value;
use wake_ldm::autoencoder::AutoencoderKl;
use wake_ldm::pipeline::{Pipeline, Request, to_bytes};
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetInput};

fn device() -> Device {
    Device::wgpu(DeviceKind::DefaultDevice)
}

fn expect(what: &str, ours: &[f32], expected: &[f32]) {
    let relative = difference(ours, expected) / largest(expected);
    println!("{what}: {relative:.1e} of the largest value");
    assert!(relative <= 1e-3, "{what}: {relative:e}, allowed 1e-3");
}

/// The model of a class with the fewest parameters, and its first case.
fn smallest(class: &str) -> (PathBuf, Golden) {
    let models = folder().join("models");
    let manifest = json(&models.join("manifest.json"));
    let (name, model) = manifest["models"]
        .as_object()
        .unwrap()
        .iter()
        .filter(|(_, model)| model["class"] == class)
        .min_by_key(|(_, model)| model["params"].as_u64())
        .unwrap_or_else(|| panic!("no {class} in {}", models.display()));
    let case = model["cases"].as_object().unwrap().keys().next().unwrap();
    let path = models.join(name);
    let golden = Golden::read(&path.join(format!("{case}.safetensors")));
    (path, golden)
}

/// By its name the default device is there; the hundredth GPU is not, which is an error before anything uses it.
#[test]
fn a_gpu_that_is_not_there_is_an_error() {
    assert_eq!(wake_nn::device_named("wgpu").unwrap(), device());
    let error = wake_nn::device_named("wgpu:99").unwrap_err().to_string();
    assert!(
        error.contains("device 'wgpu:99' is not available"),
        "{error}"
    );
}

#[test]
fn the_u_net_agrees_with_torch() {
    let device = device();
    let (path, golden) = smallest("UNet2DConditionModel");
    let unet = UNet::from_folder(&path, &device).unwrap();
    let steps: Vec<f32> = golden.i64s("timestep").iter().map(|&t| t as f32).collect();
    let out = unet.forward(UNetInput {
        sample: golden.tensor("sample", &device),
        timesteps: Tensor::from_floats(steps.as_slice(), &device),
        context: Some(golden.tensor("encoder_hidden_states", &device)),
        condition: None,
    });
    expect("U-Net", &numbers(&out), &golden.f32s("out_ref"));
}

#[test]
fn the_autoencoder_agrees_with_torch() {
    let device = device();
    let (path, golden) = smallest("AutoencoderKL");
    let vae = AutoencoderKl::from_folder(&path, &device).unwrap();
    let moments = vae.moments(golden.tensor("image", &device));
    let decoded = vae.decode(golden.tensor("z_in", &device));
    expect("moments", &numbers(&moments), &golden.f32s("moments_ref"));
    expect("decoded", &numbers(&decoded), &golden.f32s("decoded_ref"));
}

#[test]
fn the_text_encoder_agrees_with_transformers() {
    let device = device();
    let (path, golden) = smallest("CLIPTextModel");
    let text = ClipText::from_folder(&path, &device).unwrap();
    let ids = TensorData::new(golden.i64s("input_ids"), golden.shape("input_ids"));
    let output = text.forward(Tensor::<2, Int>::from_data(ids, &device));
    let last = golden.f32s("last_hidden_state_ref");
    expect("text encoder", &numbers(&output.last_hidden_state), &last);
    let pooled = golden.f32s("pooler_output");
    expect("pooled", &numbers(&output.pooled), &pooled);
}

/// A folder of models with runs, and its run of the fewest calls.
fn shortest_run() -> (PathBuf, String, Value) {
    let entries = std::fs::read_dir(folder()).expect("the folder of fixtures");
    let models = entries
        .map(|entry| entry.unwrap().path())
        .find(|path| {
            path.join("model_index.json").is_file() && path.join("runs/manifest.json").is_file()
        })
        .expect("a pipeline with runs");
    let manifest = json(&models.join("runs/manifest.json"));
    let calls = |run: &Value| run["timesteps"].as_array().unwrap().len();
    let runs = manifest["runs"].as_object().unwrap().iter();
    let (name, run) = runs
        .filter(|(_, run)| run["args"]["negative_prompt"].is_null() && run["args"]["eta"].is_null())
        .min_by_key(|(_, run)| calls(run))
        .expect("a run without further arguments");
    (models, name.clone(), run.clone())
}

fn scheduler(run: &Value) -> SchedulerConfig {
    let mut options = run["scheduler_config"].clone();
    options["_class_name"] = run["scheduler"].clone();
    SchedulerConfig::from_json(&options.to_string(), Path::new("manifest")).unwrap()
}

#[test]
fn a_whole_run_agrees_with_diffusers() {
    let device = device();
    let (models, name, run) = shortest_run();
    let golden = Golden::read(&models.join(format!("runs/{name}.safetensors")));
    let pipeline = Pipeline::load(&models, &device).unwrap();
    let args = &run["args"];
    let prompts: Vec<String> = serde_json::from_value(args["prompt"].clone()).unwrap();
    let request = Request::new(prompts)
        .with_scheduler(scheduler(&run))
        .with_steps(run["num_inference_steps"].as_u64().unwrap() as usize)
        .with_guidance(args["guidance_scale"].as_f64().unwrap_or(7.5))
        .with_latents(golden.tensor("latents", &device));
    let mut sampling = pipeline.sample(&request).unwrap();
    for (i, progress) in sampling.by_ref().enumerate() {
        let expected = numbers(&golden.entry::<4>("steps", i, &device));
        expect(
            &format!("{name}, step {i}"),
            &numbers(&progress.latents),
            &expected,
        );
    }
    let image = pipeline.decode(sampling.latents());
    expect("image", &numbers(&image), &golden.f32s("image"));
    let (ours, expected) = (to_bytes(image).concat(), golden.u8s("image_u8_nhwc"));
    let levels = ours
        .iter()
        .zip(&expected)
        .map(|(a, b)| a.abs_diff(*b))
        .max();
    assert!(levels <= Some(1), "bytes differ by {levels:?}");
}

#[test]
fn the_device_passes_the_self_check() {
    wake_ldm::self_check(&device()).unwrap();
    wake_ldm::sampler::self_check(&device()).unwrap();
    wake_detector::self_check::check_device(&device()).unwrap();
    wake_train::self_check(&device()).unwrap();
}
