//! Annotation of a part of a product: all numbers that depend on lines and pixels are adapted to the part.

use std::ops::Range;

use super::annotation::Annotation;
use super::lut::interpolate;
use super::tree::Tree;
use crate::place::Place;
use crate::time::UtcTime;

/// Lines and pixels of the geolocation grid of a part, as in original products.
const GRID: [usize; 2] = [10, 21];

/// Part of a product.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) lines: Range<usize>,
    pub(crate) pixels: Range<usize>,
}

impl Part {
    /// Adapts an annotation file.
    pub(crate) fn cut_annotation(&self, tree: &mut Tree, annotation: &Annotation) {
        let [first, last] = self.times(annotation);
        self.cut_header(tree, annotation);
        if let Some(image) = tree.find_mut("imageAnnotation/imageInformation") {
            image.set("productFirstLineUtcTime", first);
            image.set("productLastLineUtcTime", last);
            image.set("numberOfLines", self.lines.len());
            image.set("numberOfSamples", self.pixels.len());
            let corner = annotation
                .grid
                .place(self.lines.start as f64, self.pixels.start as f64);
            let middle = annotation
                .grid
                .place(middle(&self.lines), middle(&self.pixels));
            if let Some(time) = corner.slant_range_time {
                image.set("slantRangeTime", format!("{time:.15e}"));
            }
            if let Some(angle) = middle.incidence {
                image.set("incidenceAngleMidSwath", format!("{angle:.15e}"));
            }
        }
        let grid = tree.find("geolocationGrid/geolocationGridPointList");
        let ratio = grid.map_or(1.0, elevation_ratio);
        tree.set_children(
            "geolocationGrid/geolocationGridPointList",
            self.grid(annotation, ratio),
        );
        self.cut_conversions(tree, annotation);
        self.cut_swaths(tree);
    }

    /// Adapts a calibration file.
    pub(crate) fn cut_calibration(&self, tree: &mut Tree, annotation: &Annotation) {
        self.cut_header(tree, annotation);
        let tables = ["sigmaNought", "betaNought", "gamma", "dn"];
        self.cut_vectors(tree, "calibrationVectorList", &tables, annotation);
    }

    /// Adapts a noise file of either form.
    pub(crate) fn cut_noise(&self, tree: &mut Tree, annotation: &Annotation) {
        self.cut_header(tree, annotation);
        self.cut_vectors(tree, "noiseVectorList", &["noiseLut"], annotation);
        self.cut_vectors(tree, "noiseRangeVectorList", &["noiseRangeLut"], annotation);
        if let Some(list) = tree.find("noiseAzimuthVectorList") {
            let blocks = list.children.clone().into_iter();
            let blocks = blocks.filter_map(|block| self.cut_block(block)).collect();
            tree.set_children("noiseAzimuthVectorList", blocks);
        }
    }

    /// Times of the first and last line.
    pub(crate) fn times(&self, annotation: &Annotation) -> [UtcTime; 2] {
        [self.lines.start, self.lines.end - 1].map(|line| annotation.line_time(line as f64))
    }

    /// Places of the four corners, in order around the part.
    pub(crate) fn corners(&self, annotation: &Annotation) -> [Place; 4] {
        let [top, bottom] = [self.lines.start, self.lines.end - 1].map(|line| line as f64);
        let [left, right] = [self.pixels.start, self.pixels.end - 1].map(|pixel| pixel as f64);
        [(top, right), (top, left), (bottom, left), (bottom, right)]
            .map(|(line, pixel)| annotation.grid.place(line, pixel))
    }

    fn cut_header(&self, tree: &mut Tree, annotation: &Annotation) {
        let [first, last] = self.times(annotation);
        tree.set("adsHeader/startTime", first);
        tree.set("adsHeader/stopTime", last);
    }

