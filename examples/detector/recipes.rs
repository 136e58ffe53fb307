//! What images show, by name.

use super::paint::Painted;
use super::simulated::Simulated;
use super::source::{Sample, Source};

/// What the images of a training run, or of an evaluation, show.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Recipe {
    /// Painted lines, streaks and blobs, no physics
    Painted,
    /// The simulator's wakes without the edge of the turbulent wake
    Plain,
    /// The simulator's wakes with it
    Simulated,
    /// Painted and simulated images in turn
    Mixed,
}

impl Recipe {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Painted => "painted",
            Self::Plain => "plain",
            Self::Simulated => "simulated",
            Self::Mixed => "mixed",
        }
    }

    /// Images of `size` rows and columns.
    pub(crate) fn source(self, seed: u64, size: usize) -> Box<dyn Source> {
        match self {
            Self::Painted => Box::new(Painted { seed, size }),
            Self::Plain => Box::new(Simulated {
                seed,
                size,
                edge: false,
            }),
            Self::Simulated => Box::new(Simulated {
                seed,
                size,
                edge: true,
            }),
            Self::Mixed => Box::new(Mixed {
                painted: Painted { seed, size },
                simulated: Simulated {
                    seed,
                    size,
                    edge: true,
                },
            }),
        }
    }
}

/// Three painted images, then a simulated one.
struct Mixed {
    painted: Painted,
    simulated: Simulated,
}

impl Source for Mixed {
    fn sample(&self, index: u64) -> Sample {
        match index % 4 {
            3 => self.simulated.sample(index),
            _ => self.painted.sample(index),
        }
    }
}
