//! Medians, percentiles and shares.

use serde::Serialize;

/// How well one quantity was measured over many scenes.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Errors {
    /// Scenes that count.
    pub(crate) scenes: usize,
    /// Share of them in which the value is measurable.
    pub(crate) measurable: f64,
    /// Median absolute error of the measurable ones; null if there are none.
    pub(crate) median: Option<f64>,
    /// 90th percentile of the absolute error.
    pub(crate) percentile_90: Option<f64>,
}

impl Errors {
    /// From the absolute errors; `None` where not measurable.
    pub(crate) fn of(errors: &[Option<f64>]) -> Self {
        let measured: Vec<f64> = errors.iter().flatten().copied().collect();
        Self {
            scenes: errors.len(),
            measurable: measured.len() as f64 / errors.len().max(1) as f64,
            median: quantile(&measured, 0.5),
            percentile_90: quantile(&measured, 0.9),
        }
    }
}

/// A quantile by linear interpolation; `None` of nothing.
pub(crate) fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = q * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (
        sorted[place.floor() as usize],
        sorted[place.ceil() as usize],
    );
    Some(below + (place - place.floor()) * (above - below))
}

/// The mean; `None` of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
