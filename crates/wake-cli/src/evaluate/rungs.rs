//! The rungs, from the dumbest image to the simulator's, and a picture of one scene on all of them.

use super::judge::Judged;
use crate::exit::Outcome;
use wake_physics::picture::Picture;
use wake_physics::{Field, Scene};
use wake_train::evaluation::{Baseline, ImageSource, Told, grey};

/// Panels of the picture in a row.
const ACROSS: usize = 3;

/// Kinds of images, dumbest first, without the simulator's own.
pub(crate) fn kinds<'a>(judged: &Judged<'a>) -> Vec<(&'static str, &'a dyn ImageSource)> {
    let baseline = |of: &'static Baseline| (of.name(), of as &dyn ImageSource);
    let mut kinds = vec![
        baseline(&Baseline::Constant),
        baseline(&Baseline::Expected),
        baseline(&Baseline::Gaussian),
    ];
    if judged.has_network {
        kinds.push(("model", judged.source));
    }
    if let Some(source) = judged.text_to_image {
        kinds.push(("text to image", source));
    }
    kinds.push(baseline(&Baseline::OtherSea));
    kinds
}

/// One scene on every rung, in one stretch of grey: three standard deviations of the simulator's image to each side of its mean.
pub(crate) fn picture(scene: &Scene, judged: &Judged<'_>) -> Outcome<Picture> {
    let draw = |source: &dyn ImageSource| -> Outcome<Field> {
        let images = source.draw(std::slice::from_ref(scene), Told::Both)?;
        Ok(grey(&images[0]))
    };
    let mut panels = Vec::new();
    for (name, source) in kinds(judged) {
        panels.push((name, draw(source)?));
    }
    panels.push(("simulator", draw(&Baseline::Simulator)?));
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
