//! Held-out scenes, which no training set contains.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use wake_physics::Scene;
use wake_physics::scene::Ship;

/// First seed of the scenes: data sets count theirs from small numbers.
const FIRST_SEED: u64 = 0xE7A1_0000_0000_0000;

/// Scenes whose values lie anywhere in the ranges of the paper's grid, rounded as in prompts.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// All values that no prompt states, including the grid; only the first ship is used.
    pub base: Scene,
}

impl Default for HeldOut {
    /// Scenes of the wake model: 256 × 256 pixels of 4 m.
    fn default() -> Self {
        let mut base = Scene::default();
        (base.grid.rows, base.grid.columns, base.grid.spacing) = (256, 256, 4.0);
        Self { base }
    }
}

impl HeldOut {
    /// Scene number `index`.
    #[must_use]
    pub fn scene(&self, index: u64) -> Scene {
        let seed = FIRST_SEED + (index << 16);
        let mut random = StdRng::seed_from_u64(seed);
        let mut whole = |from: i32, to: i32| f64::from(random.random_range(from..=to));
        let mut scene = Scene {
            seed,
            ..self.base.clone()
        };
        scene.ships = vec![Ship {
            speed: 0.1 * whole(60, 120),
            heading: whole(0, 359),
            ..self.base.ships.first().cloned().unwrap_or_default()
        }];
        scene.sea.wind_speed = 0.1 * whole(30, 70);
        scene.sea.wind_toward = whole(0, 359);
        scene.sea.fetch = 100.0 * whole(100, 700);
        scene.radar.incidence = whole(16, 32);
        scene
    }

    /// `count` scenes from the first index.
    #[must_use]
    pub fn scenes(&self, first: u64, count: usize) -> Vec<Scene> {
        let indices = first..first + count as u64;
        indices.map(|index| self.scene(index)).collect()
    }
}
