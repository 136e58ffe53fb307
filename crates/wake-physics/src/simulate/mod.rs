//! From a scene to a SAR image: `stages` alone knows the order of the stages.
//!
//! ```text
//! Scene ─► Models ─► Survey ─► Plan ─► Stages ─► Simulation
//! ```
//!
//! `Models` are the formulas with the scene's numbers, `Survey` is what linear theory tells of them, `Plan` what is to be
//! computed, `Stages` computes it.

mod accuracy;
mod clock;
mod direct;
mod linear_sea;
mod prepared;
mod radar;
mod simulation;
mod speckling;
mod stages;
mod strip;
mod strips;
mod surface_fields;

pub use accuracy::{Accuracy, Reached};
pub use clock::Seconds;
pub use direct::{DirectPixels, direct_intensity};
pub use linear_sea::LinearSea;
pub use simulation::{Method, SarImage, Simulation};
pub use speckling::unit_speckle;

use crate::error::Result;
use crate::models::Models;
use crate::plan::Plan;
use crate::raster::Field;
use crate::scattering::BackscatterTable;
use crate::scene::{Scene, Term};
use crate::workspace::Workspace;
use clock::Clock;
use prepared::Prepared;
use speckling::{Exposure, Speckling};
use surface_fields::Wanted;

/// Simulates scene after scene with the memory, the FFT plans and the table of σ⁰ of the last.
///
/// The first scene costs what [`simulate`] costs; later ones of its size fault no new pages, and those of the same radar
/// and wind make no new table. No result depends on what was simulated before. A simulator keeps as many blocks as its
/// largest scene needs at once, some 30 fields of the image; it is freed with it. One simulator serves one thread, and
/// uses all threads of the pool itself.
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
    workspace: Workspace,
    /// The last table of σ⁰.
    table: Option<BackscatterTable>,
}

impl Simulator {
    /// Simulates a scene: all fields, the image, labels.
    ///
    /// # Errors
    ///
    /// A value of the scene out of its range, or a grid that does not fit in memory.
    pub fn simulate(&mut self, scene: &Scene) -> Result<Simulation> {
        self.simulate_with(scene, Method::Fast)
    }

    /// [`Self::simulate`] by a method.
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn simulate_with(&mut self, scene: &Scene, method: Method) -> Result<Simulation> {
        let mut clock = Clock::start();
        let mut seconds = Seconds::default();
        let prepared = Prepared::new(scene)?;
        let Prepared { models, plan, .. } = &prepared;
        seconds.plan = clock.lap();
        let what = (scene, models, plan);
        let how = (method, Wanted::Fields);
        let (drawn, exposure) = self.draw(what, how, (&mut clock, &mut seconds));
        let mut speckled = self.workspace.field(&models.image);
        speckled.values.copy_from_slice(&drawn.intensity.values);
        let speckling = Speckling::of(scene, models, exposure);
        let slc = if plan.uses(Term::Speckle) {
            speckling.apply(&mut speckled)
        } else {
            None
        };
        let sources = speckling.into_sources();
        sources
            .into_iter()
            .for_each(|field| self.workspace.give(field));
        seconds.speckle = clock.lap();
        let labels = prepared.labels();
        let fields = drawn.fields;
        let mut simulation = Simulation {
            raster: prepared.models.image,
            elevation: fields.elevation,
            slope_x: fields.slope_x,
            slope_y: fields.slope_y,
            velocity_x: fields.velocity_x,
            velocity_y: fields.velocity_y,
            velocity_z: fields.velocity_z,
            radial_velocity: drawn.radial_velocity,
            sigma0: drawn.sigma0,
            intensity: drawn.intensity,
            speckled,
            slc,
            labels,
            accuracy: drawn.accuracy,
            plan: prepared.plan,
            seconds,
            method,
            scene: scene.clone(),
        };
        simulation.seconds.labels = clock.lap();
        simulation.seconds.total = clock.total();
        Ok(simulation)
    }

