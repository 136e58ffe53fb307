//! Generates images with a model in diffusers layout, such as Stable Diffusion v1.4.

use std::path::Path;
use std::time::Instant;

use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use serde_json::{Value, json};
use wake_ldm::pipeline::{Pipeline, Request, to_bytes};
use wake_ldm::scheduler::{SchedulerConfig, SchedulerOption};
use wake_nn::burn::tensor::Tensor;
use wake_nn::device_named;
use wake_physics::Scene;

use super::arguments::Arguments;
use super::results::{finish, numbered};
use crate::exit::Outcome;
use crate::progress;

/// Default number of steps.
const STEPS: usize = 50;
/// Default guidance scale.
const GUIDANCE: f64 = 7.5;

pub(crate) fn run(arguments: &Arguments, weights: &Path) -> Outcome<()> {
    for (given, option) in [
        (arguments.sea.is_some(), "--sea"),
        (arguments.overlay, "--overlay"),
    ] {
        if given {
            return Err(format!(
                "{option} applies to the wake model only; leave it out, or leave out --weights"
            )
            .into());
        }
    }
    let scene = arguments.scene(Scene::default)?;
    let prompt = arguments.prompt(scene.as_ref())?;
    let device = device_named(&arguments.device)?;
    let begin = Instant::now();
    let mut pipeline = Pipeline::load(weights, &device)?;
    if let Some(lora) = &arguments.lora {
        pipeline = pipeline.with_lora(lora, 1.0)?;
    }
    let load = begin.elapsed().as_secs_f64();
    check_grid(scene.as_ref(), pipeline.image_size())?;
    let scheduler = scheduler_of(&pipeline, arguments.scheduler.as_deref())?;
    let request = request(arguments, &prompt, scheduler.clone());
    let (images, mut seconds) = generate(&pipeline, &request, arguments, &prompt)?;
    seconds["load"] = json!(load);
    seconds["total"] = json!(begin.elapsed().as_secs_f64());
    let report = json!({
        "prompt": prompt, "negative": negative(arguments), "seed": arguments.seed,
        "steps": arguments.steps.unwrap_or(STEPS), "guidance": arguments.guidance.unwrap_or(GUIDANCE),
        "count": arguments.count, "scheduler": scheduler.to_json(), "device": arguments.device, "weights": weights,
        "files": write_images(images, &arguments.out)?, "seconds": seconds,
    });
    finish(arguments, &report)
}

/// Rejects a scene whose image size differs from the model's.
fn check_grid(scene: Option<&Scene>, [rows, columns]: [usize; 2]) -> Result<(), String> {
    match scene.map(|scene| &scene.grid) {
        Some(grid) if [grid.rows, grid.columns] != [rows, columns] => Err(format!(
            "the scene's grid is {} × {} pixels, but the model makes {rows} × {columns}; set \
             grid.rows={rows} and grid.columns={columns}",
            grid.rows, grid.columns
        )),
        _ => Ok(()),
    }
}

/// The model's own scheduler, or another class with the same options.
pub(crate) fn scheduler_of(
    pipeline: &Pipeline,
    name: Option<&str>,
) -> wake_ldm::Result<SchedulerConfig> {
    let own = pipeline.scheduler().clone();
    match name {
        None => Ok(own),
        // The model's file may leave clipping to its default, but latents must not be clipped.
        Some(name) => Ok(own
            .with(SchedulerOption::ClipSample(false))?
            .with_class(name)?),
    }
}

fn negative(arguments: &Arguments) -> &str {
    arguments.negative.as_deref().unwrap_or_default()
}

fn request(arguments: &Arguments, prompt: &str, scheduler: SchedulerConfig) -> Request {
    Request::new(prompt)
        .with_negative(negative(arguments))
        .with_guidance(arguments.guidance.unwrap_or(GUIDANCE))
        .with_steps(arguments.steps.unwrap_or(STEPS))
        .with_scheduler(scheduler)
        .with_count(arguments.count)
        .with_seed(arguments.seed)
}

/// Runs the stages; returns the images and the seconds of each stage.
fn generate(
    pipeline: &Pipeline,
    request: &Request,
    arguments: &Arguments,
    prompt: &str,
) -> Outcome<(Tensor<4>, Value)> {
    let begin = Instant::now();
    // Embeddings are cached, so the run does not compute them again.
    pipeline.embed(&[prompt, negative(arguments)]);
    let text = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let mut sampling = pipeline.sample(request)?;
    // A rejected request leaves no folder behind.
    whole_files::make_folder(&arguments.out)?;
    let bar = progress::bar(sampling.len() as u64, "steps");
    for progress in sampling.by_ref() {
        bar.set_position(progress.done as u64);
    }
    bar.finish_and_clear();
    // Reading the numbers waits for the device.
    let latents = sampling.latents();
    latents.to_data();
    let denoise = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let images = pipeline.decode(latents);
    images.to_data();
    let decode = begin.elapsed().as_secs_f64();
    Ok((
        images,
        json!({"text": text, "denoise": denoise, "decode": decode}),
    ))
}

/// Writes one PNG per image and returns their names.
fn write_images(images: Tensor<4>, out: &Path) -> Outcome<Vec<String>> {
    let [count, channels, rows, columns] = images.dims();
    let color = match channels {
        1 => image::ExtendedColorType::L8,
        _ => image::ExtendedColorType::Rgb8,
    };
    let mut names = Vec::new();
    for (k, bytes) in to_bytes(images).into_iter().enumerate() {
        let (name, mut png) = (numbered("image", k, count, "png"), Vec::new());
        PngEncoder::new(&mut png).write_image(&bytes, columns as u32, rows as u32, color)?;
        whole_files::write_atomically(&out.join(&name), &png)?;
        names.push(name);
    }
    Ok(names)
}
