//! An image with its window: the likelihood of [`super::likelihood`] with its score and information.

use super::expected::Expected;
use super::information::{Information, Sums};
use super::matrix::Matrix;
use super::noise::{Noise, Taper};
use super::parameter::{Factors, Parameter};
use super::sea;
use super::texture::Texture;
use super::torus::{Spectrum, Torus};
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;

/// An image with its window and its kind of residual.
#[derive(Debug)]
pub(super) struct Observed {
    pub(super) image: Field,
    pub(super) torus: Torus,
    pub(super) taper: Taper,
    /// True for residuals ln I/μ minus their mean, false for I/μ − 1.
    logarithmic: bool,
}

/// The likelihood near a scene.
pub(super) struct Near {
    pub(super) score: Vec<f64>,
    pub(super) log_likelihood: f64,
    pub(super) information: Information,
    /// Part of the slope that comes from the spectrum.
    pub(super) of_power: Matrix,
    /// Σ|R|²/S over its expectation in rings of wavenumbers, and the number of independent wavenumbers in each ring.
    pub(super) rings: Vec<[f64; 2]>,
}

/// F[w ∂ln μ] over the spread of the noise for each parameter, and that spread.
#[derive(Default)]
pub(super) struct Directions {
    spectra: Vec<Spectrum>,
    spread: Field,
}

/// Smallest relative intensity whose logarithm is used (chosen); darker pixels are set to it. With four looks, 8 pixels in a
/// million are darker.
const DARKEST: f32 = 0.03;

/// Largest contrast of sources that adds noise; the higher contrast of darker pixels is clipped to it.
const CONTRAST: f32 = 8.0;

/// Least power of noise relative to its mean (chosen). Speckle that fills more than a pixel leaves almost no power at short
/// wavelengths, where an image has the errors of its rounding to whole numbers instead.
const LEAST_POWER: f32 = 1e-2;

/// Number of rings of wavenumbers in which the fit is checked.
pub(super) const RINGS: usize = 8;

impl Observed {
    /// - `shown`: weight by row and column, 0 where the image is masked
    pub(super) fn new(image: Field, scene: &Scene, shown: impl Fn(usize, usize) -> f64) -> Self {
        let torus = Torus::new(sea::period(scene));
        Self {
            taper: Taper::new(&torus, [image.rows, image.columns], shown),
            torus,
            image,
            logarithmic: false,
        }
    }

    /// The same image with logarithms as residuals. Their noise does not depend on the mean image, so the likelihood has fewer
    /// maxima far from the best.
    pub(super) fn logarithmic(&self) -> Self {
        Self {
            image: self.image.clone(),
            torus: Torus::new(self.torus.size),
            taper: self.taper.clone(),
            logarithmic: true,
        }
    }

    /// Standard deviation of each pixel's noise relative to open sea. It is larger where waves move bright sources next to dark
    /// ones.
    pub(super) fn spread(&self, contrast: &Field, noise: &Noise) -> Field {
        let share = match self.logarithmic {
            true => 0.0,
            false => noise.share_of_sea() as f32,
        };
        let of = |contrast: &f32| (1.0 + share * contrast.min(CONTRAST)).sqrt();
        Field {
            values: contrast.values.iter().map(of).collect(),
            ..*contrast
        }
    }

    /// Residual of a mean image over the spread of its noise, in the window.
    pub(super) fn residual_over(&self, gain: f32, mean: &Field, spread: &Field) -> Field {
        over(self.residual(gain, mean), spread)
    }

    /// Residual of a mean image in the window.
    pub(super) fn residual(&self, gain: f32, mean: &Field) -> Field {
        let pairs = self.image.values.iter().zip(&mean.values);
        if self.logarithmic {
            let logarithms = pairs.map(|(i, m)| (i / (gain * m)).max(DARKEST).ln());
            return self.without_mean(logarithms.collect());
        }
        self.taper.of(pairs.map(|(i, m)| i / (gain * m) - 1.0))
    }

    /// Values minus their mean in the window, times the window.
    fn without_mean(&self, values: Vec<f32>) -> Field {
        let weights = &self.taper.weights.values;
        let (mut sum, mut total) = (0.0, 0.0);
        for (value, weight) in values.iter().zip(weights) {
            sum += f64::from(weight * value);
            total += f64::from(*weight);
        }
        let mean = (sum / total) as f32;
        self.taper.of(values.into_iter().map(|v| v - mean))
    }

