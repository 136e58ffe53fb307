//! Batches of pairs of a data set, as a latent diffusion model takes them.

use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::error::Result;
use crate::streams;
use wake_dataset::{Folder, Pair};
use wake_ldm::pipeline::{PipelineParts, token_ids};
use wake_nn::noise::NoiseSource;

/// Part of the pairs whose prompt is left out, for guidance.
const WITHOUT_PROMPT: f64 = 0.1;

/// Pairs that are drawn from a folder with a seed, each as likely as every other, a tenth of them without their prompts.
///
/// # References
///
/// Ho & Salimans (2021), "Classifier-Free Diffusion Guidance", algorithm 1 (prompts left out).
#[derive(Debug)]
pub struct PromptedBatches<'a> {
    /// At least one pair.
    pub data: &'a Folder,
    /// Whose tokenizer reads the prompts, and whose autoencoder takes the images.
    pub parts: &'a PipelineParts,
    /// Images of a batch.
    pub batch: usize,
    /// Seed of what is drawn.
    pub seed: u64,
}

impl PromptedBatches<'_> {
    /// The images and the ids of the prompts of a step.
    ///
    /// # Shapes
    ///
    /// `[batch, image channels, rows, columns]` in −1…1, and `[batch, tokens]`, on `device`
    ///
    /// # Errors
    ///
    /// As [`Folder::pair`].
    pub fn of_step(&self, step: usize, device: &Device) -> Result<(Tensor<4>, Tensor<2, Int>)> {
        let random = NoiseSource::new(self.seed);
        let tokenizer = self.parts.tokenizer.as_ref();
        let (mut pixels, mut ids, mut size) = (Vec::new(), Vec::new(), [0, 0]);
        for position in (step * self.batch..(step + 1) * self.batch).map(|p| p as u64) {
            let draw = random.uniform(streams::PAIRS, position);
            let number = (draw * self.data.len() as f64) as u64;
            let Pair { image, prompt, .. } = self.data.pair(number)?;
            size = [image.rows, image.columns];
            pixels.extend(image.pixels.iter().map(|grey| 2.0 * grey - 1.0));
            let told = random.uniform(streams::UNTOLD, position) >= WITHOUT_PROMPT;
            ids.extend(token_ids(tokenizer, if told { &prompt } else { "" }));
        }
        let images = TensorData::new(pixels, [self.batch, 1, size[0], size[1]]);
        let images: Tensor<4> = Tensor::from_data(images, device);
        let channels = self.parts.autoencoder.image_channels();
        let tokens = ids.len() / self.batch.max(1);
        let ids = TensorData::new(ids, [self.batch, tokens]);
        Ok((
            images.repeat_dim(1, channels),
            Tensor::from_data(ids, device),
        ))
    }
}
