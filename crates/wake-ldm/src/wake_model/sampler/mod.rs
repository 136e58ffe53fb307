//! Sampler of the small model: one call turns a sentence or a scene into a radar image with labels.

mod image;
mod pretrained;
mod self_check;

use std::f64::consts::FRAC_PI_2;
use std::time::Instant;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use wake_physics::grey::GreyScale;
use wake_physics::labels::Labels;
use wake_physics::{Field, Scene, Ship, labels_of};
use wake_text::{PartialScene, Reading, Unread, Wording};

use crate::error::{Error, Result};
use crate::wake_model::conditioning::Vocabulary;
use crate::wake_model::network::{
    ChannelWindows, ConditioningInputs, Expected, SeaFields, WakeModel, WakeModelConfig,
    expected_greys, images_of, slope_of,
};
use crate::wake_model::sea_texture::SeaTexture;
pub use image::{SampleSeconds, WakeImage, speckled};
pub use self_check::self_check;
use wake_nn::noise::NoiseSource;
use wake_nn::{check_finite, check_range, on_pool};

/// Default number of steps from noise to image.
const STEPS: usize = 3;

/// Inputs that describe a scene to the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PromptMode {
    /// The numbers that [`wake_text`] reads from the words; if it leaves numbers or domain words unread, also those that
    /// the model reads.
    #[default]
    Both,
    /// The words alone, as the model reads them.
    Words,
    /// The numbers alone.
    Numbers,
}

/// Sampler of radar images of ship wakes.
///
/// Prompt and values become one scene, which the result keeps: image, labels and speckle all follow from it, and
/// [`sample_scenes`](Self::sample_scenes) of that scene gives the same image again. Its seed is the image's seed.
///
/// The model's grey has the mapping of its training images, [`WakeModelConfig::grey`], and no speckle.
/// The sampler holds no gradients, whatever device its model was made on, and can be moved to another thread, for
/// instance to a data loader.
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
    windows: ChannelWindows,
    steps: usize,
    prompt_mode: PromptMode,
    sea: Option<SeaTexture>,
}

impl WakeSampler {
    /// Makes a sampler of a model with a valid configuration, without checking the device.
    fn unchecked(model: WakeModel, config: WakeModelConfig) -> Self {
        #[cfg(feature = "autodiff")]
        let model = model.valid();
        let device = model.devices().into_iter().next().unwrap_or_default();
        Self {
            vocabulary: Vocabulary::new(config.vocabulary.iter().copied()),
            device,
            windows: ChannelWindows::new(&model.patches),
            model,
            config,
            steps: STEPS,
            prompt_mode: PromptMode::default(),
            sea: None,
        }
    }

    /// Returns the sampler with another number of steps, 1 to 1000.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] for another number.
    pub fn with_steps(self, steps: usize) -> Result<Self> {
        check_range("steps", steps as f64, 1.0, 1000.0)?;
        Ok(Self { steps, ..self })
    }

    /// Returns the sampler with other inputs for the model.
    #[must_use]
    pub fn with_prompt_mode(self, prompt_mode: PromptMode) -> Self {
        Self {
            prompt_mode,
            ..self
        }
    }

    /// Returns the sampler with a sea learnt from real images, instead of the model's sea and speckle.
    ///
    /// The image is then the expected image of the scene, times a learnt sea of mean 1 with its speckle, plus the echoes of
    /// the ships, see [`SeaTexture::image`]. Only the prompt parser of the model is used; the learnt sea sets the steps.
    /// Labels do not change.
    ///
    /// # Errors
    ///
    /// As [`SeaTexture::check_spacing`].
    pub fn with_sea(self, sea: SeaTexture) -> Result<Self> {
        sea.check_spacing(self.config.spacing)?;
        Ok(Self {
            sea: Some(sea),
            ..self
        })
    }

    /// Number of steps from noise to image.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Scene whose values [`sample`](Self::sample) uses where a prompt leaves them open: the default scene, on the model's grid.
    pub fn base_scene(&self) -> Scene {
        self.config.base_scene()
    }

