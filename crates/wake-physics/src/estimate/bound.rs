//! How well any estimator can read a scene: the Cramér–Rao bound, without an image.

use super::expected::ExpectedImage;
use super::fit::{Priors, covariance, values_of};
use super::likelihood::{Observed, Texture};
use super::parameter::{Parameter, State};
use crate::error::Result;
use crate::scene::Scene;
use serde::Serialize;

/// Smallest standard deviations of unbiased estimates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bound {
    /// By parameter; infinite where the image does not tell.
    pub deviations: Vec<(Parameter, f64)>,
    /// Mean squared relative change of the image by the wake over the noise, summed over wavenumbers: the squared answer of a
    /// matched filter.
    pub wake_to_noise: f64,
}

impl Bound {
    /// The bound of one parameter.
    #[must_use]
    pub fn of(&self, parameter: Parameter) -> f64 {
        let found = self.deviations.iter().find(|(p, _)| *p == parameter);
        found.map_or(f64::INFINITY, |(_, deviation)| *deviation)
    }
}

/// The Cramér–Rao bound of parameters of a scene, for an image with its grid, radar and looks.
///
/// The likelihood is that of [`estimate`](super::estimate): second order, with the priors of the nuisance values. What
/// is not among the parameters is known.
///
/// # Errors
///
/// As [`ExpectedImage::new`].
pub fn bound(scene: &Scene, parameters: &[Parameter], priors: &Priors) -> Result<Bound> {
    let state = State::of(scene);
    let image = ExpectedImage::new(scene, &values_of(parameters))?;
    let expected = image.at(scene)?;
    let texture = Texture::new(scene, parameters)?;
    let observed = Observed::new(expected.intensity.clone(), texture.noise.size, |_, _| 1.0);
    let near = observed.near(parameters, (&state, &expected), &texture, true);
    let covariance = covariance(&near.information, &priors.matrix(parameters));
    let deviation = |n: usize| {
        covariance
            .as_ref()
            .map_or(f64::INFINITY, |c| c.at(n, n).max(0.0).sqrt())
    };
    let mut open = scene.clone();
    open.ships.clear();
    let without = ExpectedImage::new(&open, &[])?.intensity(&open)?;
    let wake = observed.residual(&without);
    let spectrum = observed.torus.spectrum(&wake);
    let power = observed.power(&texture.noise);
    let area = (observed.torus.size * observed.torus.size) as f64;
    let sum: f64 = (0..spectrum.len())
        .map(|n| observed.torus.weight(n) * f64::from(spectrum[n].norm_sqr() / power[n]))
        .sum();
    Ok(Bound {
        deviations: parameters.iter().enumerate().map(|(n, p)| (*p, deviation(n))).collect(),
        wake_to_noise: observed.taper.energy * sum / area,
    })
}
