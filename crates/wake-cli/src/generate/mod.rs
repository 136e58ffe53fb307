//! `wake generate`: a sentence (or a scene) becomes a radar image with the diffusion model.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod diffusers;
mod results;
mod wake_model;

use crate::exit::Outcome;
pub(crate) use arguments::Arguments;

/// Writes `image.png` (`image-0.png`, `image-1.png`, … and all of them as `sheet.png` with `--count`) and `report.json`; the
/// wake model also writes the labels of each image (`labels.json`, `labels-0.json`, …), and says which scene it drew (what
/// the prompt states, and the default values of what it leaves open) and which parts of the prompt it did not read. A prompt
/// that states nothing of a scene is an error.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match arguments.weights.as_deref() {
        None => wake_model::run(arguments),
        Some(folder) if folder.join("unet").is_dir() => match &arguments.sea {
            None => diffusers::run(arguments, folder),
            Some(_) => Err("--sea is for the wake model; leave it out, or --weights".into()),
        },
        Some(folder) if folder.join("config.json").is_file() => wake_model::run(arguments),
        Some(folder) => Err(format!(
            "--weights {}: no model there; a folder that `wake train` wrote holds config.json, one in diffusers layout unet/",
            folder.display()
        )
        .into()),
    }
}
