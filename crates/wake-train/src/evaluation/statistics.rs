//! Medians, percentiles and shares.

use serde::Serialize;

/// Errors of one quantity over many scenes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AbsoluteErrors {
    /// Number of scenes.
    pub scenes: usize,
    /// Share of them in which the value is measurable.
    pub measurable: f64,
    /// Median absolute error of the measurable ones; `None` if there are none.
    pub median: Option<f64>,
    /// 90th percentile of the absolute error.
    pub percentile_90: Option<f64>,
}

impl AbsoluteErrors {
    /// Statistics of absolute errors, `None` where not measurable.
    #[must_use]
    pub fn of(errors: &[Option<f64>]) -> Self {
        let measured: Vec<f64> = errors.iter().flatten().copied().collect();
        Self {
            scenes: errors.len(),
            measurable: measured.len() as f64 / errors.len().max(1) as f64,
            median: quantile(&measured, 0.5),
            percentile_90: quantile(&measured, 0.9),
        }
    }
}

/// A quantile by linear interpolation; `None` without values.
///
/// - `q`: 0, the smallest value, to 1, the largest
#[must_use]
pub(super) fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = q.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (
        sorted[place.floor() as usize],
        sorted[place.ceil() as usize],
    );
    Some(below + (place - place.floor()) * (above - below))
}

/// The mean; `None` without values.
#[must_use]
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_values_beside_them() {
        let values = [4.0, 1.0, 3.0, 2.0];
        for (q, expected) in [(0.0, 1.0), (0.5, 2.5), (0.9, 3.7), (1.0, 4.0)] {
            let found = quantile(&values, q);
            assert!(found.is_some_and(|v| (v - expected).abs() < 1e-12), "{q}");
        }
        assert_eq!((quantile(&[], 0.5), mean(&[])), (None, None));
    }

    #[test]
    fn what_is_not_measurable_lowers_the_share_alone() {
        let errors = AbsoluteErrors::of(&[Some(1.0), None, Some(3.0), None]);
        assert_eq!((errors.scenes, errors.median), (4, Some(2.0)));
        assert!((errors.measurable - 0.5).abs() < 1e-12);
    }
}
