//! How large steps are, over a run.

/// Warm-up, then half a cosine down to a tenth.
///
/// ```text
/// η(s) = peak · (s + 1)/warmup                                       s < warmup
/// η(s) = peak · (0.1 + 0.9 · ½(1 + cos(π (s − warmup)/(steps − warmup))))    after
/// ```
///
/// # References
///
/// Loshchilov & Hutter (2017), "SGDR: Stochastic Gradient Descent with Warm Restarts", Eq. 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// The largest step.
    pub peak: f64,
    /// Steps of the warm-up.
    pub warmup: usize,
    /// Steps of the run; the rate stays at its last value beyond.
    pub steps: usize,
}

impl Rate {
    /// The rate of step number `step`, counted from 0.
    pub fn at(&self, step: usize) -> f64 {
        if step < self.warmup {
            return self.peak * (step + 1) as f64 / self.warmup as f64;
        }
        let length = self.steps.saturating_sub(self.warmup).max(1);
        let part = ((step - self.warmup) as f64 / length as f64).min(1.0);
        self.peak * (0.1 + 0.45 * (1.0 + (std::f64::consts::PI * part).cos()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rises_to_the_peak_and_falls_to_a_tenth() {
        let rate = Rate {
            peak: 2.0,
            warmup: 4,
            steps: 104,
        };
        for (step, expected) in [
            (0, 0.5),
            (3, 2.0),
            (4, 2.0),
            (54, 1.1),
            (104, 0.2),
            (9999, 0.2),
        ] {
            assert!(
                (rate.at(step) - expected).abs() < 1e-12,
                "{step}: {}",
                rate.at(step)
            );
        }
    }
}
