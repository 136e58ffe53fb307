//! What is asked for on the command line.

use super::product::ProductArguments;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Simulate the SAR image of a ship wake from the numbers of a scene.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                  grid.spacing is that of the image; the plan says which spacing is computed on (computed_spacing): docs/scene.md"
)]
pub(crate) struct Arguments {
    /// Scene file (TOML), or several; without it, the default scene with its ship
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) scene: Vec<PathBuf>,
    /// Change one value of the scene, such as ship.speed=8; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Fast methods, or the slow oracles that they are checked against
    #[arg(long, value_enum, default_value = "fast")]
    pub(crate) method: MethodName,
    /// Grey scale of the picture: decibels on one scale for all scenes, or amplitude as in quick-looks
    #[arg(long, value_enum, default_value = "decibel")]
    pub(crate) grey: GreyName,
    /// Write image.png alone: no fields, labels or report
    #[arg(long, conflicts_with_all = ["overlay", "export", "compare"])]
    pub(crate) only_image: bool,
    /// Also write the picture with boxes, arms and tips drawn on it
    #[arg(long)]
    pub(crate) overlay: bool,
    /// Also write every field as a file of its own, for NumPy or as TIFF
    #[arg(long, value_enum, value_delimiter = ',')]
    pub(crate) export: Vec<Export>,
    /// Folder of the results, made if absent; with several scenes, a folder per scene in it
    #[arg(long, value_name = "DIR", default_value = "out/simulate")]
    pub(crate) out: PathBuf,
    /// Compare open sea and wakes with those of the PNG images of a folder (grey linear in amplitude; the axes of wakes in
    /// its labels.json, if there is one)
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
