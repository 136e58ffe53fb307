//! Score and information of the likelihood of [`super::likelihood`], as sums over wavenumbers.

use super::matrix::Matrix;
use super::noise::Taper;
use super::torus::{Spectrum, Torus};
use crate::raster::Field;
use rayon::prelude::*;

/// Information of an image about the parameters.
#[derive(Debug, Clone)]
pub(super) struct Information {
    /// Expected slope J of the score.
    pub(super) slope: Matrix,
    /// Variance V of the score.
    pub(super) variance: Matrix,
}

/// Terms of the score and the information.
pub(super) struct Sums<'a> {
    pub(super) torus: &'a Torus,
    pub(super) taper: &'a Taper,
    /// F[w ∂ln μ] over the spread of the noise, for each parameter.
    pub(super) spectra: &'a [Spectrum],
    /// Power of the noise in the window, and its derivative by each parameter that changes it.
    pub(super) power: Vec<f32>,
    pub(super) by: Vec<Option<Vec<f32>>>,
}

impl Sums<'_> {
    /// Σw² divided by the number of wavenumbers.
    pub(super) fn scale(&self) -> f64 {
        self.taper.energy / (self.torus.size * self.torus.size) as f64
    }

    /// The score of each parameter.
    pub(super) fn score(&self, left: &Spectrum) -> Vec<f64> {
        let Self {
            power, by, spectra, ..
        } = self;
        let one = |p: usize| {
            let mut sum = 0.0;
            for n in 0..power.len() {
                let mut term = (spectra[p][n].conj() * left[n]).re / power[n];
                if let Some(slope) = &by[p] {
                    term += 0.5 * slope[n] / power[n] * (left[n].norm_sqr() / power[n] - 1.0);
                }
                sum += self.torus.weight(n) * f64::from(term);
            }
            self.scale() * sum
        };
        (0..spectra.len()).map(one).collect()
    }

    /// Returns J, V with wavenumbers taken as independent, and the part of J that comes from the spectrum.
    pub(super) fn information(&self) -> (Information, Matrix) {
        let Self {
            power, by, spectra, ..
        } = self;
        let (size, scale) = (spectra.len(), self.scale());
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
                if let (Some(a), Some(b)) = (&by[p], &by[q]) {
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
        variance
            .values
            .iter_mut()
            .for_each(|v| *v *= self.taper.peakedness);
        let information = Information {
            slope: of_mean.clone().plus(&of_power),
            variance: variance.plus(&of_mean),
        };
        (information, of_power)
    }

    /// V from the covariance between all pixels.
    pub(super) fn variance(&self, covariance: &Field) -> Matrix {
        let Self {
            torus,
            taper,
            spectra,
            power,
            by,
        } = self;
        let exact: Vec<f32> = torus
            .spectrum(covariance)
            .iter()
            .map(|v| v.re.max(0.0))
            .collect();
        let keep = [taper.weights.rows, taper.weights.columns];
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
                if let (Some(a), Some(b)) = (&by[p], &by[q]) {
                    let mut sum = 0.0;
                    for n in 0..power.len() {
                        sum += torus.weight(n) * f64::from(a[n] / power[n] * (b[n] / power[n]));
                    }
                    out.add(p, q, 0.5 * self.scale() * taper.peakedness * sum);
                }
            }
        }
        out
    }
}
