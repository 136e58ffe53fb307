//! Parsers and loaders of recipes, numbers and networks named on the command line.

use std::path::Path;

#[cfg(feature = "train")]
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use wake_detector::Detector;
use wake_nn::device_named;
#[cfg(feature = "train")]
use wake_train::detector::ImageRecipe;

use crate::exit::Outcome;

#[cfg(feature = "train")]
/// Parses the name of a recipe; `--help` describes each recipe.
pub(crate) fn recipe() -> impl TypedValueParser<Value = ImageRecipe> {
    let names =
        ImageRecipe::ALL.map(|recipe| PossibleValue::new(recipe.name()).help(recipe.about()));
    PossibleValuesParser::new(names).try_map(|name| {
        let found = ImageRecipe::ALL
            .into_iter()
            .find(|recipe| recipe.name() == name);
        found.ok_or("no such recipe")
    })
}

/// Parses a pixel spacing \[m\].
pub(crate) fn spacing(text: &str) -> Result<f32, String> {
    bounded(text, 0.5, 100.0, " m")
}

/// Parses a score.
pub(crate) fn score(text: &str) -> Result<f32, String> {
    bounded(text, 0.0, 1.0, "")
}

fn bounded(text: &str, low: f32, high: f32, unit: &str) -> Result<f32, String> {
    let expected = || format!("expected a number from {low} to {high}{unit}");
    let number: f32 = text.parse().map_err(|_| expected())?;
    match (low..=high).contains(&number) {
        true => Ok(number),
        false => Err(expected()),
    }
}

/// Loads the network of a file, or the shipped one, which detects wakes from a least score on.
pub(crate) fn network(weights: Option<&Path>, device: &str, least_score: f32) -> Outcome<Detector> {
    let device = device_named(device)?;
    let detector = match weights {
        Some(file) => Detector::load(file, &device)?,
        None => Detector::pretrained(&device)?,
    };
    Ok(detector.with_least_score(least_score)?)
}
