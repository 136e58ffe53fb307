//! The pixels on which a scene is computed: those of the image, or an integer number of finer ones along each side of a
//! pixel.
//!
//! Waves far shorter than a pixel are not visible as waves, but their effect on the mean brightness is: on pixels too
//! coarse for the waves on the arms of a wake, the arms vanish. The computed spacing is therefore at most
//!
//! ```text
//! ρ/4 and 1/(2B)                            where the image has an impulse response
//! λ_cusp/3.5,  λ_cusp = (2/3) 2πU²/g        where a ship's waves would be seen and the image's pixels do not carry them
//! ```
//!
//! and an integer fraction of the image's. Each image pixel is the mean over its square.

use crate::kelvin::KelvinWake;
use crate::raster::{Field, Raster};
use crate::sar::ImpulseResponse;
use crate::scene::Grid;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per wavelength on the arms of a wake: chosen, as the brightness of the arms no longer changes on finer pixels.
const PIXELS_A_CUSP_WAVE: f64 = 3.5;

/// Smallest slope variance at which a ship's waves are visible: below it, σ⁰ changes by less than 1 % (two-scale theory, C
/// band at 25°, where it changes most: 1.4 dB per 0.005).
const VISIBLE: f64 = 1e-4;

/// Limits of the refinement for a ship's waves: divisions along each side of a pixel, and computed pixels, about a second
/// on two cores (both chosen).
const MOST_DIVISIONS: usize = 4;
const MOST_PIXELS: usize = 1 << 22;

/// The pixels of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pixels {
    /// Pixels of the image.
    pub(crate) image: Raster,
    /// Computed pixels without the margin: those of the image or finer ones, with the guard of an impulse response.
    pub(crate) computed: Raster,
    /// Spacing that a ship's waves require \[m\], if the computed one is coarser.
    pub(crate) asked_spacing: Option<f64>,
}

impl Pixels {
    /// Chooses the computed pixels for the image of a grid.
    pub(crate) fn new(
        grid: &Grid,
        response: Option<&ImpulseResponse>,
        wakes: &[KelvinWake],
    ) -> Self {
        let image = Raster::image(grid.rows, grid.columns, grid.spacing);
        let divisions = |spacing: f64| (image.spacing / spacing * (1.0 - 1e-12)).ceil().max(1.0);
        let carried = response.map_or(1.0, |r| divisions(r.carrying_spacing()));
        let for_response = response.map_or(1.0, |r| divisions(r.largest_spacing()));
        let cusp = |wake: &KelvinWake| {
            let spacing = wake.transverse_wavelength() / 1.5 / PIXELS_A_CUSP_WAVE;
            visible(wake, &image, spacing).then_some(spacing)
        };
        let asked = wakes.iter().filter_map(cusp).fold(f64::INFINITY, f64::min);
        let most = (MOST_PIXELS as f64 / image.len() as f64).sqrt().floor();
        let for_ships = divisions(asked).min(MOST_DIVISIONS as f64).min(most);
        let chosen = match grid.oversampling {
            Some(divisions) => f64::from(divisions).max(carried),
            None => for_response.max(for_ships),
        };
        let fine = image.divided(chosen as usize);
        Self {
            image,
            computed: response.map_or(fine, |response| {
                let [rows, columns] = response.guard(fine.spacing);
                fine.with_margin(rows, columns)
            }),
            asked_spacing: (asked < fine.spacing * (1.0 - 1e-9)).then_some(asked),
        }
    }

    /// Whether the computed pixels differ from those of the image.
    pub(crate) fn are_refined(&self) -> bool {
        self.computed != self.image
    }
}

/// Whether a ship's waves that pixels of `spacing` \[m\] resolve, but the image's do not, are visible half-way to the
/// farthest corner of the image astern.
fn visible(wake: &KelvinWake, image: &Raster, spacing: f64) -> bool {
    if spacing >= image.spacing {
        return false;
    }
    let astern = wake
        .track
        .corners(image)
        .iter()
        .map(|c| -c[0])
        .fold(0.0, f64::max);
    let waves = wake.subpixel([PI / image.spacing, PI / spacing]);
    astern > 0.0 && waves.is_some_and(|waves| waves.steepest(0.5 * astern) >= VISIBLE)
}

