//! The small model as a source of images.

use crate::source::{ImageSource, Result, Told};
use burn::tensor::Device;
use std::path::Path;
use wake_ldm::{WakeSampler, sampler};
use wake_physics::{Field, Scene};
use wake_text::Wording;

/// A trained sampler.
pub(crate) struct Model(WakeSampler);

impl Model {
    /// The model of a folder, or the one in the crate.
    pub(crate) fn load(
        folder: Option<&Path>,
        steps: Option<usize>,
        device: &Device,
    ) -> Result<Self> {
        let sampler = match folder {
            Some(folder) => WakeSampler::from_folder(folder, device)?,
            None => WakeSampler::pretrained(device)?,
        };
        Ok(Self(match steps {
            Some(steps) => sampler.with_steps(steps)?,
            None => sampler,
        }))
    }
}

impl ImageSource for Model {
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
        let (told, wording) = match told {
            Told::Both => (sampler::Conditioning::Both, Wording::Paper),
            Told::Text => (sampler::Conditioning::Words, Wording::Paper),
            Told::Numbers => (sampler::Conditioning::Numbers, Wording::Paper),
            Told::Paraphrase => (sampler::Conditioning::Words, Wording::WindFirst),
        };
        let sampler = self.0.clone().with_conditioning(told);
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
