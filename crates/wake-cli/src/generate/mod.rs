//! `wake generate`: generates radar images from a sentence (or a scene) with a diffusion model.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod diffusers;
mod results;
mod wake_model;

use crate::exit::Outcome;
pub(crate) use arguments::Arguments;
#[cfg(feature = "train")]
pub(crate) use diffusers::scheduler_of;

/// Writes `image.png` and `report.json`; with `--count`, `image-0.png`, `image-1.png`, … and all of them as
/// `sheet.png`. The wake model also writes the labels of each image (`labels.json`, `labels-0.json`, …), and prints the
/// scene of the image (the prompt's values, and defaults for the rest) and the parts of the prompt that it did not
/// read. A prompt that states nothing about a scene is an error.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match arguments.weights.as_deref() {
        None => wake_model::run(arguments),
        Some(folder) if folder.join("unet").is_dir() => diffusers::run(arguments, folder),
        Some(_) if arguments.lora.is_some() => {
            Err("--lora applies to models in diffusers layout only; leave it out".into())
        }
        Some(folder) if folder.join("config.json").is_file() => wake_model::run(arguments),
        Some(folder) => Err(format!(
            "--weights {}: no model found; expected config.json (from `wake train`) or unet/ (diffusers layout) in this folder",
            folder.display()
        )
        .into()),
    }
}
