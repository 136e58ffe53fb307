//! Where images come from: the simulator, or a model that was trained on it.

use wake_ldm::noise::NoiseSource;
use wake_physics::{Field, LinearSea, Scene, expected_intensity, simulate};

/// Result of what may fail in this example.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// What a model is told about a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Told {
    /// The paper's sentence, and its numbers.
    Both,
    /// The sentence alone.
    Text,
    /// The numbers alone.
    Numbers,
    /// Another wording of the sentence, alone.
    Paraphrase,
}

impl Told {
    /// Name in reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Text => "text",
            Self::Numbers => "numbers",
            Self::Paraphrase => "paraphrase",
        }
    }
}

/// Draws images of scenes.
pub(crate) trait ImageSource {
    /// Intensity before speckle of each scene, in the unit of σ⁰; `scene.seed` decides the random sea.
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>>;
}

/// The simulator: knows the scene, whatever it is told.
pub(crate) struct Simulator;

impl ImageSource for Simulator {
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        scenes
            .iter()
            .map(|scene| Ok(simulate(scene)?.intensity))
            .collect()
    }
}

/// The simulator in the place of a model: the same scene, another random sea.
pub(crate) struct OtherSea;

impl ImageSource for OtherSea {
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
        let others: Vec<Scene> = scenes
            .iter()
            .map(|scene| Scene {
                seed: !scene.seed,
                ..scene.clone()
            })
            .collect();
        Simulator.draw(&others, told)
    }
}

/// The mean over all seas, by physics: no network, no sea.
pub(crate) struct Expected;

impl ImageSource for Expected {
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        let draw = |scene| Ok(expected_intensity(scene)?);
        scenes.iter().map(draw).collect()
    }
}

/// The mean over all seas times the exponential of a Gaussian sea with the linear spectrum of the image: no network.
pub(crate) struct Gaussian;

impl ImageSource for Gaussian {
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        let draw = |scene: &Scene| {
            let mut image = expected_intensity(scene)?;
            let sea = LinearSea::new(scene)?;
            let normals = NoiseSource::new(!scene.seed).normal(0, sea.normals());
            let field = sea.field(&normals);
            let half_variance = 0.5 * sea.covariance().values[0];
            for (value, sea) in image.values.iter_mut().zip(&field.values) {
                *value *= (sea - half_variance).exp();
            }
            Ok(image)
        };
        scenes.iter().map(draw).collect()
    }
}

/// The same value everywhere: the mean of the expected image.
pub(crate) struct Constant;

impl ImageSource for Constant {
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
        let mut images = Expected.draw(scenes, told)?;
        for image in &mut images {
            let mean = image.mean() as f32;
            image.values.fill(mean);
        }
        Ok(images)
    }
}
