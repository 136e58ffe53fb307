//! What the image of a scene is on average, over all its seas.

use super::Method;
use super::clock::{Clock, Seconds};
use super::stages::Run;
use crate::error::Result;
use crate::memory;
use crate::plan::{Plan, Situation};
use crate::raster::Field;
use crate::scene::{Scene, Term};
use crate::setup::Setup;

/// Mean over all seas of the intensity before speckle, in the unit of σ⁰, `[rows, columns]` of the image.
///
/// The wake is imaged as in [`simulate`](super::simulate), but every wave of the sea counts as one that a pixel does not
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
/// It needs no random numbers: the scene's seed does not matter.
///
/// # Errors
///
/// As [`simulate`](super::simulate).
///
/// # References
///
/// Hasselmann & Hasselmann (1991), J. Geophys. Res. 96(C6), 10713 (the factor of the
/// sea's displacement in the quasi-linear transform).
pub fn expected_intensity(scene: &Scene) -> Result<Field> {
    scene.validate()?;
    memory::keep_large_blocks();
    let mut setup = Setup::new(scene);
    let situation = Situation::new(scene, &setup);
    let mut plan = Plan::of_situation(scene, &setup, &situation)?;
    if plan.uses(Term::Sea) {
        let (slopes, velocity) = situation.resolved_sea();
        setup.average_over(&slopes, velocity);
        let mut with = vec![Term::TiltAverage, Term::Specular];
        if plan.uses(Term::Bunching) {
            with.push(Term::Coherence);
        }
        plan.change(&with, &[Term::Sea]);
    }
    let run = Run::new(scene, &setup, &plan, Method::Fast);
    let (mut clock, mut seconds) = (Clock::start(), Seconds::default());
    Ok(run.draw(&plan, &mut clock, &mut seconds).intensity)
}
