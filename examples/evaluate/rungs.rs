//! From the dumbest image to the simulator's, rung by rung: what of a sea each has that a judge can see.

use crate::judge::{BATCH, Judged};
use crate::pixels::grey;
use crate::scenes::other_sea;
use crate::source::{Constant, Expected, Gaussian, ImageSource, OtherSea, Result, Simulator, Told};
use crate::statistics::mean;
use burn::tensor::Device;
use serde::Serialize;
use wake_ldm::train::{TwoSample, TwoSampleOptions, two_sample};
use wake_physics::measure::{SeaShape, crest_variance, sea_shape, seams};
use wake_physics::picture::Picture;
use wake_physics::{Field, Scene};

/// Side of the squares of pixels that the model draws by.
const SQUARE: usize = 8;
/// Networks that are trained to tell images from simulated ones, if those before were right less often than this: one that
/// finds nothing proves little.
const NETWORKS: u64 = 3;
const FOUND: f64 = 0.9;
/// Panels of the picture in a row.
const ACROSS: usize = 3;

/// What one kind of image has of a sea, means over the scenes.
#[derive(Debug, Serialize)]
pub(crate) struct RungRow {
    pub(crate) image: &'static str,
    /// Shape of the grey that is left when the expected image is subtracted.
    pub(crate) skewness: Option<f64>,
    pub(crate) kurtosis: Option<f64>,
    /// Along range, azimuth, wind.
    pub(crate) steepness: [Option<f64>; 3],
    pub(crate) grouping: Option<f64>,
    /// Variance on crests of the wake over that in its troughs.
    pub(crate) crest_variance: Option<f64>,
    /// Squared differences of neighbours across the borders of the model's squares over those elsewhere.
    pub(crate) seams: Option<f64>,
    /// Against simulated images of the same scenes.
    pub(crate) two_sample: Option<TwoSample>,
}

/// Steps of the bar that [`rungs`] makes.
pub(crate) fn bar_steps(judged: &Judged<'_>) -> usize {
    sources(judged).len() + 1
}

/// Kinds of images, dumbest first; the simulator's own last.
fn sources<'a>(judged: &Judged<'a>) -> Vec<(&'static str, &'a dyn ImageSource)> {
    let mut sources: Vec<(&'static str, &'a dyn ImageSource)> = vec![
        ("constant", &Constant),
        ("expected image", &Expected),
        ("expected image, Gaussian sea", &Gaussian),
    ];
    if judged.has_network {
        sources.push(("model", judged.source));
    }
    if let Some(source) = judged.text_to_image {
        sources.push(("text to image", source));
    }
    sources.push(("simulator, other sea", &OtherSea));
    sources
}

/// The figures of every rung, and of the simulated images that they stand against.
pub(crate) fn rungs(
    scenes: &[Scene],
    judged: &Judged<'_>,
    device: &Device,
    step: impl Fn(),
) -> Result<Vec<RungRow>> {
    let draw = |source: &dyn ImageSource, scenes: &[Scene]| -> Result<Vec<Field>> {
        let mut images = Vec::with_capacity(scenes.len());
        for batch in scenes.chunks(BATCH) {
            images.extend(source.draw(batch, Told::Both)?.iter().map(grey));
        }
        Ok(images)
    };
    let expected = draw(&Expected, scenes)?;
    // A third sea: neither the one that pixels are compared with nor that of the last rung.
    let third: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 2)).collect();
    let simulated = draw(&Simulator, &third)?;
    step();
    let mut rows = Vec::new();
    for (name, source) in sources(judged) {
        let images = draw(source, scenes)?;
        let told = told_apart(&simulated, &images, device)?;
        rows.push(row(name, scenes, &images, &expected, told));
        step();
    }
    rows.push(row("simulator", scenes, &simulated, &expected, None));
    Ok(rows)
}

/// What the network that tells two kinds of images apart best says of them; `None` of too few.
pub(crate) fn told_apart(
    first: &[Field],
    second: &[Field],
    device: &Device,
) -> Result<Option<TwoSample>> {
    let mut best: Option<TwoSample> = None;
    if first.len() < 4 {
        return Ok(best);
    }
    for seed in 1..=NETWORKS {
        let options = TwoSampleOptions {
            seed,
            ..TwoSampleOptions::default()
        };
        let told = two_sample(first, second, &options, device)?;
        best = best
            .filter(|best| best.accuracy >= told.accuracy)
            .or(Some(told));
        if told.accuracy > FOUND {
            break;
        }
    }
    Ok(best)
}

/// One scene on every rung, in one stretch of grey: three standard deviations of the simulator's image to each side of its mean.
pub(crate) fn picture(scene: &Scene, judged: &Judged<'_>) -> Result<Picture> {
    let draw = |source: &dyn ImageSource| -> Result<Field> {
        Ok(grey(
            &source.draw(std::slice::from_ref(scene), Told::Both)?[0],
        ))
    };
    let mut panels = Vec::new();
    for (name, source) in sources(judged) {
        panels.push((name, draw(source)?));
    }
    panels.push(("simulator", draw(&Simulator)?));
    let last = &panels[panels.len() - 1].1.values;
    let mean = last.iter().sum::<f32>() / last.len() as f32;
    let variance = last.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / last.len() as f32;
    let reach = 3.0 * variance.sqrt();
    let level = |v: &f32| (127.5 * (1.0 + (v - mean) / reach)).round() as u8;
    let captioned = panels.iter().map(|(name, image)| {
        let levels: Vec<u8> = image.values.iter().map(level).collect();
        Picture::from_levels(&levels, image.columns).captioned(name)
    });
    Ok(Picture::sheet(&captioned.collect::<Vec<_>>(), ACROSS))
}

fn row(
    image: &'static str,
    scenes: &[Scene],
    images: &[Field],
    expected: &[Field],
    two_sample: Option<TwoSample>,
) -> RungRow {
    let mut shapes: Vec<SeaShape> = Vec::new();
    let (mut crests, mut borders) = (Vec::new(), Vec::new());
    for ((scene, image), expected) in scenes.iter().zip(images).zip(expected) {
        let left = image.values.iter().zip(&expected.values);
        let left = Field {
            values: left.map(|(a, b)| a - b).collect(),
            ..*image
        };
        shapes.extend(sea_shape(&left, scene.sea.wind_toward.to_radians()));
        crests.extend(crest_variance(image, expected));
        borders.extend(seams(&left, SQUARE));
    }
    let of = |value: &dyn Fn(&SeaShape) -> f64| {
        let values: Vec<f64> = shapes.iter().map(value).collect();
        mean(&values)
    };
    RungRow {
        image,
        skewness: of(&|s| s.skewness),
        kurtosis: of(&|s| s.kurtosis),
        steepness: std::array::from_fn(|n| of(&|s| s.steepness[n])),
        grouping: of(&|s| s.grouping),
        crest_variance: mean(&crests),
        seams: mean(&borders),
        two_sample,
    }
}
