//! `wake simulate --product`: simulates ships on a map as a satellite product with ground truth.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use wake_geo::Product;
use wake_product::{Options, Wind, read_ships, simulate};

use crate::exit::{self, Outcome};
use crate::locate::polarization;
use crate::progress;

/// Arguments of the simulated product.
#[derive(Args)]
#[command(next_help_heading = "Products")]
pub(crate) struct ProductArguments {
    /// Simulate a Sentinel-1 product with the annotation of this one (.SAFE folder or .zip; VV or HH)
    #[arg(long, value_name = "PRODUCT", conflicts_with_all = ["scene", "method", "grey", "overlay", "export", "compare"])]
    pub(crate) product: Option<PathBuf>,
    /// Ships as GeoJSON points with heading (degrees from true north), speed (m/s) and length (m)
    #[arg(long, value_name = "FILE", requires = "product")]
    ships: Option<PathBuf>,
    /// Wind speed at 10 m height (m/s)
    #[arg(
        long,
        value_name = "N",
        requires = "product",
        default_value_if("product", clap::builder::ArgPredicate::IsPresent, "5")
    )]
    wind_speed: Option<f64>,
    /// Direction toward which the wind blows, clockwise from true north (degrees)
    #[arg(
        long,
        value_name = "N",
        requires = "product",
        allow_negative_numbers = true,
        default_value_if("product", clap::builder::ArgPredicate::IsPresent, "90")
    )]
    wind_toward: Option<f64>,
    /// Lines to simulate, counted from 0, end excluded [default: all]
    #[arg(long, value_name = "A..B", requires = "product", value_parser = range)]
    lines: Option<Range<usize>>,
    /// Pixels of a line to simulate, counted from 0, end excluded [default: all]
    #[arg(long, value_name = "C..D", requires = "product", value_parser = range)]
    pixels: Option<Range<usize>>,
    /// Polarization: VV or HH [default: the first of these in the product]
    #[arg(long, requires = "product", value_parser = polarization)]
    polarization: Option<wake_geo::Polarization>,
    /// Seed of all random numbers
    #[arg(
        long,
        value_name = "N",
        requires = "product",
        default_value_if("product", clap::builder::ArgPredicate::IsPresent, "0")
    )]
    seed: Option<u64>,
}

/// Simulates the product and prints its path.
///
/// - `changes`: scene keys and their values
pub(crate) fn run(
    arguments: &ProductArguments,
    template: &PathBuf,
    changes: &[String],
    out: &std::path::Path,
    json: bool,
) -> Outcome<()> {
    let product = match arguments.polarization {
        Some(polarization) => Product::open_polarization(template, polarization)?,
        None => Product::open(template)?,
    };
    let ships = match &arguments.ships {
        Some(file) => read_ships(file)?,
        None => Vec::new(),
    };
    let options = Options {
        lines: arguments.lines.clone(),
        pixels: arguments.pixels.clone(),
        wind: Wind {
            speed: arguments.wind_speed.unwrap_or(5.0),
            toward: arguments.wind_toward.unwrap_or(90.0),
        },
        seed: arguments.seed.unwrap_or(0),
        changes: changes.to_vec(),
    };
    let lines = options.lines.as_ref().map_or(product.size().0, Range::len);
    let bar = progress::bar(lines as u64, "lines");
    let written = simulate(&product, &ships, &options, out, &mut |lines| {
        bar.inc(lines as u64);
    });
    bar.finish_and_clear();
    let written = written?;
    let given = ships.len();
    Ok(exit::say(&match json {
        true => json!({
            "product": written.product, "ships": written.ships, "ships_inside": written.count, "ships_given": given,
        })
        .to_string(),
        false => format!(
            "{} with {} of {given} ships, listed in {}",
            written.product.display(),
            written.count,
            written.ships.display()
        ),
    })?)
}

/// Parses `A..B`.
fn range(text: &str) -> Result<Range<usize>, String> {
    let number = |text: &str| text.trim().parse().ok();
    text.split_once("..")
        .and_then(|(first, end)| Some(number(first)?..number(end)?))
        .ok_or_else(|| "give two whole numbers from 0, such as 4000..5000".to_owned())
}
