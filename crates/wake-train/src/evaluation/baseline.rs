//! Baselines: images made without a network, to compare a model with.

use wake_physics::{Field, LinearSea, Scene, expected_intensity, simulate};

use super::source::{ImageSource, Told};
use crate::error::Result;
use wake_nn::noise::NoiseSource;

/// Sources that know the scene and ignore the prompt: from a constant to the simulator itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baseline {
    /// The same value everywhere: the mean of the expected image.
    Constant,
    /// The mean over all seas, computed by physics.
    Expected,
    /// The expected image times the exponential of a Gaussian sea with the linear spectrum of the image.
    Gaussian,
    /// The simulator with another random sea, of the seed `!scene.seed`: as good as a perfect model.
    OtherSea,
    /// The simulator.
    Simulator,
}

impl Baseline {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Expected => "expected image",
            Self::Gaussian => "expected image, Gaussian sea",
            Self::OtherSea => "simulator, other sea",
            Self::Simulator => "simulator",
        }
    }

    fn image(self, scene: &Scene) -> wake_physics::Result<Field> {
        match self {
            Self::Constant => {
                let mut image = expected_intensity(scene)?;
                let mean = image.mean() as f32;
                image.values.fill(mean);
                Ok(image)
            }
            Self::Expected => expected_intensity(scene),
            Self::Gaussian => {
                let mut image = expected_intensity(scene)?;
                let sea = gaussian_sea(scene)?;
                for (value, sea) in image.values.iter_mut().zip(&sea.values) {
                    *value *= sea;
                }
                Ok(image)
            }
            Self::OtherSea => {
                let other = Scene {
                    seed: !scene.seed,
                    ..scene.clone()
                };
                Self::Simulator.image(&other)
            }
            Self::Simulator => Ok(simulate(scene)?.intensity),
        }
    }
}

impl ImageSource for Baseline {
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        let images = scenes.iter().map(|scene| self.image(scene));
        Ok(images.collect::<wake_physics::Result<_>>()?)
    }
}

/// Factor of mean 1 by which a Gaussian sea g with the linear spectrum of the image modulates the expected intensity.
///
/// ```text
/// exp(g − ⟨g²⟩/2)
/// ```
pub(super) fn gaussian_sea(scene: &Scene) -> wake_physics::Result<Field> {
    let sea = LinearSea::new(scene)?;
    let normals = NoiseSource::new(!scene.seed).normal(0, sea.normals());
    let half_variance = 0.5 * sea.covariance().values[0];
    let mut field = sea.field(&normals);
    for value in &mut field.values {
        *value = (*value - half_variance).exp();
    }
    Ok(field)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// The constant has the mean of the expected image, and the other sea the seed `!scene.seed`.
    #[test]
    fn baselines_follow_from_each_other() {
        let keys = ["grid.rows = 32", "grid.columns = 32", "seed = 3"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let of = |baseline: Baseline, scene: &Scene| baseline.image(scene).unwrap();
        let [flat, expected] = [Baseline::Constant, Baseline::Expected].map(|b| of(b, &scene));
        assert_eq!(flat.values, vec![expected.mean() as f32; 32 * 32]);
        let other = Scene {
            seed: !3,
            ..scene.clone()
        };
        assert_eq!(
            of(Baseline::OtherSea, &scene).values,
            of(Baseline::Simulator, &other).values
        );
    }
}
