//! An image and how it is looked at: score and information of the likelihood of [`super::likelihood`].

use super::expected::Expected;
use super::matrix::Matrix;
use super::noise::{Noise, Taper};
use super::parameter::{Factors, Parameter};
use super::sea;
use super::texture::Texture;
use super::torus::{Spectrum, Torus};
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;

/// An image and how it is looked at.
#[derive(Debug)]
pub(super) struct Observed {
    pub(super) image: Field,
    pub(super) torus: Torus,
    pub(super) taper: Taper,
    /// True for residuals ln I/μ less their mean, false for I/μ − 1.
    logarithmic: bool,
}

/// The likelihood near a scene.
pub(super) struct Near {
    pub(super) score: Vec<f64>,
    pub(super) log_likelihood: f64,
    pub(super) information: Information,
    /// The part of the slope that comes from the spectrum.
    pub(super) of_power: Matrix,
    /// Σ|R|²/S over its expectation, by ring of wavenumbers, with the number of independent ones.
    pub(super) rings: Vec<[f64; 2]>,
}

/// What an image tells of the parameters.
#[derive(Debug, Clone)]
pub(super) struct Information {
    /// Expected slope J of the score.
    pub(super) slope: Matrix,
    /// Variance V of the score.
    pub(super) variance: Matrix,
}

/// Relative intensity whose logarithm stands for all darker pixels (chosen): of four looks, 8 pixels of a million are darker.
const DARKEST: f32 = 0.03;

/// Largest contrast of sources that makes noise: that of darker pixels makes no more.
const CONTRAST: f32 = 8.0;

/// Rings of wavenumbers that the fit is looked at in.
pub(super) const RINGS: usize = 8;

impl Observed {
    /// - `shown`: weight of the row and column, 0 where the image is to be left out
    pub(super) fn new(image: Field, scene: &Scene, shown: impl Fn(usize, usize) -> f64) -> Self {
        let torus = Torus::new(sea::period(scene));
        Self {
            taper: Taper::new(&torus, [image.rows, image.columns], shown),
            torus,
            image,
            logarithmic: false,
        }
    }

    /// The same image with logarithms as residuals: their noise does not depend on the mean image, so that the likelihood has fewer maxima far from the best.
    pub(super) fn logarithmic(&self) -> Self {
        Self {
            image: self.image.clone(),
            torus: Torus::new(self.torus.size),
            taper: self.taper.clone(),
            logarithmic: true,
        }
    }

    /// Standard deviation of the noise of each pixel over that of open sea: waves that move bright sources beside dark ones make more noise.
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

    /// Values less their mean in the window, seen through it.
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

    /// Mean of the image over that of a mean image, in the window.
    pub(super) fn gain(&self, mean: &Field) -> f64 {
        let pairs = self.image.values.iter().zip(&mean.values);
        let weighed = pairs.zip(&self.taper.weights.values);
        let (above, below) = weighed.fold((0.0, 0.0), |(a, b), ((image, mean), w)| {
            (a + f64::from(w * image), b + f64::from(w * mean))
        });
        above / below
    }

    /// ln L of a noise around a mean image with the brightness of the image.
    pub(super) fn log_likelihood_of(&self, noise: &Noise, mean: &Field) -> f64 {
        let gain = self.gain(mean) as f32;
        let left = self.torus.spectrum(&self.residual(gain, mean));
        let scale = self.taper.energy / (self.torus.size * self.torus.size) as f64;
        self.log_likelihood(
            scale,
            (&left, &self.power(noise)),
            gain,
            mean.values.iter().copied(),
        )
    }

    /// Power of a noise.
    pub(super) fn power(&self, noise: &Noise) -> Vec<f32> {
        let power = self.taper.power(&self.torus, &noise.covariance(1.0));
        let floor = 1e-6 * power.iter().copied().fold(0.0, f32::max);
        power.into_iter().map(|p| p.max(floor)).collect()
    }

