//! Cramér–Rao bound: the smallest standard deviations of unbiased estimates from an image of a scene.

use super::expected::ExpectedImage;
use super::matrix::Matrix;
use super::observed::Observed;
use super::parameter::{Factors, Parameter};
use super::priors::{Priors, values_of};
use super::texture::Texture;
use super::torus::Torus;
use crate::error::Result;
use crate::raster::Field;
use crate::scene::Scene;
use serde::Serialize;

/// Smallest standard deviations of unbiased estimates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bound {
    /// Standard deviation of each parameter; infinite where the image does not determine it.
    pub deviations: Vec<(Parameter, f64)>,
    /// Squared relative change of the image due to the wake over the noise, summed over wavenumbers: the squared output of a
    /// matched filter.
    pub wake_to_noise: f64,
}

impl Bound {
    /// Smallest standard deviation of one parameter.
    #[must_use]
    pub fn of(&self, parameter: Parameter) -> f64 {
        let found = self.deviations.iter().find(|(p, _)| *p == parameter);
        found.map_or(f64::INFINITY, |(_, deviation)| *deviation)
    }
}

/// Cramér–Rao bound on parameters of a scene, for an image with its grid, radar and looks.
///
/// The information in the mean image is that of a Gaussian field with the covariance between all pixels; in the texture's
/// spectrum, wavenumbers are taken as independent. The priors of the nuisance values are included. Values that are not among the
/// parameters are taken as known.
///
/// # Errors
///
/// As in [`ExpectedImage::new`].
pub fn bound(scene: &Scene, parameters: &[Parameter], priors: &Priors) -> Result<Bound> {
    let image = ExpectedImage::new(scene, &values_of(parameters))?;
    let expected = image.at(scene)?;
    let texture = Texture::new(scene, parameters)?;
    let observed = Observed::new(expected.intensity.clone(), scene, |_, _| 1.0);
    let near = observed.near(parameters, &Factors::default(), &expected, &texture, false);
    let untapered = Observed::whole(&observed);
    let spread = untapered.spread(&expected.contrast, &texture.noise);
    let directions = untapered.directions(parameters, &expected, &spread);
    let mean = of_mean(&observed.torus, &texture.noise.covariance(1.0), &directions);
    let information = mean.plus(&near.of_power).plus(&priors.matrix(parameters));
    let covariance = information.inverse();
    let deviation = |n: usize| {
        covariance
            .as_ref()
            .map_or(f64::INFINITY, |c| c.at(n, n).max(0.0).sqrt())
    };
    let mut open = scene.clone();
    open.ships.clear();
    let without = ExpectedImage::new(&open, &[])?.intensity(&open)?;
    let wake = observed.residual_over(1.0, &without, &spread);
    let spectrum = observed.torus.spectrum(&wake);
    let power = observed.power(&texture.noise.covariance(1.0));
    let area = (observed.torus.size * observed.torus.size) as f64;
    let sum: f64 = (0..spectrum.len())
        .map(|n| observed.torus.weight(n) * f64::from(spectrum[n].norm_sqr() / power[n]))
        .sum();
    Ok(Bound {
        deviations: parameters
            .iter()
            .enumerate()
            .map(|(n, p)| (*p, deviation(n)))
            .collect(),
        wake_to_noise: observed.taper.energy * sum / area,
    })
}

/// Largest number of conjugate-gradient steps, and relative residual at which they end.
const STEPS: usize = 60;
const RESIDUAL: f64 = 1e-4;

/// Fisher information Dᵀ C⁻¹ D about parameters of the mean of a Gaussian field, C the covariance between all pixels, by
/// conjugate gradients preconditioned with the inverse on the torus.
fn of_mean(torus: &Torus, covariance: &Field, directions: &[Field]) -> Matrix {
    let power: Vec<f32> = torus.spectrum(covariance).iter().map(|v| v.re).collect();
    let floor = 1e-4 * power.iter().copied().fold(0.0, f32::max);
    let filtered = |field: &Field, weight: &dyn Fn(f32) -> f32| {
        let mut spectrum = torus.spectrum(field);
        for (value, &power) in spectrum.iter_mut().zip(&power) {
            *value *= weight(power.max(floor));
        }
        let [field, _] = torus.fields([&spectrum, &spectrum], [field.rows, field.columns]);
        field
    };
    let solve = |right: &Field| {
        let mut x = Field {
            values: vec![0.0; right.values.len()],
            ..*right
        };
        let mut rest = right.clone();
        let mut z = filtered(&rest, &|p| 1.0 / p);
        let mut direction = z.clone();
        let mut product = inner(&rest, &z);
        let first = product;
        for _ in 0..STEPS {
            if product <= RESIDUAL * RESIDUAL * first {
                break;
            }
            let image = filtered(&direction, &|p| p);
            let step = product / inner(&direction, &image);
            add(&mut x, step, &direction);
            add(&mut rest, -step, &image);
            z = filtered(&rest, &|p| 1.0 / p);
            let next = inner(&rest, &z);
            let part = (next / product) as f32;
            for (d, z) in direction.values.iter_mut().zip(&z.values) {
                *d = z + part * *d;
            }
            product = next;
        }
        x
    };
    let solved: Vec<Field> = directions.iter().map(solve).collect();
    let mut out = Matrix::zero(directions.len());
    for (p, a) in directions.iter().enumerate() {
        for (q, b) in solved.iter().enumerate() {
            out.add(
                p,
                q,
                0.5 * (inner(a, b) + inner(&directions[q], &solved[p])),
            );
        }
    }
    out
}

fn inner(a: &Field, b: &Field) -> f64 {
    let pairs = a.values.iter().zip(&b.values);
    pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

fn add(to: &mut Field, factor: f64, from: &Field) {
    let pairs = to.values.iter_mut().zip(&from.values);
    pairs.for_each(|(to, from)| *to += factor as f32 * from);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The information in correlated noise equals the solution by elimination.
    #[test]
    fn information_is_that_of_all_pixels_together() {
        let torus = Torus::new(24);
        let field = |of: &dyn Fn(usize) -> f32, side: usize| Field {
            rows: side,
            columns: side,
            values: (0..side * side).map(of).collect(),
        };
        let direction = field(&|n| ((n * 7) % 11) as f32 - 5.0, 6);
        // exp(−|d|) along both axes, on the torus.
        let lag = |n: usize| n.min(24 - n) as f32;
        let covariance = field(&|n| (-0.8 * (lag(n / 24) + lag(n % 24))).exp(), 24);
        let found = of_mean(&torus, &covariance, std::slice::from_ref(&direction)).at(0, 0);
        let mut full = Matrix::zero(36);
        for a in 0..36usize {
            for b in 0..36usize {
                let (down, right) = ((a / 6).abs_diff(b / 6), (a % 6).abs_diff(b % 6));
                full.add(a, b, f64::from(covariance.at(down, right)));
            }
        }
        let values: Vec<f64> = direction.values.iter().map(|v| f64::from(*v)).collect();
        let inverse = full.inverse().unwrap();
        let pairs = (0..36).flat_map(|a| (0..36).map(move |b| [a, b]));
        let products = pairs.map(|[a, b]| values[a] * inverse.at(a, b) * values[b]);
        let expected: f64 = products.sum();
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }
}
