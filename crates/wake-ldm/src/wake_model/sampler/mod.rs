//! The small model as one call: a sentence or a scene becomes a radar image with labels.

mod image;
mod pretrained;

use std::f64::consts::FRAC_PI_2;
use std::time::Instant;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use wake_physics::Scene;
use wake_physics::labels::Labels;
use wake_physics::{Field, labels_of};
use wake_text::{PartialScene, Wording};

use crate::error::{Error, Result, check_range};
use crate::noise::NoiseSource;
use crate::wake_model::conditioning::{Conditions, Vocabulary};
use crate::wake_model::network::{
    Expected, Known, WakeModel, WakeModelConfig, expected_latents, sea_noise,
};
pub use image::{SampleSeconds, WakeImage};

/// Steps from noise to image, unless others are asked for.
const STEPS: usize = 4;

/// What the model is told about a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Conditioning {
    /// The numbers that [`wake_text`] reads from the words, and those that only the model reads.
    #[default]
    Both,
    /// The words alone, as the model reads them.
    Words,
    /// The numbers alone.
    Numbers,
}

/// Draws radar images of ship wakes.
///
/// Images are grey, [`GreyScale::default`](wake_physics::grey::GreyScale), free of speckle as the model makes them.
/// The sampler holds no gradients and may be given to another thread, for instance to a data loader.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants: A Unifying Framework for Flows and Diffusions".
#[derive(Debug, Clone)]
pub struct WakeSampler {
    model: WakeModel,
    config: WakeModelConfig,
    vocabulary: Vocabulary,
    device: Device,
    steps: usize,
    conditioning: Conditioning,
}

