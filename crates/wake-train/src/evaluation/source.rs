//! Sources of images.

use std::fmt::Debug;

use wake_physics::{Field, Scene};
use wake_text::Wording;

use crate::error::{Error, Result};
use wake_ldm::sampler::{PromptMode, WakeSampler};

/// Images requested from a source at once.
pub(super) const BATCH: usize = 8;

/// Inputs that describe a scene to a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Told {
    /// The paper's sentence, and its numbers.
    #[default]
    Both,
    /// The sentence alone.
    Text,
    /// The numbers of the sentence alone.
    Numbers,
    /// Another wording of the sentence, alone.
    Paraphrase,
    /// The scene itself, including what no sentence states.
    Scene,
}

impl Told {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Text => "text",
            Self::Numbers => "numbers",
            Self::Paraphrase => "paraphrase",
            Self::Scene => "scene",
        }
    }
}

/// Draws images of scenes.
pub trait ImageSource: Debug {
    /// Intensity before speckle of each scene, in the unit of σ⁰ and of the scene's rows and columns; `scene.seed` decides the
    /// random sea. Sources that know the scene ignore the prompt.
    ///
    /// # Errors
    ///
    /// If an image cannot be drawn. The evaluation refuses images of a wrong number or size.
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>>;

    /// `true` for sources of speckled images, such as a model trained on speckled images.
    fn has_speckle(&self) -> bool {
        false
    }
}

/// The wake model uses the given inputs whatever [`PromptMode`] it has; only for [`Told::Scene`] it uses its own.
impl ImageSource for WakeSampler {
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
        let (told, wording) = match told {
            Told::Both => (PromptMode::Both, Wording::Paper),
            Told::Text => (PromptMode::Words, Wording::Paper),
            Told::Numbers => (PromptMode::Numbers, Wording::Paper),
            Told::Paraphrase => (PromptMode::Words, Wording::WindFirst),
            Told::Scene => {
                let images = self.sample_scenes(scenes)?;
                return Ok(images.into_iter().map(|image| image.intensity).collect());
            }
        };
        let sampler = self.clone().with_prompt_mode(told);
        let mut images = Vec::with_capacity(scenes.len());
        // Image k of a call has the first seed plus k.
        for batch in scenes.chunk_by(|one, next| next.seed == one.seed.wrapping_add(1)) {
            let prompts: Vec<String> = batch
                .iter()
                .map(|scene| wording.prompt(scene))
                .collect::<wake_text::Result<_>>()?;
            let prompts: Vec<&str> = prompts.iter().map(String::as_str).collect();
            let drawn = sampler.sample_many(&prompts, batch[0].seed)?;
            images.extend(drawn.into_iter().map(|image| image.intensity));
        }
        Ok(images)
    }
}

/// Draws images of a source, and checks that there is one of each scene and of its size.
pub(super) fn drawn(source: &dyn ImageSource, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
    let images = source.draw(scenes, told)?;
    let size = |image: &Field| [image.rows, image.columns, image.values.len()];
    let asked = |scene: &Scene| {
        let [rows, columns] = [scene.grid.rows, scene.grid.columns];
        [rows, columns, rows * columns]
    };
    if images.iter().map(size).eq(scenes.iter().map(asked)) {
        return Ok(images);
    }
    Err(Error::Value(wake_nn::Error::InvalidOption {
        option: "images of a source".to_owned(),
        value: format!("{} for {} scenes", images.len(), scenes.len()),
        expected: "one image per scene, with the rows and columns of its grid".to_owned(),
    }))
}

/// A source of images, and its name in reports.
pub type Named<'a> = (&'static str, &'a dyn ImageSource);

/// The same scene with another random sea, from the seed plus `number`.
#[must_use]
pub fn other_sea(scene: &Scene, number: u64) -> Scene {
    Scene {
        seed: scene.seed.wrapping_add(number),
        ..scene.clone()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// Source whose images are one pixel, the number of images drawn together.
    #[derive(Debug)]
    struct Counted;

    impl ImageSource for Counted {
        fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
            let image = Field {
                rows: 1,
                columns: 1,
                values: vec![scenes.len() as f32],
            };
            Ok(vec![image; scenes.len()])
        }
    }

    /// A one-pixel image of a larger scene is refused, and so is a missing image.
    #[test]
    fn other_images_than_were_asked_for_are_refused() {
        #[derive(Debug)]
        struct Nothing;
        impl ImageSource for Nothing {
            fn draw(&self, _: &[Scene], _: Told) -> Result<Vec<Field>> {
                Ok(Vec::new())
            }
        }
        let scenes = [Scene::default()];
        for source in [&Counted as &dyn ImageSource, &Nothing] {
            let refused = drawn(source, &scenes, Told::Both).unwrap_err().to_string();
            assert!(refused.contains("for 1 scenes"), "{refused}");
        }
        assert!(drawn(&Nothing, &[], Told::Both).unwrap().is_empty());
    }
}
