//! Whole runs of the pipeline against diffusers, step by step.

use std::path::{Path, PathBuf};

use burn::tensor::Tensor;
use serde_json::Value;
use wake_ldm::pipeline::{Pipeline, Request, StartImage, to_bytes};
use wake_ldm::scheduler::SchedulerConfig;
use wake_nn::Error;
use wake_text::Tokenizer;

use crate::golden::{Golden, devices, expect, folder, json, largest, numbers, own_folder};

/// A folder of models, and one of runs made with them.
struct Runs {
    models: PathBuf,
    runs: PathBuf,
}

/// The runs of every pipeline among the fixtures, and those of our own made with one of them.
fn all_runs() -> Vec<Runs> {
    let entries = std::fs::read_dir(folder()).expect("the folder of fixtures");
    let mut found: Vec<Runs> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|models| {
            models.join("model_index.json").is_file() && models.join("runs/manifest.json").is_file()
        })
        .map(|models| Runs {
            runs: models.join("runs"),
            models,
        })
        .collect();
    assert!(
        !found.is_empty(),
        "no folder with runs/manifest.json in {}",
        folder().display()
    );
    let runs = own_folder().join("runs");
    let manifest = json(&runs.join("manifest.json"));
    let models = manifest["pipeline"]
        .as_str()
        .expect("the pipeline's folder");
    let models = own_folder().with_file_name(models);
    found.push(Runs { models, runs });
    found
}

/// One text, or a list of them.
fn texts(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text.clone()],
        list => list
            .as_array()
            .unwrap()
            .iter()
            .map(|text| text.as_str().unwrap().to_owned())
            .collect(),
    }
}

/// The scheduler of a run, or the option that is refused.
fn scheduler(run: &Value) -> Result<SchedulerConfig, String> {
    let mut options = run["scheduler_config"].as_object().unwrap().clone();
    options.insert("_class_name".to_owned(), run["scheduler"].clone());
    if let Some(eta) = run["args"].get("eta") {
        options.insert("eta".to_owned(), eta.clone());
    }
    match SchedulerConfig::from_json(&Value::Object(options).to_string(), Path::new("manifest")) {
        Ok(config) => Ok(config),
        Err(Error::Unsupported { option, .. }) => Err(option),
        Err(error) => panic!("{error}"),
    }
}

/// The clean latents that a run starts from; encoded here where the run has the pixels.
fn start(pipeline: &Pipeline, golden: &Golden) -> Tensor<4> {
    let device = pipeline.device();
    if !golden.has("pixels") {
        return golden.tensor("start", device);
    }
    let [pixels, noise] = ["pixels", "posterior_noise"].map(|name| golden.tensor(name, device));
    let encoded = pipeline.encode(pixels, noise);
    // Ten times the noise floor of the models' encoders.
    expect(
        "encoded start",
        &numbers(&encoded),
        &golden.f32s("start"),
        3e-5,
    );
    encoded
}

fn request(run: &Value, config: SchedulerConfig, golden: &Golden, pipeline: &Pipeline) -> Request {
    let device = pipeline.device();
    let args = run["args"].as_object().unwrap();
    let mut request = Request::new(texts(&args["prompt"]))
        .with_scheduler(config)
        .with_steps(run["num_inference_steps"].as_u64().unwrap() as usize)
        .with_latents(golden.tensor("latents", device));
    for (key, value) in args {
        request = match key.as_str() {
            "prompt" | "eta" => request,
            "negative_prompt" => request.with_negative(texts(value)),
            "num_images_per_prompt" => request.with_count(value.as_u64().unwrap() as usize),
            "guidance_scale" => request.with_guidance(value.as_f64().unwrap()),
            "guidance_rescale" => request.with_guidance_rescale(value.as_f64().unwrap()),
            "strength" => {
                let image = StartImage::Latents(start(pipeline, golden));
                request.with_start(image, value.as_f64().unwrap())
            }
            other => panic!("the pipeline test does not know the argument {other}"),
        };
    }
    if golden.has("noise") {
        request.with_step_noise(golden.tensor("noise", device))
    } else {
        request
    }
}