    /// The image of a scene and its labels: fields that the image does not need are not computed.
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn image(&mut self, scene: &Scene) -> Result<SarImage> {
        let prepared = Prepared::new(scene)?;
        let Prepared { models, plan, .. } = &prepared;
        let (intensity, exposure, accuracy) = self.intensity(scene, models, plan);
        let speckling = match plan.uses(Term::Speckle) {
            true => Speckling::of(scene, models, exposure),
            false => Speckling::Without,
        };
        Ok(SarImage {
            intensity,
            labels: prepared.labels(),
            plan: prepared.plan,
            accuracy,
            speckling,
        })
    }

    /// As [`expected_intensity`].
    ///
    /// # Errors
    ///
    /// As [`Self::simulate`].
    pub fn expected_intensity(&mut self, scene: &Scene) -> Result<Field> {
        let Prepared {
            mut models,
            survey,
            mut plan,
            ..
        } = Prepared::new(scene)?;
        if plan.uses(Term::Sea) || plan.uses(Term::Swell) {
            let (slopes, velocity) = survey.resolved_sea();
            models.average_over(&slopes, velocity);
            plan = plan.over_all_seas();
        }
        Ok(self.intensity(scene, &models, &plan).0)
    }

    /// The intensity before speckle, and no other field but what the impulse response looks at.
    fn intensity(
        &mut self,
        scene: &Scene,
        models: &Models,
        plan: &Plan,
    ) -> (Field, Option<Exposure>, Accuracy) {
        let mut clock = (Clock::start(), Seconds::default());
        let how = (Method::Fast, Wanted::Image);
        let clock = (&mut clock.0, &mut clock.1);
        let (drawn, exposure) = self.draw((scene, models, plan), how, clock);
        (drawn.intensity, exposure, drawn.accuracy)
    }

    /// Takes the blocks of a simulation back that is no longer needed: the next one of this size asks the system for
    /// none.
    pub fn reclaim(&mut self, simulation: Simulation) {
        let s = simulation;
        let surface = [
            s.elevation,
            s.slope_x,
            s.slope_y,
            s.velocity_x,
            s.velocity_y,
        ];
        let more = [
            s.velocity_z,
            s.radial_velocity,
            s.sigma0,
            s.intensity,
            s.speckled,
        ];
        let fields = surface.into_iter().chain(more);
        fields.for_each(|field| self.workspace.give(field));
    }
}

/// Simulates a scene with the fast methods; for many scenes see [`Simulator`].
///
/// # Errors
///
/// As [`Simulator::simulate`].
pub fn simulate(scene: &Scene) -> Result<Simulation> {
    Simulator::default().simulate(scene)
}

/// [`simulate`] by a method.
///
/// # Errors
///
/// As [`Simulator::simulate`].
pub fn simulate_with(scene: &Scene, method: Method) -> Result<Simulation> {
    Simulator::default().simulate_with(scene, method)
}

/// Mean over all seas of the intensity before speckle, in the unit of σ⁰, `[rows, columns]` of the image.
///
/// The wake is imaged as in [`simulate`], but every wave of the sea counts as one that a pixel does not
/// resolve: its slopes are averaged over in σ⁰, and its velocity widens the response in azimuth,
///
/// ```text
/// E I = Σ E σ⁰ P(y − y' − (R/V) u; ρ'),     ρ'² = ρ² + 2π² (R/V)² var u_sea
/// ```
///
/// with u of the wake alone. This is the mean where the sea's velocity is Gaussian and independent of the σ⁰ of the
/// same place, which a tilt and a velocity of different phase are to first order. Neglected: the sea's displacement in
/// range, its defocus, and how it and the wake modulate each other.
///
/// Gusts, slicks and the points of a ship that echo are those that the scene's seed draws; without them the seed does not
/// matter.
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
