//! The small model of `wake-ldm`, or one that `train` wrote.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use serde_json::json;
use wake_ldm::WakeSampler;
use wake_ldm::sampler::WakeImage;
use wake_physics::Scene;

use super::{Arguments, device, finish, prompt};

/// Images in a row of the contact sheet.
const ACROSS: usize = 4;

/// Whether a folder holds a small model.
pub(crate) fn is_small(folder: &Path) -> bool {
    folder.join("patches.safetensors").is_file()
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    refuse_options(arguments)?;
    let device = device(&arguments.device)?;
    let begin = Instant::now();
    let mut sampler = match &arguments.weights {
        Some(folder) => WakeSampler::from_folder(folder, &device)?,
        None => WakeSampler::pretrained(&device)?,
    };
    if let Some(steps) = arguments.steps {
        sampler = sampler.with_steps(steps)?;
    }
    let load = begin.elapsed().as_secs_f64();
    let images = sample(&sampler, arguments)?;
    let seconds = images[0].seconds;
    let total = begin.elapsed().as_secs_f64();
    std::fs::create_dir_all(&arguments.out)?;
    let files = write_images(&images, &arguments.out)?;
    let labels: Vec<_> = images.iter().map(|image| &image.labels).collect();
    std::fs::write(
        arguments.out.join("labels.json"),
        format!("{:#}\n", json!(labels)),
    )?;
    let report = json!({
        "prompt": prompt(arguments)?.0, "seed": arguments.seed, "steps": sampler.steps(),
        "count": images.len(), "device": arguments.device, "weights": arguments.weights, "files": files,
        "seconds": {
            "load": load, "text": seconds.text, "denoise": seconds.denoise, "decode": seconds.decode,
            "total": total,
        },
    });
    finish(arguments, &report, &files)
}

/// The small model has one sampler and no guidance.
fn refuse_options(arguments: &Arguments) -> Result<(), String> {
    if arguments.scheduler.is_some() || !arguments.negative.is_empty() {
        return Err(
            "--scheduler and --negative are for models in diffusers layout; give --weights".into(),
        );
    }
    if !(1..=256).contains(&arguments.count) {
        return Err(format!("--count is {}, outside [1, 256]", arguments.count));
    }
    Ok(())
}

/// All images as one batch.
fn sample(sampler: &WakeSampler, arguments: &Arguments) -> Result<Vec<WakeImage>, Box<dyn Error>> {
    let Some(path) = &arguments.scene else {
        let (prompt, _) = prompt(arguments)?;
        return Ok(sampler.sample_many(&vec![prompt.as_str(); arguments.count], arguments.seed)?);
    };
    let scene = Scene::read(path)?;
    Ok(sampler.sample_scenes(&vec![scene; arguments.count], arguments.seed)?)
}

/// Writes each image, and all of them as one, and returns their names.
fn write_images(images: &[WakeImage], out: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let save = |name: &str, levels: &[u8], columns: usize| {
        let rows = levels.len() / columns;
        image::save_buffer(
            out.join(name),
            levels,
            columns as u32,
            rows as u32,
            image::ColorType::L8,
        )
    };
    let size = images[0].grey.columns;
    if let [image] = images {
        save("image.png", &image.levels(), size)?;
        return Ok(vec!["image.png".to_owned()]);
    }
    let across = images.len().min(ACROSS);
    let mut sheet = vec![0; across * size * images.len().div_ceil(across) * size];
    let mut names = vec!["sheet.png".to_owned()];
    for (k, image) in images.iter().enumerate() {
        let (levels, name) = (image.levels(), format!("image-{k}.png"));
        save(&name, &levels, size)?;
        names.push(name);
        let corner = (k / across * size) * across * size + k % across * size;
        for (i, row) in levels.chunks(size).enumerate() {
            let start = corner + i * across * size;
            sheet[start..start + size].copy_from_slice(row);
        }
    }
    save("sheet.png", &sheet, across * size)?;
    Ok(names)
}
