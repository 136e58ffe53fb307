//! The ranges that numbers are scaled by.

/// An open range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// −1…1 for numbers in the range.
    pub(super) fn scaled(self, value: f64) -> f64 {
        2.0 * (value - self.low) / (self.high - self.low) - 1.0
    }

    /// The number that [`scaled`](Self::scaled) made `u` of.
    pub(super) fn unscaled(self, u: f64) -> f64 {
        self.low + 0.5 * (u + 1.0) * (self.high - self.low)
    }
}

/// Ship speed [m/s].
pub(super) const SHIP_SPEED: Range = Range::new(0.0, 16.0);
/// Midship x or y \[m\].
pub(super) const PLACE: Range = Range::new(-512.0, 512.0);
/// Wind speed [m/s].
pub(super) const WIND_SPEED: Range = Range::new(0.0, 12.0);
/// log₁₀ of the fetch \[m\].
pub(super) const LOG_FETCH: Range = Range::new(3.0, 6.0);
/// Incidence angle \[deg\].
pub(super) const INCIDENCE: Range = Range::new(10.0, 40.0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_minus_one_and_one_and_scaling_goes_both_ways() {
        for (value, u) in [(10.0, -1.0), (25.0, 0.0), (40.0, 1.0), (55.0, 2.0)] {
            assert!((INCIDENCE.scaled(value) - u).abs() < 1e-12);
            assert!((INCIDENCE.unscaled(u) - value).abs() < 1e-12);
        }
    }
}
