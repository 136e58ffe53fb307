//! A large scene in strips of rows: one after the other, so that only the image is in memory as a whole.
//!
//! Places decide, not strips: all strips see the same waves of the sea, drawn once on one lattice, and the same nodes of the
//! wake. What differs is the rounding of sums that depend on what else is summed (FFTs of the wake's gridding, the table of
//! σ⁰), which stays within the shares of the tolerance that these have. Rows are computed beyond a strip as far as echoes are
//! displaced, twice the margin of the image.

use super::Simulator;
use super::clock::{Clock, Seconds};
use super::simulation::Method;
use super::speckling::Exposure;
use super::stages::{Backdrop, Drawn, Stages};
use super::strip::Strip;
use super::surface_fields::Wanted;
use crate::computed::means_over;
use crate::models::Models;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::workspace::Workspace;
use std::ops::Range;

impl Simulator {
    /// All stages up to the intensity before speckle, at the pixels of the image, and what the impulse response looks at
    /// where the image has one. The clock runs since the plan was made; without `Wanted::Fields` there is only the image.
    pub(super) fn draw(
        &mut self,
        (scene, models, plan): (&Scene, &Models, &Plan),
        (method, wanted): (Method, Wanted),
        (clock, seconds): (&mut Clock, &mut Seconds),
    ) -> (Drawn, Option<Exposure>) {
        let workspace = &mut self.workspace;
        let mut backdrop = Backdrop::new(workspace, scene, models, plan);
        let mut out = Drawn::default();
        for strip in &Strip::all(models, plan) {
            let stages = Stages::new((scene, models, plan), (method, wanted), strip);
            let mut drawn =
                stages.draw(workspace, &mut self.table, &mut backdrop, (clock, seconds));
            out.accuracy = out.accuracy.and(&drawn.accuracy);
            let pixels = models.image.strip(&strip.image);
            let intensity = std::mem::take(&mut drawn.intensity);
            if models.response.is_some() {
                let rows = [strip.own.clone(), 0..models.computed.rows];
                put(workspace, &mut out.intensity, rows, intensity);
            } else {
                let rows = [strip.image.clone(), 0..models.image.rows];
                let intensity = means(workspace, intensity, &stages.computed, &pixels);
                put(workspace, &mut out.intensity, rows, intensity);
            }
            if wanted == Wanted::Fields {
                for (to, from) in out.outputs().into_iter().zip(drawn.outputs()) {
                    let rows = [strip.image.clone(), 0..models.image.rows];
                    let part = means(workspace, std::mem::take(from), &stages.raster, &pixels);
                    put(workspace, to, rows, part);
                }
            }
            drawn.give_back(workspace);
        }
        let exposure = models.response.map(|response| {
            let sources = std::mem::take(&mut out.intensity);
            let exposure = Exposure::of(scene, models, response, sources);
            out.intensity = exposure.mean();
            seconds.imaging += clock.lap();
            exposure
        });
        (out, exposure)
    }
}

/// The means of a field over the pixels of an image.
fn means(workspace: &mut Workspace, field: Field, computed: &Raster, image: &Raster) -> Field {
    if computed == image {
        return field;
    }
    let around = [computed.rows - image.rows, computed.columns - image.columns];
    let same_pixels = (image.spacing / computed.spacing).round() as usize == 1;
    if same_pixels
        && computed.origin_row - image.origin_row == (around[0] / 2) as i64
        && around[0].is_multiple_of(2)
    {
        return field.crop(around[0] / 2, around[1] / 2);
    }
    let means = means_over(&field, computed, image);
    workspace.give(field);
    means
}

