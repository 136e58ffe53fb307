//! Scenes that no training set holds.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use wake_physics::Scene;
use wake_physics::scene::Ship;

/// First seed of the scenes: data sets count theirs from small numbers.
const FIRST_SEED: u64 = 0xE7A1_0000_0000_0000;
/// Pixels along a side of a held-out scene: those of the model.
pub const SIZE: usize = 256;
/// Their size \[m\].
const SPACING: f64 = 4.0;

/// The scene of an index: values anywhere in the ranges of the paper's grid, as exact as a prompt states them.
#[must_use]
pub fn held_out(index: u64) -> Scene {
    let seed = FIRST_SEED + (index << 16);
    let mut random = StdRng::seed_from_u64(seed);
    let mut whole = |from: i32, to: i32| f64::from(random.random_range(from..=to));
    let mut scene = Scene {
        seed,
        ..Scene::default()
    };
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (SIZE, SIZE, SPACING);
    scene.ships = vec![Ship {
        speed: 0.1 * whole(60, 120),
        heading: whole(0, 359),
        ..Ship::default()
    }];
    scene.sea.wind_speed = 0.1 * whole(30, 70);
    scene.sea.wind_toward = whole(0, 359);
    scene.sea.fetch = 100.0 * whole(100, 700);
    scene.radar.incidence = whole(16, 32);
    scene
}
