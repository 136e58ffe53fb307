//! Training steps that a sampler visits.

use crate::options::Options;
use wake_nn::{Error, Result, check_range};

/// Spacing of the sampling steps among the training steps.
///
/// # References
///
/// Lin et al. (2024), "Common Diffusion Noise Schedules and Sample Steps are Flawed", table 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// Multiples of T/n upwards from 0; the noisiest step is left out.
    Leading,
    /// Multiples of T/n downwards from the end; the cleanest steps are left out.
    Trailing,
    /// Even from the first to the last.
    Linspace,
}

impl Spacing {
    const ALL: [Self; 3] = [Self::Leading, Self::Trailing, Self::Linspace];

    /// Name in diffusers.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Leading => "leading",
            Self::Trailing => "trailing",
            Self::Linspace => "linspace",
        }
    }
}

/// Spacing and offset of the visited steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps {
    /// Spacing of the steps.
    pub(super) spacing: Spacing,
    /// Added to steps with leading spacing.
    pub(super) offset: usize,
    /// Number of training steps T.
    pub(super) train: usize,
}

impl Steps {
    /// Reads `timestep_spacing` and `steps_offset`.
    pub(super) fn take(options: &mut Options, train: usize, default: &str) -> Result<Self> {
        let known = Spacing::ALL.map(|spacing| (spacing.name(), spacing));
        let spacing = options.choice("timestep_spacing", default, &known)?;
        let offset = options.usize("steps_offset", 0)?;
        check_range("steps_offset", offset as f64, 0.0, train as f64)?;
        Ok(Self {
            spacing,
            offset,
            train,
        })
    }

    /// Whole training steps, from noisy to clean.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] when `n` is not in 1…T.
    pub(super) fn whole(self, n: usize) -> Result<Vec<i64>> {
        Ok(self
            .fractional(n)?
            .into_iter()
            .map(|t| t.round_ties_even() as i64)
            .collect())
    }

    /// Training steps from noisy to clean; fractions with linspace spacing.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] when `n` is not in 1…T.
    pub(super) fn fractional(self, n: usize) -> Result<Vec<f64>> {
        check_range("steps", n as f64, 1.0, self.train as f64)?;
        Ok(match self.spacing {
            Spacing::Leading => self.leading(n, self.train / n),
            Spacing::Trailing => self.trailing(n),
            Spacing::Linspace => {
                let mut steps = linspace(0.0, (self.train - 1) as f64, n);
                steps.reverse();
                steps
            }
        })
    }

    /// Whole training steps from noisy to clean, for methods that end one step below the last.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] when `n` is not in 1…T, or not below T with leading spacing.
    pub(super) fn whole_and_beyond(self, n: usize) -> Result<Vec<i64>> {
        check_range("steps", n as f64, 1.0, self.train as f64)?;
        let steps = match self.spacing {
            Spacing::Trailing => self.trailing(n),
            Spacing::Leading => {
                check_range("steps", n as f64, 1.0, (self.train - 1) as f64)?;
                let mut steps = self.leading(n + 1, self.train / (n + 1));
                steps.truncate(n);
                steps
            }
            Spacing::Linspace => {
                let mut steps = linspace(0.0, (self.train - 1) as f64, n + 1);
                steps.reverse();
                steps.truncate(n);
                steps
            }
        };
        Ok(steps
            .into_iter()
            .map(|t| t.round_ties_even() as i64)
            .collect())
    }

    fn leading(self, n: usize, ratio: usize) -> Vec<f64> {
        (0..n)
            .rev()
            .map(|i| (i * ratio + self.offset) as f64)
            .collect()
    }

    /// T − i·T/n, rounded, minus 1.
    fn trailing(self, n: usize) -> Vec<f64> {
        let train = self.train as f64;
        let ratio = train / n as f64;
        (0..n)
            .map(|i| (train - i as f64 * ratio).round_ties_even() - 1.0)
            .collect()
    }
}

/// Evenly spaced numbers from `first` to `last`; only the first for n = 1.
pub(super) fn linspace(first: f64, last: f64, n: usize) -> Vec<f64> {
    if n == 1 {
        return vec![first];
    }
    let step = (last - first) / (n - 1) as f64;
    (0..n)
        .map(|i| {
            if i + 1 == n {
                last
            } else {
                first + i as f64 * step
            }
        })
        .collect()
}

/// Returns the error for a number of steps that a method does not support.
pub(super) fn steps_out_of_range(n: usize, min: usize, max: usize) -> Error {
    Error::OutOfRange {
        name: "steps".to_owned(),
        value: n as f64,
        min: min as f64,
        max: max as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(spacing: Spacing, offset: usize) -> Steps {
        Steps {
            spacing,
            offset,
            train: 1000,
        }
    }

    #[test]
    fn known_schedules_of_stable_diffusion() {
        let leading = steps(Spacing::Leading, 1).whole(50).unwrap();
        assert_eq!((leading[0], leading[1], leading[49]), (981, 961, 1));
        let trailing = steps(Spacing::Trailing, 0).whole(10).unwrap();
        assert_eq!((trailing[0], trailing[1], trailing[9]), (999, 899, 99));
        let linspace = steps(Spacing::Linspace, 0).whole_and_beyond(10).unwrap();
        assert_eq!((linspace[0], linspace[1], linspace[9]), (999, 899, 100));
    }

    #[test]
    fn every_number_of_steps_gives_a_falling_schedule_with_the_right_ends() {
        for n in 1..=1000 {
            for spacing in [Spacing::Leading, Spacing::Trailing, Spacing::Linspace] {
                let whole = steps(spacing, 0).whole(n).unwrap();
                assert_eq!(whole.len(), n);
                assert!(
                    whole.windows(2).all(|pair| pair[1] < pair[0]),
                    "{spacing:?} {n}"
                );
                assert!(whole[0] <= 999 && whole[n - 1] >= 0);
                match spacing {
                    Spacing::Leading => assert_eq!(whole[n - 1], 0),
                    Spacing::Trailing => assert_eq!(whole[0], 999),
                    Spacing::Linspace => assert_eq!(whole[n - 1], 0),
                }
            }
        }
    }

    #[test]
    fn schedules_that_go_beyond_fall_except_where_steps_run_out() {
        for n in 1..=1000 {
            for spacing in [Spacing::Leading, Spacing::Trailing, Spacing::Linspace] {
                let Ok(whole) = steps(spacing, 0).whole_and_beyond(n) else {
                    assert!(spacing == Spacing::Leading && n == 1000);
                    continue;
                };
                assert_eq!(whole.len(), n);
                let repeats = whole.windows(2).filter(|pair| pair[1] >= pair[0]).count();
                // With 1001 points on 1000 steps, one step must be visited twice.
                let allowed = usize::from(spacing == Spacing::Linspace && n == 1000);
                assert!(repeats <= allowed, "{spacing:?} {n}: {repeats}");
            }
        }
    }

    #[test]
    fn no_steps_or_more_than_trained_are_refused() {
        for n in [0, 1001, usize::MAX] {
            assert!(steps(Spacing::Leading, 0).whole(n).is_err());
            assert!(steps(Spacing::Linspace, 0).fractional(n).is_err());
            assert!(steps(Spacing::Trailing, 0).whole_and_beyond(n).is_err());
        }
    }
}
