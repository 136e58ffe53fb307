//! Position and contrast of a wake's line at full resolution.

use std::ops::Range;

use serde::Serialize;
use wake_detector::Wake;
use wake_geo::{Product, Values, Window};

/// Appearance of a wake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A line darker than the sea: the turbulent wake.
    DarkLine,
    /// A line brighter than the sea.
    BrightLine,
    /// No line that stands out: arms, or a line too weak to measure.
    Arms,
}

/// Half the width of the line, and distances between which the sea beside it lies \[pixels\].
const LINE: i32 = 2;
const BESIDE: [i32; 2] = [7, 16];
/// Bounds of the first part of the line that is skipped, a quarter of its length \[pixels\]: the echo may lie there, and waves
/// beside the ship displace the line.
const BEHIND: [f32; 2] = [10.0, 40.0];
/// Ends of the fitted part of the line \[pixels\]. The axis is fitted to the part that stands out most: long parts are more
/// precise, short parts suit lines that fade or bend.
const ENDS: [i32; 4] = [120, 240, 480, 720];
const LONGEST: f32 = ENDS[ENDS.len() - 1] as f32;
/// Lowest significant contrast \[standard deviations\]: on sea without wakes, the largest over all places, turns and ends reaches
/// four.
const CLEAR: f64 = 5.0;
/// Pixels brighter than the median of the surroundings by this factor belong to an echo.
const ECHO: f64 = 5.0;
/// Largest distance of the line from the detected axis \[pixels\], and its largest turn and the step of turns \[degrees\].
const ASIDE: i32 = 10;
const TURN: [f32; 2] = [8.0, 0.5];
/// Distance of a turned axis from the detected one as a share of the distance from the tip: above the sine of the largest turn.
const SPREAD: f32 = 0.15;
/// Largest distance from a wake of the parallel lines that are summed \[pixels\].
const FARTHEST: i32 = ASIDE + BESIDE[1];
/// Weight of bright lines relative to dark ones.
const BRIGHT: f64 = 0.5;

/// Pixels around a wake.
pub(crate) struct Surroundings {
    window: Window,
    rows: Range<usize>,
    columns: Range<usize>,
    of_amplitudes: bool,
    /// Brighter pixels are excluded because they belong to echoes.
    brightest: f64,
}

/// Brightness of a line over the brightness of the sea beside it, and the deviation of this ratio from 1 in standard deviations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contrast {
    ratio: f64,
    deviations: f64,
}

impl Contrast {
    /// Contrast in decibels.
    pub(crate) fn decibel(self) -> f64 {
        10.0 * self.ratio.log10()
    }

    pub(crate) fn kind(self) -> Kind {
        match self.deviations {
            z if z < -CLEAR => Kind::DarkLine,
            z if z > CLEAR => Kind::BrightLine,
            _ => Kind::Arms,
        }
    }
}

impl Surroundings {
    /// Reads the pixels around a wake; `None` if they cannot be read.
    pub(crate) fn of(product: &Product, wake: &Wake) -> Option<Self> {
        let margin = FARTHEST as f32 + SPREAD * LONGEST;
        let ends = [wake.at(0.0), wake.at(LONGEST)];
        let size = [product.size().1, product.size().0];
        let [columns, rows] = [0, 1].map(|axis| {
            let [a, b] = [ends[0][axis], ends[1][axis]];
            let from = (a.min(b) - margin).floor().max(0.0) as usize;
            from..((a.max(b) + margin).ceil().max(0.0) as usize + 1).min(size[axis])
        });
        if rows.is_empty() || columns.is_empty() {
            return None;
        }
        let window = product.read_window(rows.clone(), columns.clone()).ok()?;
        let of_amplitudes = product.values() == Values::Samples;
        let mut there: Vec<f32> = window
            .values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .collect();
        let middle = there.len() / 2;
        if there.is_empty() {
            return None;
        }
        let median = f64::from(*there.select_nth_unstable_by(middle, f32::total_cmp).1);
        let median = if of_amplitudes {
            median * median
        } else {
            median
        };
        Some(Self {
            window,
            rows,
            columns,
            of_amplitudes,
            brightest: ECHO * median,
        })
    }