    fn grid(&self, annotation: &Annotation, ratio: f64) -> Vec<Tree> {
        let along = |range: &Range<usize>, count: usize| -> Vec<usize> {
            let last = range.len() - 1;
            (0..count)
                .map(|n| (n * last + (count - 1) / 2) / (count - 1))
                .collect()
        };
        let (lines, pixels) = (along(&self.lines, GRID[0]), along(&self.pixels, GRID[1]));
        let places = lines
            .iter()
            .flat_map(|line| pixels.iter().map(move |pixel| (*line, *pixel)));
        let point = |(line, pixel): (usize, usize)| {
            let [l, p] = [self.lines.start + line, self.pixels.start + pixel];
            let place = annotation.grid.place(l as f64, p as f64);
            let incidence = place.incidence.unwrap_or(annotation.incidence_mid_swath);
            let elevation = (ratio * incidence.to_radians().sin()).asin().to_degrees();
            let slant = place
                .slant_range_time
                .unwrap_or(annotation.slant_range_time);
            let number = |name: &str, value: f64| Tree::new(name, format!("{value:.15e}"));
            let mut tree = Tree::new("geolocationGridPoint", "");
            tree.children = vec![
                Tree::new("azimuthTime", annotation.line_time(l as f64)),
                number("slantRangeTime", slant),
                Tree::new("line", line),
                Tree::new("pixel", pixel),
                number("latitude", place.latitude),
                number("longitude", place.longitude),
                number("height", place.height.unwrap_or(0.0)),
                number("incidenceAngle", incidence),
                number("elevationAngle", elevation),
            ];
            tree
        };
        places.map(point).collect()
    }

    /// Adapts the polynomials between slant and ground range: ground range is counted from the first pixel.
    fn cut_conversions(&self, tree: &mut Tree, annotation: &Annotation) {
        let list = "coordinateConversion/coordinateConversionList";
        let shift = self.pixels.start as f64 * annotation.range_spacing;
        let start = annotation
            .grid
            .place(self.lines.start as f64, self.pixels.start as f64);
        for conversion in tree
            .find_mut(list)
            .map_or(&mut [][..], |l| &mut l.children[..])
        {
            if let Some(origin) = conversion.number("gr0") {
                conversion.set("gr0", format!("{:.15e}", origin - shift));
            }
            if let Some(mut powers) = conversion.numbers("srgrCoefficients")
                && let Some(constant) = powers.first_mut()
            {
                *constant -= shift;
                let words = powers.iter().map(|value| format!("{value:.15e}"));
                conversion.set_numbers("srgrCoefficients", words);
            }
            if let Some(time) = start.slant_range_time {
                conversion.set("slantRangeTime", format!("{time:.15e}"));
            }
        }
    }

    fn cut_swaths(&self, tree: &mut Tree) {
        let Some(list) = tree.find("swathMerging/swathMergeList") else {
            return;
        };
        let merges = list.children.clone().into_iter().filter_map(|mut merge| {
            let bounds = merge.find("swathBoundsList")?.children.clone();
            let bounds = bounds
                .into_iter()
                .filter_map(|block| self.cut_bounds(block));
            let bounds: Vec<Tree> = bounds.collect();
            let any = !bounds.is_empty();
            merge.set_children("swathBoundsList", bounds);
            any.then_some(merge)
        });
        let merges = merges.collect();
        tree.set_children("swathMerging/swathMergeList", merges);
    }

    /// Cuts a block with first and last line and pixel to the part; `None` if it lies outside.
    fn cut_bounds(&self, mut block: Tree) -> Option<Tree> {
        for (range, [first, last]) in [
            (&self.lines, ["firstAzimuthLine", "lastAzimuthLine"]),
            (&self.pixels, ["firstRangeSample", "lastRangeSample"]),
        ] {
            let [from, to] = [block.number(first)?, block.number(last)?];
            let [start, end] = [range.start as f64, (range.end - 1) as f64];
            if to < start || from > end {
                return None;
            }
            block.set(first, from.max(start) - start);
            block.set(last, to.min(end) - start);
        }
        Some(block)
    }

