//! What is asked for on the command line.

use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Estimate ship and sea from the image of a wake, with standard deviations.
///
/// Without arguments it simulates the default scene and finds it again.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                  Experimental: the coverage of the error bars is not yet measured (docs/reports/estimate.md)\n\
                  Values, error bars and limits: docs/estimate.md"
)]
pub(crate) struct Arguments {
    /// Image: fields.safetensors of a simulation (its field `speckled`), or a grey PNG, JPEG or TIFF
    #[arg(long, value_name = "FILE", conflicts_with = "bound")]
    pub(crate) image: Option<PathBuf>,
    /// Scene file (TOML) of what is known: pixel, radar, fetch, depth, length and proportions of the ship
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Change one value of the scene, such as radar.incidence=35; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Quantity that the grey of a picture is linear in; its gain is then estimated, too
    #[arg(long, value_enum, default_value = "decibel")]
    pub(crate) grey: GreyName,
    /// Tip of the wake (the ship) in the image, column and row, if a detector found it; without it, the ship is searched everywhere
    #[arg(
        long,
        value_name = "COLUMN,ROW",
        value_delimiter = ',',
        num_args = 2,
        allow_negative_numbers = true
    )]
    pub(crate) tip: Option<Vec<f64>>,
    /// Distance from --tip within which the ship is searched [m]
    #[arg(long, value_name = "METRES", default_value_t = 80.0, requires = "tip")]
    pub(crate) within: f64,
    /// Heading to within 15 degrees, if a detector found it
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub(crate) heading: Option<f64>,
    /// The image has any brightness: the wind is read from the texture alone
    #[arg(long)]
    pub(crate) uncalibrated: bool,
    /// Print the smallest standard deviations that any estimator can reach for the scene, without an image
    #[arg(long)]
    pub(crate) bound: bool,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/estimate")]
    pub(crate) out: PathBuf,
    /// Print the estimate as JSON on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum GreyName {
    /// The pictures of `wake simulate`
    Decibel,
    /// Quick-looks
    Amplitude,
}
