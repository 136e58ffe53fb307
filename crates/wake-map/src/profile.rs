//! The line of a wake at full resolution: where exactly it lies, and how bright it is against the sea beside it.

use std::ops::Range;

use serde::Serialize;
use wake_detector::Wake;
use wake_geo::{Product, Values, Window};

/// What a wake looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A line darker than the sea: the turbulent wake.
    DarkLine,
    /// A line brighter than the sea.
    BrightLine,
    /// No line that stands out: arms, or a line too weak to be measured.
    Arms,
}

/// Half the width of the line \[pixels\], and where the sea beside it begins and ends.
const LINE: i32 = 2;
const BESIDE: [i32; 2] = [7, 16];
/// The line begins behind the ship \[pixels\]: its echo may lie on the first part.
const BEHIND: f32 = 10.0;
/// No more of it is looked at \[pixels\].
const LONGEST: f32 = 240.0;
/// A contrast of fewer standard deviations is none.
const CLEAR: f64 = 4.0;
/// Pixels brighter than the median of all around by this factor are of an echo.
const ECHO: f64 = 5.0;
/// How far the line may lie from where it was found, and by which angle it may be turned: pixels and degrees, in steps.
const ASIDE: i32 = 14;
const TURN: [f32; 2] = [4.0, 0.5];

/// Pixels around a wake.
pub(crate) struct Surroundings {
    window: Window,
    rows: Range<usize>,
    columns: Range<usize>,
    of_amplitudes: bool,
    /// Brighter pixels are left out: an echo is no line.
    brightest: f64,
}

/// A line through the pixels: its brightness over that of the sea beside it, and how many standard deviations it is off 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contrast {
    ratio: f64,
    deviations: f64,
}

impl Contrast {
    /// In decibel.
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
    /// Reads the pixels around a wake; `None` where they cannot be read.
    pub(crate) fn of(product: &Product, wake: &Wake) -> Option<Self> {
        let margin = (ASIDE + BESIDE[1]) as f32 + 0.1 * LONGEST;
        let ends = [wake.at(0.0), wake.at(wake.length.min(LONGEST))];
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

    /// Power of the pixel at a place, if it is there and of the sea.
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

    /// The contrast along a line; `None` where too few pixels are there.
    pub(crate) fn contrast(&self, wake: &Wake) -> Option<Contrast> {
        let [right, down] = wake.direction();
        let (mut line, mut beside) = ([0.0; 2], [0.0; 3]);
        let steps = (wake.length.min(LONGEST) - BEHIND).max(0.0) as i32;
        for step in 0..steps {
            let [x, y] = wake.at(BEHIND + step as f32);
            for across in -BESIDE[1]..=BESIDE[1] {
                let away = across.abs();
                if away > LINE && away < BESIDE[0] {
                    continue;
                }
                let at = [x - across as f32 * down, y + across as f32 * right];
                let Some(power) = self.power(at) else {
                    continue;
                };
                if away <= LINE {
                    line = [line[0] + 1.0, line[1] + power];
                } else {
                    beside = [
                        beside[0] + 1.0,
                        beside[1] + power,
                        beside[2] + power * power,
                    ];
                }
            }
        }
        if line[0] < 100.0 || beside[0] < 100.0 || beside[1] <= 0.0 || line[1] <= 0.0 {
            return None;
        }
        let off = beside[1] / beside[0];
        let variance = beside[2] / beside[0] / (off * off) - 1.0;
        // Pixels are two to a cell of resolution, both ways.
        let deviation = (variance.max(1e-6) * 4.0 / line[0]).sqrt();
        let ratio = line[1] / line[0] / off;
        Some(Contrast {
            ratio,
            deviations: (ratio - 1.0) / deviation,
        })
    }

    /// The wake with its axis on the line that stands out most near where it was found; as it was, where none does.
    pub(crate) fn refined(&self, wake: &Wake) -> (Wake, Option<Contrast>) {
        let as_found = self.contrast(wake);
        let mut best = (*wake, as_found);
        let size = |contrast: Option<Contrast>| contrast.map_or(0.0, |c| c.deviations.abs());
        let turns = (TURN[0] / TURN[1]) as i32;
        for turn in -turns..=turns {
            for aside in -ASIDE..=ASIDE {
                let mut moved = *wake;
                let [right, down] = wake.direction();
                moved.tip[0] -= aside as f32 * down;
                moved.tip[1] += aside as f32 * right;
                moved.axis_deg = (wake.axis_deg + TURN[1] * turn as f32).rem_euclid(360.0);
                let contrast = self.contrast(&moved);
                if size(contrast) > size(best.1) {
                    best = (moved, contrast);
                }
            }
        }
        match size(best.1) > CLEAR {
            true => best,
            false => (*wake, as_found),
        }
    }
}
