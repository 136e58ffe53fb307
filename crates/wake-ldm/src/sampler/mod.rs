//! The small model as one call: a sentence or a scene becomes a radar image with labels.

mod image;
mod pretrained;

use std::time::Instant;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use wake_physics::Scene;
use wake_physics::labels::Labels;
use wake_physics::{Field, labels_of};
use wake_text::{PartialScene, Wording};

use crate::conditioning::{Conditions, MapGrid, Vocabulary};
use crate::error::{Error, Result, check_range};
use crate::noise::{INITIAL_STREAM, NoiseSource, normal_batch};
use crate::small::{Expected, Known, WakeModel, WakeModelConfig};
pub use image::{SampleSeconds, WakeImage};

/// Steps from noise to image, unless others are asked for.
const STEPS: usize = 8;

/// What the model is told about a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Told {
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
/// Lipman et al. (2023), "Flow Matching for Generative Modeling".
#[derive(Debug, Clone)]
pub struct WakeSampler {
    model: WakeModel,
    config: WakeModelConfig,
    vocabulary: Vocabulary,
    device: Device,
    steps: usize,
    told: Told,
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
            told: Told::default(),
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
    pub fn with_told(self, told: Told) -> Self {
        Self { told, ..self }
    }

    /// Steps from noise to image.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The scene that [`sample`](Self::sample) takes what a prompt leaves open from: the default one, on the
    /// pixels of the model.
    pub fn base_scene(&self) -> Scene {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns) = (self.config.image_size, self.config.image_size);
        scene.grid.spacing = self.config.spacing;
        scene
    }

    /// An image of a prompt, with labels that follow from the numbers it states.
    ///
    /// # Errors
    ///
    /// [`Error::Text`] for a prompt whose numbers contradict each other or are out of range.
    pub fn sample(&self, prompt: &str, seed: u64) -> Result<WakeImage> {
        let mut images = self.sample_many(&[prompt], seed)?;
        Ok(images.swap_remove(0))
    }

    /// An image of each prompt; image k has the seed `seed + k`.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample).
    pub fn sample_many(&self, prompts: &[&str], seed: u64) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        let (mut inputs, mut scenes) = (Vec::new(), Vec::new());
        for (k, prompt) in prompts.iter().enumerate() {
            let said = PartialScene::read(prompt)?;
            let mut scene = said.onto(&self.base_scene())?;
            scene.seed = seed.wrapping_add(k as u64);
            inputs.push((Conditions::of_prompt(&said), (*prompt).to_owned()));
            scenes.push(scene);
        }
        let seeds: Vec<u64> = scenes.iter().map(|scene| scene.seed).collect();
        let mut drawn = self.run(&inputs, &seeds, begin)?;
        Ok(scenes
            .iter()
            .enumerate()
            .map(|(k, scene)| drawn.finish(k, scene))
            .collect())
    }

    /// An image of each scene; image k has the seed `seed + k`.
    ///
    /// # Errors
    ///
    /// As [`sample_batch`](Self::sample_batch).
    pub fn sample_scenes(&self, scenes: &[Scene], seed: u64) -> Result<Vec<WakeImage>> {
        let mut drawn = self.run_scenes(scenes, seed)?;
        let images = scenes.iter().enumerate().map(|(k, scene)| {
            let mut scene = scene.clone();
            scene.seed = seed.wrapping_add(k as u64);
            drawn.finish(k, &scene)
        });
        Ok(images.collect())
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
    /// [`Error::InvalidOption`] for a scene whose grid is not the model's, [`Error::Text`] for one that is not valid.
    pub fn sample_batch(&self, scenes: &[Scene], seed: u64) -> Result<(Tensor<4>, Vec<Labels>)> {
        let drawn = self.run_scenes(scenes, seed)?;
        Ok((drawn.grey, scenes.iter().map(labels_of).collect()))
    }

    fn run_scenes(&self, scenes: &[Scene], seed: u64) -> Result<Drawn> {
        let begin = Instant::now();
        let inputs = scenes.iter().map(|scene| self.input(scene));
        let inputs: Vec<(Conditions, String)> = inputs.collect::<Result<_>>()?;
        let seeds: Vec<u64> = (0..scenes.len() as u64)
            .map(|k| seed.wrapping_add(k))
            .collect();
        self.run(&inputs, &seeds, begin)
    }

    /// Numbers and words of a scene.
    fn input(&self, scene: &Scene) -> Result<(Conditions, String)> {
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
        Ok((conditions_of(scene), Wording::Paper.prompt(scene)?))
    }

    /// From noise to grey, all images at once.
    fn run(&self, inputs: &[(Conditions, String)], seeds: &[u64], begin: Instant) -> Result<Drawn> {
        let mut seconds = SampleSeconds::default();
        let conditions = self.told(inputs);
        seconds.text = begin.elapsed().as_secs_f64();
        let known = Known::new(&conditions, self.grid(), &self.device);
        let expected = self.model.expect(&conditions, &known, self.grid());
        let latents = self.denoise(&known, &expected, seeds);
        wait_for(&latents);
        seconds.denoise = begin.elapsed().as_secs_f64() - seconds.text;
        let grey = self.model.decode(latents, &expected);
        let pixels: Vec<f32> = grey.to_data().iter::<f32>().collect();
        seconds.total = begin.elapsed().as_secs_f64();
        seconds.decode = seconds.total - seconds.text - seconds.denoise;
        Ok(Drawn {
            grey,
            pixels,
            size: self.config.image_size,
            seconds,
        })
    }

    fn grid(&self) -> MapGrid {
        MapGrid {
            size: self.config.image_size,
            spacing: self.config.spacing,
        }
    }

    /// The numbers that images are drawn from; what is told of none is that of the base scene.
    fn told(&self, inputs: &[(Conditions, String)]) -> Vec<Conditions> {
        let base = conditions_of(&self.base_scene());
        if self.told == Told::Numbers {
            return inputs.iter().map(|(known, _)| known.or(base)).collect();
        }
        let prompts: Vec<&str> = inputs.iter().map(|(_, text)| text.as_str()).collect();
        let read = self.model.read(&prompts, &self.vocabulary, &self.device);
        let pairs = inputs.iter().zip(read);
        pairs
            .map(|((known, _), read)| match self.told {
                Told::Words => read.or(base),
                _ => known.or(read).or(base),
            })
            .collect()
    }

    /// Euler's steps along the flow, equal in σ, from noise to latents.
    fn denoise(&self, known: &Known, expected: &Expected, seeds: &[u64]) -> Tensor<4> {
        let size = self.config.latent_size();
        let sources: Vec<NoiseSource> = seeds.iter().map(|&seed| NoiseSource::new(seed)).collect();
        let shape = [self.config.latent_channels, size, size];
        let mut x = normal_batch(&sources, INITIAL_STREAM, shape, &self.device);
        let told = self.model.flow.told(known);
        for i in 0..self.steps {
            let sigma = 1.0 - i as f64 / self.steps as f64;
            let sigma = Tensor::full([seeds.len()], sigma, &self.device);
            let velocity = self.model.flow.velocity(x.clone(), sigma, &told);
            x = x - velocity / self.steps as f64;
        }
        expected.latents(x)
    }
}