    /// Power of the pixel at a place; `None` outside the window and for echoes.
    fn power(&self, [x, y]: [f32; 2]) -> Option<f64> {
        let [column, row] = [x, y].map(|v| v.round() as i64);
        let column = usize::try_from(column).ok()?;
        let row = usize::try_from(row).ok()?;
        if !(self.rows.contains(&row) && self.columns.contains(&column)) {
            return None;
        }
        let value = f64::from(self.window.line(row - self.rows.start)[column - self.columns.start]);
        let power = if self.of_amplitudes {
            value * value
        } else {
            value
        };
        (power <= self.brightest).then_some(power)
    }

    /// Sums along the lines parallel to a wake, from [`FARTHEST`] pixels to its left to as many to its right, from behind the
    /// ship to each of [`ENDS`].
    fn lines(&self, wake: &Wake) -> [Vec<Sums>; ENDS.len()] {
        let [right, down] = wake.direction();
        let behind = (0.25 * wake.length).clamp(BEHIND[0], BEHIND[1]);
        let mut lines = ENDS.map(|_| Vec::with_capacity(2 * FARTHEST as usize + 1));
        for across in -FARTHEST..=FARTHEST {
            let mut sums = Sums::default();
            let mut from = behind as i32;
            for (lines, end) in lines.iter_mut().zip(ENDS) {
                for along in from..end {
                    let [x, y] = wake.at(along as f32);
                    let at = [x - across as f32 * down, y + across as f32 * right];
                    if let Some(power) = self.power(at) {
                        sums.add(power);
                    }
                }
                from = end;
                lines.push(sums);
            }
        }
        lines
    }

    /// Moves the wake's axis to the line that stands out most near it; the wake is unchanged if no line stands out.
    ///
    /// Dark lines are preferred: a dark line is the axis, even if a bright edge beside it stands out more.
    pub(crate) fn refined(&self, wake: &Wake) -> (Wake, Option<Contrast>) {
        let mut best: Option<(f64, Wake, Contrast)> = None;
        let turns = (TURN[0] / TURN[1]) as i32;
        for turn in -turns..=turns {
            let turned = Wake {
                axis_deg: (wake.axis_deg + TURN[1] * turn as f32).rem_euclid(360.0),
                ..*wake
            };
            let lines = self.lines(&turned);
            let [right, down] = turned.direction();
            let places = (-ASIDE..=ASIDE).flat_map(|aside| lines.iter().map(move |l| (aside, l)));
            for (aside, lines) in places {
                let Some(found) = contrast(lines, aside) else {
                    continue;
                };
                let weight = if found.deviations < 0.0 { 1.0 } else { BRIGHT };
                let size = weight * found.deviations.abs();
                let is_best = best.is_none_or(|best| size > best.0);
                if found.kind() != Kind::Arms && is_best {
                    let mut moved = turned;
                    moved.tip[0] -= aside as f32 * down;
                    moved.tip[1] += aside as f32 * right;
                    best = Some((size, moved, found));
                }
            }
        }
        match best {
            Some((_, moved, contrast)) => (moved, Some(contrast)),
            None => {
                let lines = self.lines(wake);
                let here = lines.iter().filter_map(|lines| contrast(lines, 0));
                let size = |one: &Contrast| one.deviations.abs();
                (*wake, here.max_by(|a, b| size(a).total_cmp(&size(b))))
            }
        }
    }
}

/// Sums over the valid pixels of a line.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    power: f64,
    square: f64,
}

impl Sums {
    fn add(&mut self, power: f64) {
        self.count += 1.0;
        self.power += power;
        self.square += power * power;
    }

    fn of(lines: &[Self]) -> Self {
        let sum = |all: Self, one: &Self| Self {
            count: all.count + one.count,
            power: all.power + one.power,
            square: all.square + one.square,
        };
        lines.iter().fold(Self::default(), sum)
    }
}

