//! The search of an image: tiles, scales, network, wakes.

use crate::maps::{Maps, same, without_repeats};
use crate::missing::filled;
use crate::network::{MULTIPLE, STRIDE};
use crate::normalize;
use crate::raster::Raster;
use crate::scaling::rescaled;
use crate::wake::{Detection, Wake};

/// Something that gives maps of normalised images.
pub(crate) trait Mapper: Sync {
    /// The maps of an image that is normalised; rows and columns are multiples of [`MULTIPLE`].
    ///
    /// # Shapes
    ///
    /// `inputs`: `[INPUTS, rows, columns]`
    fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps;
}

/// Pixels of the image between which tips are taken from one tile, and what a tile sees beyond them.
const TILE: usize = 1024;
const MARGIN: usize = 384;
/// Scales at which an image is searched, when its own fits the network.
const SCALES: [f32; 5] = [0.35, 0.5, 0.7, 1.0, 1.4];
/// Tips closer than this are one, at scale 1 \[pixels\].
const NEAR: f32 = 40.0;
/// No more pixels a side are given to the network at once.
const LARGEST: f32 = 2560.0;

/// How an image is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Search {
    /// Pixel spacing \[m\], where it is known.
    pub(crate) spacing: Option<f32>,
    /// Scores below this are not told.
    pub(crate) least_score: f32,
}

/// The wakes of an image, the surest first; tips in pixels (column, row) from the centre of the first one.
pub(crate) fn find<R: Raster>(
    image: &R,
    mapper: &dyn Mapper,
    search: Search,
) -> Result<Vec<Detection>, R::Error> {
    let mut found = Vec::new();
    for tile in Tile::all(image.rows(), image.columns()) {
        found.extend(in_tile(image, &tile, mapper, search)?);
    }
    Ok(merged(found))
}

/// What the tiles of an image hold, each wake once, the surest first.
pub(crate) fn merged(found: Vec<Detection>) -> Vec<Detection> {
    without_repeats(found, NEAR)
}

/// The wakes of all scales, each told once, its score raised where other scales see it, too.
///
/// ```text
/// score = (max_i s_i + mean_i s_i)/2
/// ```
///
/// with `s_i` the score at scale i, 0 where nothing is found there.
fn agreed(by_scale: Vec<Vec<Detection>>) -> Vec<Detection> {
    let count = by_scale.len().max(1) as f32;
    let kept = without_repeats(by_scale.iter().flatten().copied().collect(), NEAR);
    let raised = |one: Detection| {
        let at = |scale: &Vec<Detection>| {
            let same = scale
                .iter()
                .filter(|other| same(&one.wake, &other.wake, NEAR));
            same.map(|other| other.score).fold(0.0, f32::max)
        };
        let mean = by_scale.iter().map(at).sum::<f32>() / count;
        Detection {
            score: 0.5 * (one.score + mean),
            ..one
        }
    };
    kept.into_iter().map(raised).collect()
}

/// A part of an image whose tips are told together, and its surroundings, that are seen with it.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// First row and column of the part, and the ones behind its last.
    part: [[usize; 2]; 2],
    /// The same of what is seen.
    seen: [[usize; 2]; 2],
    /// Rows and columns of the image.
    sides: [usize; 2],
}

impl Tile {
    /// The tiles of an image; a small one is one tile.
    #[must_use]
    pub fn all(rows: usize, columns: usize) -> Vec<Self> {
        let sides = [rows, columns];
        let columns = tiles(columns);
        let places = tiles(rows)
            .into_iter()
            .flat_map(|r| columns.iter().map(move |&c| [r, c]));
        let tile = |[(top, rows), (left, columns)]: [(usize, usize); 2]| {
            let part = [[top, left], [top + rows, left + columns]];
            Self {
                part,
                seen: [
                    part[0].map(|x| x.saturating_sub(MARGIN)),
                    [0, 1].map(|a| (part[1][a] + MARGIN).min(sides[a])),
                ],
                sides,
            }
        };
        places.map(tile).collect()
    }

    /// Rows, columns and pixels of what is seen.
    pub(crate) fn pixels<R: Raster>(
        &self,
        image: &R,
    ) -> Result<(usize, usize, Vec<f32>), R::Error> {
        let [begin, end] = self.seen;
        let [rows, columns] = [0, 1].map(|a| end[a] - begin[a]);
        let pixels = image.window(begin[0], begin[1], rows, columns)?;
        Ok((rows, columns, pixels))
    }

    /// A wake found in the scaled pixels as it lies in the image; `None` where its tip lies in another tile.
    pub(crate) fn placed(&self, wake: Wake, factor: f32) -> Option<Wake> {
        let mut wake = unscaled(wake, factor);
        wake.tip = [0, 1].map(|a| wake.tip[a] + self.seen[0][1 - a] as f32);
        let inside = |a: usize| {
            let [begin, end] = [self.part[0][a], self.part[1][a]];
            let low = if begin == 0 { f32::MIN } else { begin as f32 };
            let high = if end == self.sides[a] {
                f32::MAX
            } else {
                end as f32
            };
            (low..high).contains(&(wake.tip[1 - a] + 0.5))
        };
        (inside(0) && inside(1)).then_some(wake)
    }
}