/// The computed pixels of each image pixel, and their weights: one on the edge between two pixels counts half for each.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parts {
    /// Computed row and column where the image's first pixel begins.
    first: [usize; 2],
    step: usize,
    /// Weights along the side of a pixel, with sum 1.
    side: Vec<f32>,
}

impl Parts {
    /// Relates computed pixels to those of the image.
    ///
    /// # Panics
    ///
    /// If an image pixel reaches beyond the computed ones.
    pub(crate) fn new(computed: &Raster, image: &Raster) -> Self {
        let step = (image.spacing / computed.spacing).round() as i64;
        let half = step / 2;
        let first = [
            computed.origin_row - image.origin_row * step - half,
            computed.origin_column - image.origin_column * step - half,
        ];
        assert!(
            first.iter().all(|&n| n >= 0),
            "an image that reaches beyond what is computed"
        );
        let on_edge = |n: i64| step % 2 == 0 && (n == 0 || n == step);
        let weight = |n: i64| if on_edge(n) { 0.5 } else { 1.0 } / step as f32;
        Self {
            first: first.map(|n| n as usize),
            step: step as usize,
            side: (0..=2 * half).map(weight).collect(),
        }
    }

    /// The computed rows for some rows of the image.
    pub(crate) fn rows(&self, rows: &std::ops::Range<usize>) -> std::ops::Range<usize> {
        let start = self.first[0] + rows.start * self.step;
        let last = self.first[0] + rows.end.max(1) * self.step - self.step;
        start..(last + self.side.len()).max(start)
    }

    /// Number of computed pixels per image pixel.
    pub(crate) fn count(&self) -> usize {
        self.side.len() * self.side.len()
    }

    /// The computed pixels of one image pixel, row after row.
    pub(crate) fn of(&self, [i, j]: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
        let [row, column] = [self.first[0] + i * self.step, self.first[1] + j * self.step];
        let side = self.side.len();
        (0..side * side).map(move |n| [row + n / side, column + n % side])
    }

    /// The mean over an image pixel of the values at its computed pixels.
    pub(crate) fn mean(&self, values: &[f64]) -> f64 {
        let rows = values.chunks(self.side.len()).zip(&self.side);
        let along = |row: &[f64]| -> f64 {
            row.iter()
                .zip(&self.side)
                .map(|(v, &w)| v * f64::from(w))
                .sum()
        };
        rows.map(|(row, &weight)| f64::from(weight) * along(row))
            .sum()
    }
}

