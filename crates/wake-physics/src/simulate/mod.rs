//! From a scene to a SAR image: `stages` alone knows the order of the stages.
//!
//! It calls the method of each stage, `label` says what is where, `clock` times, `report` writes what came out.

use crate::error::Result;
use crate::labels::Labels;
use crate::memory;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::setup::Setup;
use clock::Clock;
pub use clock::Seconds;
pub use expected::expected_intensity;
pub use label::labels_of;
pub use linear_sea::LinearSea;
use serde::Serialize;
use stages::Run;

mod clock;
mod expected;
mod label;
mod linear_sea;
mod report;
mod stages;

/// How fields are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// FFT, non-uniform FFT, table, scattered kernels.
    Fast,
    /// The oracles: harmonic sums over the same waves, σ⁰ by quadrature at each pixel, the dense bunching
    /// integral. Cost grows with waves × pixels.
    Direct,
}

/// Everything a simulation makes. Fields are `[rows, columns]` of the image.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Places of the pixels.
    pub raster: Raster,
    /// Elevation ζ \[m\].
    pub elevation: Field,
    /// Slope ∂ζ/∂x \[1\].
    pub slope_x: Field,
    /// Slope ∂ζ/∂y \[1\].
    pub slope_y: Field,
    /// Velocity of the water along x [m/s].
    pub velocity_x: Field,
    /// Velocity of the water along y [m/s].
    pub velocity_y: Field,
    /// Velocity of the water upward [m/s].
    pub velocity_z: Field,
    /// Velocity toward the radar [m/s].
    pub radial_velocity: Field,
    /// Cross-section σ⁰ per unit area, linear.
    pub sigma0: Field,
    /// Image intensity before speckle, linear, in the unit of σ⁰.
    pub intensity: Field,
    /// Image intensity with speckle.
    pub speckled: Field,
    /// Where ship and wake are.
    pub labels: Labels,
    /// What was computed, and bounds on what was not.
    pub plan: Plan,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// How fields were computed.
    pub method: Method,
    /// The scene.
    pub scene: Scene,
}

/// Simulates a scene with the fast methods.
///
/// # Errors
///
/// A value of the scene out of its range, or a grid that does not fit in memory.
pub fn simulate(scene: &Scene) -> Result<Simulation> {
    simulate_with(scene, Method::Fast)
}

/// Simulates a scene.
///
/// # Errors
///
/// As [`simulate`].
pub fn simulate_with(scene: &Scene, method: Method) -> Result<Simulation> {
    scene.validate()?;
    memory::keep_large_blocks();
    let mut clock = Clock::start();
    let mut seconds = Seconds::default();
    let setup = Setup::new(scene);
    let mut plan = Plan::of(scene, &setup)?;
    let run = Run::new(scene, &setup, &plan, method);
    seconds.plan = clock.lap();
    let drawn = run.draw(&plan, &mut clock, &mut seconds);
    [plan.sizes.sea_lattice, plan.sizes.table] = drawn.sizes;
    let speckled = run.speckle(&plan, &drawn.intensity);
    seconds.speckle = clock.lap();
    let labels = labels_of(scene);
    let crop = |field| run.crop(field);
    let (radial_velocity, sigma0) = (crop(drawn.radial_velocity), crop(drawn.sigma0));
    let fields = drawn.fields;
    let [elevation, slope_x, slope_y] =
        [fields.elevation, fields.slope_x, fields.slope_y].map(crop);
    let [velocity_x, velocity_y, velocity_z] =
        [fields.velocity_x, fields.velocity_y, fields.velocity_z].map(crop);
    seconds.labels = clock.lap();
    seconds.total = clock.total();
    Ok(Simulation {
        raster: setup.image,
        elevation,
        slope_x,
        slope_y,
        velocity_x,
        velocity_y,
        velocity_z,
        radial_velocity,
        sigma0,
        intensity: drawn.intensity,
        speckled,
        labels,
        plan,
        seconds,
        method,
        scene: scene.clone(),
    })
}
