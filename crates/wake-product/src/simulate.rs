//! Simulation of a product from a real annotation and ships on the map.

use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::json;
use wake_geo::{Product, Sentinel1};
use wake_physics::{Field, Simulator, expected_intensity, unit_speckle};

use crate::blocks::Axis;
use crate::error::Result;
use crate::scenes::{Scenes, Wind, sentinel};
use crate::ships::ShipAt;

/// Part of a product to simulate, wind and other options.
#[derive(Clone, Debug)]
pub struct Options {
    /// Lines of the part; `None` for all.
    pub lines: Option<Range<usize>>,
    /// Pixels of the part; `None` for all.
    pub pixels: Option<Range<usize>>,
    /// The wind.
    pub wind: Wind,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Further assignments to keys of the scene, such as `sea.fetch=50e3`.
    pub changes: Vec<String>,
}

/// Files that were written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The product, a `.SAFE` folder.
    pub product: PathBuf,
    /// GeoJSON file beside the folder with the ships in the part, and their lines and pixels.
    pub ships: PathBuf,
    /// Number of ships in the part.
    pub count: usize,
}

/// Rows and columns of open sea over which the mean brightness at an incidence angle is computed.
const EVEN: usize = 32;
/// Smallest digital number of a pixel with data, and largest digital number.
const NUMBERS: [f64; 2] = [1.0, 65_535.0];

/// Simulates a part of a product, and writes it with the ships as ground truth into a folder.
///
/// - `template`: a Sentinel-1 product; its measurement is not needed
/// - `done`: called for every simulated strip with its number of lines
///
/// # Errors
///
/// [`Error::Template`](crate::Error::Template) for a product that cannot be simulated, [`Error::Scene`](crate::Error::Scene) for
/// a value out of range, [`Error::Product`](crate::Error::Product) for a part outside the image and for files that cannot be
/// written.
pub fn simulate(
    template: &Product,
    ships: &[ShipAt],
    options: &Options,
    out: &Path,
    done: &mut dyn FnMut(usize),
) -> Result<Written> {
    let sentinel = sentinel(template)?;
    let (all_lines, all_pixels) = template.size();
    let lines = options.lines.clone().unwrap_or(0..all_lines);
    let pixels = options.pixels.clone().unwrap_or(0..all_pixels);
    let scenes = Scenes::new(template, ships, options.wind, &options.changes)?;
    let mut strips = Strips::new(&scenes, (lines.clone(), pixels.clone()), options.seed);
    let mut failed = None;
    let written = sentinel.write_part(out, lines.clone(), pixels.clone(), |asked, numbers| {
        let filled = strips.numbers(sentinel, asked.clone(), numbers);
        done(asked.len());
        filled.map_err(|error| {
            failed = Some(error);
            wake_geo::Error::Unwritable {
                path: out.to_owned(),
                why: "the simulation failed".to_owned(),
            }
        })
    });
    let product = match (written, failed) {
        (_, Some(error)) => return Err(error),
        (written, None) => written?,
    };
    let inside = |at: f64, range: &Range<usize>| {
        at >= range.start as f64 - 0.5 && at < range.end as f64 - 0.5
    };
    let truth: Vec<_> = scenes
        .ships()
        .iter()
        .filter(|(_, [line, pixel])| inside(*line, &lines) && inside(*pixel, &pixels))
        .map(|(ship, [line, pixel])| {
            json!({
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [ship.longitude, ship.latitude]},
                "properties": {
                    "heading": ship.heading, "speed": ship.speed, "length": ship.length, "beam": ship.beam,
                    "draft": ship.draft, "line": line - lines.start as f64, "pixel": pixel - pixels.start as f64,
                },
            })
        })
        .collect();
    let count = truth.len();
    let ships = product.with_extension("geojson");
    let collection = json!({"type": "FeatureCollection", "features": truth});
    whole_files::write_json(&ships, &collection)?;
    Ok(Written {
        product,
        ships,
        count,
    })
}

/// The image in strips of lines: σ⁰ without noise and speckle, and unit-mean speckle.
struct Strips<'a> {
    scenes: &'a Scenes<'a>,
    lines: Range<usize>,
    pixels: Range<usize>,
    seed: u64,
    /// Incidence angle and logarithm of the mean σ⁰ of open sea, in the middle of each block along a line.
    brightness: Vec<[f64; 2]>,
    simulator: Simulator,
    /// Rows of blocks already added to `sum`.
    blocks: usize,
    /// First line in `sum` and `speckle`.
    first: usize,
    sum: Vec<f32>,
    speckle: Vec<f32>,
}

impl<'a> Strips<'a> {
    fn new(
        scenes: &'a Scenes<'a>,
        (lines, pixels): (Range<usize>, Range<usize>),
        seed: u64,
    ) -> Self {
        Self {
            scenes,
            brightness: Vec::new(),
            lines,
            pixels,
            seed,
            simulator: Simulator::default(),
            blocks: 0,
            first: 0,
            sum: Vec::new(),
            speckle: Vec::new(),
        }
    }

    /// Computes the brightness of open sea in the middle of each block along a line.
    fn look_at_brightness(&mut self) -> Result<()> {
        let across = Axis::new(self.pixels.len());
        let brightness = (0..across.count()).map(|n| -> Result<[f64; 2]> {
            let block = shifted(&across.block(n), self.pixels.start);
            let mut scene = self.scenes.scene(&self.lines, &block, self.seed)?;
            scene.ships.clear();
            (scene.grid.rows, scene.grid.columns) = (EVEN, EVEN);
            Ok([
                scene.radar.incidence,
                expected_intensity(&scene)?.mean().ln(),
            ])
        });
        self.brightness = brightness.collect::<Result<_>>()?;
        Ok(())
    }

