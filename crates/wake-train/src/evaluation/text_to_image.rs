//! A pipeline in the layout of diffusers as a source of images.

use burn::tensor::{Tensor, TensorData};
use wake_ldm::pipeline::{Pipeline, Request};
use wake_ldm::scheduler::SchedulerConfig;
use wake_physics::grey::GreyScale;
use wake_physics::{Field, Scene};
use wake_text::Wording;

use super::baseline::Baseline;
use super::source::{ImageSource, Told};
use super::view::View;
use crate::error::Result;

/// Draws scenes with a latent diffusion model from the paper's sentence alone.
#[derive(Debug)]
pub struct TextToImage<'a> {
    /// The model; where it draws several channels, grey is their mean.
    pub pipeline: &'a Pipeline,
    /// Scheduler; `None`: the pipeline's own.
    pub scheduler: Option<SchedulerConfig>,
    /// Steps of the scheduler.
    pub steps: usize,
    /// Guidance scale; 1 or less: no guidance.
    pub guidance: f64,
    /// Mapping from σ⁰ to grey of its training images.
    pub grey: GreyScale,
    /// Whether its training images had speckle.
    pub speckle: bool,
}

impl ImageSource for TextToImage<'_> {
    /// Images have the size of their scenes, which all have one size.
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        let Some(first) = scenes.first() else {
            return Ok(Vec::new());
        };
        let prompts = scenes.iter().map(|scene| Wording::Paper.prompt(scene));
        let prompts: Vec<String> = prompts.collect::<wake_text::Result<_>>()?;
        let scheduler = self.scheduler.as_ref();
        let request = Request::new(prompts)
            .with_scheduler(scheduler.unwrap_or(self.pipeline.scheduler()).clone())
            .with_guidance(self.guidance)
            .with_steps(self.steps)
            .with_size(first.grid.rows, first.grid.columns)
            .with_seeds(scenes.iter().map(|scene| scene.seed).collect())
            .with_images_at_once(scenes.len());
        let images = self.pipeline.generate(&request)?;
        Ok(fields(images, &self.grey))
    }

    fn has_speckle(&self) -> bool {
        self.speckle
    }
}

/// Simulated images encoded and decoded by a pipeline's autoencoder: the best that its model could draw.
#[derive(Debug)]
pub struct Reconstructed<'a> {
    /// The pipeline.
    pub pipeline: &'a Pipeline,
    /// View of its images: grey and speckle.
    pub view: View,
}

impl ImageSource for Reconstructed<'_> {
    fn draw(&self, scenes: &[Scene], told: Told) -> Result<Vec<Field>> {
        let simulated = self.view.draw(&Baseline::Simulator, scenes, told)?;
        let autoencoder = self.pipeline.autoencoder();
        let draw = |image: &Field| {
            let grey = self.view.grey(image);
            let data = TensorData::new(grey.values, [1, 1, grey.rows, grey.columns]);
            let pixels = Tensor::from_data(data, self.pipeline.device());
            let latents = autoencoder.encode(autoencoder.scaled(pixels)).mode();
            let decoded = self.pipeline.decode(autoencoder.to_latents(latents));
            fields(decoded, &self.view.grey).swap_remove(0)
        };
        Ok(simulated.iter().map(draw).collect())
    }

    fn has_speckle(&self) -> bool {
        self.view.speckle
    }
}

/// σ⁰ of the mean over the channels.
///
/// # Shapes
///
/// `[images, channels, rows, columns]`, grey 0 to 1
fn fields(images: Tensor<4>, scale: &GreyScale) -> Vec<Field> {
    let images = images.mean_dim(1);
    let [_, _, rows, columns] = images.dims();
    let pixels: Vec<f32> = images.into_data().iter::<f32>().collect();
    let sigma0 = |&grey: &f32| scale.sigma0(f64::from(grey)) as f32;
    let field = |pixels: &[f32]| Field {
        rows,
        columns,
        values: pixels.iter().map(sigma0).collect(),
    };
    pixels.chunks(rows * columns).map(field).collect()
}
