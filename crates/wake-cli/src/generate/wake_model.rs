//! Generates images with the wake model of `wake-ldm`, or one of `wake train`.

use std::path::Path;
use std::time::Instant;

use crate::sheet::Picture;
use serde_json::json;
use wake_ldm::WakeSampler;
use wake_ldm::sampler::WakeImage;
use wake_ldm::sea_texture::SeaTexture;
use wake_nn::device_named;
use wake_physics::{Scene, output};
use wake_text::Reading;

use super::arguments::Arguments;
use super::results::{finish, numbered};
use crate::exit::{self, Outcome};

/// Images in a row of the contact sheet.
const ACROSS: usize = 4;

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    refuse_options(arguments)?;
    let device = device_named(&arguments.device)?;
    let begin = Instant::now();
    let mut sampler = match &arguments.weights {
        Some(folder) => WakeSampler::from_folder(folder, &device)?,
        None => WakeSampler::pretrained(&device)?,
    };
    if let Some(steps) = arguments.steps {
        sampler = sampler.with_steps(steps)?;
    }
    if let Some(file) = &arguments.sea {
        sampler = sampler.with_sea(SeaTexture::load(file, &device)?)?;
    }
    let load = begin.elapsed().as_secs_f64();
    let scene = arguments.scene(|| sampler.base_scene())?;
    let prompt = arguments.prompt(scene.as_ref())?;
    let reading = Reading::of(&prompt)?;
    let (count, seed) = (arguments.count, arguments.seed);
    // Samples all images as one batch.
    let images = match &scene {
        Some(scene) => sampler.sample_scenes(&seeded(scene, seed, count))?,
        None => sampler.sample_many(&vec![prompt.as_str(); count], seed)?,
    };
    let total = begin.elapsed().as_secs_f64();
    whole_files::make_folder(&arguments.out)?;
    let files = write_images(&images, arguments)?;
    let seconds = images[0].seconds;
    let report = json!({
        "prompt": prompt, "stated": reading.scene, "unread": reading.unread, "scene": images[0].scene, "seed": seed,
        "steps": sampler.steps(), "count": count, "device": arguments.device,
        "weights": arguments.weights, "sea": arguments.sea, "files": files,
        "seconds": {
            "load": load, "text": seconds.text, "expect": seconds.expect, "denoise": seconds.denoise,
            "decode": seconds.decode, "total": total,
        },
    });
    if !arguments.json {
        for part in &reading.unread {
            exit::say(&format!("not read: {}", part.text))?;
        }
        exit::say(&format!(
            "generated: {}",
            wake_text::prompt(&images[0].scene)?
        ))?;
    }
    finish(arguments, &report)
}

/// Copies of a scene with consecutive seeds.
fn seeded(scene: &Scene, seed: u64, count: usize) -> Vec<Scene> {
    let seeds = (0..count as u64).map(|k| seed.wrapping_add(k));
    let scenes = seeds.map(|seed| Scene {
        seed,
        ..scene.clone()
    });
    scenes.collect()
}

/// Rejects options of other models: the wake model has one sampler and no guidance, and draws all images at once.
fn refuse_options(arguments: &Arguments) -> Result<(), String> {
    let given = [
        ("--scheduler", arguments.scheduler.is_some()),
        ("--guidance", arguments.guidance.is_some()),
        ("--negative", arguments.negative.is_some()),
    ];
    if let Some((flag, _)) = given.iter().find(|(_, given)| *given) {
        return Err(format!(
            "{flag} applies to models in diffusers layout only; leave it out, or give one with --weights"
        ));
    }
    if !(1..=256).contains(&arguments.count) {
        return Err(format!("--count is {}, outside [1, 256]", arguments.count));
    }
    Ok(())
}

/// Writes each image with its labels, and sheets; returns the names of the pictures.
fn write_images(images: &[WakeImage], arguments: &Arguments) -> wake_physics::Result<Vec<String>> {
    let (out, count) = (&arguments.out, images.len());
    let columns = images[0].grey.columns;
    let mut names = Vec::new();
    let mut pictures = Vec::new();
    for (k, image) in images.iter().enumerate() {
        let levels = image.levels();
        let name = numbered("image", k, count, "png");
        output::write_png(&out.join(&name), &levels, image.grey.rows, columns)?;
        whole_files::write_json(
            &out.join(numbered("labels", k, count, "json")),
            &image.labels,
        )?;
        names.push(name);
        pictures.push(Picture::from_levels(&levels, columns));
    }
    if count > 1 {
        sheet(&pictures, images, &out.join("sheet.png"))?;
        names.push("sheet.png".to_owned());
    }
    if arguments.overlay {
        for (picture, image) in pictures.iter_mut().zip(images) {
            picture.draw_labels(&image.labels);
        }
        sheet(&pictures, images, &out.join("overlay.png"))?;
        names.push("overlay.png".to_owned());
    }
    Ok(names)
}

/// Writes pictures as one sheet, each with its seed as caption.
fn sheet(pictures: &[Picture], images: &[WakeImage], path: &Path) -> wake_physics::Result<()> {
    let pictures = pictures.iter().zip(images);
    let captioned: Vec<Picture> = pictures
        .map(|(picture, image)| {
            picture
                .clone()
                .captioned(&format!("seed {}", image.scene.seed))
        })
        .collect();
    Picture::sheet(&captioned, ACROSS).write(path)
}
