//! Recipes by their names on the command line.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use wake_detector::train::Recipe;

/// Reads the name of a recipe; `--help` tells what each shows.
pub(crate) fn recipe() -> impl TypedValueParser<Value = Recipe> {
    let names = Recipe::ALL.map(|recipe| PossibleValue::new(recipe.name()).help(recipe.about()));
    PossibleValuesParser::new(names).try_map(|name| {
        let found = Recipe::ALL.into_iter().find(|recipe| recipe.name() == name);
        found.ok_or("no such recipe")
    })
}
