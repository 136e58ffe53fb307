//! Computation of a large scene in strips of rows, one after the other, so that only the image is held in memory as a
//! whole.
//!
//! Results depend on position, not on strips: all strips use the same waves of the sea, drawn once on one lattice, and the
//! same nodes of the wake. They differ by the rounding of sums that depend on what else is summed (FFTs of the wake's
//! gridding, the table of σ⁰), within the corresponding shares of the tolerance. Rows are computed beyond a strip as far as
//! echoes are displaced, twice the margin of the image.

use crate::pixels::{Parts, Pixels, means_over};
use crate::plan::Sizes;
use crate::raster::{Field, Raster};
use crate::workspace::Workspace;
use std::ops::Range;

/// Margins between a strip's image and the edge of the rows computed for it.
const OVERLAP: usize = 2;

/// One strip.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Strip {
    /// Rows of the image.
    pub(super) image: Range<usize>,
    /// Rows of the computed image from which they are made; the last may also be the first of the next strip.
    pub(super) computed: Range<usize>,
    /// Computed rows that belong to no other strip.
    pub(super) own: Range<usize>,
    /// Rows of the computed pixels with their margin.
    pub(super) raster: Range<usize>,
}

impl Strip {
    /// A single strip with all rows.
    pub(super) fn whole(pixels: &Pixels, sizes: &Sizes) -> Self {
        Self {
            image: 0..pixels.image.rows,
            computed: 0..pixels.computed.rows,
            own: 0..pixels.computed.rows,
            raster: 0..pixels.computed.rows + 2 * sizes.margin[0],
        }
    }

    /// The strips of a plan, from the first row to the last.
    pub(super) fn all(pixels: &Pixels, sizes: &Sizes) -> Vec<Self> {
        let count = sizes.strips;
        let whole = Self::whole(pixels, sizes);
        let parts = Parts::new(&pixels.computed, &pixels.image);
        let margin = sizes.margin[0];
        let one = |n: usize| {
            let [start, end] = [n, n + 1].map(|n| n * whole.image.end / count);
            let mut own = parts.rows(&(start..end)).start..parts.rows(&(end..end + 1)).start;
            let mut computed = parts.rows(&(start..end));
            // Around the rows of the strip lie the margin rows, then the overlap.
            let mut raster = computed.start.saturating_sub((OVERLAP - 1) * margin)
                ..(computed.end + (OVERLAP + 1) * margin).min(whole.raster.end);
            if n == 0 {
                (own.start, computed.start, raster.start) = (0, 0, 0);
            }
            if n + 1 == count {
                (own.end, computed.end, raster.end) =
                    (whole.own.end, whole.computed.end, whole.raster.end);
            }
            Self {
                image: start..end,
                computed,
                own,
                raster,
            }
        };
        (0..count).map(one).collect()
    }
}

/// Means of a field over the pixels of an image.
pub(super) fn means(
    workspace: &mut Workspace,
    field: Field,
    computed: &Raster,
    image: &Raster,
) -> Field {
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

/// Copies the first rows of a part into their place in a field of all rows, or moves the part if it covers all rows.
pub(super) fn put(
    workspace: &mut Workspace,
    into: &mut Field,
    [rows, all]: [Range<usize>; 2],
    part: Field,
) {
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
    use crate::fields::Wanted;
    use crate::plan::{Plan, SHARES};
    use crate::prepared::Prepared;
    use crate::scene::Scene;
    use crate::simulate::record::Clock;
    use crate::simulate::simulation::Method;
    use crate::simulate::stages::{Drawn, Memory, Run, draw};

    /// Small margins, so that little lies beyond a strip.
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
        let prepared = Prepared::new(scene);
        let mut plan = Plan::of(&prepared).unwrap();
        plan.sizes.strips = strips;
        let run = Run {
            prepared: &prepared,
            plan: &plan,
            method: Method::Fast,
            wanted: Wanted::Fields,
        };
        let out = draw(run, &mut Memory::default(), &mut Clock::start());
        (out, Strip::all(&prepared.models.pixels, &plan.sizes))
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
        // Refined: rows of one strip are also half of the next.
        &["grid.spacing=10", "ship.speed=6.5", "ship.edge=true"],
    ];

    /// Strips give the same image in all fields, apart from rounding and the methods' own errors.
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
                // Each sum of the wake's waves keeps its share of the root mean square over its own pixels, which in one of
                // n strips is at most √n times that over all pixels.
                let sums = (1.0 + (count as f64).sqrt()) * SHARES.fields * tolerance;
                for (a, b) in whole
                    .fields
                    .each()
                    .into_iter()
                    .zip(parts.fields.each())
                    .take(7)
                {
                    assert_eq!((a.rows, a.columns), (170, 60));
                    let largest = a.difference(b).0 / a.rms();
                    assert!(largest <= sums, "{keys:?} {count}: {largest:e} {sums:e}");
                }
                let shares = SHARES.fields + SHARES.table + SHARES.kernels;
                let (_, rms) = whole.fields.intensity.difference(&parts.fields.intensity);
                let allowed = shares * tolerance * whole.fields.intensity.mean();
                assert!(
                    rms > 0.0 && rms <= allowed,
                    "{keys:?} {count}: {rms:e} {allowed:e}"
                );
            }
        }
    }

    /// The sea itself is bit-identical, even where the margin of a strip ends with the image's.
    #[test]
    fn the_sea_does_not_know_the_strips() {
        for keys in SCENES {
            let mut scene = scene(keys);
            scene.ships.clear();
            scene.sea.swell_height = 0.0;
            scene.radar.range_to_velocity = 120.0;
            let [mut whole, mut parts] = [1, 5].map(|count| drawn(&scene, count).0);
            for (a, b) in whole
                .fields
                .each()
                .into_iter()
                .zip(parts.fields.each())
                .take(7)
            {
                assert!(a == b && a.rms() > 0.0, "{keys:?}");
            }
        }
    }

    /// Each row belongs to one strip, and each strip has its margin.
    #[test]
    fn strips_cover_all_rows_once() {
        for keys in SCENES {
            let scene = scene(keys);
            let pixels = Prepared::new(&scene).models.pixels;
            let mut sizes = Plan::new(&scene).unwrap().sizes;
            let margin = sizes.margin[0];
            for count in [1, 2, 7, 170] {
                sizes.strips = count;
                let strips = Strip::all(&pixels, &sizes);
                let mut next = [0; 2];
                for strip in &strips {
                    assert_eq!([strip.image.start, strip.own.start], next, "{keys:?}");
                    next = [strip.image.end, strip.own.end];
                    assert!(
                        strip.computed.start <= strip.own.start
                            && strip.computed.end >= strip.own.end
                    );
                    // Rows of the margin are counted from the first one above the image.
                    let above = (strip.computed.start + margin) - strip.raster.start;
                    let below = strip.raster.end - (strip.computed.end + margin);
                    assert!(above >= margin && below >= margin);
                }
                assert_eq!(next, [170, pixels.computed.rows]);
            }
        }
    }
}
