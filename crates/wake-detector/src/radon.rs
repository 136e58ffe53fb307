//! The classical detector: a localized, normalised Radon transform around bright targets and over the whole image.
//!
//! ```text
//! t = Σ_k (on_k − beside_k) / (σ_n √n),    k = 1 … n pixels from a tip
//! ```
//!
//! where on is the mean contrast across the ray, beside the mean on both sides of it, and `σ_n` the spread of the same sum
//! over the whole image, so that t is normal on sea. Bright targets are masked. The threshold on |t| follows from an
//! expected number of false alarms per image; it is lower around bright targets, where there are fewer rays.
//!
//! # References
//!
//! Murphy (1986), "Linear feature detection and enhancement in noisy images via the Radon transform"; Copeland, Ravichandran
//! & Trivedi (1995), "Localized Radon transform-based detection of ship wakes in SAR images"; Eldhuset (1996), "An automatic
//! ship and ship wake detection system for spaceborne SAR images in coastal regions" (search around ships).

use rayon::prelude::*;

use crate::image::GreyImage;
use crate::maps::without_repeats;
use crate::normalize;
use crate::scaling::rescaled;
use crate::search::{Tile, unscaled};
use crate::wake::{Detection, Wake, direction};

/// Expected false alarms per image at the threshold, from the rays around targets and from all others each.
const FALSE_ALARMS: f64 = 0.25;

/// Scale of the image that is transformed: at half size, speckle is nearly independent.
const FACTOR: f32 = 0.5;
/// Spacing of the tips that are tried \[pixels of that image\].
const STEP: usize = 6;
/// Number of angles that are tried.
const ANGLES: usize = 120;
/// Lengths of rays, and pixels skipped at their start \[pixels\].
const LENGTHS: [usize; 4] = [24, 48, 84, 130];
const SKIPPED: usize = 5;
/// Distance from a ray to the pixels compared with it on both sides \[pixels\].
const BESIDE: usize = 7;
/// Contrast is clamped to ±this, so that no single pixel dominates a ray.
const CUT: f32 = 2.5;
/// Lowest contrast of a target, and distance around it that is masked \[pixels\].
const TARGET: f32 = 6.0;
const MASK: usize = 3;
/// Largest distance of a tip from its target \[pixels\].
const NEAR_TARGET: f32 = 20.0;
/// Tips closer than this are the same \[pixels of the full image\].
const NEAR: f32 = 60.0;

/// Contrast without targets; masked pixels are NaN.
struct Sea {
    rows: usize,
    columns: usize,
    contrast: Vec<f32>,
    targets: Vec<[f32; 2]>,
}

impl Sea {
    fn of(pixels: &[f32], rows: usize, columns: usize) -> Self {
        let (rows, columns, pixels) = rescaled(pixels, rows, columns, FACTOR);
        let mut contrast = normalize::contrast(&pixels, rows, columns);
        let bright: Vec<usize> = (0..contrast.len())
            .filter(|&i| contrast[i] > TARGET)
            .collect();
        let places = bright
            .iter()
            .map(|i| [(i % columns) as f32, (i / columns) as f32]);
        let targets = places.fold(Vec::new(), |mut apart: Vec<[f32; 2]>, [x, y]| {
            // Bright pixels close together are one target; hundreds of targets are land.
            if apart.len() < 400 && !apart.iter().any(|t| (t[0] - x).hypot(t[1] - y) < 10.0) {
                apart.push([x, y]);
            }
            apart
        });
        contrast.iter_mut().for_each(|z| *z = z.clamp(-CUT, CUT));
        for i in bright {
            let (row, column) = (i / columns, i % columns);
            for r in row.saturating_sub(MASK)..(row + MASK + 1).min(rows) {
                let left = r * columns + column.saturating_sub(MASK);
                contrast[left..r * columns + (column + MASK + 1).min(columns)].fill(f32::NAN);
            }
        }
        Self {
            rows,
            columns,
            contrast,
            targets,
        }
    }

    fn at(&self, x: f32, y: f32) -> f32 {
        let (column, row) = (x.round(), y.round());
        let inside =
            column >= 0.0 && row >= 0.0 && column < self.columns as f32 && row < self.rows as f32;
        match inside {
            true => self.contrast[row as usize * self.columns + column as usize],
            false => f32::NAN,
        }
    }