    /// Ratio of the image's mean to the mean of a mean image, in the window.
    pub(super) fn gain(&self, mean: &Field) -> f64 {
        let pairs = self.image.values.iter().zip(&mean.values);
        let weighed = pairs.zip(&self.taper.weights.values);
        let (above, below) = weighed.fold((0.0, 0.0), |(a, b), ((image, mean), w)| {
            (a + f64::from(w * image), b + f64::from(w * mean))
        });
        above / below
    }

    /// Log-likelihood of noise around a mean image that is scaled to the brightness of the image.
    pub(super) fn log_likelihood_of(&self, noise: &Noise, mean: &Field) -> f64 {
        let gain = self.gain(mean) as f32;
        let left = self.torus.spectrum(&self.residual(gain, mean));
        self.log_likelihood(
            self.scale(),
            &left,
            &self.power(&noise.covariance(1.0)),
            gain,
            mean.values.iter().copied(),
        )
    }

    /// Power of noise with a given covariance, in the window.
    pub(super) fn power(&self, covariance: &Field) -> Vec<f32> {
        let power = self.taper.power(&self.torus, covariance);
        let least = self.least_power(covariance.values[0]);
        power.into_iter().map(|p| p.max(least)).collect()
    }

    /// Least power of noise with a given variance, in the window.
    fn least_power(&self, variance: f32) -> f32 {
        LEAST_POWER * variance * self.taper.energy as f32
    }

    /// Score, information and likelihood.
    pub(super) fn near(
        &self,
        parameters: &[Parameter],
        factors: &Factors,
        expected: &Expected,
        texture: &Texture,
        with_variance: bool,
    ) -> Near {
        let directions = self.towards(parameters, expected, &texture.noise);
        let mean = &expected.intensity;
        let near = self.near_by(parameters, factors, mean, &directions, texture);
        match with_variance {
            true => self.with_variance(near, parameters, factors, &directions, texture),
            false => near,
        }
    }

    /// As [`Self::near`], with the directions of a nearby scene.
    pub(super) fn near_by(
        &self,
        parameters: &[Parameter],
        factors: &Factors,
        mean: &Field,
        directions: &Directions,
        texture: &Texture,
    ) -> Near {
        let spread = &directions.spread;
        let sums = self.sums(parameters, factors, directions, texture);
        let gain = factors.gain as f32;
        let left = self.torus.spectrum(&self.residual_over(gain, mean, spread));
        let scales = mean.values.iter().zip(&spread.values).map(|(m, s)| m * s);
        let (information, of_power) = sums.information();
        let scale = sums.scale();
        let least = self.least_power(texture.noise.variance(factors.texture));
        Near {
            score: sums.score(&left),
            log_likelihood: self.log_likelihood(scale, &left, &sums.power, gain, scales),
            information,
            of_power,
            rings: self.rings(scale, &left, &sums.power, least),
        }
    }

    /// Adds the variance of the score from the covariance between all pixels.
    pub(super) fn with_variance(
        &self,
        mut near: Near,
        parameters: &[Parameter],
        factors: &Factors,
        directions: &Directions,
        texture: &Texture,
    ) -> Near {
        let sums = self.sums(parameters, factors, directions, texture);
        near.information.variance = sums.variance(&texture.noise.covariance(factors.texture));
        near
    }

