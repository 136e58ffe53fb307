//! Arguments of `wake simulate`.

use super::product::ProductArguments;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Simulate the SAR image of a ship wake from the parameters of a scene.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                  grid.spacing is the image's spacing; the plan says which spacing is computed on (computed_spacing): docs/scene.md"
)]
pub(crate) struct Arguments {
    /// Scene files (TOML), one or more [default: the default scene, with a ship]
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) scene: Vec<PathBuf>,
    /// Set one value of the scene, such as ship.speed=8; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Method: the fast methods, or the slow reference methods (direct) that validate them
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) method: MethodName,
    /// Grey scale of the picture: decibel (one scale for all scenes) or amplitude (as in quick-looks)
    #[arg(long, value_enum, default_value = "decibel")]
    pub(crate) grey: GreyName,
    /// Write only image.png, without fields, labels and report
    #[arg(long, conflicts_with_all = ["overlay", "export", "compare"])]
    pub(crate) only_image: bool,
    /// Also write the picture with boxes, arms and tips drawn on it (overlay.png)
    #[arg(long)]
    pub(crate) overlay: bool,
    /// Also write each field to a file of its own, as NumPy array or TIFF; separate several with commas
    #[arg(long, value_enum, value_delimiter = ',')]
    pub(crate) export: Vec<Export>,
    /// Folder for the results, created if absent; with several scenes, a subfolder for each
    #[arg(long, value_name = "DIR", default_value = "out/simulate")]
    pub(crate) out: PathBuf,
    /// Compare open sea and wakes with the PNG images in a folder (grey linear in amplitude; wake axes from its
    /// labels.json, if there is one)
    #[arg(long, value_name = "DIR")]
    pub(crate) compare: Option<PathBuf>,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) product: ProductArguments,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum MethodName {
    Fast,
    Direct,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum GreyName {
    Decibel,
    Amplitude,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Export {
    Npy,
    Tiff,
}