    /// Sums along the rays from given tips in a direction and in the opposite one.
    ///
    /// The image is rotated so that all rays run along its rows; cumulative sums of each row then give the sums of all its rays.
    fn sums(&self, tips: &[[f32; 2]], [right, down]: [f32; 2]) -> Vec<[Sums; 2]> {
        let middle = [0.5 * self.columns as f32, 0.5 * self.rows as f32];
        let half = middle[0].hypot(middle[1]).ceil() as usize + BESIDE + 2;
        let size = 2 * half + 1;
        let place = |line: usize, along: usize| {
            let (a, c) = (along as f32 - half as f32, line as f32 - half as f32);
            [
                middle[0] + a * right - c * down,
                middle[1] + a * down + c * right,
            ]
        };
        let turned: Vec<f32> = (0..size * size)
            .map(|i| {
                let [x, y] = place(i / size, i % size);
                self.at(x, y)
            })
            .collect();
        // Sum and number of the valid steps before each pixel of a line.
        let mut before = vec![(0.0f32, 0u32); size * (size + 1)];
        for line in BESIDE + 1..size - BESIDE - 1 {
            let row = |l: usize| &turned[l * size..][..size];
            let on = [row(line - 1), row(line), row(line + 1)];
            let beside = [
                row(line - BESIDE - 1),
                row(line + 1 - BESIDE),
                row(line + BESIDE - 1),
                row(line + BESIDE + 1),
            ];
            let running = &mut before[line * (size + 1)..][..size + 1];
            for along in 0..size {
                let mean = |rows: &[&[f32]]| {
                    rows.iter().map(|r| r[along]).sum::<f32>() / rows.len() as f32
                };
                let step = mean(&on) - mean(&beside);
                let (sum, count) = running[along];
                running[along + 1] = if step.is_finite() {
                    (sum + step, count + 1)
                } else {
                    (sum, count)
                };
            }
        }
        let ray = |line: usize, from: usize, to: usize| {
            let running = &before[line * (size + 1)..][..size + 1];
            let (first, last) = (running[from.min(size)], running[to.min(size)]);
            (last.0 - first.0, last.1 - first.1)
        };
        let of_tip = |tip: &[f32; 2]| {
            let (x, y) = (tip[0] - middle[0], tip[1] - middle[1]);
            let along = (x * right + y * down).round() + half as f32;
            let line = ((y * right - x * down).round() + half as f32) as usize;
            let along = along as usize;
            [false, true].map(|back| {
                LENGTHS.map(|length| {
                    let (sum, count) = match back {
                        false => ray(line, along + SKIPPED, along + SKIPPED + length),
                        true => ray(
                            line,
                            (along + 1).saturating_sub(SKIPPED + length),
                            (along + 1).saturating_sub(SKIPPED),
                        ),
                    };
                    (4 * count as usize >= 3 * length).then(|| sum / (count as f32).sqrt())
                })
            })
        };
        tips.iter().map(of_tip).collect()
    }
}

/// For each of [`LENGTHS`], the sum along a ray over the root of its number of valid pixels; `None` if less than three
/// quarters of the pixels are valid.
type Sums = [Option<f32>; LENGTHS.len()];

/// Returns the wakes of an image in descending order of score; the score is log₁₀ of the false alarms expected per image at
/// the threshold over those expected at the strength of the ray.
#[must_use]
pub fn find(image: &GreyImage) -> Vec<Detection> {
    let tiles = Tile::all(image.rows, image.columns);
    let found = tiles.iter().flat_map(|tile| {
        let Ok((rows, columns, pixels)) = tile.pixels(image);
        let found = in_sea(&Sea::of(&pixels, rows, columns), tiles.len());
        found.into_iter().filter_map(|one| {
            Some(Detection {
                wake: tile.placed(unscaled(one.wake, FACTOR))?,
                ..one
            })
        })
    });
    without_lines_twice(without_repeats(found.collect(), NEAR))
}

