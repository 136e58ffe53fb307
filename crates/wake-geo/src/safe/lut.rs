//! Look-up tables given as vectors along range at a few lines: calibration and range noise.

use std::ops::Range;

use crate::error::Result;
use crate::limits::VECTORS;
use crate::xml::Node;

/// A vector: values at a few pixels of one line.
#[derive(Clone, Debug)]
pub(crate) struct Vector {
    pub(crate) line: f64,
    pub(crate) pixels: Vec<f64>,
    pub(crate) values: Vec<f64>,
}

impl Vector {
    /// Value at a pixel: linear between the pixels of the vector, constant beyond.
    fn at(&self, pixel: f64) -> f64 {
        interpolate(&self.pixels, &self.values, pixel)
    }

    /// Fills `out` with the values at consecutive pixels, in one sweep.
    fn fill(&self, pixels: Range<usize>, out: &mut [f32]) {
        let mut cell = self.pixels.partition_point(|&p| p <= pixels.start as f64);
        for (pixel, out) in pixels.zip(out) {
            let pixel = pixel as f64;
            while cell < self.pixels.len() && self.pixels[cell] <= pixel {
                cell += 1;
            }
            let value = match cell {
                0 => self.values[0],
                last if last == self.pixels.len() => self.values[last - 1],
                _ => between(
                    (self.pixels[cell - 1], self.values[cell - 1]),
                    (self.pixels[cell], self.values[cell]),
                    pixel,
                ),
            };
            *out = value as f32;
        }
    }
}

/// Linear interpolation in an increasing table, constant beyond its ends.
pub(crate) fn interpolate(xs: &[f64], values: &[f64], x: f64) -> f64 {
    match xs.partition_point(|&at| at <= x) {
        0 => values[0],
        last if last == xs.len() => values[last - 1],
        i => between((xs[i - 1], values[i - 1]), (xs[i], values[i]), x),
    }
}

fn between(a: (f64, f64), b: (f64, f64), x: f64) -> f64 {
    let t = (x - a.0) / (b.0 - a.0);
    a.1 * (1.0 - t) + b.1 * t
}

/// Table over the image: bilinear between vectors, constant beyond the first and last.
#[derive(Clone, Debug)]
pub(crate) struct Lut {
    vectors: Vec<Vector>,
}

/// Size of the image that a table covers, and the allowed range of its values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) lines: usize,
    pub(crate) pixels: usize,
    pub(crate) smallest: f64,
    pub(crate) largest: f64,
}

impl Lut {
    /// Reads the vectors `item` in the list `list`; each has its values in the element `values`.
    ///
    /// # Errors
    /// No vector, lines or pixels that do not increase or lie more than one image size away, lists of unequal length,
    /// values outside the range of `extent`, vectors that leave much of the image uncovered.
    pub(crate) fn read(list: Node<'_>, item: &str, values: &str, extent: Extent) -> Result<Self> {
        let mut vectors: Vec<Vector> = Vec::new();
        for node in list.children(item) {
            if vectors.len() == VECTORS {
                return Err(list.error(format!("it has more than {VECTORS} elements {item:?}")));
            }
            let vector = read_vector(node, values, extent)?;
            if vectors.last().is_some_and(|last| last.line >= vector.line) {
                return Err(node.error(format!(
                    "line {} of a {item} does not come after the previous line",
                    vector.line
                )));
            }
            vectors.push(vector);
        }
        let (Some(first), Some(last)) = (vectors.first(), vectors.last()) else {
            return Err(list.error(format!("{:?} has no {item:?}", list.name())));
        };
        // Vectors are about a second apart; a table that ends farther from the border was cut off.
        let steps = vectors.windows(2).map(|pair| pair[1].line - pair[0].line);
        let step = steps.fold(0.0, f64::max).max(1.0);
        let uncovered = first.line.max(extent.lines as f64 - 1.0 - last.line);
        if vectors.len() > 1 && uncovered > 2.0 * step {
            return Err(list.error(format!(
                "the {item}s reach from line {} to {}, but the image has {} lines",
                first.line, last.line, extent.lines
            )));
        }
        Ok(Self { vectors })
    }

    /// The vectors before and after a line, and the weight of the second.
    fn around(&self, line: f64) -> (usize, usize, f64) {
        let lines = &self.vectors;
        match lines.partition_point(|v| v.line <= line) {
            0 => (0, 0, 0.0),
            end if end == lines.len() => (end - 1, end - 1, 0.0),
            i => (
                i - 1,
                i,
                (line - lines[i - 1].line) / (lines[i].line - lines[i - 1].line),
            ),
        }
    }

