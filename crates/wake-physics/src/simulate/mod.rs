//! Simulation of a scene: the order of the stages is defined in `stages` alone.
//!
//! ```text
//! Scene ─► Prepared { models, effects, open sea } ─► Plan ─► Stages ─► Simulation
//! ```

mod direct;
pub(crate) mod linear_sea;
mod radar;
mod record;
mod simulation;
mod speckling;
mod stages;
mod strips;

pub use direct::{DirectPixels, direct_intensity};
pub use linear_sea::LinearSea;
pub use record::{Accuracy, Reached, Seconds};
pub use simulation::{Method, SarImage, Simulation};
pub use speckling::unit_speckle;

use crate::error::Result;
use crate::fields::Wanted;
use crate::labels::labels;
use crate::plan::Plan;
use crate::prepared::Prepared;
use crate::raster::Field;
use crate::scene::{Scene, Term};
use record::Clock;
use speckling::Speckling;
use stages::{Drawn, Memory, Run, draw};

/// Simulates scenes one after another, reusing memory, FFT plans and the table of σ⁰.
///
/// The first scene costs as much as [`simulate`]. Later scenes of the same size cause no new page faults, and those with
/// the same radar and wind build no new table. No result depends on earlier simulations. A simulator keeps as many buffers
/// as its largest scene needs at once, some 30 fields of the image, until it is dropped. One simulator serves one thread,
/// and uses all threads of the pool itself.
///
/// ```
/// use wake_physics::{Scene, Simulator};
///
/// let mut scene = Scene::default();
/// (scene.grid.rows, scene.grid.columns) = (64, 64);
/// let mut simulator = Simulator::default();
/// for seed in 0..3 {
///     scene.seed = seed;
///     let image = simulator.image(&scene)?; // no field but the image
///     assert_eq!(image.intensity.values.len(), 64 * 64);
/// }
/// # Ok::<(), wake_physics::Error>(())
/// ```
#[derive(Debug, Default)]
pub struct Simulator {
    memory: Memory,
}

impl Simulator {
    /// Simulates a scene: all fields, the image and labels.
    ///
    /// # Errors
    ///
    /// If a value of the scene is out of range, or the grid does not fit in memory.
    pub fn simulate(&mut self, scene: &Scene) -> Result<Simulation> {
        self.simulate_with(scene, Method::Fast)
    }

    /// As [`Self::simulate`], by the given method.
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn simulate_with(&mut self, scene: &Scene, method: Method) -> Result<Simulation> {
        let mut clock = Clock::start();
        scene.validate()?;
        let prepared = Prepared::new(scene);
        let models = &prepared.models;
        let plan = Plan::of(&prepared)?;
        clock.lap(|seconds| &mut seconds.plan);
        let memory = &mut self.memory;
        let run = Run {
            prepared: &prepared,
            plan: &plan,
            method,
            wanted: Wanted::Fields,
        };
        let drawn = draw(run, memory, &mut clock);
        let fields = drawn.fields;
        let mut speckled = memory.workspace.field(&models.pixels.image);
        speckled.values.copy_from_slice(&fields.intensity.values);
        let speckling = Speckling::of(scene, models, drawn.exposure);
        let slc = match plan.uses(Term::Speckle) {
            true => speckling.apply(&mut speckled),
            false => None,
        };
        if let Some(sources) = speckling.into_sources() {
            memory.workspace.give(sources);
        }
        clock.lap(|seconds| &mut seconds.speckle);
        let labels = labels(&prepared);
        clock.lap(|seconds| &mut seconds.labels);
        Ok(Simulation {
            raster: models.pixels.image,
            elevation: fields.elevation,
            slope_x: fields.slope_x,
            slope_y: fields.slope_y,
            velocity_x: fields.velocity_x,
            velocity_y: fields.velocity_y,
            velocity_z: fields.velocity_z,
            radial_velocity: fields.radial_velocity,
            sigma0: fields.sigma0,
            intensity: fields.intensity,
            speckled,
            slc,
            labels,
            accuracy: drawn.accuracy,
            plan,
            seconds: clock.stop(),
            method,
            scene: scene.clone(),
        })
    }

    /// Computes only the image of a scene and its labels, without fields that the image does not need.
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn image(&mut self, scene: &Scene) -> Result<SarImage> {
        scene.validate()?;
        let prepared = Prepared::new(scene);
        let plan = Plan::of(&prepared)?;
        let drawn = self.image_of(&prepared, &plan);
        let speckling = match plan.uses(Term::Speckle) {
            true => Speckling::of(scene, &prepared.models, drawn.exposure),
            false => Speckling::Without,
        };
        Ok(SarImage {
            intensity: drawn.fields.intensity,
            labels: labels(&prepared),
            plan,
            accuracy: drawn.accuracy,
            speckling,
        })
    }

    /// As [`expected_intensity`], reusing memory.
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn expected_intensity(&mut self, scene: &Scene) -> Result<Field> {
        scene.validate()?;
        let mut prepared = Prepared::new(scene);
        let mut plan = Plan::of(&prepared)?;
        if plan.uses(Term::Sea) || plan.uses(Term::Swell) {
            prepared = prepared.over_all_seas();
            plan = plan.over_all_seas();
        }
        Ok(self.image_of(&prepared, &plan).fields.intensity)
    }

    /// Intensity before speckle, with no other fields than the sources of the impulse response.
    fn image_of(&mut self, prepared: &Prepared<'_>, plan: &Plan) -> Drawn {
        let run = Run {
            prepared,
            plan,
            method: Method::Fast,
            wanted: Wanted::Image,
        };
        draw(run, &mut self.memory, &mut Clock::start())
    }

    /// Takes back the buffers of a simulation that is no longer needed, so that the next one of this size allocates none.
    pub fn reclaim(&mut self, mut simulation: Simulation) {
        for field in simulation.fields_mut() {
            self.memory.workspace.give(std::mem::take(field));
        }
    }
}

/// Simulates a scene with the fast methods; for many scenes use [`Simulator`].
///
/// # Errors
///
/// As [`Simulator::simulate`].
pub fn simulate(scene: &Scene) -> Result<Simulation> {
    Simulator::default().simulate(scene)
}

/// As [`simulate`], by the given method.
///
/// # Errors
///
/// As [`Simulator::simulate`].
pub fn simulate_with(scene: &Scene, method: Method) -> Result<Simulation> {
    Simulator::default().simulate_with(scene, method)
}

/// Mean over all seas of the intensity before speckle, in units of σ⁰, `[rows, columns]` of the image.
///
/// The wake is imaged as in [`simulate`], but every wave of the sea is treated as unresolved: its slopes are averaged over
/// in σ⁰, and its velocity widens the response in azimuth,
///
/// ```text
/// E I = Σ E σ⁰ P(y − y' − (R/V) u; ρ'),     ρ'² = ρ² + 2π² (R/V)² var u_sea
/// ```
///
/// with u of the wake alone. This is the mean if the sea's velocity is Gaussian and independent of σ⁰ at the same place,
/// which holds to first order for a tilt and a velocity of different phase. Neglected are the sea's displacement in range,
/// its defocus, and the mutual modulation of sea and wake.
///
/// Gusts, slicks and a ship's point scatterers are determined by the scene's seed; without them the seed does not matter.
///
/// # Errors
///
/// As [`simulate`].
///
/// # References
///
/// Hasselmann & Hasselmann (1991), J. Geophys. Res. 96(C6), 10713 (the factor of the
/// sea's displacement in the quasi-linear transform).
pub fn expected_intensity(scene: &Scene) -> Result<Field> {
    Simulator::default().expected_intensity(scene)
}
