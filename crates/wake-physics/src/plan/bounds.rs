//! What leaving each term out would change: bounds from the linear image.

use super::choose::Effect;
use super::linear::{Modulation, WaveSample, rms, smear};
use super::situation::Situation;
use crate::scene::Term;
use crate::waves::Quantity;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2};

/// Safety factor on root mean squares: one draw of a random sea may be rougher than its mean, bunching gathers
/// what changes, and waves of finite height are not quite linear.
const SAFETY: f64 = 3.0;

/// What the rounding of `f32` fields may change, whatever is left out: a few times 6e-8 of each of several fields.
const ROUNDING: f64 = 1e-6;

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
        let both = |of: &dyn Fn(&[WaveSample]) -> f64| of(&self.sea).hypot(of(&self.wake));
        let effect = match term {
            Term::Sea => self.waves(&self.sea),
            Term::Kelvin => self.waves(&self.wake),
            Term::Turbulent => self.damping * self.image.bragg_share,
            Term::TiltAverage => self.backscatter[0],
            Term::Specular => self.backscatter[1],
            Term::RangeBunching => {
                self.part(|m| m.range_bunching) + both(&|w| self.range_shift(w)) * self.contrast()
            }
            Term::Hydrodynamic => self.part(|m| m.hydrodynamic),
            Term::Bunching => {
                self.part(|m| m.bunching) + both(&|w| self.azimuth_shift(w)) * self.contrast()
            }
            Term::Coherence => self.coherence(),
            // Speckle multiplies: its share of the speckled image is √(1 + cv²)/√looks, with cv below √3.
            Term::Speckle => return 2.0 / self.looks.sqrt(),
        };
        SAFETY * effect + ROUNDING
    }

    /// Modulation by waves as imaged, with the second order of the tilt and the shifts of all else.
    fn waves(&self, waves: &[WaveSample]) -> f64 {
        let linear = rms(waves, |w| self.modulation(w).total() * self.sharpest(w));
        let variance =
            |axis: usize| -> f64 { waves.iter().map(|w| w.variance * w.k[axis].powi(2)).sum() };
        let tilt = self.curvature[0] * variance(0) + self.curvature[1] * variance(1);
        let shift = self.azimuth_shift(waves).hypot(self.range_shift(waves));
        (linear + tilt) * self.contrast().hypot(1.0) + shift * self.contrast()
    }

    /// One effect of all waves, as imaged.
    fn part(&self, of: impl Fn(&Modulation) -> Complex64) -> f64 {
        self.imaged(&self.sea, &of)
            .hypot(self.imaged(&self.wake, &of))
    }

    /// A modulation by waves, in the image: smeared in azimuth where it stands alone; where the image has contrast
    /// of its own, their product is there too, at other wavenumbers and so not smeared alike.
    fn imaged(&self, waves: &[WaveSample], of: impl Fn(&Modulation) -> Complex64) -> f64 {
        let alone = rms(waves, |w| of(&self.modulation(w)) * self.sharpest(w));
        alone + self.contrast() * rms(waves, |w| of(&self.modulation(w)))
    }

    /// The change of the smear of everything that is imaged.
    fn coherence(&self) -> f64 {
        let accelerations = |w: &WaveSample| {
            self.image
                .transfer
                .factor(Quantity::RadialAcceleration, w.k, w.omega)
        };
        let acceleration = rms(&self.sea, accelerations).hypot(rms(&self.wake, accelerations));
        let moving = self.resolution.at(acceleration);
        let change = |w: &WaveSample| {
            let lost = smear(w.k[1], self.resolution.nominal) - smear(w.k[1], moving);
            self.modulation(w).total() * lost
        };
        let modulation = rms(&self.sea, change).hypot(rms(&self.wake, change));
        // A spot of width w spread to w' loses about (1 − w²/w'²)/2 of its height.
        let widths = [self.resolution.nominal, moving].map(|rho| self.width(rho));
        let spots = 0.5 * (1.0 - (widths[0] / widths[1]).powi(2));
        modulation * self.contrast().hypot(1.0) + spots * self.backscatter[1]
    }

    /// Standard deviation over mean of the image: the modulation by all waves, and the glints.
    fn contrast(&self) -> f64 {
        let linear =
            |waves: &[WaveSample]| rms(waves, |w| self.modulation(w).total() * self.sharpest(w));
        linear(&self.sea)
            .hypot(linear(&self.wake))
            .hypot(self.backscatter[1])
    }

    /// Displacements in azimuth over the width of what is displaced.
    fn azimuth_shift(&self, waves: &[WaveSample]) -> f64 {
        let velocity = rms(waves, |w| self.image.transfer.radial(w.k, w.omega));
        self.image.range_to_velocity * velocity / self.width(self.resolution.at(0.0))
    }

    /// Displacements in range over the width of what is displaced.
    fn range_shift(&self, waves: &[WaveSample]) -> f64 {
        rms(waves, |_| Complex64::ONE) / (self.image.transfer.incidence.tan() * self.spacing)
    }

    /// Width of a point of azimuth resolution ρ on the pixels \[m\].
    fn width(&self, resolution: f64) -> f64 {
        self.spacing.hypot(resolution / (SQRT_2 * PI))
    }

    fn modulation(&self, wave: &WaveSample) -> Modulation {
        self.image.modulation(wave.k, wave.omega)
    }

    /// The smear without the defocus of accelerated pixels: some pixels are not accelerated.
    fn sharpest(&self, wave: &WaveSample) -> f64 {
        smear(wave.k[1], self.resolution.at(0.0))
    }
}
