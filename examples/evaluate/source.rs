//! Where images come from: the simulator, or a model that was trained on it.

use wake_physics::{Field, Scene, simulate};

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
