//! Picture of one scene by every kind of image.

use crate::exit::Outcome;
use crate::sheet::Picture;
use wake_physics::{Field, Scene};
use wake_train::evaluation::{Baseline, Evaluation, ImageSource, Told};

/// Panels in a row.
const ACROSS: usize = 3;

/// One scene by every kind of image, all on the same grey scale: three standard deviations of the simulator's image on
/// each side of its mean.
pub(crate) fn picture(scene: &Scene, judged: &Evaluation<'_>) -> Outcome<Picture> {
    let draw = |source: &dyn ImageSource| -> Outcome<Field> {
        let view = &judged.view;
        let images = view.draw(source, std::slice::from_ref(scene), Told::Both)?;
        Ok(view.grey(&images[0]))
    };
    let mut panels = Vec::new();
    for (name, source) in judged.kinds() {
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
