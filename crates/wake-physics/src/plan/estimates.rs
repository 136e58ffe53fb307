//! What leaving each term out would change: estimates by the modulation transfer functions.

use super::terms::Effect;
use crate::modulation::{Modulation, WaveSample, rms, smear};
use crate::scene::Term;
use crate::survey::Survey;
use crate::waves::Quantity;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2};

/// An estimate is this many times the linear root mean square: one draw of a random sea may be rougher than its mean,
/// bunching gathers what changes, and waves of finite height are not quite linear. No proof makes it a bound.
const SAFETY: f64 = 3.0;

/// What the rounding of `f32` fields may change, whatever is left out: a few times 6e-8 of each of several fields.
const ROUNDING: f64 = 1e-6;

/// A wave with what it does to the image.
struct Weighed<'a> {
    wave: &'a WaveSample,
    modulation: Modulation,
    /// Smear without the defocus of accelerated pixels: some pixels are not accelerated.
    sharpest: f64,
}

impl AsRef<WaveSample> for Weighed<'_> {
    fn as_ref(&self) -> &WaveSample {
        self.wave
    }
}

/// The waves of a survey, weighed once for all terms.
struct Estimates<'a> {
    survey: &'a Survey,
    /// Relative root mean square change of σ⁰ without tilt average, and without specular return.
    backscatter: [f64; 2],
    sea: Vec<Weighed<'a>>,
    swell: Vec<Weighed<'a>>,
    wake: Vec<Weighed<'a>>,
    /// Standard deviation over mean of the image.
    contrast: f64,
}

/// One effect a term, in the order of the data flow.
///
/// - `backscatter`: relative root mean square change of σ⁰ without tilt average, and without specular return
pub(super) fn effects(survey: &Survey, backscatter: [f64; 2]) -> Vec<Effect> {
    let estimates = Estimates::new(survey, backscatter);
    let absent = |term| survey.absent.iter().find(|(absent, _)| *absent == term);
    let effect = |&term: &Term| Effect {
        term,
        estimate: estimates.of(term),
        absent: absent(term).map(|(_, why)| *why),
    };
    Term::ALL.iter().map(effect).collect()
}

