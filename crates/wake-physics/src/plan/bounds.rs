//! What leaving each term out would change: bounds from the linear image.

use super::choose::Effect;
use super::linear::{Modulation, WaveSample, rms, smear};
use super::situation::Situation;
use crate::scene::Term;
use crate::waves::Quantity;
use num_complex::Complex64;

/// Safety factor on root mean squares: one draw of a random sea may be rougher than its mean, bunching gathers
/// what changes, and waves of finite height are not quite linear.
const SAFETY: f64 = 3.0;

impl Situation {
    /// One effect a term, in the order of the data flow.
    pub(crate) fn effects(&self) -> Vec<Effect> {
        let effect = |&term: &Term| Effect {
            term,
            bound: self.bound(term),
            absent: self
                .absent
                .iter()
                .find(|(absent, _)| *absent == term)
                .map(|(_, why)| *why),
        };
        Term::ALL.iter().map(effect).collect()
    }

    fn bound(&self, term: Term) -> f64 {
        match term {
            Term::Sea => SAFETY * self.waves(&self.sea),
            Term::Kelvin => SAFETY * self.waves(&self.wake),
            Term::Turbulent => SAFETY * self.damping * self.image.bragg_share,
            Term::TiltAverage => SAFETY * self.backscatter[0],
            Term::Specular => SAFETY * self.backscatter[1],
            Term::RangeBunching => SAFETY * self.part(|m| m.range_bunching),
            Term::Hydrodynamic => SAFETY * self.part(|m| m.hydrodynamic),
            Term::Bunching => SAFETY * self.part(|m| m.bunching),
            Term::Coherence => SAFETY * self.coherence(),
            // Speckle multiplies: its share of the speckled image is √(1 + cv²)/√looks, with cv below √3.
            Term::Speckle => 2.0 / self.looks.sqrt(),
        }
    }

    /// Modulation by waves as imaged, with the second order of the tilt.
    fn waves(&self, waves: &[WaveSample]) -> f64 {
        let linear = rms(waves, |w| self.modulation(w).total() * self.sharpest(w));
        let variance = |axis: usize| -> f64 {
            waves.iter().map(|w| w.variance * w.k[axis].powi(2)).sum()
        };
        linear + self.curvature[0] * variance(0) + self.curvature[1] * variance(1)
    }

    /// One effect of all waves, as imaged.
    fn part(&self, of: impl Fn(&Modulation) -> Complex64) -> f64 {
        let one = |waves: &[WaveSample]| {
            rms(waves, |w| of(&self.modulation(w)) * self.sharpest(w))
        };
        one(&self.sea).hypot(one(&self.wake))
    }

    /// The change of the smear of everything that is imaged.
    fn coherence(&self) -> f64 {
        let accelerations =
            |w: &WaveSample| self.image.transfer.factor(Quantity::RadialAcceleration, w.k, w.omega);
        let acceleration = rms(&self.sea, accelerations).hypot(rms(&self.wake, accelerations));
        let moving = self.resolution.at(acceleration);
        let change = |w: &WaveSample| {
            let lost = smear(w.k[1], self.resolution.nominal) - smear(w.k[1], moving);
            self.modulation(w).total() * lost
        };
        rms(&self.sea, change).hypot(rms(&self.wake, change))
    }

    fn modulation(&self, wave: &WaveSample) -> Modulation {
        self.image.modulation(wave.k, wave.omega)
    }

    /// The smear without the defocus of accelerated pixels: some pixels are not accelerated.
    fn sharpest(&self, wave: &WaveSample) -> f64 {
        smear(wave.k[1], self.resolution.at(0.0))
    }
}
