//! Named recipes of training images.

use std::sync::Arc;

use burn::tensor::Device;
use wake_dataset::{Mixture, Recipe, Simulated, Source};
use wake_ldm::{Sampled, WakeSampler};

use super::clear::Clear;
use super::cluttered::Cluttered;
use super::painted::Painted;

/// Images of a training or an evaluation of the detector.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ImageRecipe {
    /// Painted lines, streaks and blobs, no physics
    Painted,
    /// Simulated: X band over an open sea with at most one ship, at satellite pixels
    Plain,
    /// Simulated: several sensors with their response and noise, and the ship's echo
    Echo,
    /// The same, and the edges of the turbulent wake
    Edge,
    /// The recipe satellites: all that, gusts, swell, slicks, shallow water, several ships
    Satellites,
    /// The recipe detector: the same as it is passed on, with mottle, breaking waves, turns, and wakes that the wind wipes out
    Detector,
    /// The recipe detector, clear wakes more often
    Clear,
    /// The recipe clear under painted land, piers, streaks, fronts, filaments and borders
    Cluttered,
    /// The recipe satellites, drawn by the wake model
    Sampled,
    /// Painted and simulated images (detector) in turn
    #[default]
    Mixed,
    /// Painted and simulated images (cluttered) in turn
    Full,
}

/// Removes gusts, swell, slicks, shallow water and a second ship from the recipe satellites.
const CALM: [&str; 5] = [
    "draw.count = { one_of = [0, 1], weights = [1, 4] }",
    "draw.sea.gust_strength = 0",
    "draw.sea.swell_height = 0",
    "draw.sea.slick_damping = 0",
    "draw.sea.depth = \"infinite\"",
];
/// Removes the edges of turbulent wakes.
const NO_EDGE: [&str; 1] = ["scene.ship.edge = false"];
/// Removes echo, breaking waves, sensors, responses and noise.
const PLAIN: [&str; 5] = [
    "scene.ship.echo = false",
    "scene.sea.breaking = false",
    "draw.together = [{ \"grid.spacing\" = [5, 25], \"radar.incidence\" = [20, 45] }]",
    "draw.radar.noise_floor = -60",
    "draw.radar.looks = [1, 8]",
];

