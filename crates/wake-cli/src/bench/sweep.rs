//! Sweep of the simulator's stages over sizes and tolerances.

use super::plot;
use super::row::{Row, instruction_set};
use super::stages::{self, Memo, STAGES, has_tolerance};
use crate::progress;
use std::cmp::Ordering;

/// Sizes measured at the default tolerance.
const SIZES: [usize; 5] = [128, 256, 512, 1024, 2048];
/// Tolerances measured at [`plot::FRONTIER_SIZE`].
const TOLERANCES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
const DEFAULT_TOLERANCE: f64 = 1e-3;

/// Measures the named stages of the simulator, or all if none is named.
pub(crate) fn measure(largest: usize, stages: &[String]) -> wake_physics::Result<Vec<Row>> {
    let mut cases: Vec<(usize, f64)> = TOLERANCES.map(|t| (plot::FRONTIER_SIZE, t)).to_vec();
    let sizes = SIZES.into_iter().filter(|&n| n <= largest);
    cases.extend(
        sizes
            .filter(|&n| n != plot::FRONTIER_SIZE)
            .map(|n| (n, DEFAULT_TOLERANCE)),
    );
    let bar = progress::bar((cases.len() * STAGES.len()) as u64, "simulator runs");
    let (mut rows, mut memo) = (Vec::new(), Memo::default());
    let named = |stage: &&str| stages.is_empty() || stages.iter().any(|named| named == stage);
    for stage in STAGES.into_iter().filter(named) {
        for &(size, tolerance) in &cases {
            if has_tolerance(stage) || tolerance == DEFAULT_TOLERANCE {
                rows.push(stages::measure(stage, size, tolerance, &mut memo)?);
            }
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    rows.sort_by(|a, b| {
        let tolerances = b.tolerance.partial_cmp(&a.tolerance);
        (a.stage, a.size)
            .cmp(&(b.stage, b.size))
            .then(tolerances.unwrap_or(Ordering::Equal))
    });
    Ok(rows)
}

/// Markdown table of the rows of [`plot::FRONTIER_SIZE`] at the default tolerance, with threads and instruction set.
pub(crate) fn table(rows: &[Row]) -> String {
    let threads = rayon::current_num_threads();
    let size = plot::FRONTIER_SIZE;
    let mut text = format!(
        "{threads} threads, {}; {size} x {size} pixels, tolerance {DEFAULT_TOLERANCE:.0e} where the method has one.\n\n\
         | stage | fast ms | oracle s | product ms | ratio | pixels | max error | rms error |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        instruction_set()
    );
    let shown = |row: &&Row| {
        let tolerance = row.tolerance.unwrap_or(DEFAULT_TOLERANCE);
        row.size == size && tolerance == DEFAULT_TOLERANCE
    };
    for r in rows.iter().filter(shown) {
        text += &format!(
            "| {} | {} | {}{} | {} | {} | {} | {:.1e} | {:.1e} |\n",
            r.stage,
            figures(1e3 * r.fast_seconds),
            figures(r.oracle_seconds),
            if r.extrapolated() { "*" } else { "" },
            product(r),
            figures(r.ratio),
            r.pixels,
            r.max_error,
            r.rms_error
        );
    }
    text + "\n\\* extrapolated from the listed number of random pixels, on which the errors are measured.\n"
}

/// All rows as CSV.
pub(crate) fn csv(rows: &[Row]) -> String {
    let mut text =
        "stage,size,tolerance,fast_ms,oracle_s,oracle_extrapolated,product_ms,ratio,pixels,max_error,rms_error\n"
            .to_owned();
    for r in rows {
        let tolerance = r.tolerance.map_or(String::new(), |t| format!("{t:.0e}"));
        text += &format!(
            "{},{},{tolerance},{},{},{},{},{},{},{:.1e},{:.1e}\n",
            r.stage,
            r.size,
            figures(1e3 * r.fast_seconds),
            figures(r.oracle_seconds),
            r.extrapolated(),
            product(r),
            figures(r.ratio),
            r.pixels,
            r.max_error,
            r.rms_error
        );
    }
    text
}

/// Milliseconds of the matrix product, if there is one.
fn product(row: &Row) -> String {
    let seconds = row.matrix_product_seconds;
    seconds.map_or(String::new(), |s| figures(1e3 * s))
}

/// Formats a number with at most three significant digits.
fn figures(value: f64) -> String {
    let decimals = match value {
        _ if value >= 1e3 => return format!("{value:.2e}"),
        _ if value >= 100.0 => 0,
        _ if value >= 10.0 => 1,
        _ if value >= 1.0 => 2,
        _ if value >= 0.1 => 3,
        _ => return format!("{value:.1e}"),
    };
    format!("{value:.decimals$}")
}
