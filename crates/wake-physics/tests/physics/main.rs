//! Whole scenes: hard cases, fast against direct, the plan's estimates, and trends that radar images show.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::float_cmp, reason = "values that must be the same bits")]
#![allow(
    clippy::field_reassign_with_default,
    reason = "a scene is a default with some values changed"
)]

mod any_scene;
mod attack;
mod detectability;
mod echo;
mod expected;
mod hard_cases;
mod methods;
mod numbers;
mod plan;
mod refinement;
mod satellite;
mod ships;
mod simulator;
mod trends;
mod visibility;

use wake_physics::scene::Term;
use wake_physics::wind_sea::{DirectionalSpectrum, WindSea};
use wake_physics::{Scene, Simulation, simulate};

/// The default scene on a small grid, with assignments.
fn small(rows: usize, columns: usize, assignments: &[&str]) -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns) = (rows, columns);
    scene.with_assignments(assignments).expect("a valid scene")
}

fn open_sea(mut scene: Scene) -> Scene {
    scene.ships.clear();
    scene
}

/// The spectrum of the wind sea of a scene.
fn wind_sea(scene: &Scene) -> DirectionalSpectrum {
    let sea = &scene.sea;
    DirectionalSpectrum::new(&WindSea {
        wind_speed: sea.wind_speed,
        wind_toward: sea.wind_toward.to_radians(),
        fetch: sea.fetch,
        depth: sea.depth,
        spectrum: sea.spectrum,
        spreading: sea.spreading,
    })
}

fn run(scene: &Scene) -> Simulation {
    simulate(scene).expect("a valid scene is simulated")
}

/// Every field finite, everything that is a power at least 0.
fn assert_sound(simulation: &Simulation, what: &str) {
    for (name, field) in simulation.named_fields() {
        assert_eq!(
            (field.rows, field.columns, field.values.len()),
            (
                simulation.raster.rows,
                simulation.raster.columns,
                simulation.raster.len()
            ),
            "{what}: {name}"
        );
        assert!(
            field.values.iter().all(|v| v.is_finite()),
            "{what}: {name} is not finite"
        );
    }
    for field in [
        &simulation.sigma0,
        &simulation.intensity,
        &simulation.speckled,
    ] {
        assert!(
            field.values.iter().all(|&v| v >= 0.0),
            "{what}: a negative power"
        );
    }
    let plan = &simulation.plan;
    assert_eq!(plan.terms.len(), Term::ALL.len(), "{what}");
    assert!(
        plan.terms
            .iter()
            .all(|t| t.estimate.is_finite() && t.estimate >= 0.0),
        "{what}: {plan}"
    );
}
