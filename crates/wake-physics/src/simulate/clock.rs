//! Wall-clock time by stage.

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
    /// All of it, without writing files.
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

/// Laps since a start.
pub(crate) struct Clock {
    start: Instant,
    lap: Instant,
}

impl Clock {
    pub(crate) fn start() -> Self {
        let now = Instant::now();
        Self {
            start: now,
            lap: now,
        }
    }

    /// Seconds since the last lap.
    pub(crate) fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = (now - self.lap).as_secs_f64();
        self.lap = now;
        seconds
    }

    /// Seconds since the start.
    pub(crate) fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
