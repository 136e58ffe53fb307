//! Stage of the whole simulation against the oracles of all stages.

use std::collections::btree_map::Entry;

use super::memo::Memo;
use super::oracle::{RUNS, row, sample};
use crate::bench::row::{Errors, Row, median_seconds};
use wake_physics::{Scene, direct_intensity, simulate};

/// Tolerance of the direct simulation: its wake nodes are the reference for all others, and no term is left out.
const STRICTEST: f64 = 1e-6;

/// The whole simulation against the oracles of all stages at random pixels of the same image, with all terms and at the
/// strictest tolerance. Times of wave sums and σ⁰ are scaled from the source pixels that contribute to all source
/// pixels, and times of imaging from the sampled pixels to all pixels.
pub(crate) fn scene(size: usize, tolerance: f64, memo: &mut Memo) -> wake_physics::Result<Row> {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns) = (size, size);
    scene.model.tolerance = tolerance;
    let (fast_seconds, fast) = median_seconds(RUNS, || simulate(&scene));
    let fast = fast?;
    scene.model.tolerance = STRICTEST;
    let raster = fast.raster;
    let pixels = sample(&raster, scene_pixels(size));
    let direct = match memo.scene.entry(size) {
        Entry::Occupied(known) => known.into_mut(),
        Entry::Vacant(new) => new.insert(direct_intensity(&scene, &pixels)?),
    };

    let values = pixels.iter().map(|&[i, j]| fast.intensity.at(i, j).into());
    let errors = Errors::of(values, &direct.intensity, fast.intensity.mean());
    let [rows, columns] = fast.plan.sizes.computed;
    let per_source = direct.seconds.sea + direct.seconds.kelvin + direct.seconds.backscatter;
    let oracle = per_source * (rows * columns) as f64 / direct.sources as f64
        + direct.seconds.imaging * raster.len() as f64 / pixels.len() as f64;
    let oracle = (oracle, pixels.len());
    Ok(row(
        "scene",
        &raster,
        Some(tolerance),
        fast_seconds,
        oracle,
        errors,
    ))
}

/// Pixels of the scene's oracle: fewer for a large image, whose sea has more waves.
fn scene_pixels(size: usize) -> usize {
    ((1 << 23) / (size * size).max(1 << 18)).max(4)
}
