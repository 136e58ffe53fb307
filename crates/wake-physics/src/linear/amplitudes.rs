//! Root mean square changes of the image by waves and effects, each wave weighted by its modulation.

use super::FirstOrder;
use super::waves::{WaveSample, rms};
use crate::raster::Raster;
use crate::scattering::Sensitivity;
use crate::scattering::modulation::{Modulation, smear};
use crate::waves::Quantity;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2};

/// Points along each side of the image at which an effect that no wave carries is evaluated.
const POINTS: usize = 48;

/// A wave with its modulation of the image.
pub(crate) struct Weighed<'a> {
    wave: &'a WaveSample,
    modulation: Modulation,
    /// Smear without the defocus by acceleration: some pixels are not accelerated.
    sharpest: f64,
}

impl AsRef<WaveSample> for Weighed<'_> {
    fn as_ref(&self) -> &WaveSample {
        self.wave
    }
}

/// The waves of a scene, weighted once for all terms.
pub(crate) struct Amplitudes<'a> {
    pub(crate) first: &'a FirstOrder<'a>,
    /// Relative root mean square change of σ⁰ without tilt average, and without specular return.
    pub(crate) backscatter: [f64; 2],
    pub(crate) sea: Vec<Weighed<'a>>,
    pub(crate) swell: Vec<Weighed<'a>>,
    pub(crate) wake: Vec<Weighed<'a>>,
    /// Standard deviation over mean of the image.
    pub(crate) contrast: f64,
}

impl<'a> Amplitudes<'a> {
    pub(crate) fn new(first: &'a FirstOrder<'a>) -> Self {
        let Sensitivity {
            tilt_average,
            specular,
            ..
        } = first.open.backscatter.sensitivity(&first.resolved);
        Self::with(first, [tilt_average, specular])
    }

    /// - `backscatter`: relative root mean square change of σ⁰ without tilt average, and without specular return
    pub(crate) fn with(first: &'a FirstOrder<'a>, backscatter: [f64; 2]) -> Self {
        let at_rest = first.resolution.at(0.0);
        let weighed = |waves: &'a [WaveSample]| -> Vec<Weighed<'a>> {
            let one = |wave: &'a WaveSample| Weighed {
                wave,
                modulation: first.modulation.at(wave.k, wave.omega),
                sharpest: smear(wave.k[1], at_rest),
            };
            waves.iter().map(one).collect()
        };
        let (sea, wake) = (weighed(&first.open.waves), weighed(&first.wake));
        let swell = weighed(&first.open.swell);
        let contrast = linear(&sea).hypot(linear(&wake)).hypot(backscatter[1]);
        Self {
            first,
            backscatter,
            sea,
            swell,
            wake,
            contrast,
        }
    }

    /// Factor from a relative change of the intensity to the change of its mean and contrast.
    pub(crate) fn with_contrast(&self) -> f64 {
        self.contrast.hypot(1.0)
    }

    /// Width of a point of azimuth resolution ρ on the pixels \[m\].
    pub(crate) fn width(&self, resolution: f64) -> f64 {
        self.first.spacing.hypot(resolution / (SQRT_2 * PI))
    }

    /// Width of a point of the moving sea on the pixels \[m\].
    pub(crate) fn moving_width(&self) -> f64 {
        self.width(self.first.resolution.at(0.0))
    }

    /// Combines a quantity of sea and wake, which are independent.
    pub(crate) fn both(&self, of: impl Fn(&[Weighed<'_>]) -> f64) -> f64 {
        of(&self.sea).hypot(of(&self.wake))
    }

    /// Modulation by waves as imaged, with the second-order tilt and the displacement of all other contrast.
    pub(crate) fn waves(&self, waves: &[Weighed<'_>]) -> f64 {
        let variance = |axis: usize| -> f64 {
            let square = |w: &Weighed<'_>| w.wave.variance * w.wave.k[axis].powi(2);
            waves.iter().map(square).sum()
        };
        let curvature = self.first.open.curvature;
        let tilt = curvature[0] * variance(0) + curvature[1] * variance(1);
        let shift = self.azimuth_shift(waves).hypot(self.range_shift(waves));
        (linear(waves) + tilt) * self.with_contrast() + shift * self.contrast
    }

    /// Modulation of the image by one effect of all waves. Alone it is smeared in azimuth; its product with the image's own
    /// contrast lies at other wavenumbers and is not smeared alike.
    pub(crate) fn part(&self, of: impl Fn(&Modulation) -> Complex64) -> f64 {
        let imaged = |waves: &[Weighed<'_>]| {
            let alone = rms(waves, |w| of(&w.modulation) * w.sharpest);
            alone + self.contrast * rms(waves, |w| of(&w.modulation))
        };
        self.both(imaged)
    }

    /// Change of the azimuth smear of everything imaged.
    pub(crate) fn azimuth_smear(&self) -> f64 {
        let first = self.first;
        let transfer = &first.modulation.transfer;
        let accelerations = |waves: &[Weighed<'_>]| {
            rms(waves, |w| {
                transfer.factor(Quantity::RadialAcceleration, w.wave.k, w.wave.omega)
            })
        };
        let nominal = first.resolution.nominal;
        let moving = first.resolution.at(self.both(accelerations));
        let change = |waves: &[Weighed<'_>]| {
            rms(waves, |w| {
                let lost = smear(w.wave.k[1], nominal) - smear(w.wave.k[1], moving);
                w.modulation.total() * lost
            })
        };
        // A spot of width w spread to w' loses about (1 − w²/w'²)/2 of its height.
        let widths = [nominal, moving].map(|rho| self.width(rho));
        let spots = 0.5 * (1.0 - (widths[0] / widths[1]).powi(2));
        self.both(change) * self.with_contrast() + spots * self.backscatter[1]
    }

    /// Displacements in azimuth over the width of the displaced features.
    pub(crate) fn azimuth_shift(&self, waves: &[Weighed<'_>]) -> f64 {
        let modulation = &self.first.modulation;
        let velocity = rms(waves, |w| {
            modulation.transfer.radial(w.wave.k, w.wave.omega)
        });
        modulation.range_to_velocity * velocity / self.moving_width()
    }

    /// Displacements in range over the width of the displaced features.
    pub(crate) fn range_shift(&self, waves: &[Weighed<'_>]) -> f64 {
        let incidence = self.first.modulation.transfer.incidence;
        rms(waves, |_| Complex64::ONE) / (incidence.tan() * self.first.spacing)
    }
}

/// Modulation by all effects, as imaged.
fn linear(waves: &[Weighed<'_>]) -> f64 {
    rms(waves, |w| w.modulation.total() * w.sharpest)
}

/// Root mean square over the image of a function of the position (x, y), evaluated on a coarse raster.
pub(crate) fn rms_over(image: &Raster, of: impl Fn([f64; 2]) -> f64) -> f64 {
    let [rows, columns] = [image.rows.min(POINTS), image.columns.min(POINTS)];
    let mut sum = 0.0;
    for i in 0..rows {
        for j in 0..columns {
            let (x, y) = (
                image.x(j * image.columns / columns),
                image.y(i * image.rows / rows),
            );
            sum += of([x, y]).powi(2);
        }
    }
    (sum / (rows * columns) as f64).sqrt()
}
