//! Thermal noise of a product: power \[DN²\] as a range table times an azimuth profile.
//!
//! Until March 2018 (IPF 2.8 and older) a file has one list, `noiseVectorList`, along range. Since then it has
//! `noiseRangeVectorList`, and `noiseAzimuthVectorList` with a factor along azimuth for each block of a swath.

use std::ops::Range;

use super::lut::{Extent, Lut, interpolate};
use crate::error::Result;
use crate::limits::VECTORS;
use crate::xml::{Document, Node};

/// Largest noise power that is accepted \[DN²\]; products of 16 bits have at most 2³².
const LARGEST: f64 = 1e12;

/// Thermal noise at each position: bilinear range table times the azimuth factor of the block.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    pub(crate) range: Lut,
    pub(crate) azimuth: Vec<AzimuthBlock>,
}

/// Block of the image with one azimuth profile; the bounds are inclusive.
#[derive(Clone, Debug)]
pub(crate) struct AzimuthBlock {
    first_line: usize,
    last_line: usize,
    pub(crate) first_pixel: usize,
    pub(crate) last_pixel: usize,
    lines: Vec<f64>,
    factors: Vec<f64>,
}

impl AzimuthBlock {
    /// Factor at a line: linear between the lines of the profile, constant beyond.
    pub(crate) fn at(&self, line: f64) -> f64 {
        interpolate(&self.lines, &self.factors, line)
    }

    pub(crate) fn has_line(&self, line: usize) -> bool {
        (self.first_line..=self.last_line).contains(&line)
    }
}

impl Noise {
    /// Reads a noise file of either form, for an image with the given lines and pixels.
    pub(crate) fn read(document: &Document, lines: usize, pixels: usize) -> Result<Self> {
        let root = document.root();
        let extent = Extent {
            lines,
            pixels,
            smallest: 0.0,
            largest: LARGEST,
        };
        if let Some(list) = root.find("noiseVectorList") {
            let range = Lut::read(list, "noiseVector", "noiseLut", extent)?;
            return Ok(Self {
                range,
                azimuth: Vec::new(),
            });
        }
        let Some(list) = root.find("noiseRangeVectorList") else {
            return Err(root.error("it has neither noiseVectorList nor noiseRangeVectorList"));
        };
        let range = Lut::read(list, "noiseRangeVector", "noiseRangeLut", extent)?;
        let mut azimuth = Vec::new();
        if let Some(list) = root.find("noiseAzimuthVectorList") {
            for node in list.children("noiseAzimuthVector") {
                if azimuth.len() == VECTORS {
                    return Err(list.error(format!("it has more than {VECTORS} azimuth vectors")));
                }
                azimuth.push(read_block(node, lines, pixels)?);
            }
        }
        Ok(Self { range, azimuth })
    }

    /// Azimuth factor at a position; 1 outside all blocks. Of overlapping blocks, the first is used.
    pub(crate) fn azimuth_factor(&self, line: f64, pixel: f64) -> f64 {
        let (row, column) = (
            line.round().max(0.0) as usize,
            pixel.round().max(0.0) as usize,
        );
        let holds = |block: &&AzimuthBlock| {
            block.has_line(row) && (block.first_pixel..=block.last_pixel).contains(&column)
        };
        self.azimuth
            .iter()
            .find(holds)
            .map_or(1.0, |block| block.at(line))
    }

    /// Noise power at a position \[DN²\].
    pub(crate) fn at(&self, line: f64, pixel: f64) -> f64 {
        self.range.at(line, pixel) * self.azimuth_factor(line, pixel)
    }

    /// Multiplies a row of the range table, at consecutive pixels of a line, by its azimuth factors.
    pub(crate) fn scale_row(&self, line: usize, pixels: Range<usize>, row: &mut [f32]) {
        if self.blocks_overlap(line) {
            for (pixel, value) in pixels.zip(row) {
                *value *= self.azimuth_factor(line as f64, pixel as f64) as f32;
            }
            return;
        }
        for block in self.azimuth.iter().filter(|block| block.has_line(line)) {
            let first = block.first_pixel.max(pixels.start);
            let end = (block.last_pixel + 1).min(pixels.end);
            if first < end {
                let factor = block.at(line as f64) as f32;
                let part = &mut row[first - pixels.start..end - pixels.start];
                part.iter_mut().for_each(|value| *value *= factor);
            }
        }
    }

