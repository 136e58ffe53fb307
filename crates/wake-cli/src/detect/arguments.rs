//! Arguments of `wake detect`.

use std::path::PathBuf;

use wake_detector::LEAST_SCORE;

use crate::exit::Outcome;
use crate::{locate, named};

/// Detection method.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// The trained network
    Network,
    /// Normalised Radon transform around bright targets and over the whole image
    Radon,
}

/// Find ship wakes in radar images.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Arguments {
    /// Images (PNG, JPEG or TIFF; grey, 8 or 16 bits) or folders of images (without *.wakes.png); or one satellite
    /// product: a Sentinel-1 .SAFE folder or .zip, or a GeoTIFF
    #[arg(required = true, value_name = "FILE|DIR")]
    pub(super) images: Vec<PathBuf>,
    /// Pixel spacing (m) [default: the product's spacing; for images, the scale is estimated from the speckle]
    #[arg(long, value_parser = named::spacing)]
    pub(super) spacing: Option<f32>,
    /// Detection method for images; products are searched with the network
    #[arg(long, value_enum, default_value_t = Method::Network)]
    pub(super) method: Method,
    /// Weights of the network [default: the shipped weights]
    #[arg(long, value_name = "FILE")]
    pub(super) weights: Option<PathBuf>,
    /// Leave out detections of the network with a lower score, 0 to 1 [default: 0.03]
    #[arg(long, value_parser = named::score)]
    pub(super) least_score: Option<f32>,
    /// Print the wakes as JSON, and nothing else
    #[arg(long)]
    pub(super) json: bool,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    pub(super) device: String,
    /// Folder for the results, created if absent
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
    /// Land polygons (GeoJSON), instead of the built-in coast of Natural Earth
    #[arg(long, value_name = "FILE")]
    pub(super) land: Option<PathBuf>,
    /// Search land as well
    #[arg(long, conflicts_with = "land")]
    pub(super) no_land: bool,
    /// Leave out sea closer to land than this (m) [default: 1000]
    #[arg(long, value_name = "N", conflicts_with = "no_land")]
    pub(super) coast: Option<f64>,
    /// Estimate speed, heading and wind of each sure wake of a Sentinel-1 product, with standard deviations (a minute
    /// or two per wake)
    #[cfg(feature = "simulate")]
    #[arg(long)]
    pub(super) estimate: bool,
    /// Polarization: VV, HH, VH or HV [default: the first of these in the product]
    #[arg(long, value_parser = locate::polarization)]
    pub(super) polarization: Option<wake_geo::Polarization>,
}

impl Arguments {
    /// Score below which detections of the network are left out.
    pub(super) fn least_score(&self) -> f32 {
        self.least_score.unwrap_or(LEAST_SCORE)
    }

    /// Rejects options that would have no effect.
    ///
    /// - `on_product`: whether a product is searched, instead of images
    pub(super) fn check(&self, on_product: bool) -> Outcome<()> {
        let radon = self.method == Method::Radon;
        let of_network = [
            ("--weights", self.weights.is_some()),
            ("--spacing", self.spacing.is_some()),
            ("--least-score", self.least_score.is_some()),
        ];
        let product = &self.product;
        let of_products = [
            ("--geojson", product.geojson.is_some()),
            ("--land", product.land.is_some()),
            ("--no-land", product.no_land),
            ("--coast", product.coast.is_some()),
            #[cfg(feature = "simulate")]
            ("--estimate", product.estimate),
            ("--polarization", product.polarization.is_some()),
        ];
        let given = |options: &[(&'static str, bool)]| {
            let first = options.iter().find(|(_, given)| *given);
            first.map(|(option, _)| *option)
        };
        if on_product && radon {
            return Err("--method radon searches images, not products; leave it out".into());
        }
        if let Some(option) = given(&of_network).filter(|_| radon) {
            return Err(format!(
                "{option} applies to the network only; leave it out with --method radon"
            )
            .into());
        }
        if let Some(option) = given(&of_products).filter(|_| !on_product) {
            return Err(format!(
                "{option} applies to a satellite product only; leave it out, or search one product"
            )
            .into());
        }
        Ok(())
    }
}

impl ProductArguments {
    /// Sea closer to land is left out \[m\].
    pub(super) fn coast(&self) -> f64 {
        self.coast.unwrap_or(1000.0)
    }
}
