//! Search of an image: tiles, scales, network, wakes.

use crate::extent::Surroundings;
use crate::maps::{Maps, same, without_repeats};
use crate::missing::filled;
use crate::network::{MULTIPLE, STRIDE};
use crate::normalize;
use crate::raster::Raster;
use crate::scaling::rescaled;
use crate::wake::{Detection, Wake, turn};

/// Computes maps of normalised images.
pub(crate) trait Mapper: Sync {
    /// Computes the maps of a normalised image; rows and columns are multiples of [`MULTIPLE`].
    ///
    /// # Shapes
    ///
    /// `inputs`: `[INPUTS, rows, columns]`
    fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps;
}

/// Sides of small and large tiles, and width of the surroundings searched with a tile \[pixels\].
const TILE: usize = 1024;
const LARGE_TILE: usize = 2048;
const MARGIN: usize = 384;
/// Scales at which an image is searched, relative to its native scale.
const SCALES: [f32; 5] = [0.35, 0.5, 0.7, 1.0, 1.4];
/// Scales for known pixel spacing, in order. The whole image is searched at the first; each further scale is searched around
/// wakes whose combined score at the earlier scales is at least [`CANDIDATE`].
const KNOWN_SCALES: [f32; 3] = [0.7, 1.0, 1.4];
const CANDIDATE: f32 = 0.02;
/// Margin around a wake and length along it that are searched at further scales, and the longest side of a joint window
/// \[pixels at the native scale\].
const AROUND: f32 = 128.0;
const ALONG: f32 = 400.0;
const TOGETHER: f32 = 1024.0;
/// Tips closer than this are the same \[pixels of the image\].
const NEAR: f32 = 40.0;
/// Standard deviation of the axes at different scales that agree \[deg\].
const AGREEING: f32 = 10.0;
/// Longest side of a network input without known spacing \[pixels\].
const LARGEST: f32 = 2560.0;

/// Options of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Search {
    /// Pixel spacing \[m\], if known.
    pub(crate) spacing: Option<f32>,
    /// Detections with lower scores are not reported.
    pub(crate) least_score: f32,
}

/// Score below which detections are not reported by default.
///
/// At a single scale, no higher threshold is used: combined scores would depend on it.
pub const LEAST_SCORE: f32 = 0.03;

/// The wakes of an image in descending order of score; tips in pixels (column, row) from the centre of the first pixel.
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

/// The wakes of all tiles without duplicates, in descending order of score.
pub(crate) fn merged(found: Vec<Detection>) -> Vec<Detection> {
    without_repeats(found, NEAR)
}

/// Combines the wakes of all scales without duplicates, with higher scores for wakes found at several scales.
///
/// ```text
/// score = (max_i s_i + mean_i s_i·exp(−δ_i²/2·10²))/2
/// ```
///
/// with `s_i` the score at scale i, 0 if the wake is not found there, and `δ_i` the turn of its axis from the axis at the scale
/// with the highest score \[deg\].
fn agreed(by_scale: &[Vec<Detection>]) -> Vec<Detection> {
    let count = by_scale.len().max(1) as f32;
    let kept = without_repeats(by_scale.iter().flatten().copied().collect(), NEAR);
    let raised = |one: Detection| {
        let at = |scale: &Vec<Detection>| {
            let same = scale
                .iter()
                .filter(|other| same(&one.wake, &other.wake, NEAR));
            same.max_by(|a, b| a.score.total_cmp(&b.score)).copied()
        };
        let seen = by_scale.iter().filter_map(at);
        let agreeing: Vec<(f32, Option<f32>)> = seen
            .map(|other| {
                let off = turn(one.wake.axis_deg, other.wake.axis_deg) / AGREEING;
                (other.score * (-0.5 * off * off).exp(), other.forward)
            })
            .collect();
        let sum: f32 = agreeing.iter().map(|(score, _)| score).sum();
        let forward = agreeing.iter().map(|(score, f)| Some(score * (*f)?));
        let forward = forward.sum::<Option<f32>>();
        Detection {
            score: 0.5 * (one.score + sum / count),
            forward: forward.filter(|_| sum > 0.0).map(|total| total / sum),
            ..one
        }
    };
    kept.into_iter().map(raised).collect()
}

/// A part of an image that is searched at once with its surroundings; wakes with tips in the part belong to the tile.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// First row and column of the part, and the row and column after its last.
    part: [[usize; 2]; 2],
    /// The same for the part with its surroundings.
    seen: [[usize; 2]; 2],
    /// Rows and columns of the image.
    sides: [usize; 2],
}