impl<'a> Estimates<'a> {
    fn new(survey: &'a Survey, backscatter: [f64; 2]) -> Self {
        let at_rest = survey.resolution.at(0.0);
        let weighed = |waves: &'a [WaveSample]| -> Vec<Weighed<'a>> {
            let one = |wave: &'a WaveSample| Weighed {
                wave,
                modulation: survey.modulation.at(wave.k, wave.omega),
                sharpest: smear(wave.k[1], at_rest),
            };
            waves.iter().map(one).collect()
        };
        let (sea, wake) = (weighed(&survey.sea), weighed(&survey.wake));
        let swell = weighed(&survey.swell);
        let contrast = linear(&sea).hypot(linear(&wake)).hypot(backscatter[1]);
        Self {
            survey,
            backscatter,
            sea,
            swell,
            wake,
            contrast,
        }
    }

    fn of(&self, term: Term) -> f64 {
        let effect = match term {
            Term::Sea => self.waves(&self.sea),
            Term::Swell => self.waves(&self.swell),
            Term::BrightEdge => {
                let [change, velocity] = self.survey.edge;
                let shift = self.survey.modulation.range_to_velocity * velocity;
                change + shift / self.width(self.survey.resolution.at(0.0)) * self.contrast
            }
            Term::Slicks => self.survey.slicks * self.survey.modulation.bragg_share,
            Term::Breaking => self.survey.added[0],
            Term::Gusts => self.survey.gusts * self.contrast.hypot(1.0),
            Term::Noise => self.survey.added[1],
            // What it smears away is at most all contrast; the speckle of neighbours is what it adds.
            Term::ImpulseResponse => return self.contrast.max(self.survey.response),
            Term::Kelvin => self.waves(&self.wake),
            Term::SubpixelWake => {
                let [change, wider] = self.survey.subpixel_wake;
                change * self.contrast.hypot(1.0) + wider * self.contrast
            }
            Term::Turbulent => self.survey.damping * self.survey.modulation.bragg_share,
            Term::TiltAverage => self.backscatter[0],
            Term::Specular => self.backscatter[1].max(self.survey.rough_specular),
            Term::RangeBunching => {
                self.part(|m| m.range_bunching) + self.both(|w| self.range_shift(w)) * self.contrast
            }
            Term::Hydrodynamic => self.part(|m| m.hydrodynamic),
            Term::VelocityBunching => {
                self.part(|m| m.bunching) + self.both(|w| self.azimuth_shift(w)) * self.contrast
            }
            Term::AzimuthSmear => self.coherence(),
            // Speckle multiplies: its share of the speckled image is √(1 + cv²)/√looks, with cv below √3.
            Term::Speckle => return 2.0 / self.survey.looks.sqrt(),
        };
        SAFETY * effect + ROUNDING
    }

    /// Width of a point of azimuth resolution ρ on the pixels \[m\].
    fn width(&self, resolution: f64) -> f64 {
        self.survey.spacing.hypot(resolution / (SQRT_2 * PI))
    }

    fn both(&self, of: impl Fn(&[Weighed<'_>]) -> f64) -> f64 {
        of(&self.sea).hypot(of(&self.wake))
    }

    /// Modulation by waves as imaged, with the second order of the tilt and the shifts of all else.
    fn waves(&self, waves: &[Weighed<'_>]) -> f64 {
        let variance = |axis: usize| -> f64 {
            let square = |w: &Weighed<'_>| w.wave.variance * w.wave.k[axis].powi(2);
            waves.iter().map(square).sum()
        };
        let curvature = self.survey.curvature;
        let tilt = curvature[0] * variance(0) + curvature[1] * variance(1);
        let shift = self.azimuth_shift(waves).hypot(self.range_shift(waves));
        (linear(waves) + tilt) * self.contrast.hypot(1.0) + shift * self.contrast
    }

    /// One effect of all waves, in the image: smeared in azimuth where it stands alone; where the image has
    /// contrast of its own, their product is there too, at other wavenumbers and so not smeared alike.
    fn part(&self, of: impl Fn(&Modulation) -> Complex64) -> f64 {
        let imaged = |waves: &[Weighed<'_>]| {
            let alone = rms(waves, |w| of(&w.modulation) * w.sharpest);
            alone + self.contrast * rms(waves, |w| of(&w.modulation))
        };
        self.both(imaged)
    }

    /// The change of the smear of everything that is imaged.
    fn coherence(&self) -> f64 {
        let survey = self.survey;
        let transfer = &survey.modulation.transfer;
        let accelerations = |waves: &[Weighed<'_>]| {
            rms(waves, |w| {
                transfer.factor(Quantity::RadialAcceleration, w.wave.k, w.wave.omega)
            })
        };
        let nominal = survey.resolution.nominal;
        let moving = survey.resolution.at(self.both(accelerations));
        let change = |waves: &[Weighed<'_>]| {
            rms(waves, |w| {
                let lost = smear(w.wave.k[1], nominal) - smear(w.wave.k[1], moving);
                w.modulation.total() * lost
            })
        };
        // A spot of width w spread to w' loses about (1 − w²/w'²)/2 of its height.
        let widths = [nominal, moving].map(|rho| self.width(rho));
        let spots = 0.5 * (1.0 - (widths[0] / widths[1]).powi(2));
        self.both(change) * self.contrast.hypot(1.0) + spots * self.backscatter[1]
    }

    /// Displacements in azimuth over the width of what is displaced.
    fn azimuth_shift(&self, waves: &[Weighed<'_>]) -> f64 {
        let modulation = &self.survey.modulation;
        let velocity = rms(waves, |w| {
            modulation.transfer.radial(w.wave.k, w.wave.omega)
        });
        let width = self.width(self.survey.resolution.at(0.0));
        modulation.range_to_velocity * velocity / width
    }

    /// Displacements in range over the width of what is displaced.
    fn range_shift(&self, waves: &[Weighed<'_>]) -> f64 {
        let incidence = self.survey.modulation.transfer.incidence;
        rms(waves, |_| Complex64::ONE) / (incidence.tan() * self.survey.spacing)
    }
}

/// Modulation by all effects, as imaged.
fn linear(waves: &[Weighed<'_>]) -> f64 {
    rms(waves, |w| w.modulation.total() * w.sharpest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modulation::ModulationTransfer;
    use crate::sar::AzimuthResolution;
    use crate::scattering::SlopeCovariance;
    use crate::waves::Transfer;

    const BACKSCATTER: [f64; 2] = [0.21, 0.3];

    /// One wave of the sea along range and one of the wake along azimuth, both of ω = 1/s, tan θ = 3/4, and numbers of
    /// their own for all else.
    fn survey() -> Survey {
        let wave = |k, variance| WaveSample {
            k,
            omega: 1.0,
            variance,
        };
        Survey {
            sea: vec![wave([0.1, 0.0], 0.04)],
            swell: vec![wave([0.1, 0.0], 0.01)],
            wake: vec![wave([0.0, 0.2], 1e-4)],
            modulation: ModulationTransfer {
                transfer: Transfer {
                    depth: f64::INFINITY,
                    incidence: 0.75f64.atan(),
                    relaxation_rate: 1.0,
                    action_slope: 4.0,
                },
                tilt: [5.0, 0.0],
                bragg_share: 0.5,
                range_to_velocity: 50.0,
            },
            curvature: [3.0, 7.0],
            resolution: AzimuthResolution {
                nominal: 10.0 * PI,
                coherence: 0.0,
                defocus: 50.0 * PI,
            },
            damping: 0.11,
            edge: [0.12, 0.5],
            subpixel_wake: [0.13, 0.14],
            rough_specular: 0.2,
            slicks: 0.15,
            gusts: 0.16,
            added: [0.17, 0.18],
            response: 0.19,
            mean: [1.0, 1.0],
            resolved: SlopeCovariance::NONE,
            spacing: 4.0,
            looks: 25.0,
            absent: vec![(Term::Kelvin, "there is no ship")],
        }
    }

    /// Worked out by hand. Modulation of the sea's wave: tilt 0.5 i, range bunching 0.4/3 i, hydrodynamic
    /// 0.5 · (−0.4 i)/(1 − i) = 0.1 − 0.1 i; of the wake's: bunching −0.2 i · 50 · (−0.8 i) = −8, smeared to 1/e.
    /// Heights 0.2 and 0.01 m.
    #[test]
    fn estimates_are_those_worked_out_by_hand() {
        let one_over_e = (-1f64).exp();
        let sea = 0.2 * (0.01 + (0.5 + 0.4 / 3.0 - 0.1f64).powi(2)).sqrt();
        let wake = 0.01 * 8.0 * one_over_e;
        // Contrast of the image: both and what the specular return changes.
        let c = (sea * sea + wake * wake + 0.09).sqrt();
        let product = (1.0 + c * c).sqrt();
        // Width of a point: 4 m of the pixel and 10/√2 of the resolution.
        let width = 66f64.sqrt();
        // The rms acceleration toward the radar is √0.040064: the resolution's square grows by 2500 π² of it.
        let acceleration: f64 = 0.04 + 0.64e-4;
        let moving = 1.0 + 25.0 * acceleration;
        let wider = 16.0 + 50.0 * moving;
        let shifts = |height: f64, velocity: f64| [50.0 * velocity / width, height / 3.0];
        let [sea_shift, wake_shift] = [shifts(0.2, 0.2), shifts(0.01, 0.008)];
        let both = |axis: usize| sea_shift[axis].hypot(wake_shift[axis]) * c;
        let of_sea = (sea + 3.0 * 0.04 * 0.01) * product + sea_shift[0].hypot(sea_shift[1]) * c;
        let of_wake = (wake + 7.0 * 1e-4 * 0.04) * product + wake_shift[0].hypot(wake_shift[1]) * c;
        // Half as high: a quarter of the second order.
        let of_swell =
            (0.5 * sea + 3.0 * 0.01 * 0.01) * product + 0.5 * sea_shift[0].hypot(sea_shift[1]) * c;
        let survey = survey();
        for effect in effects(&survey, BACKSCATTER) {
            let expected = match effect.term {
                Term::Sea => of_sea,
                Term::Swell => of_swell,
                Term::Kelvin => of_wake,
                Term::BrightEdge => 0.12 + 50.0 * 0.5 / width * c,
                Term::Slicks => 0.15 * 0.5,
                Term::Breaking => 0.17,
                Term::Gusts => 0.16 * product,
                Term::Noise => 0.18,
                Term::SubpixelWake => 0.13 * product + 0.14 * c,
                Term::Turbulent => 0.11 * 0.5,
                Term::TiltAverage => 0.21,
                Term::Specular => 0.3,
                Term::RangeBunching => 0.2 * 0.4 / 3.0 * (1.0 + c) + both(1),
                Term::Hydrodynamic => 0.2 * 0.02f64.sqrt() * (1.0 + c),
                Term::VelocityBunching => 0.01 * 8.0 * (one_over_e + c) + both(0),
                Term::AzimuthSmear => {
                    let lost = 0.01 * 8.0 * (one_over_e - (-moving).exp());
                    lost * product + 0.5 * (1.0 - 66.0 / wider) * 0.3
                }
                // These stand alone, and are no linear estimates.
                Term::ImpulseResponse => (c - 1e-6) / 3.0,
                Term::Speckle => (0.4 - 1e-6) / 3.0,
            };
            let expected = 3.0 * expected + 1e-6;
            assert!(
                (effect.estimate / expected - 1.0).abs() < 1e-12,
                "{:?}: {} {expected}",
                effect.term,
                effect.estimate
            );
        }
        // Where a ship's waves roughen the sea, its specular return is more than that of the sea alone.
        let mut smooth = survey;
        smooth.rough_specular = 0.4;
        let estimates = Estimates::new(&smooth, BACKSCATTER);
        assert!((estimates.of(Term::Specular) - (3.0 * 0.4 + 1e-6)).abs() < 1e-12);
        // Speckle that neighbours share may be more than the contrast.
        smooth.response = 0.9;
        let estimates = Estimates::new(&smooth, BACKSCATTER);
        assert!((estimates.of(Term::ImpulseResponse) - 0.9).abs() < 1e-15);
    }

    /// Every term once, and what is absent says so of itself alone.
    #[test]
    fn what_is_absent_is_told_of_its_own_term() {
        let effects = effects(&survey(), BACKSCATTER);
        let terms: Vec<Term> = effects.iter().map(|e| e.term).collect();
        assert_eq!(terms, Term::ALL);
        for effect in effects {
            let reason = (effect.term == Term::Kelvin).then_some("there is no ship");
            assert_eq!(effect.absent, reason, "{:?}", effect.term);
        }
    }
}
