//! Blocks of the networks on a device, compared with the CPU backend flex on the same inputs.

mod blocks;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde::Serialize;
use wake_nn::burn::tensor::{DType, Device, Tensor};
use wake_nn::device_named;
use wake_nn::weights::Precision;

use self::blocks::{BLOCKS, Block, Call, reference};
use crate::exit::Outcome;

/// Number formats, used if the device supports them.
const KINDS: [(&str, Precision); 3] = [
    ("f32", Precision::F32),
    ("f16", Precision::F16),
    ("bf16", Precision::BF16),
];
/// Timed calls of flex, after a warm-up call.
const FLEX_RUNS: usize = 1;

/// Figures of one block in one number format.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct DeviceRow {
    pub(crate) stage: &'static str,
    pub(crate) block: &'static str,
    pub(crate) device: String,
    /// Number format of weights and inputs.
    pub(crate) precision: &'static str,
    /// Median seconds of a call on the device; `None` if it failed.
    pub(crate) seconds: Option<f64>,
    /// Seconds of the first call, which compiles kernels.
    pub(crate) first_seconds: Option<f64>,
    /// Median seconds of flex in f32.
    pub(crate) flex_seconds: f64,
    /// Largest difference from flex in f32, relative to its largest value.
    pub(crate) max_error: Option<f64>,
    /// Root mean square difference from flex in f32, relative to its root mean square.
    pub(crate) rms_error: Option<f64>,
    /// Reason for missing values.
    pub(crate) failure: Option<String>,
}

/// Result of a crate's self-check on the device.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct CheckRow {
    pub(crate) stage: &'static str,
    pub(crate) check: &'static str,
    pub(crate) device: String,
    /// Reason for a failed check.
    pub(crate) failure: Option<String>,
}

/// The blocks whose names contain one of `wanted`, or all if `wanted` is empty.
fn asked(wanted: &[String]) -> Vec<&'static Block> {
    let named =
        |block: &&Block| wanted.is_empty() || wanted.iter().any(|name| block.name.contains(name));
    BLOCKS.iter().filter(named).collect()
}

/// Number of calls of `done` in [`measure`].
pub(crate) fn parts(wanted: &[String]) -> u64 {
    asked(wanted).len() as u64
}

/// Measures all rows and calls `done` after each block.
pub(crate) fn measure(
    name: &str,
    wanted: &[String],
    mut done: impl FnMut(&[DeviceRow]) -> Outcome<()>,
) -> Outcome<Vec<DeviceRow>> {
    let device = device_named(name)?;
    let kinds: Vec<_> = KINDS
        .into_iter()
        .filter(|(_, kind)| device.supports_dtype(kind.dtype()))
        .collect();
    let mut rows = Vec::new();
    for block in asked(wanted) {
        let on = (block.make)();
        let flex = timed(&on(&reference(), DType::F32), FLEX_RUNS, &reference())?;
        let of_kind = |&(precision, kind): &(&'static str, Precision)| {
            // A driver that fails must not end the report.
            let work = || timed(&on(&device, kind.dtype()), block.runs, &device);
            let found = catch_unwind(AssertUnwindSafe(work))
                .unwrap_or_else(|panic| Err(said(&*panic).into()));
            row(block.name, name, precision, &flex, found)
        };
        let of_block: Vec<DeviceRow> = kinds.iter().map(of_kind).collect();
        done(&of_block)?;
        rows.extend(of_block);
    }
    Ok(rows)
}

