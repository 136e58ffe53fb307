//! How far around the image things are computed: what moves into it must come from somewhere.

use super::linear::WaveSample;
use super::situation::Situation;
use crate::setup::Setup;
use crate::waves::Quantity;

/// Standard deviations of the sea that the margin holds; beyond, 7 velocities in a million.
const DEVIATIONS: f64 = 4.5;

/// Crests of the wake over its root mean square: a sum of few waves, √2 each.
const CREST: f64 = 2.5;

impl Situation {
    /// Margin in rows and columns. It depends on the scene alone, not on the terms that are used: the same seed
    /// draws the same sea whatever is left out.
    pub(crate) fn margin(&self, setup: &Setup) -> [usize; 2] {
        let spacing = setup.image.spacing;
        let velocity = self.largest(|w| self.image.transfer.radial(w.k, w.omega).norm_sqr());
        let height = self.largest(|w| {
            self.image.transfer.factor(Quantity::Elevation, w.k, w.omega).norm_sqr()
        });
        let acceleration = self.largest(|w| {
            (w.omega * self.image.transfer.radial(w.k, w.omega)).norm_sqr()
        });
        if self.sea.is_empty() && self.wake.is_empty() {
            return [0, 0];
        }
        let shift = setup.range_to_velocity * velocity;
        // The Gaussian exp(−(πy/ρ)²) is 1e-6 at 1.2 ρ.
        let reach = 1.2 * self.resolution.at(acceleration);
        let rows = (shift + reach) / spacing;
        let columns = height / setup.incidence.tan() / spacing;
        [rows.ceil() as usize + 1, columns.ceil() as usize + 1]
    }

    /// Largest value to be expected of a quantity with this |factor|².
    fn largest(&self, square: impl Fn(&WaveSample) -> f64) -> f64 {
        let sum = |waves: &[WaveSample]| waves.iter().map(|w| w.variance * square(w)).sum::<f64>();
        let wake = CREST * (self.crowding * sum(&self.wake)).sqrt();
        (DEVIATIONS * sum(&self.sea).sqrt()).hypot(wake)
    }
}
