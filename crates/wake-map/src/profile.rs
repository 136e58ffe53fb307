//! How bright the line of a wake is against the sea beside it.

use serde::Serialize;
use wake_detector::Wake;
use wake_geo::{Product, Values};

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
const LINE: i64 = 2;
const BESIDE: [i64; 2] = [8, 20];
/// The line begins behind the ship \[pixels\].
const BEHIND: f32 = 6.0;
/// A contrast of fewer standard deviations is none.
const CLEAR: f64 = 3.0;

/// Contrast of the line against the sea on both sides \[dB\] and what it makes of the wake; `None` where too few pixels are there.
pub(crate) fn profile(product: &Product, wake: &Wake) -> Option<(f64, Kind)> {
    let margin = BESIDE[1] as f32 + 2.0;
    let ends = [wake.at(0.0), wake.at(wake.length)];
    let size = [product.size().1, product.size().0];
    let bounds = [0, 1].map(|axis| {
        let [a, b] = [ends[0][axis], ends[1][axis]];
        let from = (a.min(b) - margin).floor().max(0.0) as usize;
        let to = ((a.max(b) + margin).ceil().max(0.0) as usize + 1).min(size[axis]);
        from..to
    });
    let [columns, rows] = bounds;
    if rows.is_empty() || columns.is_empty() {
        return None;
    }
    let window = product.read_window(rows.clone(), columns.clone()).ok()?;
    let power = |value: f32| match product.values() {
        Values::SigmaNought => f64::from(value),
        Values::Samples => f64::from(value).powi(2),
    };
    let [right, down] = wake.direction();
    let (mut line, mut beside) = (Vec::new(), Vec::new());
    let steps = (wake.length - BEHIND).max(0.0) as i32;
    for step in 0..steps {
        let [x, y] = wake.at(BEHIND + step as f32);
        for across in -BESIDE[1]..=BESIDE[1] {
            let away = across.abs();
            if away > LINE && away < BESIDE[0] {
                continue;
            }
            let at = [x - across as f32 * down, y + across as f32 * right];
            let [column, row] = at.map(|v| v.round() as i64);
            let inside = (columns.start as i64..columns.end as i64).contains(&column)
                && (rows.start as i64..rows.end as i64).contains(&row);
            if !inside {
                continue;
            }
            let value = window.line(row as usize - rows.start)[column as usize - columns.start];
            if value.is_finite() {
                let values = if away <= LINE { &mut line } else { &mut beside };
                values.push(power(value));
            }
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    if line.len() < 20 || beside.len() < 20 {
        return None;
    }
    let (on, off) = (mean(&line), mean(&beside));
    if on <= 0.0 || off <= 0.0 {
        return None;
    }
    let variance =
        beside.iter().map(|v| (v / off - 1.0).powi(2)).sum::<f64>() / beside.len() as f64;
    // Pixels are two to a cell of resolution, both ways.
    let deviation = (variance * 4.0 / line.len() as f64).sqrt();
    let contrast = on / off;
    let kind = match (contrast - 1.0) / deviation {
        z if z < -CLEAR => Kind::DarkLine,
        z if z > CLEAR => Kind::BrightLine,
        _ => Kind::Arms,
    };
    Some((10.0 * contrast.log10(), kind))
}
