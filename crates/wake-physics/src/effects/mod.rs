//! Optional effects, one file each: their parameters, the reason to leave them out, an estimate of what they change, and
//! their application.
//!
//! An effect is a type with a function `new(&Scene, &Models)` that implements [`Effect`]; a line in the list below adds it
//! to every scene.

mod breaking;
pub(crate) mod bright_edge;
mod effect;
mod gusts;
mod noise;
mod slicks;
pub(crate) mod subpixel_wake;
mod swell;
pub(crate) mod turbulent;

pub(crate) use effect::{Effect, Site, Weight};

use crate::models::Models;
use crate::scene::Scene;

/// Effects in the order in which they are applied, each in its own stage.
macro_rules! effects {
    ($($name:ident: $type:ty),* $(,)?) => {
        /// The optional effects of a scene.
        #[derive(Debug)]
        pub(crate) struct Effects {
            $(pub(crate) $name: $type),*
        }

        impl Effects {
            pub(crate) fn new(scene: &Scene, models: &Models) -> Self {
                Self { $($name: <$type>::new(scene, models)),* }
            }

            /// All effects, in order.
            pub(crate) fn each(&self) -> impl Iterator<Item = &dyn Effect> {
                [$(&self.$name as &dyn Effect),*].into_iter()
            }
        }
    };
}

effects! {
    swell: swell::SwellWaves,
    subpixel_wake: subpixel_wake::SubpixelWakes,
    slicks: slicks::SlickBands,
    turbulent: turbulent::TurbulentWakes,
    breaking: breaking::BreakingWaves,
    bright_edge: bright_edge::BrightEdges,
    gusts: gusts::GustField,
    noise: noise::Noise,
}

impl Effects {
    /// σ⁰ that no wave modulates: breaking waves and noise.
    pub(crate) fn added(&self) -> [f64; 2] {
        [self.breaking.sigma0, self.noise.sigma0]
    }
}