/// Keeps only the highest score of rays along one line, which can be followed both ways but has one tip.
fn without_lines_twice(found: Vec<Detection>) -> Vec<Detection> {
    let mut kept: Vec<Detection> = Vec::new();
    for one in found {
        let [x, y] = one.wake.at(0.5 * one.wake.length);
        let on_line = |other: &Detection| {
            let half_turn =
                (one.wake.axis_deg - other.wake.axis_deg + 90.0).rem_euclid(180.0) - 90.0;
            let ([right, down], [tx, ty]) = (other.wake.direction(), other.wake.tip);
            let (along, across) = (
                (x - tx) * right + (y - ty) * down,
                (y - ty) * right - (x - tx) * down,
            );
            let reach = other.wake.length + 0.5 * one.wake.length;
            half_turn.abs() < 15.0
                && across.abs() < 25.0
                && (-0.5 * one.wake.length..reach).contains(&along)
        };
        if !kept.iter().any(on_line) {
            kept.push(one);
        }
    }
    kept
}

/// The wakes of a tile, in pixels of the transform; `tiles` is the number of tiles in the image.
fn in_sea(sea: &Sea, tiles: usize) -> Vec<Detection> {
    let tips: Vec<[f32; 2]> = (0..sea.rows.div_ceil(STEP))
        .flat_map(|r| {
            (0..sea.columns.div_ceil(STEP)).map(move |c| [c * STEP, r * STEP].map(|x| x as f32))
        })
        .collect();
    let half_turn: Vec<Vec<[Sums; 2]>> = (0..ANGLES / 2)
        .into_par_iter()
        .map(|k| sea.sums(&tips, direction(360.0 * k as f32 / ANGLES as f32)))
        .collect();
    // Sums of a tip at an angle.
    let sums = |tip: usize, k: usize| half_turn[k % (ANGLES / 2)][tip][k / (ANGLES / 2)];
    let spreads: [f32; LENGTHS.len()] = std::array::from_fn(|n| {
        let all = half_turn.iter().flatten().flatten();
        let mut sizes: Vec<f32> = all.filter_map(|s| s[n]).map(f32::abs).collect();
        match sizes.len() {
            0 => f32::INFINITY,
            count => 1.4826 * *sizes.select_nth_unstable_by(count / 2, f32::total_cmp).1,
        }
    });
    let near_target = |tip: &[f32; 2]| {
        sea.targets
            .iter()
            .any(|t| (t[0] - tip[0]).hypot(t[1] - tip[1]) < NEAR_TARGET)
    };
    let near: Vec<bool> = tips.par_iter().map(near_target).collect();
    // Neighbouring rays share pixels: about a quarter of the rays are independent.
    let trials =
        |of: bool| 0.25 * (near.iter().filter(|&&n| n == of).count() * ANGLES * tiles) as f64;
    let (trials_near, trials_far) = (trials(true), trials(false));
    let found = tips
        .iter()
        .zip(&near)
        .enumerate()
        .flat_map(|(i, (tip, &near))| {
            let trials = if near { trials_near } else { trials_far };
            let best = |k: usize| {
                let known =
                    (0..LENGTHS.len()).filter_map(|n| Some((n, sums(i, k)[n]? / spreads[n])));
                known
                    .filter(|(_, t)| t.is_finite())
                    .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            };
            let rays: Vec<Option<(usize, f32)>> = (0..ANGLES).map(best).collect();
            let size = |k: usize| rays[k % ANGLES].map_or(0.0, |(_, t)| t.abs());
            let peaks: Vec<Detection> = (0..ANGLES)
                .filter(|&k| size(k) >= size(k + 1) && size(k) > size(k + ANGLES - 1))
                .filter_map(|k| {
                    let (n, t) = rays[k]?;
                    let alarms = log_tail(f64::from(t.abs())) + trials.max(1.0).log10();
                    let score = FALSE_ALARMS.log10() - alarms;
                    let wake = Wake {
                        tip: *tip,
                        axis_deg: 360.0 * k as f32 / ANGLES as f32,
                        half_angle_deg: 0.0,
                        length: (SKIPPED + LENGTHS[n]) as f32,
                        snr: f32::INFINITY,
                        contrast_db: None,
                    };
                    // A line that ends at a target, or shortly before it, begins there.
                    let onward = [0.0, NEAR_TARGET, 2.0 * NEAR_TARGET];
                    let at_end = |on: f32| near_target(&wake.at(wake.length + on));
                    let backward = !near && onward.into_iter().any(at_end);
                    let score = score as f32;
                    (score > 0.0 && !backward).then(|| Detection::new(score, wake))
                })
                .collect();
            peaks
        });
    found.collect()
}

