//! Measured row, and timing functions.

use serde::Serialize;
use std::time::Instant;

/// Comparison of one fast method with its oracle.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    /// Stage of the data flow.
    pub(crate) stage: &'static str,
    /// Pixels along each side.
    pub(crate) size: usize,
    /// Requested tolerance, if the method has one.
    pub(crate) tolerance: Option<f64>,
    /// Seconds of the fast method, the median of several runs.
    pub(crate) fast_seconds: f64,
    /// Seconds of the oracle.
    pub(crate) oracle_seconds: f64,
    /// Pixels at which the oracle ran and errors are measured; if these are not all pixels, its time was scaled up.
    pub(crate) pixels: usize,
    /// Seconds of the same sum as a matrix product, if there is one; scaled up from some rows above 128².
    pub(crate) matrix_product_seconds: Option<f64>,
    /// Oracle seconds over fast seconds.
    pub(crate) ratio: f64,
    /// Largest error relative to the root mean square (fields) or the mean (σ⁰, image), over all quantities.
    pub(crate) max_error: f64,
    /// Root mean square error, relative to the same scale.
    pub(crate) rms_error: f64,
}

impl Row {
    /// Whether the oracle ran on only some of the pixels.
    pub(crate) fn extrapolated(&self) -> bool {
        self.pixels < self.size * self.size
    }
}

/// The widest vector instructions of this machine that the fast methods use.
pub(crate) fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            return "AVX-512";
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return "AVX2";
        }
    }
    std::env::consts::ARCH
}

/// Median seconds of `runs` calls after a warm-up call, and the last result.
pub(crate) fn median_seconds<T>(runs: usize, mut call: impl FnMut() -> T) -> (f64, T) {
    let mut result = call();
    let mut seconds: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            result = call();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    (seconds[runs / 2], result)
}

/// Seconds of one call, and its result.
pub(crate) fn seconds<T>(call: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = call();
    (start.elapsed().as_secs_f64(), result)
}

/// Largest and root mean square error of values against exact ones.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Errors {
    pub(crate) max: f64,
    pub(crate) rms: f64,
}

impl Errors {
    /// Errors relative to `scale`.
    pub(crate) fn of(fast: impl Iterator<Item = f64>, exact: &[f64], scale: f64) -> Self {
        let (mut max, mut sum) = (0.0f64, 0.0);
        for (a, b) in fast.zip(exact) {
            max = max.max((a - b).abs());
            sum += (a - b).powi(2);
        }
        let rms = (sum / exact.len().max(1) as f64).sqrt();
        let scale = if scale > 0.0 { scale } else { 1.0 };
        Self {
            max: max / scale,
            rms: rms / scale,
        }
    }

    /// The larger of each error.
    pub(crate) fn worst(self, other: Self) -> Self {
        Self {
            max: self.max.max(other.max),
            rms: self.rms.max(other.rms),
        }
    }
}
