//! How far around the image things are computed: what moves into it must come from somewhere.

use super::linear::{WaveSample, rms};
use super::situation::Situation;
use crate::setup::Setup;
use crate::waves::Quantity;
use std::f64::consts::{PI, SQRT_2};

/// Standard deviations that the margin holds; beyond lie 7 in a million.
const DEVIATIONS: f64 = 4.5;

/// Mean square of the wake where it is over that in the whole image: the wedge covers about a quarter of it.
const WEDGE: f64 = 4.0;

impl Situation {
    /// Margin in rows and columns. It depends on the scene alone, not on the terms that are used: the same seed
    /// draws the same sea whatever is left out.
    pub(crate) fn margin(&self, setup: &Setup) -> [usize; 2] {
        if self.sea.is_empty() && self.wake.is_empty() {
            return [0, 0];
        }
        let deviation = |quantity| {
            let factor = |w: &WaveSample| self.image.transfer.factor(quantity, w.k, w.omega);
            rms(&self.sea, factor).hypot(WEDGE.sqrt() * rms(&self.wake, factor))
        };
        let radial = |w: &WaveSample| self.image.transfer.radial(w.k, w.omega);
        let velocity = rms(&self.sea, radial).hypot(WEDGE.sqrt() * rms(&self.wake, radial));
        let acceleration = deviation(Quantity::RadialAcceleration);
        let width = self.resolution.at(acceleration) / (SQRT_2 * PI);
        let azimuth = (setup.range_to_velocity * velocity).hypot(width);
        let range = deviation(Quantity::Elevation) / setup.incidence.tan();
        [azimuth, range].map(|d| (DEVIATIONS * d / setup.image.spacing).ceil() as usize + 1)
    }
}