/// A wake found in scaled pixels, in those of the window.
fn unscaled(mut wake: Wake, factor: f32) -> Wake {
    wake.tip = wake.tip.map(|x| (x + 0.5) / factor - 0.5);
    wake.length /= factor;
    wake
}

/// First pixels of the tiles and their sizes: few enough pixels are one tile.
fn tiles(size: usize) -> Vec<(usize, usize)> {
    if size <= TILE + 2 * MARGIN {
        return vec![(0, size)];
    }
    let count = size.div_ceil(TILE);
    let edge = |k: usize| k * size / count;
    (0..count)
        .map(|k| (edge(k), edge(k + 1) - edge(k)))
        .collect()
}

/// The wakes of a tile.
pub(crate) fn in_tile<R: Raster>(
    image: &R,
    tile: &Tile,
    mapper: &dyn Mapper,
    search: Search,
) -> Result<Vec<Detection>, R::Error> {
    let (rows, columns, mut pixels) = tile.pixels(image)?;
    let Some(missing) = filled(&mut pixels, columns) else {
        return Ok(Vec::new());
    };
    let at = |factor: f32| -> Vec<Detection> {
        let maps = at_scale(&pixels, rows, columns, factor, mapper);
        let sure = maps
            .detections()
            .into_iter()
            .filter(|one| one.score >= search.least_score);
        sure.filter(|one| missing.leaves(&unscaled(one.wake, factor)))
            .filter_map(|one| {
                Some(Detection {
                    wake: tile.placed(one.wake, factor)?,
                    ..one
                })
            })
            .collect()
    };
    let scales = scales(&pixels, rows, columns, search.spacing);
    Ok(agreed(scales.into_iter().map(at).collect()))
}

/// The factors by which an image is scaled before the network sees it.
fn scales(pixels: &[f32], rows: usize, columns: usize, spacing: Option<f32>) -> Vec<f32> {
    let native = match spacing {
        // The images that the network learned from have pixels of about ten metres.
        Some(metres) => (metres / 10.0).clamp(0.25, 1.0),
        None => native_scale(pixels, rows, columns),
    };
    let longest = rows.max(columns) as f32;
    let fits = |factor: &f32| longest * factor <= LARGEST;
    SCALES
        .iter()
        .map(|scale| native * scale)
        .filter(fits)
        .collect()
}

/// The scale at which the speckle is correlated as in most of what the network learned from, ½ to 1.
///
/// ```text
/// ρ₁ = exp(−1/4s²),    scale = s₀/s
/// ```
///
/// with ρ₁ the correlation of neighbouring pixels, s the width of the response and s₀ = 0.7 pixels.
fn native_scale(pixels: &[f32], rows: usize, columns: usize) -> f32 {
    let contrast = normalize::contrast(pixels, rows, columns);
    let cut: Vec<f32> = contrast.iter().map(|z| z.clamp(-2.5, 2.5)).collect();
    let (mut power, mut product, mut count) = (0.0f64, 0.0f64, 0u32);
    for row in (0..rows.saturating_sub(1)).step_by(2) {
        for i in row * columns..(row * columns + columns).saturating_sub(1) {
            let (z, beside, below) = (cut[i], cut[i + 1], cut[i + columns]);
            power += f64::from(z * z);
            product += f64::from(z * 0.5 * (beside + below));
            count += 1;
        }
    }
    if count == 0 || power <= 0.0 {
        return 1.0;
    }
    let correlation = (product / power).clamp(0.01, 0.99);
    let width = 0.5 / (-correlation.ln()).sqrt();
    (0.7 / width).clamp(0.5, 1.0) as f32
}