impl WakeSampler {
    /// A sampler of a model that lies in memory.
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::validate`].
    pub fn new(model: WakeModel, config: WakeModelConfig) -> Result<Self> {
        config.validate()?;
        let device = model.devices().into_iter().next().unwrap_or_default();
        Ok(Self {
            vocabulary: Vocabulary::new(config.vocabulary.iter().copied()),
            device,
            model,
            config,
            steps: STEPS,
            conditioning: Conditioning::default(),
        })
    }

    /// The same sampler with another number of steps, 1 to 1000.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for another number.
    pub fn with_steps(self, steps: usize) -> Result<Self> {
        check_range("steps", steps as f64, 1.0, 1000.0)?;
        Ok(Self { steps, ..self })
    }

    /// The same sampler with a model that sees less.
    #[must_use]
    pub fn with_conditioning(self, conditioning: Conditioning) -> Self {
        Self {
            conditioning,
            ..self
        }
    }

    /// Steps from noise to image.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The scene that [`sample`](Self::sample) takes what a prompt leaves open from: the default one, on the
    /// pixels of the model.
    pub fn base_scene(&self) -> Scene {
        self.config.base_scene()
    }

    /// An image of a prompt, with labels that follow from the numbers it states.
    ///
    /// # Errors
    ///
    /// [`Error::Text`] for a prompt whose numbers contradict each other or are out of range, [`Error::Scene`] for a scene
    /// that physics refuses.
    pub fn sample(&self, prompt: &str, seed: u64) -> Result<WakeImage> {
        let mut images = self.sample_many(&[prompt], seed)?;
        Ok(images.swap_remove(0))
    }

    /// An image of each prompt; image k has the seed `seed + k`.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample), and [`Error::InvalidOption`] for no prompt.
    pub fn sample_many(&self, prompts: &[&str], seed: u64) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        let input = |(k, prompt): (u64, &&str)| -> Result<Input> {
            let said = PartialScene::read(prompt)?;
            let mut scene = said.onto(&self.base_scene())?;
            scene.seed = seed.wrapping_add(k);
            Ok(Input {
                known: Conditions::of_prompt(&said),
                words: (*prompt).to_owned(),
                scene,
            })
        };
        let inputs = (0..).zip(prompts).map(input);
        let inputs: Vec<Input> = inputs.collect::<Result<_>>()?;
        Ok(self.run(&inputs, begin)?.images(&inputs))
    }

    /// An image of each scene; image k has the seed `seed + k`.
    ///
    /// # Errors
    ///
    /// As [`sample_batch`](Self::sample_batch).
    pub fn sample_scenes(&self, scenes: &[Scene], seed: u64) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        let inputs = self.inputs(scenes, seed)?;
        Ok(self.run(&inputs, begin)?.images(&inputs))
    }

    /// An image of each scene, in one batch on the device, without speckle, and its labels; image k has the seed
    /// `seed + k`.
    ///
    /// # Shapes
    ///
    /// `[scenes, 1, rows, columns]`, grey 0…1.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidOption`] for no scene, or one whose grid is not the model's, [`Error::Text`] for one that is not
    /// valid.
    pub fn sample_batch(&self, scenes: &[Scene], seed: u64) -> Result<(Tensor<4>, Vec<Labels>)> {
        let inputs = self.inputs(scenes, seed)?;
        let drawn = self.run(&inputs, Instant::now())?;
        Ok((drawn.grey, scenes.iter().map(labels_of).collect()))
    }

    fn inputs(&self, scenes: &[Scene], seed: u64) -> Result<Vec<Input>> {
        let seeds = (0..).map(|k| seed.wrapping_add(k));
        let inputs = scenes.iter().zip(seeds);
        inputs
            .map(|(scene, seed)| self.input(scene, seed))
            .collect()
    }

    /// Numbers and words of a scene.
    fn input(&self, scene: &Scene, seed: u64) -> Result<Input> {
        let grid = &scene.grid;
        let size = self.config.image_size;
        if [grid.rows, grid.columns] != [size, size]
            || (grid.spacing - self.config.spacing).abs() > 1e-9
        {
            return Err(Error::InvalidOption {
                option: "grid".to_owned(),
                value: format!(
                    "{} × {} pixels of {} m",
                    grid.rows, grid.columns, grid.spacing
                ),
                expected: format!(
                    "{size} × {size} pixels of {} m, as the model draws them",
                    self.config.spacing
                ),
            });
        }
        Ok(Input {
            known: Conditions::of_scene(scene),
            words: Wording::Paper.prompt(scene)?,
            scene: Scene {
                seed,
                ..scene.clone()
            },
        })
    }

    /// From noise to grey, all images at once.
    fn run(&self, inputs: &[Input], begin: Instant) -> Result<Drawn> {
        if inputs.is_empty() {
            return Err(Error::InvalidOption {
                option: "images".to_owned(),
                value: "0".to_owned(),
                expected: "at least one prompt or scene".to_owned(),
            });
        }
        let mut seconds = SampleSeconds::default();
        let conditions = self.told(inputs);
        seconds.text = begin.elapsed().as_secs_f64();
        let told = conditions.iter().zip(inputs);
        let scenes: Vec<Scene> = told.map(|(told, input)| told.onto(&input.scene)).collect();
        let wake = expected_latents(&scenes, &self.model.patches)?;
        let known = Known::new(&conditions, self.config.grid(), wake);
        let expected = self.model.prior.forward(&known);
        wait_for(&expected.mean);
        seconds.expect = begin.elapsed().as_secs_f64() - seconds.text;
        let sources = inputs
            .iter()
            .map(|input| NoiseSource::new(input.scene.seed));
        let noise = sea_noise(&scenes, &sources.collect::<Vec<_>>(), &self.model.patches)?;
        let latents = self.denoise(&known, &expected, noise);
        wait_for(&latents);
        seconds.denoise = begin.elapsed().as_secs_f64() - seconds.text - seconds.expect;
        let grey = self.model.decode(latents, &expected);
        let pixels: Vec<f32> = grey.to_data().iter::<f32>().collect();
        seconds.total = begin.elapsed().as_secs_f64();
        seconds.decode = seconds.total - seconds.text - seconds.expect - seconds.denoise;
        Ok(Drawn {
            grey,
            pixels,
            seconds,
        })
    }

    /// The numbers that images are drawn from; what is told of none is that of the base scene.
    fn told(&self, inputs: &[Input]) -> Vec<Conditions> {
        let base = Conditions::of_scene(&self.base_scene());
        if self.conditioning == Conditioning::Numbers {
            return inputs.iter().map(|input| input.known.or(base)).collect();
        }
        let prompts: Vec<&str> = inputs.iter().map(|input| input.words.as_str()).collect();
        let read = self.model.read(&prompts, &self.vocabulary, &self.device);
        let pairs = inputs.iter().zip(read);
        pairs
            .map(|(input, read)| match self.conditioning {
                Conditioning::Words => read.or(base),
                _ => input.known.or(read).or(base),
            })
            .collect()
    }

    /// Euler's steps along the flow, equal in the angle, from noise to latents.
    fn denoise(&self, known: &Known, expected: &Expected, noise: Tensor<4>) -> Tensor<4> {
        let [batch, ..] = noise.dims();
        let mut x = noise;
        let prepared = self.model.flow.prepared(known);
        for i in 0..self.steps {
            let sigma = 1.0 - i as f64 / self.steps as f64;
            let sigma = Tensor::full([batch], sigma, &self.device);
            let velocity = self.model.flow.velocity(x.clone(), sigma, &prepared);
            x = x - velocity * (FRAC_PI_2 / self.steps as f64);
        }
        expected.latents(x)
    }
}

/// Waits until a device has computed a tensor, by reading one number of it.
fn wait_for(tensor: &Tensor<4>) {
    tensor.clone().slice([0..1, 0..1, 0..1, 0..1]).into_data();
}

/// What an image is drawn from.
struct Input {
    known: Conditions,
    words: String,
    /// What the numbers are put into, and its seed.
    scene: Scene,
}

/// Images as they come from the model.
struct Drawn {
    grey: Tensor<4>,
    pixels: Vec<f32>,
    seconds: SampleSeconds,
}

impl Drawn {
    /// The images with their speckle and labels.
    fn images(&self, inputs: &[Input]) -> Vec<WakeImage> {
        let [_, _, rows, columns] = self.grey.dims();
        let images = self.pixels.chunks(rows * columns).zip(inputs);
        images
            .map(|(pixels, input)| {
                let grey = Field {
                    rows,
                    columns,
                    values: pixels.to_vec(),
                };
                WakeImage::new(grey, &input.scene, self.seconds)
            })
            .collect()
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