/// log₁₀ of the probability that a normal number is further than t from 0; 0 for t below 1.
///
/// ```text
/// P = 2 φ(t) / (t + 1/(t + 2/(t + 3/(t + …))))
/// ```
///
/// # References
///
/// Abramowitz & Stegun (1964), 26.2.14 (Laplace's continued fraction).
fn log_tail(t: f64) -> f64 {
    if t < 1.0 {
        return 0.0;
    }
    let fraction = (1..=60).rev().fold(t, |below, k| t + f64::from(k) / below);
    let ln = (2.0 / std::f64::consts::TAU.sqrt() / fraction).ln() - 0.5 * t * t;
    ln / std::f64::consts::LN_10
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// Values of the two-sided normal tail: 0.3173105, 0.0455003, 5.7330e-7, 1.9732e-9 at 1, 2, 5, 6.
    #[test]
    fn the_tail_is_that_of_tables() {
        for (t, p) in [
            (1.0, 0.3173105f64),
            (2.0, 0.0455003),
            (5.0, 5.7330e-7),
            (6.0, 1.9732e-9),
        ] {
            assert!(
                (log_tail(t) - p.log10()).abs() < 2e-5,
                "{t}: {}",
                10f64.powf(log_tail(t))
            );
        }
    }

    #[test]
    fn a_line_found_from_both_ends_counts_once() {
        let of = |score: f32, tip: [f32; 2], axis_deg: f32| {
            let wake = Wake {
                tip,
                axis_deg,
                half_angle_deg: 0.0,
                length: 200.0,
                snr: f32::INFINITY,
                contrast_db: None,
            };
            Detection::new(score, wake)
        };
        let first = of(0.9, [100.0, 150.0], 30.0);
        let end = first.wake.at(190.0);
        let beside = [100.0 + 40.0 * 0.866, 150.0 + 40.0 * 0.5];
        let found = vec![
            first,
            of(0.8, end, 210.0),
            of(0.7, beside, 30.0),
            of(0.6, [100.0, 150.0], 60.0),
        ];
        let scores: Vec<f32> = without_lines_twice(found).iter().map(|d| d.score).collect();
        assert_eq!(scores, [0.9, 0.7, 0.6]);
    }

    /// A dark line one standard deviation deep is found where it lies, and the sea around it stays below the threshold.
    #[test]
    fn a_dark_line_beside_a_target_is_found() {
        let (size, mut alarms) = (400, 0);
        for seed in 0..3 {
            let noise = NoiseSource::new(seed).normal(0, size * size);
            let mut levels: Vec<f32> = noise.iter().map(|n| 100.0 + 12.0 * n).collect();
            let dark = |levels: &mut [f32]| {
                for k in 0..180 {
                    for c in -3i32..=3 {
                        levels[(200 + c) as usize * size + 120 + k] -= 12.0;
                    }
                }
                for (r, c) in (196..204).flat_map(|r| (108..116).map(move |c| (r, c))) {
                    levels[r * size + c] = 255.0;
                }
            };
            alarms += find(&GreyImage::from_levels(size, size, &levels)).len();
            dark(&mut levels);
            let found = find(&GreyImage::from_levels(size, size, &levels));
            let first = found.first().expect("the line").wake;
            // A sum along a line gives its position, but not its direction.
            let [right, down] = first.direction();
            let off = (first.axis_deg - 90.0 + 90.0).rem_euclid(180.0) - 90.0;
            let middle = first.tip[1] + (210.0 - first.tip[0]) * down / right;
            assert!(
                off.abs() <= 6.0 && (middle - 200.0).abs() < 16.0,
                "{first:?}"
            );
        }
        // ¼ expected in each of three images.
        assert!(alarms <= 4, "{alarms}");
    }
}