    /// Score, information and likelihood.
    pub(super) fn near(
        &self,
        parameters: &[Parameter],
        (factors, expected): (&Factors, &Expected),
        texture: &Texture,
        with_variance: bool,
    ) -> Near {
        let spread = self.spread(&expected.contrast, &texture.noise);
        let spectra = self.spectra(parameters, expected, &spread);
        let mean = (factors, &expected.intensity);
        self.near_by(
            parameters,
            mean,
            (&spectra, &spread),
            texture,
            with_variance,
        )
    }

    /// The same with spectra of a scene nearby.
    ///
    /// - `spectra`: as [`Self::spectra`] gives them for this spread
    pub(super) fn near_by(
        &self,
        parameters: &[Parameter],
        (factors, mean): (&Factors, &Field),
        (spectra, spread): (&[Spectrum], &Field),
        texture: &Texture,
        with_variance: bool,
    ) -> Near {
        let (torus, taper) = (&self.torus, &self.taper);
        let factor = factors.texture;
        let power = taper.power(torus, &texture.noise.covariance(factor));
        let floor = 1e-6 * power.iter().copied().fold(0.0, f32::max);
        let power: Vec<f32> = power.into_iter().map(|p| p.max(floor)).collect();
        let gain = factors.gain as f32;
        let left = torus.spectrum(&self.residual_over(gain, mean, spread));
        let scales = mean.values.iter().zip(&spread.values).map(|(m, s)| m * s);
        let slopes = texture.slopes(parameters, factor);
        let slopes: Vec<Option<Vec<f32>>> = slopes
            .par_iter()
            .map(|s| s.as_ref().map(|s| taper.power(torus, s)))
            .collect();
        let scale = taper.energy / (torus.size * torus.size) as f64;
        let (information, of_power) =
            self.information(scale, &power, (spectra, &slopes), taper.peakedness);
        let mut near = Near {
            score: score(torus, scale, (&left, &power), (spectra, &slopes)),
            log_likelihood: self.log_likelihood(scale, (&left, &power), gain, scales),
            information,
            of_power,
            rings: self.rings(scale, &left, &power),
        };
        if with_variance {
            let covariance = texture.noise.covariance(factor);
            near.information.variance =
                self.variance(scale, (&power, &covariance), (spectra, &slopes));
        }
        near
    }

    /// F[w ∂ln μ] over the spread by each parameter.
    pub(super) fn spectra(
        &self,
        parameters: &[Parameter],
        expected: &Expected,
        spread: &Field,
    ) -> Vec<Spectrum> {
        let directions = self.directions(parameters, expected, spread);
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
        spectra
    }

    /// The same image without a taper.
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

    /// w ∂ln μ over the spread by each parameter.
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
        (left, power): (&Spectrum, &[f32]),
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

    fn rings(&self, scale: f64, left: &Spectrum, power: &[f32]) -> Vec<[f64; 2]> {
        let size = self.torus.size;
        let mut rings = vec![[0.0; 2]; RINGS];
        for n in 0..left.len() {
            let (i, j) = (n / size, n % size);
            let radius = (i as f64).hypot(j.min(size - j) as f64) / (0.5 * size as f64);
            let ring = &mut rings[((radius * RINGS as f64) as usize).min(RINGS - 1)];
            let weight = scale * self.torus.weight(n);
            ring[0] += weight * f64::from(left[n].norm_sqr()) / f64::from(power[n]);
            ring[1] += weight;
        }
        for ring in &mut rings {
            ring[0] /= ring[1].max(1e-9);
        }
        rings
    }

