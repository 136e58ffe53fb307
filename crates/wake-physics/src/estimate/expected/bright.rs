//! Covariances between the brightness and the velocity of the sea's waves, which set where bright waves are imaged.
//!
//! Slopes s, modulation m and velocity u of the waves at one place are Gaussian. A source has the brightness σ(s̄ + s) e^{m −
//! ½⟨m²⟩}; its mean and the mean of its product with the velocity are
//!
//! ```text
//! E σ e^m   = σ̄(s̄ + ⟨s m⟩)                                   σ̄ the mean over s
//! E u σ e^m = ⟨u m⟩ σ̄ + ⟨u s⟩·∇σ̄, at the same slope
//! ```

use crate::linear::OpenSea;
use crate::models::Models;
use crate::plan::Plan;
use crate::scene::Term;
use crate::waves::Quantity;

/// Covariances at one place of the sea.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct BrightWaves {
    /// ⟨s m⟩ along x and y \[1\].
    pub(super) slope_modulation: [f64; 2],
    /// ⟨u s⟩ along x and y \[m/s\].
    pub(super) velocity_slope: [f64; 2],
    /// ⟨u m⟩ \[m/s\].
    pub(super) velocity_modulation: f64,
}

impl BrightWaves {
    /// Covariances over the resolved waves of a sea, for the terms that a plan uses.
    pub(super) fn new(models: &Models, plan: &Plan) -> Self {
        let mut sum = Self::default();
        let modulating = plan.uses(Term::Hydrodynamic);
        let moving = plan.uses(Term::VelocityBunching);
        let transfer = &models.transfer;
        for wave in &OpenSea::new(models).waves {
            let of = |quantity| transfer.factor(quantity, wave.k, wave.omega);
            let slope = [of(Quantity::SlopeX), of(Quantity::SlopeY)];
            let m = match modulating {
                true => of(Quantity::Hydrodynamic).conj(),
                false => 0.0.into(),
            };
            let u = match moving {
                true => transfer.radial(wave.k, wave.omega),
                false => 0.0.into(),
            };
            for (axis, slope) in slope.into_iter().enumerate() {
                sum.slope_modulation[axis] += wave.variance * (slope * m).re;
                sum.velocity_slope[axis] += wave.variance * (slope * u.conj()).re;
            }
            sum.velocity_modulation += wave.variance * (u * m).re;
        }
        sum
    }
}