    /// Checks that a scene is within the model's training ranges.
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::check_scene`].
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        self.config.check_scene(scene)
    }

    /// Samples an image of a prompt, with its scene and labels.
    ///
    /// # Errors
    ///
    /// [`Error::NothingStated`] for a prompt that states nothing about a scene, [`Error::Text`] for one whose numbers
    /// contradict each other or are out of range, [`Error::Scene`] for a scene that the physics rejects,
    /// [`wake_nn::Error::NotFinite`] for a model whose numbers overflow.
    pub fn sample(&self, prompt: &str, seed: u64) -> Result<WakeImage> {
        let mut images = self.sample_many(&[prompt], seed)?;
        Ok(images.swap_remove(0))
    }

    /// Samples an image of each prompt; image k has the seed `seed + k`.
    ///
    /// Calls whose seeds differ by less than the number of prompts share seas: in a loop, increase the seed by that number.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample), and [`wake_nn::Error::InvalidOption`] without a prompt.
    pub fn sample_many(&self, prompts: &[&str], seed: u64) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        let input = |(k, prompt): (u64, &&str)| -> Result<Input> {
            let reading = Reading::of(prompt)?;
            if reading.states_nothing() {
                return Err(Error::NothingStated {
                    prompt: (*prompt).to_owned(),
                });
            }
            let mut scene = reading.scene.onto(&self.base_scene())?;
            scene.seed = seed.wrapping_add(k);
            Ok(Input {
                unread: reading
                    .unread
                    .iter()
                    .any(Unread::is_of_the_field)
                    .then_some(reading.scene),
                words: (*prompt).to_owned(),
                scene,
            })
        };
        let inputs: Result<Vec<Input>> = (0..).zip(prompts).map(input).collect();
        self.run(&inputs?, begin)?.images()
    }

    /// Samples an image of each scene.
    ///
    /// # Errors
    ///
    /// As [`sample_batch`](Self::sample_batch).
    pub fn sample_scenes(&self, scenes: &[Scene]) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        self.run(&self.inputs(scenes)?, begin)?.images()
    }

    /// Samples an image of each scene in one batch on the device, with the labels of the scenes.
    ///
    /// Only images of a learnt sea contain speckle.
    ///
    /// # Shapes
    ///
    /// `[scenes, 1, rows, columns]`, grey 0…1.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] without a scene, or for one outside the training ranges, see
    /// [`WakeModelConfig::check_scene`]; [`Error::Text`] for an invalid scene; [`wake_nn::Error::NotFinite`] for a model
    /// whose numbers overflow.
    pub fn sample_batch(&self, scenes: &[Scene]) -> Result<(Tensor<4>, Vec<Labels>)> {
        let drawn = self.run(&self.inputs(scenes)?, Instant::now())?;
        let labels = drawn.scenes.par_iter().map(labels_of).collect();
        Ok((drawn.grey, labels))
    }

    /// Checks scenes, and puts them into words if the prompt mode needs words.
    fn inputs(&self, scenes: &[Scene]) -> Result<Vec<Input>> {
        let input = |scene: &Scene| {
            self.config.check_scene(scene)?;
            Ok(Input {
                unread: None,
                words: match self.prompt_mode {
                    PromptMode::Words => Wording::Paper.prompt(scene)?,
                    _ => String::new(),
                },
                scene: scene.clone(),
            })
        };
        scenes.iter().map(input).collect()
    }

    /// Samples all images at once, from noise to grey.
    fn run(&self, inputs: &[Input], begin: Instant) -> Result<Drawn> {
        on_pool(&self.device, || self.run_here(inputs, begin))
    }

    fn run_here(&self, inputs: &[Input], begin: Instant) -> Result<Drawn> {
        if inputs.is_empty() {
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "images".to_owned(),
                value: "0".to_owned(),
                expected: "at least one prompt or scene".to_owned(),
            }));
        }
        let mut seconds = SampleSeconds::default();
        let mut last = begin;
        let mut lap = || {
            let now = Instant::now();
            now.duration_since(std::mem::replace(&mut last, now))
                .as_secs_f64()
        };
        let scenes = self.resolved(inputs)?;
        seconds.text = lap();
        if let Some(sea) = &self.sea {
            let intensities = scenes.iter().map(|scene| sea.image(scene));
            let intensities: Vec<Field> = intensities.collect::<Result<_>>()?;
            seconds.denoise = lap();
            seconds.total = seconds.text + seconds.denoise;
            return Ok(Drawn {
                grey: grey_of(&intensities, &self.config.grey, &self.device),
                pixels: Pixels::WithSpeckle(intensities),
                scale: self.config.grey,
                scenes,
                seconds,
            });
        }
        let sources = scenes.iter().map(|scene| NoiseSource::new(scene.seed));
        let sources: Vec<NoiseSource> = sources.collect();
        // The two are independent, and one of them alone does not fill all cores for a single image.
        let (expected, seas) = rayon::join(
            || expected_greys(&scenes, &self.config.grey),
            || SeaFields::new(&scenes, &sources, &self.windows),
        );
        let (expected, seas) = (expected?, seas?);
        let slopes = expected
            .iter()
            .map(|grey| slope_of(grey, &self.config.grey));
        let deviations = seas.log_deviations(&self.windows, &slopes.collect::<Vec<_>>());
        let patches = &self.model.patches;
        let image = images_of(&scenes, &expected, patches);
        let inputs = ConditioningInputs::new(&scenes, patches.encode(image.clone()).0, &deviations);
        let expected = self.model.prior.forward(&inputs);
        check_finite("the mean of the image", &expected.mean)?;
        seconds.expect = lap();
        let noise = seas.noise(&scenes, &sources, patches);
        let latents = self.denoise(&inputs, &expected, noise);
        check_finite("the latents of the image", &latents)?;
        seconds.denoise = lap();
        let grey = self.model.decode(latents, (&expected, &inputs), image);
        check_finite("the image", &grey)?;
        let pixels: Vec<f32> = grey.to_data().iter::<f32>().collect();
        seconds.decode = lap();
        seconds.total = seconds.text + seconds.expect + seconds.denoise + seconds.decode;
        Ok(Drawn {
            scenes,
            grey,
            scale: self.config.grey,
            pixels: Pixels::Grey(pixels),
            seconds,
        })
    }

    /// Scenes to sample: as given, or completed by the model from words that the grammar did not recognise.
    fn resolved(&self, inputs: &[Input]) -> Result<Vec<Scene>> {
        let asked = |input: &Input| match self.prompt_mode {
            // For words that are all recognised, the model would only add values that they do not state.
            PromptMode::Both => input.unread.is_some(),
            PromptMode::Words => true,
            PromptMode::Numbers => false,
        };
        let prompts = inputs.iter().filter(|input| asked(input));
        let prompts: Vec<&str> = prompts.map(|input| input.words.as_str()).collect();
        let mut answers = match prompts.is_empty() {
            true => Vec::new(),
            false => self.model.read(&prompts, &self.vocabulary, &self.device),
        }
        .into_iter();
        let scene = |input: &Input| {
            let Some(read) = asked(input).then(|| answers.next()).flatten() else {
                return Ok(input.scene.clone());
            };
            let (stated, base) = match self.prompt_mode {
                PromptMode::Words => (PartialScene::default(), self.unspoken(&input.scene)),
                _ => (input.unread.unwrap_or_default(), input.scene.clone()),
            };
            Ok(stated.or(read).onto(&base)?)
        };
        inputs.iter().map(scene).collect()
    }

    /// Scene with ship, wind, depth and incidence of the base scene, to be completed from words alone.
    fn unspoken(&self, scene: &Scene) -> Scene {
        let (mut scene, base) = (scene.clone(), self.base_scene());
        match base.ships.first() {
            None => scene.ships.clear(),
            Some(told) => {
                if scene.ships.is_empty() {
                    scene.ships.push(Ship::default());
                }
                let ship = &mut scene.ships[0];
                (ship.speed, ship.heading) = (told.speed, told.heading);
                (ship.position, ship.length) = (told.position, told.length);
            }
        }
        let (sea, told) = (&mut scene.sea, &base.sea);
        (sea.wind_speed, sea.wind_toward) = (told.wind_speed, told.wind_toward);
        (sea.fetch, sea.depth) = (told.fetch, told.depth);
        scene.radar.incidence = base.radar.incidence;
        scene
    }

    /// Euler steps along the flow, from noise to latents.
    fn denoise(
        &self,
        inputs: &ConditioningInputs,
        expected: &Expected,
        noise: Tensor<4>,
    ) -> Tensor<4> {
        let [batch, ..] = noise.dims();
        let mut x = noise;
        let prepared = self.model.flow.cached(inputs);
        for [from, to] in levels(self.steps) {
            let sigma = Tensor::full([batch], from, &self.device);
            let velocity = self.model.flow.velocity(x.clone(), sigma, &prepared);
            x = x - velocity * (FRAC_PI_2 * (from - to));
        }
        expected.latents(x)
    }
}

/// Noise levels at the beginning and end of each step, 1 − (k/n)^1.2, falling from 1 to 0. The first steps are shorter,
/// where the flow bends most. The exponent is chosen.
fn levels(steps: usize) -> impl Iterator<Item = [f64; 2]> {
    let level = move |k: usize| 1.0 - (k as f64 / steps as f64).powf(1.2);
    (0..steps).map(move |k| [level(k), level(k + 1)])
}

/// Input of one image.
struct Input {
    /// The given scene, or the scene that the prompt states.
    scene: Scene,
    words: String,
    /// Values that the prompt states, if it has unrecognised words that may state a value.
    unread: Option<PartialScene>,
}

/// Images as sampled from the model.
struct Drawn {
    /// Scenes of the images.
    scenes: Vec<Scene>,
    grey: Tensor<4>,
    scale: GreyScale,
    pixels: Pixels,
    seconds: SampleSeconds,
}

/// All pixels of a batch.
enum Pixels {
    /// Grey of all images, one after another.
    Grey(Vec<f32>),
    /// Intensities that already have speckle.
    WithSpeckle(Vec<Field>),
}

/// Converts intensities of one size to grey, `[images, 1, rows, columns]`.
fn grey_of(intensities: &[Field], scale: &GreyScale, device: &Device) -> Tensor<4> {
    let size = intensities.first().map_or([0, 0], |f| [f.rows, f.columns]);
    let values = intensities.iter().flat_map(|f| &f.values);
    let grey: Vec<f32> = values.map(|&v| scale.grey(f64::from(v)) as f32).collect();
    let shape = [intensities.len(), 1, size[0], size[1]];
    Tensor::from_data(TensorData::new(grey, shape), device)
}

impl Drawn {
    /// The images with their speckle and labels.
    fn images(self) -> Result<Vec<WakeImage>> {
        let [_, _, rows, columns] = self.grey.dims();
        let pixels = match self.pixels {
            Pixels::Grey(pixels) => pixels,
            Pixels::WithSpeckle(intensities) => {
                let images = intensities.into_par_iter().zip(self.scenes);
                let drawn = |(image, scene)| {
                    WakeImage::with_speckle(image, self.scale, scene, self.seconds)
                };
                return Ok(images.map(drawn).collect());
            }
        };
        let images = pixels.par_chunks(rows * columns);
        images
            .zip(self.scenes)
            .map(|(pixels, scene)| {
                let grey = Field {
                    rows,
                    columns,
                    values: pixels.to_vec(),
                };
                WakeImage::new(grey, self.scale, scene, self.seconds)
            })
            .collect()
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
