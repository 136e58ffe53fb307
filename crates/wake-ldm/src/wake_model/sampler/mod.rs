//! The small model as one call: a sentence or a scene becomes a radar image with labels.

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
use wake_nn::{check_finite, check_range};

/// Steps from noise to image, unless others are asked for.
const STEPS: usize = 3;

/// Inputs that describe a scene to the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PromptMode {
    /// The numbers that [`wake_text`] reads from the words; where it leaves numbers or words of the field unread, also those
    /// that the model reads.
    #[default]
    Both,
    /// The words alone, as the model reads them.
    Words,
    /// The numbers alone.
    Numbers,
}

/// Draws radar images of ship wakes.
///
/// Prompt and values become one scene, which the result keeps: image, labels and speckle all follow from it, and
/// [`sample_scenes`](Self::sample_scenes) of it draws the same image again. Its seed is the image's seed.
///
/// Images are grey in the mapping that the model was trained with, [`WakeModelConfig::grey`], free of speckle as the model makes them.
/// The sampler holds no gradients, whatever device its model was made on, and may be given to another thread, for
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
    /// A sampler of a model with a valid configuration, on a device that may be faulty.
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

    /// The same sampler with another number of steps, 1 to 1000.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] for another number.
    pub fn with_steps(self, steps: usize) -> Result<Self> {
        check_range("steps", steps as f64, 1.0, 1000.0)?;
        Ok(Self { steps, ..self })
    }

    /// The same sampler with a model that sees less.
    #[must_use]
    pub fn with_prompt_mode(self, prompt_mode: PromptMode) -> Self {
        Self {
            prompt_mode,
            ..self
        }
    }

    /// The same sampler with a sea learnt from real images, instead of the model's own sea and of speckle.
    ///
    /// The image is then the one that physics expects of the scene, times a learnt sea of mean 1 with its speckle, and
    /// the echoes of the ships on it, see [`SeaTexture::image`]. Of the model the parser of prompts is used alone; steps
    /// are those of the learnt sea. Labels are as ever.
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

    /// Steps from noise to image.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The scene that [`sample`](Self::sample) takes what a prompt leaves open from: the default one, on the
    /// pixels of the model.
    pub fn base_scene(&self) -> Scene {
        self.config.base_scene()
    }

    /// Checks that a scene is one that the model can draw.
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::check_scene`].
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        self.config.check_scene(scene)
    }

    /// An image of a prompt, with the scene that was drawn and its labels.
    ///
    /// # Errors
    ///
    /// [`Error::NothingStated`] for a prompt that states nothing of a scene, [`Error::Text`] for one whose numbers
    /// contradict each other or are out of range, [`Error::Scene`] for a scene that physics refuses,
    /// [`wake_nn::Error::NotFinite`] for a model whose numbers overflow.
    pub fn sample(&self, prompt: &str, seed: u64) -> Result<WakeImage> {
        let mut images = self.sample_many(&[prompt], seed)?;
        Ok(images.swap_remove(0))
    }

    /// An image of each prompt; image k has the seed `seed + k`.
    ///
    /// Calls whose seeds are closer than their prompts are many share seas: a loop counts its seed up by the number of
    /// prompts.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample), and [`wake_nn::Error::InvalidOption`] for no prompt.
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

    /// An image of each scene.
    ///
    /// # Errors
    ///
    /// As [`sample_batch`](Self::sample_batch).
    pub fn sample_scenes(&self, scenes: &[Scene]) -> Result<Vec<WakeImage>> {
        let begin = Instant::now();
        self.run(&self.inputs(scenes)?, begin)?.images()
    }

    /// An image of each scene, in one batch on the device, without speckle but that of a learnt sea, and the labels of what
    /// was drawn.
    ///
    /// # Shapes
    ///
    /// `[scenes, 1, rows, columns]`, grey 0…1.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for no scene, or one that the model was not trained for, see
    /// [`WakeModelConfig::check_scene`]; [`Error::Text`] for one that is not valid; [`wake_nn::Error::NotFinite`] for a model
    /// whose numbers overflow.
    pub fn sample_batch(&self, scenes: &[Scene]) -> Result<(Tensor<4>, Vec<Labels>)> {
        let drawn = self.run(&self.inputs(scenes)?, Instant::now())?;
        let labels = drawn.scenes.par_iter().map(labels_of).collect();
        Ok((drawn.grey, labels))
    }

    /// Numbers and words of some scenes.
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

    /// From noise to grey, all images at once.
    fn run(&self, inputs: &[Input], begin: Instant) -> Result<Drawn> {
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
        // Neither needs the other, and one of a single image does not fill all cores.
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

    /// The scenes that are drawn: as they are given, or with what the model reads in words that the grammar did not understand.
    fn resolved(&self, inputs: &[Input]) -> Result<Vec<Scene>> {
        let asked = |input: &Input| match self.prompt_mode {
            // Of words that are all understood the model would only add what they do not say.
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

    /// A scene whose ship, wind, depth and incidence are those of the base scene: what words alone are put into.
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

    /// Euler's steps along the flow, from noise to latents.
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

/// Levels of noise that each step begins and ends at, 1 − (k/n)^1.2: from 1 down to 0, first in shorter steps, where the flow bends
/// most. The exponent is chosen.
fn levels(steps: usize) -> impl Iterator<Item = [f64; 2]> {
    let level = move |k: usize| 1.0 - (k as f64 / steps as f64).powf(1.2);
    (0..steps).map(move |k| [level(k), level(k + 1)])
}

/// What an image is drawn from.
struct Input {
    /// The scene that is given, or that the prompt states.
    scene: Scene,
    words: String,
    /// What the prompt states, where some of its words were not understood that may state a value.
    unread: Option<PartialScene>,
}

/// Images as they come from the model.
struct Drawn {
    /// What they show.
    scenes: Vec<Scene>,
    grey: Tensor<4>,
    scale: GreyScale,
    pixels: Pixels,
    seconds: SampleSeconds,
}

/// All pixels of a batch.
enum Pixels {
    /// Grey, of all images in a row.
    Grey(Vec<f32>),
    /// Intensities that have their speckle already.
    WithSpeckle(Vec<Field>),
}

/// Grey of some intensities of one size, `[images, 1, rows, columns]`.
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