/// |d| ≤ 2e-5 max|latents|, at least 2e-4.
fn expect_latents(what: &str, ours: &Tensor<4>, expected: &[f32]) {
    let allowed = (2e-5 * largest(expected)).max(2e-4);
    expect(what, &numbers(ours), expected, allowed);
}

/// Token ids and embeddings of the prompts, where the run has them.
fn check_text(
    name: &str,
    run: &Value,
    pipeline: &Pipeline,
    tokenizer: &Tokenizer,
    golden: &Golden,
) {
    for (key, ids, embeddings) in [
        ("prompt", "input_ids", "prompt_embeds"),
        (
            "negative_prompt",
            "negative_input_ids",
            "negative_prompt_embeds",
        ),
    ] {
        let Some(prompts) = run["args"].get(key).map(texts) else {
            continue;
        };
        if golden.has(ids) {
            let ours: Vec<i64> = prompts
                .iter()
                .flat_map(|prompt| tokenizer.encode(prompt).ids.map(i64::from))
                .collect();
            assert_eq!(ours, golden.i64s(ids), "{name}, {key}");
        }
        if golden.has(embeddings) {
            // Ten times the noise floor of the models' text encoders.
            let ours = numbers(&pipeline.embed(&prompts));
            expect(
                &format!("{name}, {embeddings}"),
                &ours,
                &golden.f32s(embeddings),
                2e-5,
            );
        }
    }
}

fn check_images(name: &str, pipeline: &Pipeline, latents: Tensor<4>, golden: &Golden) {
    let autoencoder = pipeline.autoencoder();
    let raw = autoencoder.decode(autoencoder.from_latents(latents.clone()));
    let image = pipeline.decode(latents);
    for (what, ours) in [("decoded_raw", &raw), ("image", &image)] {
        expect(
            &format!("{name}, {what}"),
            &numbers(ours),
            &golden.f32s(what),
            2e-5,
        );
    }
    let (ours, expected) = (to_bytes(image).concat(), golden.u8s("image_u8_nhwc"));
    assert_eq!(ours.len(), expected.len());
    let levels = ours
        .iter()
        .zip(&expected)
        .map(|(a, b)| a.abs_diff(*b))
        .max();
    assert!(levels <= Some(1), "{name}: bytes differ by {levels:?}");
}

fn check_run(name: &str, run: &Value, request: &Request, pipeline: &Pipeline, golden: &Golden) {
    let mut sampling = pipeline
        .sample(request)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let timesteps: Vec<f64> = run["timesteps"]
        .as_array()
        .unwrap()
        .iter()
        .map(|t| t.as_f64().unwrap())
        .collect();
    assert_eq!(sampling.len(), timesteps.len(), "{name}");
    for (i, progress) in sampling.by_ref().enumerate() {
        assert!(
            (progress.timestep - timesteps[i]).abs() < 1e-4,
            "{name}, call {i}"
        );
        let expected = numbers(&golden.entry::<4>("steps", i, pipeline.device()));
        expect_latents(&format!("{name}, step {i}"), &progress.latents, &expected);
    }
    let latents = sampling.latents();
    expect_latents(
        &format!("{name}, at the end"),
        &latents,
        &golden.f32s("final_latents"),
    );
    check_images(name, pipeline, latents, golden);
}

#[test]
fn whole_runs_follow_diffusers_step_by_step() {
    for (backend, device) in devices() {
        let (mut ran, mut refused) = (0, Vec::new());
        for Runs { models, runs } in all_runs() {
            let pipeline = Pipeline::load(&models, &device).unwrap();
            let tokenizer = Tokenizer::from_folder(&models.join("tokenizer")).unwrap();
            let manifest = json(&runs.join("manifest.json"));
            for (name, run) in manifest["runs"].as_object().unwrap() {
                let golden = Golden::read(&runs.join(format!("{name}.safetensors")));
                check_text(name, run, &pipeline, &tokenizer, &golden);
                match scheduler(run) {
                    Ok(config) => {
                        let request = request(run, config, &golden, &pipeline);
                        check_run(name, run, &request, &pipeline, &golden);
                        ran += 1;
                    }
                    Err(option) => refused.push(format!("{name} ({option})")),
                }
            }
        }
        println!(
            "{backend}: {ran} runs, {} refused {refused:?}",
            refused.len()
        );
        assert!(ran > 0, "no run ran");
    }
}
