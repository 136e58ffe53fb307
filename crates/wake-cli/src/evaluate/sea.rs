//! `wake evaluate sea`: similarity of simulated, learnt and Gaussian seas to the sea of real images.

use std::path::{Path, PathBuf};

use crate::sheet::Picture;
use clap::Args;
use wake_dataset::Recipe;
use wake_ldm::sea_texture::{SeaTexture, WINDOW};
use wake_nn::device_named;
use wake_physics::Field;
use wake_train::evaluation::sea::{
    SeaPair, SeaRow, discriminant, gaussian_amplitude, kinds, mean_spectrum, simulated_seas,
};
use wake_train::{TwoSample, TwoSampleOptions, classifier_two_sample_test};

use super::sea_report::{RecipeRow, SeaReport, markdown};
use crate::exit::{self, Outcome};
use crate::progress;
use crate::sea_images::{Half, list};

/// First seed of the simulated seas, which no training has.
const SEED: u64 = 1 << 40;
/// Number of styles in the picture.
const SHOWN: usize = 4;

/// Compare simulated seas, and one learnt from real images, with the right halves of these images.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of real images; pixels marked in `NAME_mask.png` are left out
    #[arg(long, value_name = "DIR")]
    real: PathBuf,
    /// Learnt sea from `wake train sea --half left` on these images
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Recipes whose open seas are compared: satellites, detector or a TOML file; may be repeated
    #[arg(long, value_name = "NAME", default_values = ["satellites", "detector"])]
    recipe: Vec<String>,
    /// Largest number of windows of open sea per half image
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u8).range(1..))]
    windows: u8,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_sea")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let device = device_named(&options.device)?;
    let learnt = options.weights.as_ref();
    let learnt = learnt
        .map(|file| SeaTexture::load(file, &device))
        .transpose()?;
    let recipes = options
        .recipe
        .iter()
        .map(|name| Ok((name.clone(), Recipe::named_or_read(name)?)));
    let recipes: Vec<(String, Recipe)> = recipes.collect::<Outcome<_>>()?;
    let files = list(&options.real)?;
    let mut images: Vec<Vec<SeaPair>> = Vec::new();
    for file in &files {
        let [left, right] = [Half::Left, Half::Right].map(|half| file.read(Some(half)));
        let most = usize::from(options.windows);
        images.push(SeaPair::of_image(&left?, &right?, most));
    }
    images.retain(|pairs| !pairs.is_empty());
    let pairs = images.concat();
    if pairs.len() < 4 || images.len() < 2 {
        let (place, found) = (options.real.display(), pairs.len());
        return Err(format!(
            "--real {place}: {found} windows of open sea in both halves of {} images, expected at least 4 in 2 images; add images",
            images.len()
        )
        .into());
    }
    // Unreadable images leave no folder behind.
    whole_files::make_folder(&options.out)?;
    let right =
        |pairs: &[SeaPair]| -> Vec<Field> { pairs.iter().map(|p| p.right.clone()).collect() };
    let real: Vec<Vec<Field>> = images.iter().map(|pairs| right(pairs)).collect();
    let right = right(&pairs);
    let told = |others: &[Field]| -> Outcome<TwoSample> {
        let options = TwoSampleOptions::default();
        Ok(classifier_two_sample_test(
            &right, others, &options, &device,
        )?)
    };
    let bar = progress::bar(recipes.len() as u64, "recipes");
    let mut rows = Vec::new();
    for (name, recipe) in recipes {
        let others = simulated_seas(&recipe, right.len(), SEED)?;
        rows.push(RecipeRow {
            recipe: name,
            groups: discriminant(&real, &others),
            network: told(&others)?,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = SeaReport {
        images: files.len(),
        open_images: images.len(),
        windows: pairs.len(),
        recipes: rows,
        rows: match &learnt {
            Some(learnt) => beside_learnt(&pairs, &right, learnt, &told)?,
            None => Vec::new(),
        },
    };
    let text = markdown(&report);
    whole_files::write_json(&options.out.join("report.json"), &report)?;
    whole_files::write_atomically(&options.out.join("report.md"), text.as_bytes())?;
    if let Some(learnt) = &learnt {
        picture(learnt, &options.out.join("learned_sea.png"))?;
    }
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}

/// Figures of a learnt sea and of the other kinds of sea.
///
/// - `told`: accuracy of a classifier between some windows and the right halves
fn beside_learnt(
    pairs: &[SeaPair],
    right: &[Field],
    learnt: &SeaTexture,
    told: &dyn Fn(&[Field]) -> Outcome<TwoSample>,
) -> Outcome<Vec<SeaRow>> {
    let kinds = kinds(pairs, learnt, SEED)?;
    let bar = progress::bar(kinds.len() as u64, "kinds of sea");
    let spectrum = mean_spectrum(right);
    let mut rows = vec![SeaRow::of("real, right halves", right, &spectrum, None)];
    for (name, fields) in &kinds {
        let told = told(fields)?;
        rows.push(SeaRow::of(name, fields, &spectrum, Some(told)));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rows)
}

/// Picture of seas of several styles: Gaussian noise above, the flow's output for the same noise below.
fn picture(learnt: &SeaTexture, path: &Path) -> Outcome<()> {
    let step = learnt.styles().len() / SHOWN;
    let show = |field: &Field, caption: &str| {
        let level = |&a: &f32| (90.0 * a).round().clamp(0.0, 255.0) as u8;
        let levels: Vec<u8> = field.values.iter().map(level).collect();
        Picture::from_levels(&levels, WINDOW).captioned(caption)
    };
    let styles = || learnt.styles().iter().step_by(step).take(SHOWN).zip(SEED..);
    let mut pictures: Vec<Picture> = styles()
        .map(|(style, seed)| show(&gaussian_amplitude(style, seed), "Gaussian"))
        .collect();
    for (style, seed) in styles() {
        let sea = learnt.amplitude(style, seed, WINDOW, WINDOW)?;
        pictures.push(show(&sea, "learnt"));
    }
    Ok(Picture::sheet(&pictures, SHOWN).write(path)?)
}