    /// Value at a position in the image.
    pub(crate) fn at(&self, line: f64, pixel: f64) -> f64 {
        let (a, b, t) = self.around(line);
        self.vectors[a].at(pixel) * (1.0 - t) + self.vectors[b].at(pixel) * t
    }

    /// The table at consecutive pixels, for use line by line.
    pub(crate) fn rows(&self, pixels: Range<usize>) -> Rows<'_> {
        Rows {
            lut: self,
            first: (usize::MAX, vec![0.0; pixels.len()]),
            second: (usize::MAX, vec![0.0; pixels.len()]),
            pixels,
        }
    }
}

fn read_vector(node: Node<'_>, values: &str, extent: Extent) -> Result<Vector> {
    let (lines, samples) = (extent.lines as i64, extent.pixels as f64);
    let line = node.integer_in("line", -lines, 2 * lines)? as f64;
    let pixels = node.numbers("pixel")?;
    let table = node.numbers(values)?;
    if pixels.is_empty() || pixels.len() != table.len() {
        return Err(node.error(format!(
            "the vector of line {line} has {} pixels and {} values of {values}",
            pixels.len(),
            table.len()
        )));
    }
    if pixels.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(node.error(format!(
            "pixels of the vector of line {line} do not increase"
        )));
    }
    let outside = |&&pixel: &&f64| !(-samples..=2.0 * samples).contains(&pixel);
    if let Some(pixel) = pixels.iter().find(outside) {
        return Err(node.error(format!(
            "pixel {pixel} of the vector of line {line} lies outside [{}, {}]",
            -samples,
            2.0 * samples
        )));
    }
    let allowed = extent.smallest..=extent.largest;
    if let Some(value) = table.iter().find(|value| !allowed.contains(value)) {
        return Err(node.error(format!(
            "a value of {values} in line {line} is {value}, outside [{}, {}]",
            extent.smallest, extent.largest
        )));
    }
    Ok(Vector {
        line,
        pixels,
        values: table,
    })
}

/// Rows of a table: the two vectors around a line are resampled once and reused for the following lines.
#[derive(Debug)]
pub(crate) struct Rows<'a> {
    lut: &'a Lut,
    pixels: Range<usize>,
    first: (usize, Vec<f32>),
    second: (usize, Vec<f32>),
}

impl Rows<'_> {
    /// Values of the vectors before and after a line, and the weight of the second.
    pub(crate) fn at(&mut self, line: usize) -> (&[f32], &[f32], f32) {
        let (a, b, t) = self.lut.around(line as f64);
        if self.second.0 == a {
            std::mem::swap(&mut self.first, &mut self.second);
        }
        for (index, kept) in [(a, &mut self.first), (b, &mut self.second)] {
            if kept.0 != index {
                self.lut.vectors[index].fill(self.pixels.clone(), &mut kept.1);
                kept.0 = index;
            }
        }
        (&self.first.1, &self.second.1, t as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lut() -> Lut {
        let vector = |line, values: [f64; 3]| Vector {
            line,
            pixels: vec![2.0, 5.0, 9.0],
            values: values.to_vec(),
        };
        Lut {
            vectors: vec![
                vector(-3.0, [1.0, 4.0, 8.0]),
                vector(4.0, [2.0, 5.0, 6.0]),
                vector(8.0, [0.0, 1.0, 7.0]),
            ],
        }
    }

    #[test]
    fn rows_are_the_table() {
        let lut = lut();
        let mut rows = lut.rows(0..12);
        for line in [0, 3, 4, 5, 8, 20, 1, 7, 4] {
            let (a, b, t) = rows.at(line);
            let row: Vec<f32> = a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect();
            for (pixel, value) in row.into_iter().enumerate() {
                let exact = lut.at(line as f64, pixel as f64);
                assert!((f64::from(value) - exact).abs() < 1e-5, "{line} {pixel}");
            }
        }
    }

    #[test]
    fn the_table_is_linear_between_and_constant_beyond() {
        let lut = lut();
        assert!((lut.at(4.0, 5.0) - 5.0).abs() < 1e-15);
        assert!((lut.at(6.0, 5.0) - 3.0).abs() < 1e-15);
        assert!((lut.at(6.0, 7.0) - 4.75).abs() < 1e-15);
        assert!((lut.at(100.0, 100.0) - 7.0).abs() < 1e-15);
        assert!((lut.at(-100.0, -100.0) - 1.0).abs() < 1e-15);
    }
}
