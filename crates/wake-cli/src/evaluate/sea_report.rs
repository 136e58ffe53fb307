//! Report of `wake evaluate sea` in Markdown.

use serde::Serialize;
use wake_train::TwoSample;
use wake_train::evaluation::sea::{GroupAccuracy, SeaRow};

/// Contents of `report.json`.
#[derive(Debug, Serialize)]
pub(crate) struct SeaReport {
    pub(crate) images: usize,
    /// Images with windows of open sea in their right halves.
    pub(crate) open_images: usize,
    /// Windows of each kind.
    pub(crate) windows: usize,
    /// The open sea of each recipe.
    pub(crate) recipes: Vec<RecipeRow>,
    /// Figures of the kinds of sea, the real right halves first; empty without weights.
    pub(crate) rows: Vec<SeaRow>,
}

/// Accuracy of classifiers between the open sea of a recipe and real windows.
#[derive(Debug, Serialize)]
pub(crate) struct RecipeRow {
    pub(crate) recipe: String,
    /// Linear discriminants, one per group of features, with each image left out in turn.
    pub(crate) groups: Vec<GroupAccuracy>,
    /// A small network.
    pub(crate) network: TwoSample,
}

/// The report in Markdown.
pub(crate) fn markdown(report: &SeaReport) -> String {
    let command = "wake evaluate sea --real DIR";
    if report.rows.is_empty() {
        return format!("<!-- Written by: {command} -->\n\n# Simulated seas beside real ones\n\n")
            + &recipes(report);
    }
    format!("<!-- Written by: {command} --weights FILE -->\n\n# A sea learnt from real images\n\n")
        + &learnt(report)
        + "\n## Recipes\n\n"
        + &recipes(report)
}

/// Table of the seas of recipes.
fn recipes(report: &SeaReport) -> String {
    let mut text = format!(
        "Accuracy of classifiers between simulated and real open sea (0.5: indistinguishable): {} windows of 128 x 128 pixels from the \
         right halves of {} real images, and as many of each recipe, in 8-bit levels. A linear discriminant of each group of features \
         is tested on the image left out of its training; a small network, trained on half of the windows, on patches of 64 x 64 \
         pixels of the others. 95 % intervals over images and windows.\n\n| features |",
        report.windows, report.open_images
    );
    for row in &report.recipes {
        text += &format!(" {} |", row.recipe);
    }
    text += "\n| --- |";
    text += &" --- |".repeat(report.recipes.len());
    let groups = report.recipes.first().map_or(0, |row| row.groups.len());
    for n in 0..groups {
        text += &format!("\n| {} |", report.recipes[0].groups[n].group);
        for row in &report.recipes {
            let GroupAccuracy {
                accuracy,
                half_width,
                ..
            } = row.groups[n];
            text += &format!(" {accuracy:.2} ± {half_width:.2} |");
        }
    }
    text += "\n| small network |";
    for row in &report.recipes {
        text += &format!(" {} |", accuracy(&row.network));
    }
    text + "\n"
}

/// Section on the learnt sea.
fn learnt(report: &SeaReport) -> String {
    let mut text = format!(
        "{}\n\n\
         {} windows of 128 x 128 pixels of open sea from the right halves of {} real images are compared with as many of each kind, \
         in 8-bit levels. The sea was learnt from the left halves alone (`wake train sea --half left`), without labels.\n\n\
         ![Gaussian noise of four styles, and the flow's output below](learned_sea.png)\n\n\
         Four styles: Gaussian noise with their correlations above, the flow's output from the same noise below.\n\n\
         | sea | classifier accuracy | spectrum dB | along rows 1, 2 | along columns 1, 2 | skewness | blocks of 8, 32 |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
        finding(report),
        report.windows,
        report.images
    );
    for row in &report.rows {
        let told = row.two_sample.map_or("–".to_owned(), |t| accuracy(&t));
        let [r1, r2, c1, c2] = row.correlations;
        let [fine, coarse] = row.block_variation;
        text += &format!(
            "| {} | {told} | {:.2} | {r1:.3}, {r2:.3} | {c1:.3}, {c2:.3} | {:.3} | {fine:.3}, {coarse:.3} |\n",
            row.kind, row.spectrum_db, row.skewness
        );
    }
    text + "\n- Classifier accuracy: [two-sample test](evaluation.md#two-sample-test-and-shape-of-the-sea) on patches of 64² pixels, with \
        its 95 % interval over the windows; variation between trainings is not included.\n\
        - Spectrum: root mean square difference of the radial spectrum over all rings.\n\
        - Correlations, skewness, variation of block means: `measure::texture`, means over the windows.\n\
        - Gaussian noise: mean, spread and correlations (to 32 pixels) of one left window each; in the styles of the left windows, \
        the learnt sea starts from that noise and has the window's median.\n\
        - Its own styles: random patches of its file, with another mix of images and sensors, which also raises the accuracy.\n\
        - Windows exclude what `wake train sea` excludes; unmasked wakes are in both halves.\n"
}

fn accuracy(found: &TwoSample) -> String {
    format!("{:.2} ± {:.2}", found.accuracy, found.half_width)
}

/// First paragraph: what the learnt sea adds, in numbers.
fn finding(report: &SeaReport) -> String {
    let find = |start: &str| -> Option<(&SeaRow, TwoSample)> {
        let row = report.rows.iter().find(|row| row.kind.starts_with(start))?;
        Some((row, row.two_sample?))
    };
    let (Some(floor), Some(learnt), Some(gaussian), Some(simulated), Some(real)) = (
        find("real, left"),
        find("learnt, styles"),
        find("Gaussian"),
        find("simulated"),
        report.rows.first(),
    ) else {
        return String::new();
    };
    let gain = gaussian.1.accuracy - learnt.1.accuracy;
    // Two independent intervals of 95 %.
    let doubt = gaussian.1.half_width.hypot(learnt.1.half_width);
    let verdict = if gain > doubt {
        "the flow adds structure beyond the spectrum"
    } else if gain < -doubt {
        "the flow makes the sea less like the real one"
    } else {
        "the flow adds nothing that the classifier detects"
    };
    let skewness = |row: &SeaRow| format!("{:.2}", row.skewness);
    format!(
        "A classifier separates the learnt sea from the real one with an accuracy of {} (0.5: indistinguishable), Gaussian noise of the \
         same correlations with {}: {verdict}. Simulated sea, which was not fitted to these images, scores {}, the other halves of \
         the same images {}. Skewness is {} in real, {} in learnt and {} in Gaussian windows, variation of 32-pixel blocks {:.3}, \
         {:.3} and {:.3}; the spectra of learnt and Gaussian sea are {:.2} and {:.2} dB off.",
        accuracy(&learnt.1),
        accuracy(&gaussian.1),
        accuracy(&simulated.1),
        accuracy(&floor.1),
        skewness(real),
        skewness(learnt.0),
        skewness(gaussian.0),
        real.block_variation[1],
        learnt.0.block_variation[1],
        gaussian.0.block_variation[1],
        learnt.0.spectrum_db,
        gaussian.0.spectrum_db,
    )
}