fn at_scale(pixels: &[f32], rows: usize, columns: usize, factor: f32, mapper: &dyn Mapper) -> Maps {
    let (rows, columns, scaled) = rescaled(pixels, rows, columns, factor);
    let contrast = normalize::contrast(&scaled, rows, columns);
    let [padded_rows, padded_columns] = [rows, columns].map(|n| n.next_multiple_of(MULTIPLE));
    let area = padded_rows * padded_columns;
    let nothing = normalize::inputs(0.0);
    let mut inputs: Vec<f32> = nothing
        .iter()
        .flat_map(|&x| std::iter::repeat_n(x, area))
        .collect();
    for (row, line) in contrast.chunks_exact(columns).enumerate() {
        for (column, &z) in line.iter().enumerate() {
            for (k, x) in normalize::inputs(z).into_iter().enumerate() {
                inputs[k * area + row * padded_columns + column] = x;
            }
        }
    }
    let maps = mapper.maps(inputs, padded_rows, padded_columns);
    maps.cut_to(rows.div_ceil(STRIDE), columns.div_ceil(STRIDE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::GreyImage;
    use crate::network::{INPUTS, Map, OUTPUTS};
    use wake_nn::noise::NoiseSource;

    /// Tips where a pixel is bright, each with a line toward the right.
    struct Bright;

    impl Mapper for Bright {
        fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps {
            assert!(rows.is_multiple_of(MULTIPLE) && columns.is_multiple_of(MULTIPLE));
            assert_eq!(inputs.len(), INPUTS * rows * columns);
            assert!(inputs.iter().all(|x| x.is_finite()), "no missing numbers");
            let (r, c) = (rows / STRIDE, columns / STRIDE);
            let mut values = vec![0.0; OUTPUTS * r * c];
            values[..2 * r * c].fill(-12.0);
            for (i, _) in inputs[..rows * columns]
                .iter()
                .enumerate()
                .filter(|(_, x)| **x > 2.5)
            {
                let (row, column) = (i / columns / STRIDE, i % columns / STRIDE);
                let mut put = |map: Map, column: usize, value: f32| {
                    values[(map as usize * r + row) * c + column.min(c - 1)] = value;
                };
                put(Map::Tip, column, 8.0);
                put(Map::TipRight, column, 1.0);
                for k in 1..20 {
                    put(Map::Line, column + k, 8.0);
                    put(Map::LineRight, column + k, 1.0);
                }
            }
            Maps::new(r, c, values)
        }
    }

    const SEARCH: Search = Search {
        spacing: None,
        least_score: 0.1,
    };

    /// Normal noise through a Gaussian filter of this standard deviation \[pixels\], `[size, size]`.
    fn filtered_noise(size: usize, deviation: f32) -> Vec<f32> {
        if deviation <= 0.0 {
            return NoiseSource::new(4).normal(0, size * size);
        }
        let reach = (3.0 * deviation).ceil() as usize;
        let wide = size + 2 * reach;
        let white = NoiseSource::new(4).normal(0, wide * wide);
        let weight = |k: usize| (-0.5 * ((k as f32 - reach as f32) / deviation).powi(2)).exp();
        let blur = |at: &dyn Fn(usize) -> f32| (0..=2 * reach).map(|k| weight(k) * at(k)).sum();
        let rows: Vec<f32> = (0..wide * size)
            .map(|i| blur(&|k| white[i / size * wide + i % size + k]))
            .collect();
        (0..size * size)
            .map(|i| blur(&|k| rows[(i / size + k) * size + i % size]))
            .collect()
    }

    /// Speckle of a Gaussian response of 1.2 pixels is native at 0.7/1.2, white noise at 1.
    #[test]
    fn the_native_scale_follows_from_the_correlation() {
        let size = 300;
        for (filter, expected) in [(0.0, 1.0), (1.2, 0.7 / 1.2)] {
            let pixels = filtered_noise(size, filter);
            // Local medians take out a few hundredths of the correlation.
            let found = native_scale(&pixels, size, size);
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
    }

    /// Spots on noise, also beside the seams of tiles, are found once each, where they are.
    #[test]
    fn tiles_lose_nothing_and_tell_nothing_twice() {
        let (rows, columns) = (2100, 1900);
        let noise = |i: usize| ((i * 2_654_435_761) % 1009) as f32 / 1009.0;
        let mut levels: Vec<f32> = (0..rows * columns)
            .map(|i| 100.0 + 20.0 * noise(i))
            .collect();
        let spots = [
            [300, 200],
            [1040, 1061],
            [955, 60],
            [945, 700],
            [30, 2080],
            [1500, 1397],
            [1500, 1403 + 300],
        ];
        for [x, y] in spots {
            for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
                levels[(y - 6 + r) * columns + x - 6 + c] = 255.0;
            }
        }
        assert!(tiles(columns).len() > 1 && tiles(rows).len() > 1);
        let Ok(found) = find(
            &GreyImage::from_levels(rows, columns, &levels),
            &Bright,
            SEARCH,
        );
        assert_eq!(found.len(), spots.len(), "{found:?}");
        for [x, y] in spots {
            let near =
                |d: &&Detection| (d.wake.tip[0] - x as f32).hypot(d.wake.tip[1] - y as f32) < 14.0;
            assert_eq!(found.iter().filter(near).count(), 1, "{x} {y}");
        }
    }

    #[test]
    fn tiles_cover_every_size_once() {
        for size in [1, 17, 1792, 1793, 4096, 20_000] {
            let tiles = tiles(size);
            assert_eq!(tiles.iter().map(|t| t.1).sum::<usize>(), size);
            assert!(tiles.windows(2).all(|t| t[0].0 + t[0].1 == t[1].0));
            assert!(tiles.len() == 1 || tiles.iter().all(|t| t.1 <= TILE));
        }
    }

    /// Whatever the size, the content and the scaling, nothing is told twice and no number is missing.
    #[test]
    fn hard_images_are_searched() {
        let noise = |i: usize| ((i * 2_654_435_761) % 1009) as f32 / 4.0;
        for (rows, columns) in [(1, 1), (17, 4000), (5, 3), (64, 64)] {
            let flat = GreyImage::from_levels(rows, columns, &vec![120.0; rows * columns]);
            let Ok(found) = find(&flat, &Bright, SEARCH);
            assert!(found.is_empty());
            let levels: Vec<f32> = (0..rows * columns).map(noise).collect();
            let Ok(_) = find(
                &GreyImage::from_levels(rows, columns, &levels),
                &Bright,
                SEARCH,
            );
        }
    }
}
