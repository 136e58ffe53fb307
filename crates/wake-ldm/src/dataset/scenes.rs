//! Scene number `index` of a recipe: a pure function.

use super::recipe::{Draw, Recipe};
use crate::error::Result;
use crate::noise::NoiseSource;
use wake_physics::Scene;
use wake_physics::scene::paper_grid;
use wake_text::{PartialScene, Wording};

/// Streams of random numbers beside those of the values that are drawn.
const SEA_STREAM: u32 = 1000;
const WORDING_STREAM: u32 = 1001;

/// Number of scenes in the paper's grid.
const PAPER_SCENES: u64 = 3456;

/// Steps in which the paper's grid is walked: prime, so that every scene comes once, and near the golden section of
/// the grid, so that the first few already differ in every value.
const PAPER_STRIDE: u64 = 2137;

/// The endless data set of a recipe and a seed.
///
/// Pair `index` is a function of (recipe, seed, index) alone: its values come from a counter-based generator (see
/// [`crate::noise`]). Drawn values are rounded as [`PartialScene::of`] rounds them, so that the prompt states the
/// scene exactly.
#[derive(Debug, Clone)]
pub struct Simulated {
    recipe: Recipe,
    seed: u64,
}

impl Simulated {
    /// The data set of a recipe and a seed.
    ///
    /// # Errors
    ///
    /// As [`Recipe::validate`].
    pub fn new(recipe: Recipe, seed: u64) -> Result<Self> {
        recipe.validate()?;
        Ok(Self { recipe, seed })
    }

    /// The recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Scene number `index`.
    pub fn scene(&self, index: u64) -> Scene {
        let (base, random) = (&self.recipe.scene, NoiseSource::new(self.seed));
        let drawn = match &self.recipe.draw {
            Draw::PaperGrid => paper_scene(index, base),
            Draw::Ranges(ranges) => ranges.scene(base, random, index),
        };
        let mut scene = PartialScene::of(&drawn).onto(&drawn).unwrap_or(drawn);
        // 52 bits: every reader of JSON takes them for a whole number.
        scene.seed = (random.uniform(SEA_STREAM, index) * (1u64 << 52) as f64) as u64;
        scene
    }

    /// The words for scene number `index`.
    pub(super) fn wording(&self, index: u64) -> Wording {
        if !self.recipe.paraphrase {
            return Wording::Paper;
        }
        let count = Wording::ALL.len();
        let draw = NoiseSource::new(self.seed).uniform(WORDING_STREAM, index);
        Wording::ALL[(draw * count as f64) as usize % count]
    }
}

/// The values that the paper's grid states, on a base that has all others.
fn paper_scene(index: u64, base: &Scene) -> Scene {
    let at = (index % PAPER_SCENES) * PAPER_STRIDE % PAPER_SCENES;
    let stated = paper_grid().nth(at as usize).unwrap_or_default();
    PartialScene::of(&stated)
        .onto(base)
        .unwrap_or_else(|_| base.clone())
}

#[cfg(test)]
#[path = "scenes_tests.rs"]
mod tests;
