//! The small model of `wake-ldm`, or one that `train` wrote.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use serde_json::json;
use wake_ldm::sampler::WakeImage;
use wake_ldm::{WakeSampler, device_named};
use wake_physics::{Scene, output};
use wake_text::Reading;

use super::{Arguments, exit, finish, image_name, prompt};

/// Images in a row of the contact sheet.
const ACROSS: usize = 4;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    refuse_options(arguments)?;
    let scene = arguments.scene.as_deref().map(Scene::read).transpose()?;
    let prompt = prompt(arguments, scene.as_ref())?;
    let reading = Reading::of(&prompt)?;
    let device = device_named(&arguments.device)?;
    let begin = Instant::now();
    let mut sampler = match &arguments.weights {
        Some(folder) => WakeSampler::from_folder(folder, &device)?,
        None => WakeSampler::pretrained(&device)?,
    };
    if let Some(steps) = arguments.steps {
        sampler = sampler.with_steps(steps)?;
    }
    let load = begin.elapsed().as_secs_f64();
    let (count, seed) = (arguments.count, arguments.seed);
    // All images as one batch.
    let images = match &scene {
        Some(scene) => sampler.sample_scenes(&seeded(scene, seed, count))?,
        None => sampler.sample_many(&vec![prompt.as_str(); count], seed)?,
    };
    let total = begin.elapsed().as_secs_f64();
    output::make_folder(&arguments.out)?;
    let files = write_images(&images, &arguments.out)?;
    let labels: Vec<_> = images.iter().map(|image| &image.labels).collect();
    output::write_json(&arguments.out.join("labels.json"), &labels)?;
    let seconds = images[0].seconds;
    let report = json!({
        "prompt": prompt, "stated": reading.scene, "unread": reading.unread, "scene": images[0].scene, "seed": seed, "steps": sampler.steps(), "count": count, "device": arguments.device,
        "weights": arguments.weights, "files": files,
        "seconds": {
            "load": load, "text": seconds.text, "expect": seconds.expect, "denoise": seconds.denoise,
            "decode": seconds.decode, "total": total,
        },
    });
    if !arguments.json {
        for part in &reading.unread {
            exit::say(&format!("not read: {}", part.text))?;
        }
        exit::say(&format!("drawn: {}", wake_text::prompt(&images[0].scene)?))?;
    }
    finish(arguments, &report)
}

/// A scene with seeds that count up.
fn seeded(scene: &Scene, seed: u64, count: usize) -> Vec<Scene> {
    let seeds = (0..count as u64).map(|k| seed.wrapping_add(k));
    let scenes = seeds.map(|seed| Scene {
        seed,
        ..scene.clone()
    });
    scenes.collect()
}

/// The small model has one sampler and no guidance, and draws all images at once.
fn refuse_options(arguments: &Arguments) -> Result<(), String> {
    let given = [
        ("--scheduler", arguments.scheduler.is_some()),
        ("--guidance", arguments.guidance.is_some()),
        ("--negative", arguments.negative.is_some()),
    ];
    if let Some((flag, _)) = given.iter().find(|(_, given)| *given) {
        return Err(format!(
            "{flag} is for models in diffusers layout; leave it out, or name one with --weights"
        ));
    }
    if !(1..=256).contains(&arguments.count) {
        return Err(format!("--count is {}, outside [1, 256]", arguments.count));
    }
    Ok(())
}

/// Writes each image, and all of them as one, and returns their names.
fn write_images(images: &[WakeImage], out: &Path) -> wake_physics::Result<Vec<String>> {
    let levels: Vec<Vec<u8>> = images.iter().map(WakeImage::levels).collect();
    let [rows, columns] = [images[0].grey.rows, images[0].grey.columns];
    let mut names = Vec::new();
    if images.len() > 1 {
        let sheet = sheet(&levels, columns);
        let width = columns * images.len().min(ACROSS);
        output::write_png(&out.join("sheet.png"), &sheet, sheet.len() / width, width)?;
        names.push("sheet.png".to_owned());
    }
    for (k, levels) in levels.iter().enumerate() {
        let name = image_name(k, images.len());
        output::write_png(&out.join(&name), levels, rows, columns)?;
        names.push(name);
    }
    Ok(names)
}

/// Images side by side, [`ACROSS`] in a row; what is left of the last row is black.
fn sheet(images: &[Vec<u8>], columns: usize) -> Vec<u8> {
    let across = images.len().min(ACROSS);
    let rows_of_images = images.chunks(across).map(|beside| {
        let rows = beside[0].len() / columns;
        let mut block = vec![0; rows * across * columns];
        for (k, image) in beside.iter().enumerate() {
            let lines = block.chunks_mut(across * columns);
            for (line, row) in lines.zip(image.chunks(columns)) {
                line[k * columns..][..columns].copy_from_slice(row);
            }
        }
        block
    });
    rows_of_images.flatten().collect()
}
