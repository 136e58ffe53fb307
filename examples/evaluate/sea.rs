//! How like the sea of real images a learnt, a simulated and a Gaussian one are.

use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use wake_ldm::dataset::{Grey, Recipe, Simulated};
use wake_ldm::device_named;
use wake_ldm::noise::NoiseSource;
use wake_ldm::sea_texture::{PATCH, SeaImage, SeaStyle, SeaTexture};
use wake_ldm::train::{TwoSample, TwoSampleOptions, two_sample};
use wake_physics::measure::{Binning, radial_spectrum, texture};
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, LinearSea, Scene, Simulator, expected_intensity, output};

use crate::sea_images::{Half, list};
use crate::sea_report;
use crate::source::Result;
use crate::{exit, progress};

/// First seed of what is drawn: no training has it.
const SEED: u64 = 1 << 40;
/// The open sea of the recipe detector.
const OPEN_SEA: [&str; 4] = [
    "scene.grid.rows = 128",
    "scene.grid.columns = 128",
    "draw.count = 0",
    "draw.sea.slick_damping = 0",
];
/// A level that is black in no quick-look of the recipe: linear seas are shown with it as their median.
const LINEAR_GREY: f64 = 0.3;

#[derive(Args)]
pub(crate) struct Options {
    /// Folder of real images, and `NAME_mask.png` of what does not count
    #[arg(long, value_name = "DIR")]
    real: PathBuf,
    /// A sea that `train -- sea --half left` learnt from the left halves of these images
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

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct SeaReport {
    pub(crate) images: usize,
    /// Windows of each kind.
    pub(crate) windows: usize,
    /// The right halves first.
    pub(crate) rows: Vec<SeaRow>,
}

/// What one kind of sea looks like, means over its windows.
#[derive(Debug, Serialize)]
pub(crate) struct SeaRow {
    pub(crate) kind: &'static str,
    /// Against the right halves.
    pub(crate) two_sample: Option<TwoSample>,
    /// Root mean square over the rings of the difference of the mean radial spectrum [dB], of windows of variance 1.
    pub(crate) spectrum_db: f64,
    /// Correlation of speckle one and two pixels apart, along rows and along columns.
    pub(crate) correlations: [f64; 4],
    pub(crate) skewness: f64,
    /// Standard deviation over mean of the means of blocks of 8 and of 32 pixels.
    pub(crate) block_variation: [f64; 2],
}

/// A real window of a left half, and one of the right half of the same image.
struct Pair {
    left: Field,
    right: Field,
    style: SeaStyle,
    /// Median grey of the left one.
    median: f64,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let device = device_named(&options.device)?;
    let learnt = SeaTexture::load(&options.weights, &device)?;
    let files = list(&options.real)?;
    let mut pairs = Vec::new();
    for file in &files {
        let halves = [Half::Left, Half::Right].map(|half| file.read(Some(half)));
        let [left, right] = halves;
        pairs.extend(of_image(&left?, &right?, usize::from(options.windows)));
    }
    if pairs.len() < 4 {
        let (place, found) = (options.real.display(), pairs.len());
        return Err(format!(
            "--real {place}: {found} windows of open sea in both halves of its images, at least 4 are needed"
        )
        .into());
    }
    // What cannot be read leaves no folder behind.
    output::make_folder(&options.out)?;
    let kinds = kinds(&pairs, &learnt)?;
    let bar = progress::bar(kinds.len() as u64, "kinds of sea");
    let right: Vec<Field> = pairs.iter().map(|pair| pair.right.clone()).collect();
    let spectrum = mean_spectrum(&right);
    let mut rows = vec![row("real, right halves", &right, &spectrum, None)];
    for (name, fields) in &kinds {
        let told = two_sample(&right, fields, &TwoSampleOptions::default(), &device)?;
        rows.push(row(name, fields, &spectrum, Some(told)));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = SeaReport {
        images: files.len(),
        windows: pairs.len(),
        rows,
    };
    let text = sea_report::markdown(&report);
    output::write_json(&options.out.join("report.json"), &report)?;
    output::write_atomically(&options.out.join("report.md"), text.as_bytes())?;
    picture(&learnt, &options.out.join("learned_sea.png"))?;
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}

/// Windows of open sea of both halves of an image, as many of each, spread over them.
fn of_image(left: &SeaImage, right: &SeaImage, most: usize) -> Vec<Pair> {
    let [left, right] = [left, right].map(|half| -> Vec<(Field, SeaStyle)> {
        half.places()
            .filter_map(|place| half.patch(place))
            .collect()
    });
    let count = left.len().min(right.len()).min(most);
    let at = |half: &[(Field, SeaStyle)], n: usize| half[n * half.len() / count].clone();
    let pair = |n: usize| {
        let ((left, style), (right, _)) = (at(&left, n), at(&right, n));
        let median = left.mean() / f64::from(style.mean());
        Pair {
            left,
            right,
            style,
            median,
        }
    };
    (0..count).map(pair).collect()
}

/// Every kind of sea, as many windows as there are pairs, in levels of 8 bits.
fn kinds(pairs: &[Pair], learnt: &SeaTexture) -> Result<Vec<(&'static str, Vec<Field>)>> {
    let numbered = || pairs.iter().zip(SEED..);
    let draw = |work: &dyn Fn(&Pair, u64) -> Result<Field>| -> Result<Vec<Field>> {
        numbered().map(|(pair, seed)| work(pair, seed)).collect()
    };
    let own = draw(&|pair, seed| Ok(levels(amplitude(&learnt.sample(seed, PATCH, PATCH)?), pair)))?;
    let told = draw(&|pair, seed| {
        let sea = learnt.amplitude(&pair.style, seed, PATCH, PATCH)?;
        Ok(levels(sea, pair))
    })?;
    let gaussian = draw(&|pair, seed| Ok(levels(gaussian(&pair.style, seed), pair)))?;
    let white = draw(&|pair, seed| Ok(levels(white_speckle(&pair.left, seed), pair)))?;
    let recipe = Recipe::detector()?.with_assignments(&OPEN_SEA)?;
    let source = Simulated::new(recipe, SEED)?;
    let indices = 0..pairs.len() as u64;
    let simulated = indices.clone().into_par_iter().map(|index| {
        let levels = source.pair(index)?.image.levels();
        Ok(window(levels.into_iter().map(f32::from).collect()))
    });
    let simulated: Vec<Field> = simulated.collect::<wake_ldm::Result<_>>()?;
    let linear = indices
        .into_par_iter()
        .map(|index| linear(&source.scene(index)?));
    let linear: Vec<Field> = linear.collect::<wake_ldm::Result<_>>()?;
    let left = pairs.iter().map(|pair| pair.left.clone()).collect();
    Ok(vec![
        ("real, left halves", left),
        ("learnt, styles of the left windows", told),
        ("learnt, its own styles", own),
        ("Gaussian noise, correlations of the left windows", gaussian),
        ("white speckle, looks of the left windows", white),
        ("simulated (recipe detector)", simulated),
        ("linear sea and the sensor's speckle", linear),
    ])
}

fn window(values: Vec<f32>) -> Field {
    Field {
        rows: PATCH,
        columns: PATCH,
        values,
    }
}

fn amplitude(intensity: &Field) -> Field {
    Field {
        values: intensity.values.iter().map(|v| v.max(0.0).sqrt()).collect(),
        ..*intensity
    }
}

/// Gaussian amplitude, with the mean, the spread and the correlations of a window.
fn gaussian(style: &SeaStyle, seed: u64) -> Field {
    let mut field = style.noise(NoiseSource::new(seed), PATCH, PATCH);
    for value in &mut field.values {
        *value = (style.mean() + style.spread() * *value).max(0.0);
    }
    field
}

/// Speckle that no pixel shares with its neighbour, of the window's equivalent looks, to a whole one.
fn white_speckle(like: &Field, seed: u64) -> Field {
    let looks = texture(like, PATCH).map_or(1.0, |texture| texture.looks);
    let mut field = window(vec![1.0; PATCH * PATCH]);
    speckle(&mut field, looks.round().max(1.0) as u32, seed);
    amplitude(&field)
}

/// Amplitudes as the levels of a quick-look whose median is that of the pair's left window.
fn levels(mut amplitude: Field, pair: &Pair) -> Field {
    let mut sorted = amplitude.values.clone();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let factor = pair.median as f32 / median.max(f32::MIN_POSITIVE);
    for value in &mut amplitude.values {
        *value = (factor * *value).round().clamp(0.0, 255.0);
    }
    amplitude
}

/// A Gaussian sea with the linear spectrum of the image, under the speckle of a simulated image of the scene.
fn linear(scene: &Scene) -> wake_ldm::Result<Field> {
    let mut power = expected_intensity(scene)?;
    let sea = LinearSea::new(scene)?;
    let normals = NoiseSource::new(!scene.seed).normal(0, sea.normals());
    let half_variance = 0.5 * sea.covariance().values[0];
    let field = sea.field(&normals);
    let image = Simulator::default().image(scene)?;
    let mean = image.intensity.clone();
    let speckled = image.speckled();
    let speckle = speckled.values.iter().zip(&mean.values);
    for ((value, sea), (with, without)) in power.values.iter_mut().zip(&field.values).zip(speckle) {
        let speckle = if *without > 0.0 { with / without } else { 0.0 };
        *value *= (sea - half_variance).exp() * speckle;
    }
    let (grey, _) = Grey::quick_look(&power, LINEAR_GREY, 0.0);
    let levels = grey.levels();
    Ok(window(levels.into_iter().map(f32::from).collect()))
}

fn row(
    kind: &'static str,
    fields: &[Field],
    reference: &[f64],
    two_sample: Option<TwoSample>,
) -> SeaRow {
    let textures: Vec<_> = fields.iter().filter_map(|f| texture(f, PATCH)).collect();
    let mean = |of: &dyn Fn(&wake_physics::measure::Texture) -> f64| {
        textures.iter().map(of).sum::<f64>() / textures.len().max(1) as f64
    };
    let spectrum = mean_spectrum(fields);
    let squares = spectrum.iter().zip(reference).map(|(a, b)| (a - b).powi(2));
    SeaRow {
        kind,
        two_sample,
        spectrum_db: (squares.sum::<f64>() / reference.len() as f64).sqrt(),
        correlations: [
            mean(&|t| t.along_rows[0]),
            mean(&|t| t.along_rows[1]),
            mean(&|t| t.along_columns[0]),
            mean(&|t| t.along_columns[1]),
        ],
        skewness: mean(&|t| t.skewness),
        block_variation: [
            mean(&|t| t.block_variation[0]),
            mean(&|t| t.block_variation[1]),
        ],
    }
}

/// Power of windows of variance 1 by rings [dB], up to the Nyquist wavenumber, mean over the windows.
fn mean_spectrum(fields: &[Field]) -> Vec<f64> {
    let rings = PATCH / 2;
    let mut sums = vec![0.0; rings - 1];
    for field in fields {
        let spectrum = radial_spectrum(field, Binning::Round);
        let pairs = || spectrum.power.iter().zip(&spectrum.count).skip(1);
        let total: f64 = pairs().map(|(power, &count)| power * count as f64).sum();
        for (sum, (power, _)) in sums.iter_mut().zip(pairs()) {
            *sum += 10.0 * (power / total).max(1e-12).log10();
        }
    }
    let count = fields.len().max(1) as f64;
    sums.into_iter().map(|sum| sum / count).collect()
}

/// Seas of the first styles: Gaussian noise above, below it what the flow makes of the same noise.
fn picture(learnt: &SeaTexture, path: &Path) -> Result<()> {
    use wake_physics::picture::Picture;
    const SHOWN: usize = 4;
    let step = learnt.styles().len() / SHOWN;
    let show = |field: &Field, caption: &str| {
        let level = |&a: &f32| (90.0 * a).round().clamp(0.0, 255.0) as u8;
        let levels: Vec<u8> = field.values.iter().map(level).collect();
        Picture::from_levels(&levels, PATCH).captioned(caption)
    };
    let styles = || learnt.styles().iter().step_by(step).take(SHOWN).zip(SEED..);
    let mut pictures: Vec<Picture> = styles()
        .map(|(style, seed)| show(&gaussian(style, seed), "Gaussian"))
        .collect();
    for (style, seed) in styles() {
        let sea = learnt.amplitude(style, seed, PATCH, PATCH)?;
        pictures.push(show(&sea, "learnt"));
    }
    Ok(Picture::sheet(&pictures, SHOWN).write(path)?)
}