/// All numbers of a scene that the model knows.
fn conditions_of(scene: &Scene) -> Conditions {
    let ship = scene.ship.as_ref();
    let windy = scene.sea.wind_speed > 0.0;
    Conditions {
        ship: Some(ship.is_some()),
        ship_speed: ship.map(|ship| ship.speed),
        ship_heading: ship.map(|ship| ship.heading),
        ship_position: ship.map(|ship| ship.position),
        wind_speed: Some(scene.sea.wind_speed),
        wind_toward: windy.then_some(scene.sea.wind_toward),
        fetch: windy.then_some(scene.sea.fetch),
        incidence: Some(scene.radar.incidence),
    }
}

/// Waits until a device has computed a tensor, by reading one number of it.
fn wait_for(tensor: &Tensor<4>) {
    tensor.clone().slice([0..1, 0..1, 0..1, 0..1]).into_data();
}

/// Images as they come from the model.
struct Drawn {
    grey: Tensor<4>,
    pixels: Vec<f32>,
    size: usize,
    seconds: SampleSeconds,
}

impl Drawn {
    /// One of the images with its speckle and labels.
    fn finish(&mut self, index: usize, scene: &Scene) -> WakeImage {
        let length = self.size * self.size;
        let grey = Field {
            rows: self.size,
            columns: self.size,
            values: self.pixels[index * length..(index + 1) * length].to_vec(),
        };
        WakeImage::new(grey, scene, self.seconds)
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