impl ImageRecipe {
    /// All recipes.
    pub const ALL: [Self; 11] = [
        Self::Painted,
        Self::Plain,
        Self::Echo,
        Self::Edge,
        Self::Satellites,
        Self::Detector,
        Self::Clear,
        Self::Cluttered,
        Self::Sampled,
        Self::Mixed,
        Self::Full,
    ];

    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Painted => "painted",
            Self::Plain => "plain",
            Self::Echo => "echo",
            Self::Edge => "edge",
            Self::Satellites => "satellites",
            Self::Detector => "detector",
            Self::Clear => "clear",
            Self::Cluttered => "cluttered",
            Self::Sampled => "sampled",
            Self::Mixed => "mixed",
            Self::Full => "full",
        }
    }

    /// One-line description of its images.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            Self::Painted => "Painted lines, streaks and blobs, no physics",
            Self::Plain => {
                "Simulated: X band over an open sea with at most one ship, at satellite pixels"
            }
            Self::Echo => {
                "Simulated: several sensors with their response and noise, and the ship's echo"
            }
            Self::Edge => "The same, and the edges of the turbulent wake",
            Self::Satellites => {
                "The recipe satellites: all that, gusts, swell, slicks, shallow water, several ships"
            }
            Self::Detector => {
                "The recipe detector: the same as it is passed on, with mottle, breaking waves, turns, and wakes that the wind wipes out"
            }
            Self::Clear => "The recipe detector, clear wakes more often",
            Self::Cluttered => {
                "The recipe clear under painted land, piers, streaks, fronts, filaments and borders"
            }
            Self::Sampled => "The recipe satellites, drawn by the wake model",
            Self::Mixed => "Painted and simulated images (detector) in turn",
            Self::Full => "Painted and simulated images (cluttered) in turn",
        }
    }

    /// Images of `size` rows and columns.
    ///
    /// - `device`: device of the wake model, for the recipe `Sampled`
    ///
    /// # Errors
    ///
    /// Errors of the recipe or the model; the wake model draws only 256 rows and columns.
    pub fn source(
        self,
        seed: u64,
        size: usize,
        device: &Device,
    ) -> wake_dataset::Result<Arc<dyn Source>> {
        let changes: [&[&str]; 3] = match self {
            Self::Plain => [&CALM, &NO_EDGE, &PLAIN],
            Self::Echo => [&CALM, &NO_EDGE, &[]],
            Self::Edge => [&CALM, &[], &[]],
            Self::Satellites => [&[]; 3],
            Self::Detector => {
                return Ok(Arc::new(simulated(Recipe::detector()?, &[], seed, size)?));
            }
            Self::Cluttered => {
                return Ok(Arc::new(Cluttered::new(clear(seed, size)?)));
            }
            Self::Clear => return Ok(Arc::new(clear(seed, size)?)),
            Self::Painted => return Ok(Arc::new(Painted { seed, size })),
            Self::Sampled => {
                let sampler = WakeSampler::pretrained(device)?;
                let scenes = simulated(Recipe::satellites()?, &[], seed, size)?;
                return Ok(Arc::new(Sampled::new(sampler, scenes)?));
            }
            Self::Mixed => return in_turn([Self::Painted, Self::Detector], seed, size, device),
            Self::Full => return in_turn([Self::Painted, Self::Cluttered], seed, size, device),
        };
        let recipe = Recipe::satellites()?;
        Ok(Arc::new(simulated(recipe, &changes.concat(), seed, size)?))
    }

    /// Images of the open sea of the recipe satellites, or of the recipe plain: without ships and slicks.
    ///
    /// # Errors
    ///
    /// Errors of the recipe.
    pub fn open_sea(plain: bool, seed: u64, size: usize) -> wake_dataset::Result<Arc<dyn Source>> {
        let changes: [&[&str]; 3] = match plain {
            true => [&CALM, &NO_EDGE, &PLAIN],
            false => [&[]; 3],
        };
        let empty = ["draw.count = 0", "draw.sea.slick_damping = 0"];
        let changes = [&changes.concat()[..], &empty].concat();
        Ok(Arc::new(simulated(
            Recipe::satellites()?,
            &changes,
            seed,
            size,
        )?))
    }

    /// The sea of the recipe detector without ships, with its gusts, swell and slicks.
    ///
    /// # Errors
    ///
    /// Errors of the recipe.
    pub fn empty_sea(seed: u64, size: usize) -> wake_dataset::Result<Arc<dyn Source>> {
        let recipe = Recipe::detector()?;
        Ok(Arc::new(simulated(
            recipe,
            &["draw.count = 0"],
            seed,
            size,
        )?))
    }
}

/// The recipe detector with clear wakes more often.
fn clear(seed: u64, size: usize) -> wake_dataset::Result<Clear> {
    Ok(Clear::new(simulated(Recipe::detector()?, &[], seed, size)?))
}

/// Images of both recipes in turn.
fn in_turn(
    recipes: [ImageRecipe; 2],
    seed: u64,
    size: usize,
    device: &Device,
) -> wake_dataset::Result<Arc<dyn Source>> {
    let part = |recipe: ImageRecipe| Ok((1.0, recipe.source(seed, size, device)?));
    let parts = recipes.into_iter().map(part);
    Ok(Arc::new(Mixture::new(
        parts.collect::<wake_dataset::Result<_>>()?,
    )?))
}

/// A recipe with changes.
fn simulated(
    recipe: Recipe,
    changes: &[&str],
    seed: u64,
    size: usize,
) -> wake_dataset::Result<Simulated> {
    let pixels = ["rows", "columns"].map(|side| format!("scene.grid.{side} = {size}"));
    let recipe = recipe.with_assignments(&pixels)?;
    Simulated::new(recipe.with_assignments(changes)?, seed)
}