    /// Cuts an azimuth profile of the noise.
    fn cut_block(&self, block: Tree) -> Option<Tree> {
        let mut block = self.cut_bounds(block)?;
        let (lines, factors) = (block.numbers("line")?, block.numbers("noiseAzimuthLut")?);
        if lines.is_empty() || lines.len() != factors.len() {
            return None;
        }
        let at = clipped(&lines, &self.lines);
        let shift = self.lines.start as f64;
        block.set_numbers("line", at.iter().map(|line| (line - shift).to_string()));
        let values = at.iter().map(|&line| interpolate(&lines, &factors, line));
        block.set_numbers("noiseAzimuthLut", values.map(|v| format!("{v:.6e}")));
        Some(block)
    }

    /// Cuts vectors along range at a few lines, so that the bilinear table has the same values in the part.
    fn cut_vectors(&self, tree: &mut Tree, list: &str, tables: &[&str], annotation: &Annotation) {
        let Some(vectors) = tree.find(list) else {
            return;
        };
        let vectors = vectors.children.clone();
        let lines: Option<Vec<f64>> = vectors.iter().map(|v| v.number("line")).collect();
        let Some(lines) = lines.filter(|lines| !lines.is_empty()) else {
            return;
        };
        let vector = |line: f64| -> Option<Tree> {
            let after = lines.partition_point(|&at| at <= line).min(lines.len() - 1);
            let before = after.saturating_sub(usize::from(lines[after] > line));
            let [a, b] = [&vectors[before], &vectors[after]];
            let t = match before == after {
                true => 0.0,
                false => (line - lines[before]) / (lines[after] - lines[before]),
            };
            let [pa, pb] = [a.numbers("pixel")?, b.numbers("pixel")?];
            let mut pixels = [pa.clone(), pb.clone()].concat();
            pixels.sort_by(f64::total_cmp);
            pixels.dedup();
            let at = clipped(&pixels, &self.pixels);
            let mut cut = a.clone();
            cut.set("azimuthTime", annotation.line_time(line));
            cut.set("line", line - self.lines.start as f64);
            let shift = self.pixels.start as f64;
            cut.set_numbers("pixel", at.iter().map(|pixel| (pixel - shift).to_string()));
            for table in tables {
                let [va, vb] = [a.numbers(table), b.numbers(table)];
                let (Some(va), Some(vb)) = (va, vb) else {
                    continue;
                };
                let value = |&pixel: &f64| {
                    let [x, y] = [interpolate(&pa, &va, pixel), interpolate(&pb, &vb, pixel)];
                    format!("{:.9e}", x * (1.0 - t) + y * t)
                };
                cut.set_numbers(table, at.iter().map(value));
            }
            Some(cut)
        };
        let at = clipped(&lines, &self.lines);
        let cut: Option<Vec<Tree>> = at.into_iter().map(vector).collect();
        if let Some(cut) = cut {
            tree.set_children(list, cut);
        }
    }
}

/// Sine of the elevation angle over sine of the incidence angle, which is the Earth's radius over the orbit's.
fn elevation_ratio(grid: &Tree) -> f64 {
    let ratio = |point: &Tree| {
        let sine = |name| Some(point.number(name)?.to_radians().sin());
        Some(sine("elevationAngle")? / sine("incidenceAngle")?)
    };
    let ratio = grid.children.first().and_then(ratio);
    ratio.filter(|r| (0.5..1.0).contains(r)).unwrap_or(0.9)
}

fn middle(range: &Range<usize>) -> f64 {
    0.5 * (range.start + range.end - 1) as f64
}

/// Positions of a table inside a range, and both ends of the range.
fn clipped(places: &[f64], range: &Range<usize>) -> Vec<f64> {
    let [first, last] = [range.start as f64, (range.end - 1) as f64];
    let inside = places.iter().copied().filter(|&at| at > first && at < last);
    std::iter::once(first)
        .chain(inside)
        .chain(std::iter::once(last))
        .collect()
}