    /// J, and V as if wavenumbers were independent.
    fn information(
        &self,
        scale: f64,
        power: &[f32],
        (spectra, slopes): (&[Spectrum], &[Option<Vec<f32>>]),
        peakedness: f64,
    ) -> (Information, Matrix) {
        let size = spectra.len();
        let [mut of_mean, mut of_power] = [Matrix::zero(size), Matrix::zero(size)];
        let pairs: Vec<[usize; 2]> = (0..size)
            .flat_map(|p| (0..=p).map(move |q| [p, q]))
            .collect();
        let sums: Vec<[f64; 2]> = pairs
            .par_iter()
            .map(|&[p, q]| {
                let mut sums = [0.0; 2];
                for n in 0..power.len() {
                    let product = (spectra[p][n].conj() * spectra[q][n]).re / power[n];
                    sums[0] += self.torus.weight(n) * f64::from(product);
                }
                if let (Some(a), Some(b)) = (&slopes[p], &slopes[q]) {
                    for n in 0..power.len() {
                        let product = a[n] / power[n] * (b[n] / power[n]);
                        sums[1] += 0.5 * self.torus.weight(n) * f64::from(product);
                    }
                }
                sums.map(|s| scale * s)
            })
            .collect();
        for (&[p, q], [mean, power]) in pairs.iter().zip(sums) {
            for [p, q] in if p == q {
                vec![[p, q]]
            } else {
                vec![[p, q], [q, p]]
            } {
                of_mean.add(p, q, mean);
                of_power.add(p, q, power);
            }
        }
        let mut variance = of_power.clone();
        variance.values.iter_mut().for_each(|v| *v *= peakedness);
        let information = Information {
            slope: of_mean.clone().plus(&of_power),
            variance: variance.plus(&of_mean),
        };
        (information, of_power)
    }

    /// V with the covariance between all pixels.
    fn variance(
        &self,
        scale: f64,
        (power, covariance): (&[f32], &Field),
        (spectra, slopes): (&[Spectrum], &[Option<Vec<f32>>]),
    ) -> Matrix {
        let (torus, taper) = (&self.torus, &self.taper);
        let exact: Vec<f32> = torus
            .spectrum(covariance)
            .iter()
            .map(|v| v.re.max(0.0))
            .collect();
        let keep = [self.image.rows, self.image.columns];
        let whitened: Vec<Spectrum> = spectra
            .iter()
            .map(|s| {
                s.iter()
                    .zip(power)
                    .map(|(d, p)| d * (taper.energy as f32 / p))
                    .collect()
            })
            .collect();
        // v = w F⁻¹[D/S], so that g = Σ v r.
        let mut seen: Vec<Spectrum> = Vec::new();
        for pair in whitened.chunks(2) {
            let second = pair.get(1).unwrap_or(&pair[0]);
            let fields = torus.fields([&pair[0], second], keep);
            let [a, b] = fields.map(|f| taper.of(f.values.into_iter()));
            let [a, b] = torus.spectra([&a, &b]);
            seen.push(a);
            if pair.len() > 1 {
                seen.push(b);
            }
        }
        let count = spectra.len();
        let area = (torus.size * torus.size) as f64;
        let mut out = Matrix::zero(count);
        for p in 0..count {
            for q in 0..count {
                let mut sum = 0.0;
                for n in 0..exact.len() {
                    let product = (seen[p][n].conj() * seen[q][n]).re * exact[n];
                    sum += torus.weight(n) * f64::from(product);
                }
                out.add(p, q, sum / area);
                if let (Some(a), Some(b)) = (&slopes[p], &slopes[q]) {
                    let mut sum = 0.0;
                    for n in 0..power.len() {
                        sum += torus.weight(n) * f64::from(a[n] / power[n] * (b[n] / power[n]));
                    }
                    out.add(p, q, 0.5 * scale * taper.peakedness * sum);
                }
            }
        }
        out
    }
}

/// A field over another one.
fn over(mut field: Field, by: &Field) -> Field {
    let pixels = field.values.iter_mut().zip(&by.values);
    pixels.for_each(|(value, by)| *value /= by);
    field
}

/// The score of each parameter.
fn score(
    torus: &Torus,
    scale: f64,
    (left, power): (&Spectrum, &[f32]),
    (spectra, slopes): (&[Spectrum], &[Option<Vec<f32>>]),
) -> Vec<f64> {
    let one = |p: usize| {
        let mut sum = 0.0;
        for n in 0..power.len() {
            let mut term = (spectra[p][n].conj() * left[n]).re / power[n];
            if let Some(slope) = &slopes[p] {
                term += 0.5 * slope[n] / power[n] * (left[n].norm_sqr() / power[n] - 1.0);
            }
            sum += torus.weight(n) * f64::from(term);
        }
        scale * sum
    };
    (0..spectra.len()).map(one).collect()
}

#[cfg(test)]
#[allow(clippy::print_stdout, reason = "what was measured is printed")]
#[path = "observed_tests.rs"]
mod tests;
