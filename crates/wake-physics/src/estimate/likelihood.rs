//! The likelihood of an image given a scene, to second order.
//!
//! Relative intensity r = I/μ − 1 has a covariance that is the same everywhere ([`super::noise`]). In a window w, its spectrum R
//! = F[w r] has the power S = E|R|², and wavenumbers are taken as independent (Whittle):
//!
//! ```text
//! ln L = −½ c Σ (|R|²/S + ln S) − Σ w² ln μ,       c = Σw²/P²   on a torus of P² pixels
//! score of the mean      g = c Σ Re D̄ R/S,          D = F[w ∂ln μ]
//! score of the spectrum  g = ½ c Σ (∂ln S)(|R|²/S − 1)
//! ```
//!
//! r and ∂ln μ are divided by the spread of the noise, which is larger where waves of the sea move bright sources next to dark
//! ones; it is fixed at one scene. The scores have mean 0 whenever mean and covariance are right: Gamma speckle and a sea that is
//! not Gaussian change only their variances. The variance V of the score of the mean is computed with the covariance between all
//! pixels, without the approximation; the variance of the spectrum's score is the Gaussian one. Standard deviations are those of
//! J⁻¹VJ⁻¹ (Godambe), with J the expected slope of the score.
//!
//! # References
//!
//! Whittle (1953), Ark. Mat. 2, 423; Godambe (1960), Ann. Math. Stat. 31, 1208.

use super::expected::{Expected, ExpectedImage};
use super::observed::Observed;
use super::parameter::{Factors, Parameter};
use super::priors::values_of;
use super::texture::Texture;
use crate::error::{Error, Result};
use crate::raster::Field;
use crate::sar::speckle::speckle;
use crate::scene::Scene;

/// The likelihood of images given a scene.
///
/// ```
/// use wake_physics::estimate::{Factors, Likelihood, Parameter};
/// use wake_physics::{Scene, simulate};
///
/// let mut scene = Scene::default();
/// (scene.grid.rows, scene.grid.columns) = (64, 64);
/// let image = simulate(&scene)?.speckled;
/// let likelihood = Likelihood::new(&scene, &Parameter::OF_WAKE)?;
/// let here = likelihood.of(&image, &Factors::default())?;
/// // A sea of twice the variance is less likely, and the score says so.
/// let rougher = likelihood.of(&image, &Factors { texture: 2.0, ..Factors::default() })?;
/// assert!(rougher.log_likelihood < here.log_likelihood);
/// # Ok::<(), wake_physics::Error>(())
/// ```
#[derive(Debug)]
pub struct Likelihood {
    parameters: Vec<Parameter>,
    scene: Scene,
    expected: Expected,
    texture: Texture,
}

/// Log-likelihood, score and information of an image at a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Log-likelihood, up to a constant of the image.
    pub log_likelihood: f64,
    /// Derivative of the log-likelihood by each parameter; mean 0 over images of the scene.
    pub score: Vec<f64>,
    /// Expected slope J of the score, row after row.
    pub information: Vec<f64>,
    /// Variance V of the score, row after row; the covariance of an estimate is J⁻¹VJ⁻¹.
    pub variance: Vec<f64>,
    /// Power of the residual over its expectation in rings of wavenumbers, longest waves first; 1 where the scene explains the
    /// image. Wavelengths at which noise has less than a hundredth of its mean power are left out; 1 in a ring of such.
    pub power: Vec<f64>,
}

impl Likelihood {
    /// The likelihood near a scene, with the score of some parameters.
    ///
    /// # Errors
    ///
    /// As in [`ExpectedImage::new`].
    pub fn new(scene: &Scene, parameters: &[Parameter]) -> Result<Self> {
        let image = ExpectedImage::new(scene, &values_of(parameters))?;
        Ok(Self {
            expected: image.at(scene)?,
            texture: Texture::new(scene, parameters)?,
            parameters: parameters.to_vec(),
            scene: scene.clone(),
        })
    }

    /// Draws an image from the likelihood's own distribution: the mean image times a Gaussian sea and Gamma speckle, with the
    /// spread of the noise.
    ///
    /// Returns intensity with speckle in units of σ⁰, `[rows, columns]` of the scene's grid; the same seed gives the same image.
    /// Use it to separate errors of an estimator from errors of the model.
    ///
    /// # Validity
    ///
    /// Up to second order: values that the Gaussian sea would make negative are set to 0.
    ///
    /// # Errors
    ///
    /// A radar with an impulse response along range: its speckle would be correlated, which is not implemented.
    pub fn draw(&self, seed: u64) -> Result<Field> {
        let radar = &self.scene.radar;
        if let Some(resolution) = radar.range_resolution {
            return Err(Error::Conflict {
                name: "radar.range_resolution".to_owned(),
                value: resolution.to_string(),
                requirement:
                    "but images drawn from the likelihood have independent pixels: remove it"
                        .to_owned(),
            });
        }
        let mut image = self.expected.intensity.clone();
        let mut noise = self.texture.noise.drawn([image.rows, image.columns], seed);
        for value in &mut noise.values {
            *value = (1.0 + *value).max(0.0);
        }
        speckle(&mut noise, radar.looks, seed);
        let observed = Observed::new(image.clone(), &self.scene, |_, _| 1.0);
        let spread = observed.spread(&self.expected.contrast, &self.texture.noise);
        let noise = noise.values.iter().zip(&spread.values);
        for (value, (noise, spread)) in image.values.iter_mut().zip(noise) {
            *value *= (1.0 + spread * (noise - 1.0)).max(0.0);
        }
        Ok(image)
    }

    /// Evaluates an image of intensity with speckle, in units of σ⁰ times the gain.
    ///
    /// # Errors
    ///
    /// An image whose size differs from the grid's, a pixel that is negative or not finite, or a factor out of its range.
    pub fn of(&self, image: &Field, factors: &Factors) -> Result<Score> {
        let conflict = |name: &str, value: String, requirement: &str| {
            Err(Error::Conflict {
                name: name.to_owned(),
                value,
                requirement: requirement.to_owned(),
            })
        };
        let grid = &self.scene.grid;
        if [image.rows, image.columns] != [grid.rows, grid.columns] {
            let value = format!("{} x {} pixels", image.rows, image.columns);
            let requirement = format!("but the grid has {} x {}", grid.rows, grid.columns);
            return conflict("image", value, &requirement);
        }
        if !image.values.iter().all(|v| v.is_finite() && *v >= 0.0) {
            let value = "negative or not finite in some pixels".to_owned();
            let requirement = "but intensities must be finite and at least 0";
            return conflict("image", value, requirement);
        }
        let Factors { gain, texture } = *factors;
        if !(gain.is_finite() && gain > 0.0 && texture.is_finite() && texture >= 0.0) {
            let value = format!("gain {gain}, texture {texture}");
            return conflict(
                "factors",
                value,
                "but gain must be above 0, texture at least 0, and both finite",
            );
        }
        let observed = Observed::new(image.clone(), &self.scene, |_, _| 1.0);
        let near = observed.near(
            &self.parameters,
            factors,
            &self.expected,
            &self.texture,
            true,
        );
        Ok(Score {
            log_likelihood: near.log_likelihood,
            score: near.score,
            information: near.information.slope.values,
            variance: near.information.variance.values,
            power: near.rings.iter().map(|ring| ring[0]).collect(),
        })
    }
}