/// Self-checks of all crates on a device.
pub(crate) fn checks(name: &str) -> Outcome<Vec<CheckRow>> {
    let device = device_named(name)?;
    type Check = fn(&Device) -> Result<(), String>;
    let list: &[(&'static str, Check)] = &[
        ("Stable Diffusion", |device| {
            wake_ldm::self_check(device).map_err(|e| e.to_string())
        }),
        ("wake model", |device| {
            wake_ldm::sampler::self_check(device).map_err(|e| e.to_string())
        }),
        ("detector", |device| {
            wake_detector::self_check::check_device(device).map_err(|e| e.to_string())
        }),
        #[cfg(feature = "train")]
        ("training step", |device| {
            wake_train::self_check(device).map_err(|e| e.to_string())
        }),
    ];
    let row = |&(check, run): &(&'static str, Check)| CheckRow {
        stage: "self-check",
        check,
        device: name.to_owned(),
        failure: catch_unwind(AssertUnwindSafe(|| run(&device)))
            .unwrap_or_else(|panic| Err(said(&*panic)))
            .err(),
    };
    Ok(list.iter().map(row).collect())
}

/// Result and seconds of a call.
struct Timed {
    first: f64,
    seconds: f64,
    numbers: Vec<f32>,
}

fn timed(call: &Call, runs: usize, device: &Device) -> Outcome<Timed> {
    let once = || -> Outcome<(f64, Tensor<1>)> {
        device.sync()?;
        let begin = Instant::now();
        let result = call();
        device.sync()?;
        Ok((begin.elapsed().as_secs_f64(), result))
    };
    // The first call compiles and tunes kernels.
    let (first, mut result) = once()?;
    let mut all = Vec::new();
    for _ in 0..runs {
        let (seconds, found) = once()?;
        all.push(seconds);
        result = found;
    }
    all.sort_by(f64::total_cmp);
    Ok(Timed {
        first,
        seconds: all[runs / 2],
        numbers: result.into_data().iter::<f32>().collect(),
    })
}

fn row(
    block: &'static str,
    device: &str,
    precision: &'static str,
    flex: &Timed,
    found: Outcome<Timed>,
) -> DeviceRow {
    let (found, failure) = match found {
        Ok(found) => (Some(found), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let errors = found
        .as_ref()
        .and_then(|found| errors(&found.numbers, &flex.numbers));
    let failure = match (&found, errors) {
        (Some(_), None) => Some("not all numbers are finite".to_owned()),
        _ => failure,
    };
    DeviceRow {
        stage: "device",
        block,
        device: device.to_owned(),
        precision,
        seconds: found.as_ref().map(|found| found.seconds),
        first_seconds: found.as_ref().map(|found| found.first),
        flex_seconds: flex.seconds,
        max_error: errors.map(|(max, _)| max),
        rms_error: errors.map(|(_, rms)| rms),
        failure,
    }
}

/// Largest difference relative to the largest value, and root mean square difference relative to the root mean square;
/// `None` if values are missing or not finite.
fn errors(found: &[f32], exact: &[f32]) -> Option<(f64, f64)> {
    let (mut largest, mut difference, mut square, mut differences) = (0.0f64, 0.0f64, 0.0, 0.0);
    for (&a, &b) in found.iter().zip(exact) {
        let (b, off) = (f64::from(b), f64::from(a) - f64::from(b));
        (largest, difference) = (largest.max(b.abs()), difference.max(off.abs()));
        (square, differences) = (square + b * b, differences + off * off);
    }
    let errors = (difference / largest, f64::sqrt(differences / square));
    let whole = found.len() == exact.len() && errors.0.is_finite() && errors.1.is_finite();
    whole.then_some(errors)
}

/// First line of a panic's message.
fn said(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message")
        .lines()
        .next()
        .unwrap_or_default()
        .to_owned()
}

/// Markdown table of the rows: milliseconds and largest errors by number format.
pub(crate) fn table(rows: &[DeviceRow], checks: &[CheckRow]) -> String {
    let device = rows.first().map_or("", |row| row.device.as_str());
    let mut text = format!(
        "Device {device}; flex with {} threads.\n\n",
        rayon::current_num_threads()
    );
    text += "| block | flex, ms |";
    let kinds: Vec<_> = KINDS
        .into_iter()
        .filter(|(kind, _)| rows.iter().any(|row| row.precision == *kind))
        .collect();
    for (kind, _) in &kinds {
        text += &format!(" {kind}, ms | error |");
    }
    text += &format!("\n| --- | --- |{}\n", " --- | --- |".repeat(kinds.len()));
    for of_block in rows.chunk_by(|a, b| a.block == b.block) {
        let flex = 1e3 * of_block[0].flex_seconds;
        text += &format!("| {} | {flex:.2} |", of_block[0].block);
        for row in of_block {
            let seconds = row
                .seconds
                .map_or("–".to_owned(), |s| format!("{:.2}", 1e3 * s));
            let error = row
                .max_error
                .map_or("none".to_owned(), |error| format!("{error:.0e}"));
            text += &format!(" {seconds} | {error} |");
        }
        text += "\n";
    }
    text += "\nSelf-checks:";
    for row in checks {
        let verdict = row.failure.as_deref().unwrap_or("agrees");
        text += &format!(" {}: {verdict};", row.check);
    }
    text.pop();
    text + ".\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One value of three that is off by a tenth of the largest, and values that are not finite or missing.
    #[test]
    fn errors_are_of_the_largest_value_and_of_the_root_mean_square() {
        let exact = [3.0, 4.0, 0.0];
        let (max, rms) = errors(&[3.0, 3.6, 0.0], &exact).expect("finite");
        assert!((max - 0.1).abs() < 1e-6 && (rms - 0.4 / 5.0).abs() < 1e-6);
        for bad in [
            &[3.0, f32::NAN, 0.0][..],
            &[3.0, f32::INFINITY, 0.0],
            &[3.0],
        ] {
            assert_eq!(errors(bad, &exact), None);
        }
    }
}
