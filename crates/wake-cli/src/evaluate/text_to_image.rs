//! A model of images and prompts alone as a source of images: the paper's own way.

use crate::exit::Outcome;
use std::path::Path;
use wake_ldm::pipeline::{Pipeline, Request};
use wake_nn::burn::tensor::Device;
use wake_physics::grey::GreyScale;
use wake_physics::{Field, Scene};
use wake_text::Wording;
use wake_train::evaluation::{ImageSource, SIZE, Told};

/// Steps of DDIM from noise to image: chosen, the paper does not state its own.
const STEPS: usize = 50;

/// A pipeline in the layout of diffusers; it is told the paper's sentence, whatever else there is.
#[derive(Debug)]
pub(crate) struct TextToImage(Pipeline);

impl TextToImage {
    /// The model of a folder.
    pub(crate) fn load(folder: &Path, device: &Device) -> Outcome<Self> {
        let pipeline = Pipeline::load(folder, device)?;
        let [rows, columns] = pipeline.image_size();
        if [rows, columns] != [SIZE, SIZE] {
            return Err(format!(
                "--text-to-image {}: it draws {rows} x {columns} pixels, but the scenes have {SIZE} x {SIZE}",
                folder.display()
            )
            .into());
        }
        Ok(Self(pipeline))
    }
}

impl ImageSource for TextToImage {
    fn draw(&self, scenes: &[Scene], _: Told) -> wake_train::Result<Vec<Field>> {
        let prompts = scenes.iter().map(|scene| Wording::Paper.prompt(scene));
        let prompts: Vec<String> = prompts.collect::<wake_text::Result<_>>()?;
        let seeds: Vec<u64> = scenes.iter().map(|scene| scene.seed).collect();
        // Without guidance: images as often as the data have them.
        let request = Request::new(prompts)
            .with_guidance(1.0)
            .with_steps(STEPS)
            .with_seeds(seeds)
            .with_images_at_once(scenes.len());
        let images = self.0.generate(&request)?;
        let [count, channels, rows, columns] = images.dims();
        let grey: Vec<f32> = images.into_data().iter::<f32>().collect();
        let scale = GreyScale::default();
        let field = |pixels: &[f32]| Field {
            rows,
            columns,
            values: pixels[..rows * columns]
                .iter()
                .map(|&grey| scale.sigma0(f64::from(grey)) as f32)
                .collect(),
        };
        let each = channels * rows * columns;
        Ok(grey.chunks(each).take(count).map(field).collect())
    }
}