    /// Terms of the score and the information.
    fn sums<'a>(
        &'a self,
        parameters: &[Parameter],
        factors: &Factors,
        directions: &'a Directions,
        texture: &Texture,
    ) -> Sums<'a> {
        let (torus, taper) = (&self.torus, &self.taper);
        let slopes = texture.slopes(parameters, factors.texture);
        Sums {
            torus,
            taper,
            spectra: &directions.spectra,
            power: self.power(&texture.noise.covariance(factors.texture)),
            by: slopes
                .par_iter()
                .map(|s| s.as_ref().map(|s| taper.power(torus, s)))
                .collect(),
        }
    }

    /// Log-likelihood alone, with the directions of a nearby scene.
    pub(super) fn log_likelihood_by(
        &self,
        factors: &Factors,
        mean: &Field,
        directions: &Directions,
        noise: &Noise,
    ) -> f64 {
        let spread = &directions.spread;
        let power = self.power(&noise.covariance(factors.texture));
        let gain = factors.gain as f32;
        let left = self.torus.spectrum(&self.residual_over(gain, mean, spread));
        let scales = mean.values.iter().zip(&spread.values).map(|(m, s)| m * s);
        self.log_likelihood(self.scale(), &left, &power, gain, scales)
    }

    /// Σw² divided by the number of wavenumbers.
    fn scale(&self) -> f64 {
        self.taper.energy / (self.torus.size * self.torus.size) as f64
    }

    /// Directions of the parameters, with the noise of a sea.
    pub(super) fn towards(
        &self,
        parameters: &[Parameter],
        expected: &Expected,
        noise: &Noise,
    ) -> Directions {
        let spread = self.spread(&expected.contrast, noise);
        let directions = self.directions(parameters, expected, &spread);
        let mut spectra = Vec::new();
        for pair in directions.chunks(2) {
            let [first, last] = [&pair[0], &pair[pair.len() - 1]];
            spectra.extend(
                self.torus
                    .spectra([first, last])
                    .into_iter()
                    .take(pair.len()),
            );
        }
        Directions { spectra, spread }
    }

    /// The same image with a window of 1.
    pub(super) fn whole(&self) -> Self {
        let torus = Torus::new(self.torus.size);
        let size = [self.image.rows, self.image.columns];
        Self {
            taper: Taper::flat(&torus, size),
            torus,
            image: self.image.clone(),
            logarithmic: self.logarithmic,
        }
    }

    /// w ∂ln μ over the spread, for each parameter.
    pub(super) fn directions(
        &self,
        parameters: &[Parameter],
        expected: &Expected,
        spread: &Field,
    ) -> Vec<Field> {
        let of = |p: &Parameter| over(self.direction(*p, expected), spread);
        parameters.iter().map(of).collect()
    }

    /// w ∂ln μ by a parameter.
    fn direction(&self, parameter: Parameter, expected: &Expected) -> Field {
        if parameter == Parameter::Gain {
            return self.taper.weights.clone();
        }
        let mut sum = Field {
            values: vec![0.0; self.image.values.len()],
            ..self.image
        };
        for value in parameter.values() {
            let slope = expected.derivatives.iter().find(|(v, _)| v == value);
            if let Some((_, slope)) = slope {
                let pixels = slope.values.iter().zip(&expected.intensity.values);
                for (sum, (slope, mean)) in sum.values.iter_mut().zip(pixels) {
                    *sum += slope / mean;
                }
            }
        }
        match self.logarithmic {
            true => self.without_mean(sum.values),
            false => self.taper.of(sum.values.into_iter()),
        }
    }

    fn log_likelihood(
        &self,
        scale: f64,
        left: &Spectrum,
        power: &[f32],
        gain: f32,
        scales: impl Iterator<Item = f32>,
    ) -> f64 {
        let term = |n: usize| {
            let power = f64::from(power[n]);
            self.torus.weight(n)
                * (f64::from(left[n].norm_sqr()) / power + (power / self.taper.energy).ln())
        };
        let spectrum: f64 = (0..left.len()).map(term).sum();
        let weighed = scales.zip(&self.taper.weights.values);
        let jacobian: f64 = match self.logarithmic {
            true => 0.0,
            false => weighed
                .map(|(m, w)| f64::from(w * w) * f64::from(gain * m).ln())
                .sum(),
        };
        -0.5 * scale * spectrum - jacobian
    }

    /// - `least`: power at and below which wavenumbers do not count; a ring without others fits
    fn rings(&self, scale: f64, left: &Spectrum, power: &[f32], least: f32) -> Vec<[f64; 2]> {
        let size = self.torus.size;
        let mut rings = vec![[0.0; 2]; RINGS];
        for n in (0..left.len()).filter(|&n| power[n] > least) {
            let (i, j) = (n / size, n % size);
            let radius = (i as f64).hypot(j.min(size - j) as f64) / (0.5 * size as f64);
            let ring = &mut rings[((radius * RINGS as f64) as usize).min(RINGS - 1)];
            let weight = scale * self.torus.weight(n);
            ring[0] += weight * f64::from(left[n].norm_sqr()) / f64::from(power[n]);
            ring[1] += weight;
        }
        for ring in &mut rings {
            ring[0] = match ring[1] > 0.0 {
                true => ring[0] / ring[1],
                false => 1.0,
            };
        }
        rings
    }
}

/// Quotient of two fields.
fn over(mut field: Field, by: &Field) -> Field {
    let pixels = field.values.iter_mut().zip(&by.values);
    pixels.for_each(|(value, by)| *value /= by);
    field
}

#[cfg(test)]
#[allow(clippy::print_stdout, reason = "what was measured is printed")]
#[path = "observed_tests.rs"]
mod tests;