    /// Whether blocks of a line may share pixels. In products they do not: pixels increase from block to block.
    fn blocks_overlap(&self, line: usize) -> bool {
        let mut end = None;
        let mut on_line = self.azimuth.iter().filter(|block| block.has_line(line));
        on_line.any(|block| {
            let overlaps = end.is_some_and(|end| block.first_pixel <= end);
            end = Some(block.last_pixel);
            overlaps
        })
    }
}

fn read_block(node: Node<'_>, lines: usize, pixels: usize) -> Result<AzimuthBlock> {
    let bound = |name: &str, size: usize, otherwise: usize| match node.find(name) {
        Some(_) => node
            .integer_in(name, 0, size as i64 - 1)
            .map(|value| value as usize),
        None => Ok(otherwise),
    };
    let profile = (node.numbers("line")?, node.numbers("noiseAzimuthLut")?);
    let block = AzimuthBlock {
        first_line: bound("firstAzimuthLine", lines, 0)?,
        last_line: bound("lastAzimuthLine", lines, lines - 1)?,
        first_pixel: bound("firstRangeSample", pixels, 0)?,
        last_pixel: bound("lastRangeSample", pixels, pixels - 1)?,
        lines: profile.0,
        factors: profile.1,
    };
    if block.first_line > block.last_line || block.first_pixel > block.last_pixel {
        return Err(node.error(format!(
            "an azimuth block of noise is empty: it reaches from line {} to {} and from pixel {} to {}",
            block.first_line, block.last_line, block.first_pixel, block.last_pixel
        )));
    }
    if block.lines.is_empty() || block.lines.len() != block.factors.len() {
        return Err(node.error(format!(
            "an azimuth block of noise has {} lines and {} factors",
            block.lines.len(),
            block.factors.len()
        )));
    }
    if block.lines.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(node.error("lines of an azimuth block of noise do not increase"));
    }
    if let Some(factor) = block.factors.iter().find(|f| !(0.0..=1e6).contains(*f)) {
        return Err(node.error(format!(
            "an azimuth factor of noise is {factor}, outside [0, 1000000]"
        )));
    }
    Ok(block)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(blocks: &str) -> Result<Noise> {
        let range = "<noiseRangeVectorList><noiseRangeVector><line>0</line><pixel>0 9</pixel>\
                     <noiseRangeLut>10 10</noiseRangeLut></noiseRangeVector></noiseRangeVectorList>";
        let text = format!(
            "<noise>{range}<noiseAzimuthVectorList>{blocks}</noiseAzimuthVectorList></noise>"
        );
        Noise::read(&Document::parse("noise.xml", &text)?, 20, 10)
    }

    fn block(bounds: [usize; 4], lines: &str, factors: &str) -> String {
        let names = [
            "firstAzimuthLine",
            "lastAzimuthLine",
            "firstRangeSample",
            "lastRangeSample",
        ];
        let bounds: String = names
            .iter()
            .zip(bounds)
            .map(|(name, value)| format!("<{name}>{value}</{name}>"))
            .collect();
        format!(
            "<noiseAzimuthVector>{bounds}<line>{lines}</line><noiseAzimuthLut>{factors}</noiseAzimuthLut></noiseAzimuthVector>"
        )
    }

    #[test]
    fn blocks_end_with_their_last_pixel_and_rows_agree() {
        let text = block([0, 19, 0, 3], "0 10", "1 2")
            + &block([5, 19, 4, 9], "5", "3")
            + &block([0, 4, 3, 9], "0", "7");
        let noise = noise(&text).expect("noise");
        assert!((noise.at(5.0, 3.0) - 15.0).abs() < 1e-12);
        assert!((noise.at(5.0, 4.0) - 30.0).abs() < 1e-12);
        assert!(
            (noise.at(19.0, 3.0) - 20.0).abs() < 1e-12,
            "constant beyond the profile"
        );
        for line in 0..20 {
            let mut row = [10.0; 9];
            noise.scale_row(line, 1..10, &mut row);
            for (pixel, value) in (1..10).zip(row) {
                let exact = noise.at(line as f64, pixel as f64);
                assert!((f64::from(value) - exact).abs() < 1e-5, "{line} {pixel}");
            }
        }
    }

    #[test]
    fn blocks_that_cannot_be_are_refused() {
        for text in [
            block([3, 2, 0, 9], "0", "1"),
            block([0, 20, 0, 9], "0", "1"),
            block([0, 19, 0, 9], "0 0", "1 1"),
            block([0, 19, 0, 9], "0 1", "1"),
            block([0, 19, 0, 9], "0", "-1"),
            block([0, 19, 0, 9], "0", "NaN"),
            block([0, 19, 0, 9], "", ""),
        ] {
            assert!(noise(&text).is_err(), "{text}");
        }
    }
}
