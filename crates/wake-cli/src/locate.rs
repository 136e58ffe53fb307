//! `wake locate`: places and calibration of single pixels.

use std::path::PathBuf;

use clap::Args;
use wake_geo::{Located, Polarization, Product, locate};

use crate::exit::{self, Outcome};

/// Print the place on Earth and the calibration of pixels of a product.
#[derive(Args)]
#[command(after_help = "Rules of interpolation and calibration: docs/products.md")]
pub(crate) struct Arguments {
    /// Sentinel-1 GRD product (.SAFE folder or .zip), or GeoTIFF
    #[arg(value_name = "PRODUCT")]
    product: PathBuf,
    /// Pixels, as line and pixel counted from 0
    #[arg(required = true, value_name = "LINE,PIXEL", value_parser = pixel)]
    places: Vec<(usize, usize)>,
    /// Compute σ⁰ of this digital number instead of the measured one
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    dn: Option<f64>,
    /// Polarization: VV, HH, VH or HV [default: the first of these in the product]
    #[arg(long, value_parser = polarization)]
    polarization: Option<Polarization>,
    /// Print one JSON object per line for each pixel, and nothing else
    #[arg(long)]
    json: bool,
}

/// Prints the places in the given order; prints nothing if one of them fails.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let path = &arguments.product;
    let product = match arguments.polarization {
        Some(polarization) => Product::open_polarization(path, polarization)?,
        None => Product::open(path)?,
    };
    let line = |&(line, pixel): &(usize, usize)| -> Outcome<String> {
        let located = locate(&product, line, pixel, arguments.dn)?;
        Ok(match arguments.json {
            true => serde_json::to_string(&located)?,
            false => sentence(&located),
        })
    };
    let lines: Vec<String> = arguments.places.iter().map(line).collect::<Outcome<_>>()?;
    Ok(exit::say(&lines.join("\n"))?)
}

/// Parses `LINE,PIXEL`.
fn pixel(text: &str) -> Result<(usize, usize), String> {
    let number = |text: &str| text.trim().parse().ok();
    text.split_once(',')
        .and_then(|(line, pixel)| number(line).zip(number(pixel)))
        .ok_or_else(|| "give two whole numbers from 0, such as 4512,9512".to_owned())
}

/// Parses the name of a polarization.
pub(crate) fn polarization(name: &str) -> Result<Polarization, String> {
    Polarization::from_name(name).ok_or_else(|| "give VV, HH, VH or HV".to_owned())
}

/// A place as a line of text.
fn sentence(located: &Located) -> String {
    let of = |value: f64, [positive, negative]: [&str; 2]| {
        let side = if value < 0.0 { negative } else { positive };
        format!("{:.7}° {side}", value.abs())
    };
    let mut parts = vec![
        of(located.latitude, ["N", "S"]),
        of(located.longitude, ["E", "W"]),
    ];
    let more = [
        located.incidence.map(|v| format!("incidence {v:.5}°")),
        located
            .slant_range_time
            .map(|v| format!("slant range time {:.6} ms", 1e3 * v)),
        located.sigma_nought_lut.map(|v| format!("A {v:.4}")),
        located.noise.map(|v| format!("noise {v:.3}")),
        located
            .sigma0
            .map(|v| format!("σ⁰ {v:.6} ({:.2} dB)", 10.0 * v.log10())),
    ];
    parts.extend(more.into_iter().flatten());
    format!(
        "line {}, pixel {}: {}",
        located.line,
        located.pixel,
        parts.join(", ")
    )
}