/// Means of a field on computed pixels over the pixels of an image.
///
/// # Panics
///
/// If an image pixel reaches beyond the computed ones, or the field does not match them in size.
pub(crate) fn means_over(field: &Field, computed: &Raster, image: &Raster) -> Field {
    let size = [field.rows, field.columns];
    assert_eq!(
        size,
        [computed.rows, computed.columns],
        "a field of another size"
    );
    let Parts { first, step, side } = Parts::new(computed, image);
    let mut out = Field::constant(image, 0.0);
    let rows = out.values.par_chunks_mut(image.columns.max(1)).enumerate();
    rows.for_each_init(
        || vec![0.0f32; field.columns],
        |line, (i, row)| {
            line.fill(0.0);
            for (n, weight) in side.iter().enumerate() {
                let part = &field.values[(first[0] + i * step + n) * field.columns..];
                for (sum, value) in line.iter_mut().zip(part) {
                    *sum += weight * value;
                }
            }
            for (j, value) in row.iter_mut().enumerate() {
                let parts = line[first[1] + j * step..].iter().zip(&side);
                *value = parts.map(|(v, w)| v * w).sum();
            }
        },
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use crate::models::Models;

    fn computed(keys: &[&str]) -> (Pixels, f64) {
        let size = ["grid.rows=64", "grid.columns=48"];
        let scene = Scene::default()
            .with_assignments(&[&size[..], keys].concat())
            .unwrap();
        let pixels = Models::new(&scene).pixels;
        (pixels, pixels.computed.spacing)
    }

    /// `λ_cusp` = 2π 6.5²/(1.5 · 9.807) = 18.05 m requires 5.16 m: the next smaller fraction of the image's spacing.
    #[test]
    fn the_waves_on_the_arms_have_their_pixels() {
        let slow = "ship.speed=6.5";
        for (spacing, expected) in [
            (20.0, 5.0),
            (10.0, 5.0),
            (5.0, 5.0),
            (2.5, 2.5),
            (15.0, 5.0),
        ] {
            let grid = format!("grid.spacing={spacing}");
            assert!(
                (computed(&[slow, &grid]).1 - expected).abs() < 1e-12,
                "{spacing}"
            );
            // No waves, no finer pixels: for a ship at rest and where the image lies ahead of the ship.
            for none in ["ship.speed=0", "ship.position=[0, 9000]"] {
                let heading = "ship.heading=180";
                assert!((computed(&[slow, heading, none, &grid]).1 - spacing).abs() < 1e-12);
            }
        }
        // The default ship's waves have 17 pixels already.
        let (pixels, _) = computed(&[]);
        assert!(!pixels.are_refined() && pixels.computed == pixels.image);
    }

    /// Neither a slow ship nor a large image exceeds the limits; the required spacing is recorded.
    #[test]
    fn the_limits_hold() {
        let (pixels, spacing) = computed(&["ship.speed=2", "grid.spacing=10"]);
        assert!((spacing - 2.5).abs() < 1e-12);
        let asked = 2.0 / 3.0 * std::f64::consts::TAU * 4.0 / 9.80665 / 3.5;
        assert!((pixels.asked_spacing.unwrap() / asked - 1.0).abs() < 1e-12);
        let large = [
            "ship.speed=2",
            "grid.spacing=10",
            "grid.rows=1500",
            "grid.columns=1500",
        ];
        assert!((computed(&large).1 - 10.0).abs() < 1e-12);
        let (pixels, spacing) = computed(&["ship.speed=6.5", "grid.spacing=10"]);
        assert!((spacing - 5.0).abs() < 1e-12 && pixels.asked_spacing.is_none());
    }

    #[test]
    fn a_key_or_a_response_decide_where_they_are_there() {
        let key = "grid.oversampling=3";
        assert!((computed(&["grid.spacing=9", key]).1 - 3.0).abs() < 1e-12);
        let sentinel = "radar.sensor=sentinel-1-iw";
        assert!((computed(&[sentinel]).1 - 5.0).abs() < 1e-12);
        // ρ = 20.3 m requires 5.1 m, and sampling at twice its bandwidth 9.7 m: pixels of 20 m are too coarse.
        assert!(
            (computed(&[sentinel, "grid.spacing=20", "grid.oversampling=1"]).1 - 20.0 / 3.0).abs()
                < 1e-9
        );
    }

    /// The weights are shares of the square: a plane keeps its value at the centre of a pixel, and where the parts tile the
    /// image, the weights of each add up to 1.
    #[test]
    fn means_are_over_the_square_of_a_pixel() {
        let image = Raster::image(5, 4, 12.0);
        for divisions in 1..=5 {
            let fine = image.divided(divisions).with_margin(2, 1);
            let plane = Field::from_fn(&fine, |i, j| (fine.x(j) + 3.0 * fine.y(i)) as f32);
            let means = means_over(&plane, &fine, &image);
            let parts = Parts::new(&fine, &image);
            for (i, j) in [(0, 0), (4, 3), (2, 1)] {
                let expected = image.x(j) + 3.0 * image.y(i);
                // Sums of 25 values below 200, rounded to 6e-8 each.
                assert!(
                    (f64::from(means.at(i, j)) - expected).abs() < 1e-4,
                    "{divisions}"
                );
                let values = parts.of([i, j]).map(|[r, c]| f64::from(plane.at(r, c)));
                let mean = parts.mean(&values.collect::<Vec<_>>());
                assert!((mean - expected).abs() < 1e-4, "{divisions}");
            }
            let mut shares = vec![0.0f32; fine.len()];
            for pixel in (0..image.len()).map(|n| [n / 4, n % 4]) {
                for (n, [r, c]) in parts.of(pixel).enumerate() {
                    let side = parts.side.len();
                    shares[r * fine.columns + c] += parts.side[n / side] * parts.side[n % side];
                }
            }
            let inner = shares[(2 + divisions) * fine.columns + 1 + divisions];
            assert!((inner * (divisions * divisions) as f32 - 1.0).abs() < 1e-6);
            assert!((shares.iter().sum::<f32>() - image.len() as f32).abs() < 1e-4);
        }
    }
}
