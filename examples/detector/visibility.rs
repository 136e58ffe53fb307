//! Recall by how well wakes can be seen.

use std::fmt::Write;

use wake_detector::Wake;
use wake_detector::judging::Searched;
use wake_detector::score::{Rule, found_by};
use wake_detector::train::Recipe;

use super::report::FALSE_ALARMS;

/// Bounds of the visibility of wakes that are counted together \[dB\]: contrast of simulated ones, signal over noise of
/// painted ones.
const CONTRASTS: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 20.0];
const SIGNALS: [f64; 7] = [15.0, 18.0, 21.0, 24.0, 28.0, 32.0, 40.0];

/// A table of recall by visibility, at the score that allows half a false alarm an image.
pub(crate) fn by_visibility(recipe: Recipe, finders: &[&str], searched: &Searched) -> String {
    let (bounds, what) = match recipe {
        Recipe::Painted => (SIGNALS, "signal over noise"),
        _ => (CONTRASTS, "contrast"),
    };
    let decibel = |wake: &Wake| match (recipe, wake.contrast_db) {
        (Recipe::Painted, _) | (_, None) => 20.0 * f64::from(wake.snr).log10(),
        (_, Some(db)) => f64::from(db),
    };
    let mut text = format!("\n| {}, {what} \\[dB\\] |", recipe.name());
    for bound in bounds.windows(2) {
        // Writing into a string cannot fail.
        let _ = write!(text, " {} to {} |", bound[0], bound[1]);
    }
    text += "\n| --- |";
    text += &" --- |".repeat(bounds.len() - 1);
    text.push('\n');
    for (name, images) in finders.iter().zip(&searched.judged) {
        let value = |image: usize, label: usize| decibel(&searched.wakes[image][label]);
        let counts = found_by(images, Rule::Ray, FALSE_ALARMS, &bounds, value);
        let _ = write!(text, "| {name} |");
        for [right, all] in counts {
            let _ = match all {
                0 => write!(text, " – |"),
                _ => write!(text, " {:.2} of {all} |", right as f64 / all as f64),
            };
        }
        text.push('\n');
    }
    text
}