impl Tile {
    /// Splits an image into tiles; a small image is one tile.
    #[must_use]
    pub fn all(rows: usize, columns: usize) -> Vec<Self> {
        Self::of(rows, columns, TILE)
    }

    /// Splits an image into larger tiles, which overlap less: for known pixel spacing, where most is searched at a coarse scale.
    #[must_use]
    pub fn large(rows: usize, columns: usize) -> Vec<Self> {
        Self::of(rows, columns, LARGE_TILE)
    }

    fn of(rows: usize, columns: usize, tile: usize) -> Vec<Self> {
        let sides = [rows, columns];
        let columns = tiles(columns, tile);
        let places = tiles(rows, tile)
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

    /// Rows, columns and pixels of the part with its surroundings.
    pub(crate) fn pixels<R: Raster>(
        &self,
        image: &R,
    ) -> Result<(usize, usize, Vec<f32>), R::Error> {
        let [begin, end] = self.seen;
        let [rows, columns] = [0, 1].map(|a| end[a] - begin[a]);
        let pixels = image.window(begin[0], begin[1], rows, columns)?;
        Ok((rows, columns, pixels))
    }

    /// Converts a wake to pixels of the image; `None` if its tip lies in another tile.
    pub(crate) fn placed(&self, mut wake: Wake) -> Option<Wake> {
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

/// Converts a wake from scaled pixels to pixels of the window.
pub(crate) fn unscaled(mut wake: Wake, factor: f32) -> Wake {
    wake.tip = wake.tip.map(|x| (x + 0.5) / factor - 0.5);
    wake.length /= factor;
    wake
}

/// First pixels and sizes of the tiles along one axis; a short axis is one tile.
fn tiles(size: usize, tile: usize) -> Vec<(usize, usize)> {
    if size <= tile + 2 * MARGIN {
        return vec![(0, size)];
    }
    let count = size.div_ceil(tile);
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
    let view = View {
        pixels: &pixels,
        rows,
        columns,
    };
    let by_scale = match search.spacing {
        Some(metres) => view.around_candidates(native_of_spacing(metres), mapper),
        None => view.at_all_scales(mapper),
    };
    let least = search.least_score.min(LEAST_SCORE);
    let placed = |one: Detection| -> Option<Detection> {
        let counts = one.score >= least && missing.leaves(&one.wake);
        let wake = counts.then(|| tile.placed(one.wake)).flatten()?;
        Some(Detection { wake, ..one })
    };
    let by_scale: Vec<Vec<Detection>> = by_scale
        .into_iter()
        .map(|found| found.into_iter().filter_map(placed).collect())
        .collect();
    let mut found = agreed(&by_scale);
    found.retain(|one| one.score >= search.least_score);
    Ok(view.followed(found, tile, search))
}

/// Pixels to search.
#[derive(Debug, Clone, Copy)]
struct View<'a> {
    pixels: &'a [f32],
    rows: usize,
    columns: usize,
}

impl View<'_> {
    /// The wakes at each scale, for unknown pixel spacing.
    fn at_all_scales(&self, mapper: &dyn Mapper) -> Vec<Vec<Detection>> {
        let native = native_scale(self.pixels, self.rows, self.columns);
        let longest = self.rows.max(self.columns) as f32;
        let scales = SCALES.iter().map(|scale| native * scale);
        scales
            .filter(|factor| longest * factor <= LARGEST)
            .map(|factor| self.at(factor, mapper))
            .collect()
    }

    /// The wakes at each scale for known pixel spacing; after the first, only around the wakes of the scales before.
    fn around_candidates(&self, native: f32, mapper: &dyn Mapper) -> Vec<Vec<Detection>> {
        let mut by_scale = Vec::new();
        for scale in KNOWN_SCALES {
            let found = if by_scale.is_empty() {
                self.at(scale * native, mapper)
            } else {
                let mut candidates = agreed(&by_scale);
                candidates.retain(|one| one.score >= CANDIDATE);
                let windows = windows(&candidates, [self.rows, self.columns], native);
                let windows = windows.into_iter();
                let found =
                    windows.flat_map(|window| self.in_window(window, scale * native, mapper));
                found.collect()
            };
            by_scale.push(found);
        }
        by_scale
    }

    /// Measures the lengths of a tile's wakes in the image.
    fn followed(&self, mut found: Vec<Detection>, tile: &Tile, search: Search) -> Vec<Detection> {
        if found.is_empty() {
            return found;
        }
        let contrast = normalize::contrast(self.pixels, self.rows, self.columns);
        let native = search.spacing.map_or_else(
            || native_scale(self.pixels, self.rows, self.columns),
            native_of_spacing,
        );
        let surroundings = Surroundings {
            contrast: &contrast,
            rows: self.rows,
            columns: self.columns,
            unit: 1.0 / native,
        };
        for one in &mut found {
            let mut seen = one.wake;
            seen.tip = [0, 1].map(|a| seen.tip[a] - tile.seen[0][1 - a] as f32);
            one.extent = surroundings.extent(&seen);
        }
        found
    }

    /// The wakes of a window, in pixels of the whole view.
    fn in_window(
        &self,
        [from, to]: [[usize; 2]; 2],
        factor: f32,
        mapper: &dyn Mapper,
    ) -> Vec<Detection> {
        let [rows, columns] = [0, 1].map(|axis| to[axis] - from[axis]);
        let lines = self
            .pixels
            .chunks_exact(self.columns)
            .skip(from[0])
            .take(rows);
        let pixels: Vec<f32> = lines
            .flat_map(|line| &line[from[1]..to[1]])
            .copied()
            .collect();
        let part = View {
            pixels: &pixels,
            rows,
            columns,
        };
        let mut found = part.at(factor, mapper);
        for one in &mut found {
            one.wake.tip[0] += from[1] as f32;
            one.wake.tip[1] += from[0] as f32;
        }
        found
    }

    /// The wakes at a scale.
    fn at(&self, factor: f32, mapper: &dyn Mapper) -> Vec<Detection> {
        let maps = at_scale(self.pixels, self.rows, self.columns, factor, mapper);
        let mut found = maps.detections();
        for one in &mut found {
            one.wake = unscaled(one.wake, factor);
        }
        found
    }
}

/// Windows around wakes; overlapping windows are merged unless the result is too large.
///
/// - `native`: native scale of the image
///
/// # Shapes
///
/// For each window, its first row and column, and the row and column after its last.
fn windows(found: &[Detection], size: [usize; 2], native: f32) -> Vec<[[usize; 2]; 2]> {
    let around = (AROUND / native) as usize;
    let window = |one: &Detection| {
        let ends = [0.0, one.wake.length.min(ALONG / native)].map(|along| one.wake.at(along));
        let side = |axis: usize| {
            let [a, b] = ends.map(|end| end[1 - axis].clamp(0.0, size[axis] as f32 - 1.0));
            let from = (a.min(b) as usize).saturating_sub(around);
            let to = (a.max(b) as usize + around).min(size[axis]);
            [from, to]
        };
        let [rows, columns] = [side(0), side(1)];
        [[rows[0], columns[0]], [rows[1], columns[1]]]
    };
    let union = |a: &[[usize; 2]; 2], b: &[[usize; 2]; 2]| {
        let both = [0, 1].map(|axis| [a[0][axis].min(b[0][axis]), a[1][axis].max(b[1][axis])]);
        let longest = both.map(|[from, to]| to - from).into_iter().max();
        let fits = longest.is_some_and(|side| side as f32 <= TOGETHER / native);
        (fits && overlap(a, b)).then_some([[both[0][0], both[1][0]], [both[0][1], both[1][1]]])
    };
    let mut all: Vec<[[usize; 2]; 2]> = Vec::new();
    for mut one in found.iter().map(window) {
        // A union may overlap further windows.
        while let Some((at, both)) =
            (0..all.len()).find_map(|at| Some((at, union(&all[at], &one)?)))
        {
            all.swap_remove(at);
            one = both;
        }
        all.push(one);
    }
    all
}

fn overlap(a: &[[usize; 2]; 2], b: &[[usize; 2]; 2]) -> bool {
    (0..2).all(|axis| a[0][axis] < b[1][axis] && b[0][axis] < a[1][axis])
}

/// Scale at which the speckle is correlated as in most training images, ½ to 1.
///
/// ```text
/// ρ₁ = exp(−1/4s²),    scale = s₀/s
/// ```
///
/// with ρ₁ the correlation of neighbouring pixels, s the width of the impulse response and s₀ = 0.7 pixels.
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

/// Scale for a known pixel spacing \[m\]: the training images have pixels of about ten metres.
fn native_of_spacing(metres: f32) -> f32 {
    (metres / 10.0).clamp(0.25, 1.0)
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

    /// Maps with a tip at every bright pixel and a line from it to the right; the logit of the tip depends on the columns of the
    /// image.
    struct SpotFinder(fn(usize) -> f32);

    const BRIGHT: SpotFinder = SpotFinder(|_| 8.0);

    impl Mapper for SpotFinder {
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
                put(Map::Tip, column, self.0(columns));
                put(Map::TipRight, column, 1.0);
                for k in 1..20 {
                    put(Map::Line, column + k, 8.0);
                    put(Map::LineRight, column + k, 1.0);
                }
            }
            Maps::new(r, c, values)
        }
    }

    /// Twice the distances in an image of half the network's scale; nothing beyond the image.
    #[test]
    fn windows_surround_the_beginning_of_a_wake() {
        let along = |tip: [f32; 2]| {
            let wake = Wake {
                tip,
                axis_deg: 90.0,
                half_angle_deg: 4.0,
                length: 1000.0,
                snr: f32::INFINITY,
                contrast_db: None,
            };
            Detection::new(0.5, wake)
        };
        let found = [along([500.5, 300.5]), along([2990.5, 1990.5])];
        assert_eq!(
            windows(&found, [2000, 3000], 0.5),
            [[[44, 244], [556, 1556]], [[1734, 2734], [2000, 3000]]]
        );
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

    /// The native scale is 0.7/1.2 for speckle with a Gaussian response of 1.2 pixels, and 1 for white noise.
    #[test]
    fn the_native_scale_follows_from_the_correlation() {
        let size = 300;
        for (filter, expected) in [(0.0, 1.0), (1.2, 0.7 / 1.2)] {
            let pixels = filtered_noise(size, filter);
            // Subtracting local medians lowers the correlation by a few hundredths.
            let found = native_scale(&pixels, size, size);
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
    }

    /// A higher least score drops wakes and leaves the scores of the others: a wake with a score of 0.27 at one scale and nearly 1
    /// at the others keeps its mean over the scales.
    /// A wake at a further scale raises the score the less, the more its axis is turned.
    #[test]
    fn scales_that_agree_raise_the_score() {
        let at = |score: f32, axis_deg: f32| {
            let wake = Wake {
                tip: [50.0, 50.0],
                axis_deg,
                half_angle_deg: 10.0,
                length: 100.0,
                snr: f32::INFINITY,
                contrast_db: None,
            };
            vec![Detection::new(score, wake)]
        };
        let score = |axis_deg: f32| agreed(&[at(0.8, 355.0), at(0.4, axis_deg)])[0].score;
        assert!((score(355.0) - 0.7).abs() < 1e-6);
        // One standard deviation, across zero.
        assert!((score(5.0) - (0.6 + 0.1 * (-0.5f32).exp())).abs() < 1e-6);
        assert!((score(175.0) - 0.6).abs() < 1e-6);
    }

    #[test]
    fn the_least_score_holds_for_the_reported_scores() {
        let size = 400;
        let mut levels: Vec<f32> = (0..size * size)
            .map(|i| 100.0 + 20.0 * (((i * 2_654_435_761) % 1009) as f32 / 1009.0))
            .collect();
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            levels[(200 + r) * size + 150 + c] = 255.0;
        }
        let image = GreyImage::from_levels(size, size, &levels);
        let mapper = SpotFinder(|columns| if columns < 300 { -1.0 } else { 8.0 });
        let scores = |least_score: f32| -> Vec<f32> {
            let search = Search {
                least_score,
                ..SEARCH
            };
            let Ok(found) = find(&image, &mapper, search);
            found.iter().map(|one| one.score).collect()
        };
        let all = scores(0.03);
        let [best, ..] = all[..] else {
            panic!("nothing found");
        };
        assert!(best < 0.9, "{best}");
        for least in [0.1, 0.3, 0.5, best, best + 0.01] {
            let kept: Vec<f32> = all.iter().copied().filter(|&s| s >= least).collect();
            assert_eq!(scores(least), kept);
        }
    }

    /// Bright spots on noise, some near the seams of tiles, are each found once, at their position.
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
        assert!(tiles(columns, TILE).len() > 1 && tiles(rows, TILE).len() > 1);
        let Ok(found) = find(
            &GreyImage::from_levels(rows, columns, &levels),
            &BRIGHT,
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
            let tiles = tiles(size, TILE);
            assert_eq!(tiles.iter().map(|t| t.1).sum::<usize>(), size);
            assert!(tiles.windows(2).all(|t| t[0].0 + t[0].1 == t[1].0));
            assert!(tiles.len() == 1 || tiles.iter().all(|t| t.1 <= TILE));
        }
    }

    /// Tiny, narrow and flat images are searched without a panic or missing values; flat ones have no wakes.
    #[test]
    fn hard_images_are_searched() {
        let noise = |i: usize| ((i * 2_654_435_761) % 1009) as f32 / 4.0;
        for (rows, columns) in [(1, 1), (17, 4000), (5, 3), (64, 64)] {
            let flat = GreyImage::from_levels(rows, columns, &vec![120.0; rows * columns]);
            let Ok(found) = find(&flat, &BRIGHT, SEARCH);
            assert!(found.is_empty());
            let levels: Vec<f32> = (0..rows * columns).map(noise).collect();
            let Ok(_) = find(
                &GreyImage::from_levels(rows, columns, &levels),
                &BRIGHT,
                SEARCH,
            );
        }
    }

    /// Further scales search around the bright spot and line found at the first scale; open sea is searched at the first alone.
    #[test]
    fn other_scales_look_where_the_first_found_something() {
        struct Counted(std::sync::Mutex<Vec<[usize; 2]>>);
        impl Mapper for Counted {
            fn maps(&self, inputs: Vec<f32>, rows: usize, columns: usize) -> Maps {
                self.0.lock().expect("sizes").push([rows, columns]);
                BRIGHT.maps(inputs, rows, columns)
            }
        }
        let (rows, columns) = (900, 1100);
        let noise = |i: usize| ((i * 2_654_435_761) % 1009) as f32 / 1009.0;
        let sea: Vec<f32> = (0..rows * columns)
            .map(|i| 100.0 + 20.0 * noise(i))
            .collect();
        let mut levels = sea.clone();
        for (r, c) in (0..12).flat_map(|r| (0..12).map(move |c| (r, c))) {
            levels[(394 + r) * columns + 694 + c] = 255.0;
        }
        let known = Search {
            spacing: Some(10.0),
            ..SEARCH
        };
        let searched = |levels: &[f32]| {
            let mapper = Counted(std::sync::Mutex::default());
            let image = GreyImage::from_levels(rows, columns, levels);
            let Ok(found) = find(&image, &mapper, known);
            (found, mapper.0.into_inner().expect("sizes"))
        };
        let (found, sizes) = searched(&levels);
        // Reported once, with the highest score; this mapper also takes corners of windows for spots.
        let at_spot = |one: &Detection| {
            let [x, y] = one.wake.tip;
            (x - 700.0).hypot(y - 400.0) < 14.0
        };
        assert!(at_spot(&found[0]), "{found:?}");
        assert!(!found[1..].iter().any(at_spot), "{found:?}");
        // The whole image, then smaller windows, at least one at each further scale.
        assert!(sizes.len() >= KNOWN_SCALES.len(), "{sizes:?}");
        assert_eq!(
            sizes[0],
            [630, 770].map(|n: usize| n.next_multiple_of(MULTIPLE))
        );
        for [height, width] in &sizes[1..] {
            assert!(
                5 * height < 4 * rows && 5 * width < 4 * columns,
                "{sizes:?}"
            );
        }
        // Found at all scales, with the line to the right.
        assert!(found[0].score > 0.5 && found[0].forward.is_some_and(|f| f > 0.9));
        assert_eq!(searched(&sea).1.len(), 1);
    }

    #[test]
    fn windows_hold_all_tips_and_stay_small() {
        let draws = NoiseSource::new(3).normal(0, 400);
        let wakes: Vec<Detection> = draws
            .chunks_exact(4)
            .map(|x| {
                let wake = Wake {
                    tip: [600.0 + 900.0 * x[0], 500.0 + 900.0 * x[1]],
                    axis_deg: 180.0 * x[2],
                    half_angle_deg: 0.0,
                    length: 80.0 * x[3].abs(),
                    snr: f32::INFINITY,
                    contrast_db: None,
                };
                Detection::new(0.5, wake)
            })
            .collect();
        for some in [&wakes[..7], &wakes[..40], &wakes[..]] {
            let found = windows(some, [1000, 1200], 1.0);
            assert!(found.len() < some.len());
            for [from, to] in &found {
                assert!(from[0] < to[0] && to[0] <= 1000 && from[1] < to[1] && to[1] <= 1200);
                assert!(to[0] - from[0] <= 1024 && to[1] - from[1] <= 1024);
            }
            for wake in some.iter().map(|one| one.wake.tip) {
                let [x, y] =
                    [wake[0].clamp(0.0, 1199.0), wake[1].clamp(0.0, 999.0)].map(|x| x as usize);
                let holds = |w: &[[usize; 2]; 2]| {
                    (w[0][0]..w[1][0]).contains(&y) && (w[0][1]..w[1][1]).contains(&x)
                };
                assert!(found.iter().any(holds));
            }
        }
        assert!(windows(&[], [10, 10], 1.0).is_empty());
    }
}