    /// Computes the digital numbers of lines, which must be requested in order.
    fn numbers(
        &mut self,
        sentinel: &Sentinel1,
        lines: Range<usize>,
        out: &mut [u16],
    ) -> Result<()> {
        let down = Axis::new(self.lines.len());
        while down.done(self.blocks) < lines.end {
            self.add_row_of_blocks()?;
        }
        let width = self.pixels.len();
        let from = (lines.start - self.first) * width;
        let (sigma, speckle) = (&self.sum[from..], &self.speckle[from..]);
        let rows = out.par_chunks_mut(width).zip(lines.clone());
        rows.for_each(|(row, line)| {
            let at = (line - lines.start) * width;
            for (column, number) in row.iter_mut().enumerate() {
                let place = [self.lines.start + line, self.pixels.start + column];
                let pixel = sentinel.calibration(place[0] as f64, place[1] as f64);
                let gain = pixel.sigma_nought_lut * pixel.sigma_nought_lut;
                let power = f64::from(sigma[at + column].max(0.0)) * gain + pixel.noise;
                let power = power * f64::from(speckle[at + column]);
                *number = power.sqrt().round().clamp(NUMBERS[0], NUMBERS[1]) as u16;
            }
        });
        self.forget(lines.end);
        Ok(())
    }

    /// Drops the lines before a given one.
    fn forget(&mut self, line: usize) {
        let count = (line - self.first) * self.pixels.len();
        self.sum.drain(..count.min(self.sum.len()));
        self.speckle.drain(..count.min(self.speckle.len()));
        self.first = line;
    }

    /// Simulates the next row of blocks, and blends it with the previous row.
    fn add_row_of_blocks(&mut self) -> Result<()> {
        if self.blocks == 0 {
            self.look_at_brightness()?;
        }
        let (down, across) = (Axis::new(self.lines.len()), Axis::new(self.pixels.len()));
        let (row, width) = (self.blocks, self.pixels.len());
        let lines = down.block(row);
        let (from, until) = (down.done(row), down.done(row + 1));
        self.sum.resize((lines.end - self.first) * width, 0.0);
        let weights_down = down.weights(row);
        for column in 0..across.count() {
            let pixels = across.block(column);
            let seed = block_seed(self.seed, row, column);
            let scene = self.scenes.scene(
                &shifted(&lines, self.lines.start),
                &shifted(&pixels, self.pixels.start),
                seed,
            )?;
            let drawn = self.simulator.simulate(&scene)?.intensity;
            let mean = self.simulator.expected_intensity(&scene)?;
            let tilt = self.tilt(&pixels, column)?;
            let weights_across = across.weights(column);
            for (line, down) in lines.clone().zip(&weights_down) {
                // Row 0 of a scene is the farthest along azimuth.
                let in_scene = (lines.end - 1 - line) * pixels.len();
                let at = (line - self.first) * width + pixels.start;
                let sums = &mut self.sum[at..at + pixels.len()];
                for (n, sum) in sums.iter_mut().enumerate() {
                    let (mean, drawn) = (mean.values[in_scene + n], drawn.values[in_scene + n]);
                    let across = weights_across[n];
                    let value = down.mean * across.mean * mean
                        + down.deviation * across.deviation * (drawn - mean);
                    *sum += value * tilt[n];
                }
            }
        }
        let mut speckled = self.scenes.scene(
            &shifted(&(from..until), self.lines.start),
            &self.pixels,
            block_seed(self.seed, row, usize::MAX),
        )?;
        speckled.ships.clear();
        self.speckle.extend(upside_down(unit_speckle(&speckled)?));
        self.blocks += 1;
        Ok(())
    }

    /// Brightness of open sea at each pixel of a block, relative to the middle of the block.
    fn tilt(&self, pixels: &Range<usize>, column: usize) -> Result<Vec<f32>> {
        let middle = self.brightness[column];
        let line = 0.5 * (self.lines.start + self.lines.end - 1) as f64;
        let at = |pixel: usize| -> Result<f32> {
            let place = self
                .scenes
                .incidence(line, (self.pixels.start + pixel) as f64)?;
            let change = place.map_or(0.0, |angle| {
                line_through(&self.brightness, angle) - middle[1]
            });
            Ok(change.exp() as f32)
        };
        pixels.clone().map(at).collect()
    }
}

/// Piecewise linear interpolation through points, with linear extrapolation beyond them.
fn line_through(points: &[[f64; 2]], at: f64) -> f64 {
    if points.len() < 2 {
        return points.first().map_or(0.0, |point| point[1]);
    }
    let after = points
        .partition_point(|point| point[0] <= at)
        .clamp(1, points.len() - 1);
    let [a, b] = [points[after - 1], points[after]];
    a[1] + (b[1] - a[1]) * (at - a[0]) / (b[0] - a[0])
}

/// Values of a field with its rows in reverse order.
fn upside_down(field: Field) -> Vec<f32> {
    let rows = field.values.chunks(field.columns.max(1)).rev();
    rows.flatten().copied().collect()
}

fn shifted(range: &Range<usize>, by: usize) -> Range<usize> {
    range.start + by..range.end + by
}

/// Seed of a block.
fn block_seed(seed: u64, row: usize, column: usize) -> u64 {
    let mixed = |x: u64| (x ^ (x >> 29)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed(mixed(seed ^ (row as u64 + 1)).wrapping_add(column as u64)) >> 1
}