/// Puts some rows of all into a field; what covers all of it becomes it. Rows after those that are put are dropped.
fn put(workspace: &mut Workspace, into: &mut Field, [rows, all]: [Range<usize>; 2], part: Field) {
    if rows == all {
        *into = part;
        return;
    }
    let columns = part.columns;
    if into.values.is_empty() {
        *into = Field {
            rows: all.len(),
            columns,
            values: workspace.floats.take(all.len() * columns),
        };
    }
    let to = rows.start * columns..rows.end * columns;
    into.values[to].copy_from_slice(&part.values[..rows.len() * columns]);
    workspace.give(part);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::SHARES;
    use crate::survey::Survey;

    /// Small margins: what lies beyond a strip is little.
    fn scene(keys: &[&str]) -> Scene {
        let base = [
            "grid.rows=170",
            "grid.columns=60",
            "radar.range_to_velocity=20",
            "ship.position=[20, 120]",
            "ship.heading=20",
        ];
        let scene = Scene::default().with_assignments(&base).unwrap();
        scene.with_assignments(keys).unwrap()
    }

    fn drawn(scene: &Scene, strips: usize) -> (Drawn, Vec<Strip>) {
        let models = Models::new(scene);
        let mut plan = Plan::of(scene, &models, &Survey::new(scene, &models)).unwrap();
        plan.sizes.strips = strips;
        let mut clock = (Clock::start(), Seconds::default());
        let what = (scene, &models, &plan);
        let how = (Method::Fast, Wanted::Fields);
        let (out, _) = Simulator::default().draw(what, how, (&mut clock.0, &mut clock.1));
        (out, Strip::all(&models, &plan))
    }

    const SCENES: [&[&str]; 4] = [
        &[],
        &[
            "sea.gust_strength=0.1",
            "sea.slick_damping=0.5",
            "sea.wind_speed=4",
            "sea.swell_height=1",
        ],
        &[
            "radar.sensor=sentinel-1-iw",
            "radar.range_to_velocity=20",
            "sea.gust_strength=0.1",
        ],
        // Refined: rows of one strip are half of the next as well.
        &["grid.spacing=10", "ship.speed=6.5", "ship.edge=true"],
    ];

    /// Strips make the same image: all fields, rounding and the methods' own errors apart.
    #[test]
    fn strips_make_the_image_that_one_piece_makes() {
        for keys in SCENES {
            let scene = scene(keys);
            let (mut whole, one) = drawn(&scene, 1);
            assert_eq!(one.len(), 1);
            for count in [2, 3] {
                let (mut parts, strips) = drawn(&scene, count);
                assert_eq!(strips.len(), count);
                let tolerance = scene.model.tolerance;
                // Each sum of the wake's waves keeps its share of the root mean square over its own pixels, which in one
                // of n strips is at most √n times that over all.
                let sums = (1.0 + (count as f64).sqrt()) * SHARES.fields * tolerance;
                for (a, b) in whole.outputs().into_iter().zip(parts.outputs()).take(7) {
                    assert_eq!((a.rows, a.columns), (170, 60));
                    let largest = a.difference(b).0 / a.rms();
                    assert!(largest <= sums, "{keys:?} {count}: {largest:e} {sums:e}");
                }
                let shares = SHARES.fields + SHARES.table + SHARES.kernels;
                let (_, rms) = whole.intensity.difference(&parts.intensity);
                let allowed = shares * tolerance * whole.intensity.mean();
                assert!(
                    rms > 0.0 && rms <= allowed,
                    "{keys:?} {count}: {rms:e} {allowed:e}"
                );
            }
        }
    }

    /// The sea itself is the same to the last bit, also where the margin of a strip ends with the image's.
    #[test]
    fn the_sea_does_not_know_the_strips() {
        for keys in SCENES {
            let mut scene = scene(keys);
            scene.ships.clear();
            scene.sea.swell_height = 0.0;
            scene.radar.range_to_velocity = 120.0;
            let [mut whole, mut parts] = [1, 5].map(|count| drawn(&scene, count).0);
            for (a, b) in whole.outputs().into_iter().zip(parts.outputs()).take(7) {
                assert!(a == b && a.rms() > 0.0, "{keys:?}");
            }
        }
    }

    /// Each row belongs to one strip, and each strip has its margin.
    #[test]
    fn strips_cover_all_rows_once() {
        for keys in SCENES {
            let scene = scene(keys);
            let models = Models::new(&scene);
            let mut plan = Plan::of(&scene, &models, &Survey::new(&scene, &models)).unwrap();
            let margin = plan.sizes.margin[0];
            for count in [1, 2, 7, 170] {
                plan.sizes.strips = count;
                let strips = Strip::all(&models, &plan);
                let mut next = [0; 2];
                for strip in &strips {
                    assert_eq!([strip.image.start, strip.own.start], next, "{keys:?}");
                    next = [strip.image.end, strip.own.end];
                    assert!(
                        strip.computed.start <= strip.own.start
                            && strip.computed.end >= strip.own.end
                    );
                    // Rows of the margin count from the first one above the image.
                    let above = (strip.computed.start + margin) - strip.raster.start;
                    let below = strip.raster.end - (strip.computed.end + margin);
                    assert!(above >= margin && below >= margin);
                }
                assert_eq!(next, [170, models.computed.rows]);
            }
        }
    }
}
