//! Record of a run: seconds by stage, and the accuracy of the numerical methods.

use serde::Serialize;
use std::time::Instant;

/// Wall-clock seconds by stage.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "the stages' names")]
pub struct Seconds {
    pub plan: f64,
    pub sea: f64,
    pub kelvin: f64,
    pub turbulent: f64,
    pub backscatter: f64,
    pub imaging: f64,
    pub speckle: f64,
    pub labels: f64,
    /// Total, without writing files.
    pub total: f64,
}

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ms = |s: f64| 1e3 * s;
        write!(
            f,
            "{:.1} ms: plan {:.1}, sea {:.1}, kelvin {:.1}, turbulent {:.1}, backscatter {:.1}, imaging {:.1}, speckle {:.1}, labels {:.1}",
            ms(self.total),
            ms(self.plan),
            ms(self.sea),
            ms(self.kelvin),
            ms(self.turbulent),
            ms(self.backscatter),
            ms(self.imaging),
            ms(self.speckle),
            ms(self.labels)
        )
    }
}

/// Stopwatch that adds up the time of each stage.
pub(super) struct Clock {
    start: Instant,
    lap: Instant,
    pub(super) seconds: Seconds,
}

impl Clock {
    pub(super) fn start() -> Self {
        let now = Instant::now();
        Self {
            start: now,
            lap: now,
            seconds: Seconds::default(),
        }
    }

    /// Adds the time since the last lap to a stage.
    pub(super) fn lap(&mut self, stage: impl FnOnce(&mut Seconds) -> &mut f64) {
        let now = Instant::now();
        *stage(&mut self.seconds) += (now - self.lap).as_secs_f64();
        self.lap = now;
    }

    /// Discards the time since the last lap.
    pub(super) fn skip(&mut self) {
        self.lap = Instant::now();
    }

    /// Returns the seconds by stage, and in total since the start.
    pub(super) fn stop(mut self) -> Seconds {
        self.seconds.total = self.start.elapsed().as_secs_f64();
        self.seconds
    }
}

/// A demanded error, and the error reached by the method's own bound or estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reached {
    /// Largest error demanded.
    pub asked: f64,
    /// Error stated by the method.
    pub reached: f64,
}

impl Reached {
    /// Whether the method is as accurate as demanded.
    #[must_use]
    pub fn met(&self) -> bool {
        self.reached <= self.asked
    }
}

/// Errors of the numerical methods; absent for fields that were not computed or were computed directly.
///
/// The kernels of the imaging always keep their share of the tolerance; FFTs err by rounding.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Accuracy {
    /// Sum of the wake's waves: bound on the largest error of a field, relative to the field's root mean square.
    pub wake: Option<Reached>,
    /// Table of σ⁰: estimate of its largest error, relative to the mean σ⁰.
    pub table: Option<Reached>,
    /// Nodes of the table along the two principal axes of the unresolved slopes; 0 without a table.
    pub table_nodes: [usize; 2],
}

impl Accuracy {
    /// Combined accuracy of two parts of a scene: the worse of both.
    pub(super) fn and(&self, other: &Self) -> Self {
        let worse = |a: Option<Reached>, b: Option<Reached>| match (a, b) {
            (Some(a), Some(b)) if b.reached <= a.reached => Some(a),
            (a, None) => a,
            (_, b) => b,
        };
        let nodes = [self.table_nodes, other.table_nodes];
        Self {
            wake: worse(self.wake, other.wake),
            table: worse(self.table, other.table),
            table_nodes: [0, 1].map(|axis| nodes[0][axis].max(nodes[1][axis])),
        }
    }

    /// One sentence for every method that missed the demanded error.
    #[must_use]
    pub fn missed(&self) -> Vec<String> {
        [
            ("the waves of the wake", self.wake),
            ("the table of σ⁰", self.table),
        ]
        .into_iter()
        .filter_map(|(what, reached)| {
            let Reached { asked, reached } = reached.filter(|r| !r.met())?;
            Some(format!(
                "the error of {what} is {reached:.1e}, but {asked:.1e} was requested"
            ))
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missed_is_told() {
        let accuracy = |reached| Accuracy {
            table: Some(Reached {
                asked: 1e-3,
                reached,
            }),
            ..Accuracy::default()
        };
        assert!(accuracy(1e-3).missed().is_empty());
        let missed = accuracy(2e-3).missed();
        assert!(
            missed.len() == 1 && missed[0].contains("2.0e-3"),
            "{missed:?}"
        );
        // NaN counts as missed.
        assert_eq!(accuracy(f64::NAN).missed().len(), 1);
    }
}