/// Contrast of the line `aside` pixels to the right of the middle; `None` if there are too few pixels.
fn contrast(lines: &[Sums], aside: i32) -> Option<Contrast> {
    let middle = FARTHEST + aside;
    let between =
        |from: i32, to: i32| Sums::of(&lines[(middle + from) as usize..=(middle + to) as usize]);
    let line = between(-LINE, LINE);
    let [near, far] = BESIDE;
    let beside = Sums::of(&[between(-far, -near), between(near, far)]);
    if line.count < 100.0 || beside.count < 100.0 || beside.power <= 0.0 || line.power <= 0.0 {
        return None;
    }
    let off = beside.power / beside.count;
    let variance = beside.square / beside.count / (off * off) - 1.0;
    // A resolution cell has two pixels along both axes.
    let deviation = (variance.max(1e-6) * 4.0 / line.count).sqrt();
    let ratio = line.power / line.count / off;
    Some(Contrast {
        ratio,
        deviations: (ratio - 1.0) / deviation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    const SIDE: usize = 900;

    /// Sea of four looks with two pixels per resolution cell, times the brightness at each place.
    fn sea(seed: u64, brightness: impl Fn([f32; 2]) -> f32) -> Surroundings {
        let mut random = StdRng::seed_from_u64(seed);
        let mut look = || -(1.0 - random.random::<f32>()).ln() / 4.0;
        let cells: Vec<f32> = (0..SIDE * SIDE / 4)
            .map(|_| (0..4).map(|_| look()).sum())
            .collect();
        let value = |n: usize| {
            let (row, column) = (n / SIDE, n % SIDE);
            cells[row / 2 * (SIDE / 2) + column / 2] * brightness([column as f32, row as f32])
        };
        Surroundings {
            window: Window {
                lines: SIDE,
                pixels: SIDE,
                values: (0..SIDE * SIDE).map(value).collect(),
                ..Window::default()
            },
            rows: 0..SIDE,
            columns: 0..SIDE,
            of_amplitudes: false,
            brightest: ECHO,
        }
    }

    fn wake(tip: [f32; 2], axis_deg: f32, length: f32) -> Wake {
        Wake {
            tip,
            axis_deg,
            half_angle_deg: 10.0,
            length,
            snr: f32::INFINITY,
            contrast_db: None,
        }
    }

    /// Distance of a place from the axis of a wake, and whether it is astern of the tip.
    fn off(wake: &Wake, [x, y]: [f32; 2]) -> (f32, bool) {
        let [right, down] = wake.direction();
        let from = [x - wake.tip[0], y - wake.tip[1]];
        (
            (from[1] * right - from[0] * down).abs(),
            from[0] * right + from[1] * down > 0.0,
        )
    }

    fn on(wake: &Wake, at: [f32; 2]) -> bool {
        let (across, astern) = off(wake, at);
        astern && across < 2.5
    }

    /// A short detection is six degrees and four pixels off its wake, which another wake crosses: the axis moves to the dark
    /// line, to within a step of the angle and the line's half-width.
    #[test]
    fn the_axis_is_that_of_the_long_line() {
        let truth = wake([150.0, 120.0], 130.0, 720.0);
        let other = wake([60.0, 150.0], 95.0, 720.0);
        let pixels = sea(5, |at| {
            if on(&truth, at) || on(&other, at) {
                0.75
            } else {
                1.0
            }
        });
        let found = wake([147.0, 123.0], 136.0, 50.0);
        let (line, contrast) = pixels.refined(&found);
        assert_eq!(contrast.map(Contrast::kind), Some(Kind::DarkLine));
        assert!((line.axis_deg - 130.0).abs() <= 0.5, "{line:?}");
        assert!(off(&truth, line.tip).0 < 2.5, "{line:?}");
        assert!((line.length - 50.0).abs() < 1e-6);
    }

    /// The axis follows the first part of a turning ship's track with a radius of 2,000 pixels: it is off by no more than about
    /// half the turn over 240 pixels.
    #[test]
    fn the_axis_of_a_bent_line_is_that_of_its_first_part() {
        let centre = [150.0, 120.0 + 2000.0];
        let pixels = sea(6, |[x, y]| {
            let radius = (x - centre[0]).hypot(y - centre[1]);
            let dark = x > 150.0 && (radius - 2000.0).abs() < 2.5;
            if dark { 0.7 } else { 1.0 }
        });
        let (line, contrast) = pixels.refined(&wake([150.0, 120.0], 90.0, 200.0));
        assert_eq!(contrast.map(Contrast::kind), Some(Kind::DarkLine));
        // The track turns by 6.9 degrees over 240 pixels.
        let turned = line.axis_deg - 90.0;
        assert!((-0.5..4.0).contains(&turned), "{line:?}");
    }

    /// On sea alone, a detection is unchanged.
    #[test]
    fn without_a_line_nothing_moves() {
        for seed in 0..4 {
            let pixels = sea(seed, |_| 1.0);
            let found = wake([300.0, 300.0], 45.0 + 90.0 * seed as f32, 100.0);
            let (line, contrast) = pixels.refined(&found);
            assert_eq!(line, found);
            assert_eq!(contrast.map(Contrast::kind), Some(Kind::Arms));
        }
    }
}
