//! Arguments of `wake detect`.

use std::path::PathBuf;

use crate::{locate, named};

/// The method of the search.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// The trained network
    Network,
    /// A normalised Radon transform around bright targets and over the whole image
    Radon,
}

/// Find ship wakes in radar images.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Arguments {
    /// Images (PNG, JPEG or TIFF, grey, 8 or 16 bits) or folders of them, whose *.wakes.png are left out; or one satellite
    /// product: a Sentinel-1 .SAFE folder or .zip, or a GeoTIFF
    #[arg(required = true, value_name = "FILE|DIR")]
    pub(super) images: Vec<PathBuf>,
    /// Pixel spacing [m]; without it the scale is estimated from the speckle
    #[arg(long, value_parser = named::spacing)]
    pub(super) spacing: Option<f32>,
    /// Method of the search
    #[arg(long, value_enum, default_value_t = Method::Network)]
    pub(super) method: Method,
    /// Weights of the network, by default those in the repository
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Leave out detections with a lower score, 0 to 1
    #[arg(long, default_value_t = 0.03, value_parser = named::score)]
    pub(super) least_score: f32,
    /// Print the wakes as JSON, and nothing else
    #[arg(long)]
    pub(super) json: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    pub(super) device: String,
    /// Folder of the pictures, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/detect")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(super) product: ProductArguments,
}

/// Arguments for satellite products.
#[derive(clap::Args, Debug, Clone)]
#[command(next_help_heading = "Products")]
pub(crate) struct ProductArguments {
    /// Also write the wakes as GeoJSON to this file
    #[arg(long, value_name = "FILE")]
    pub(super) geojson: Option<PathBuf>,
    /// Polygons of land (GeoJSON), instead of the built-in coast of Natural Earth
    #[arg(long, value_name = "FILE")]
    pub(super) land: Option<PathBuf>,
    /// Search land too
    #[arg(long, conflicts_with = "land")]
    pub(super) no_land: bool,
    /// Sea closer to land than this is left out [m]
    #[arg(long, value_name = "N", default_value_t = 1000.0)]
    pub(super) coast: f64,
    /// Estimate speed, heading and wind of each sure wake of a Sentinel-1 product, with standard deviations; a minute or two a wake
    #[cfg(feature = "simulate")]
    #[arg(long)]
    pub(super) estimate: bool,
    /// VV, HH, VH or HV, by default the first of these that the product has
    #[arg(long, value_parser = locate::polarization)]
    pub(super) polarization: Option<wake_geo::Polarization>,
}
