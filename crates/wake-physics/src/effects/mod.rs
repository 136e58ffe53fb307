//! Optional effects, one file each: the numbers of a scene, the reason to leave the effect out, an estimate of what it
//! changes, and its application.
//!
//! An effect is a type with a function `new(&Scene, &Models)` and the trait [`Effect`]; a line of the list below makes it part
//! of every scene.

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

            /// All of them.
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
    /// σ⁰ that no wave modulates: of breaking waves and of noise.
    pub(crate) fn added(&self) -> [f64; 2] {
        [self.breaking.sigma0, self.noise.sigma0]
    }
}
