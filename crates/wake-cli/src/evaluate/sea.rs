//! How like the sea of real images a learnt, a simulated and a Gaussian one are.

use std::path::{Path, PathBuf};

use crate::sheet::Picture;
use clap::Args;
use wake_ldm::sea_texture::{SeaTexture, WINDOW};
use wake_nn::device_named;
use wake_physics::Field;
use wake_train::evaluation::sea::{SeaPair, SeaRow, gaussian_amplitude, kinds, mean_spectrum};
use wake_train::{TwoSampleOptions, classifier_two_sample_test};

use super::sea_report::{SeaReport, markdown};
use crate::exit::{self, Outcome};
use crate::progress;
use crate::sea_images::{Half, list};

/// First seed of what is drawn: no training has it.
const SEED: u64 = 1 << 40;
/// Styles that are shown.
const SHOWN: usize = 4;

/// Compare a sea learnt from real images with their other halves.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of real images, and `NAME_mask.png` of what does not count
    #[arg(long, value_name = "DIR")]
    real: PathBuf,
    /// A sea that `wake train sea --half left` learnt from the left halves of these images
    #[arg(long, value_name = "FILE")]
    weights: PathBuf,
    /// Windows of open sea of each half of an image, at most
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u8).range(1..))]
    windows: u8,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_sea")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let device = device_named(&options.device)?;
    let learnt = SeaTexture::load(&options.weights, &device)?;
    let files = list(&options.real)?;
    let mut pairs = Vec::new();
    for file in &files {
        let halves = [Half::Left, Half::Right].map(|half| file.read(Some(half)));
        let [left, right] = halves;
        pairs.extend(SeaPair::of_image(
            &left?,
            &right?,
            usize::from(options.windows),
        ));
    }
    if pairs.len() < 4 {
        let (place, found) = (options.real.display(), pairs.len());
        return Err(format!(
            "--real {place}: {found} windows of open sea in both halves of its images, at least 4 are needed"
        )
        .into());
    }
    // What cannot be read leaves no folder behind.
    whole_files::make_folder(&options.out)?;
    let kinds = kinds(&pairs, &learnt, SEED)?;
    let bar = progress::bar(kinds.len() as u64, "kinds of sea");
    let right: Vec<Field> = pairs.iter().map(|pair| pair.right.clone()).collect();
    let spectrum = mean_spectrum(&right);
    let mut rows = vec![SeaRow::of("real, right halves", &right, &spectrum, None)];
    for (name, fields) in &kinds {
        let told =
            classifier_two_sample_test(&right, fields, &TwoSampleOptions::default(), &device)?;
        rows.push(SeaRow::of(name, fields, &spectrum, Some(told)));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = SeaReport {
        images: files.len(),
        windows: pairs.len(),
        rows,
    };
    let text = markdown(&report);
    whole_files::write_json(&options.out.join("report.json"), &report)?;
    whole_files::write_atomically(&options.out.join("report.md"), text.as_bytes())?;
    picture(&learnt, &options.out.join("learned_sea.png"))?;
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}

/// Seas of the first styles: Gaussian noise above, below it what the flow makes of the same noise.
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
