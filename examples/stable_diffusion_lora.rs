//! Trains a low-rank adaptation of a model in Stable Diffusion's layout on simulated pairs, and generates an image with
//! it:
//! `cargo run --release --example stable_diffusion_lora -- stable-diffusion-v1-4` (default: a tiny model of the tests).

use std::path::{Path, PathBuf};

use wake_dataset::{Folder, Manifest, Recipe, write};
use wake_ldm::pipeline::{Pipeline, Request, to_bytes};
use wake_nn::burn::tensor::Device;
use wake_train::{FineTuning, StageOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tiny = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/pipeline_a");
    let weights = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| tiny.to_owned()));
    let pipeline = Pipeline::load(&weights, &Device::default())?;
    let [rows, columns] = pipeline.image_size();
    let out = Path::new("out/stable_diffusion_lora");

    let recipe = Recipe::default().with_assignments(&[
        format!("scene.grid.rows = {rows}"),
        format!("scene.grid.columns = {columns}"),
    ])?;
    let set = out.join(format!("{rows}x{columns}"));
    let manifest = Manifest::new(recipe, 7, 8)?;
    write(&set, &manifest, &manifest.source()?, 2, |_| ())?;

    let tuned = out.join(weights.file_name().unwrap_or_default());
    let tuning = FineTuning {
        weights: &weights,
        data: &Folder::open(&set)?,
        rank: Some(4),
        snr_gamma: None,
        options: StageOptions {
            steps: Some(4),
            batch: Some(2),
            rate: Some(1e-4),
            resume: tuned.join("checkpoints").is_dir(),
            ..StageOptions::default()
        },
    };
    tuning.train(&tuned, &|_| ())?;

    // The adaptation is a separate file, which is added to the weights at any scale.
    let adaptations = tuned.join("pytorch_lora_weights.safetensors");
    let pipeline = pipeline.with_lora(&adaptations, 0.8)?;
    let request = Request::new("a ship and its wake, radar image")
        .with_steps(10)
        .with_seed(7);
    let bytes = to_bytes(pipeline.generate(&request)?).remove(0);
    let file = out.join("image.png");
    let [rows, columns] = [rows as u32, columns as u32];
    match bytes.len() as u32 / (rows * columns) {
        1 => image::save_buffer(&file, &bytes, columns, rows, image::ColorType::L8)?,
        _ => image::save_buffer(&file, &bytes, columns, rows, image::ColorType::Rgb8)?,
    }
    println!("{} and {}", adaptations.display(), file.display());
    Ok(())
}
