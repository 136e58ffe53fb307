//! Loop over the steps, as an iterator.

use burn::tensor::Tensor;

use super::guidance::Guidance;
use super::request::{Request, StartImage, invalid};
use super::{Pipeline, check_shape};
use crate::error::Result;
use crate::stable_diffusion::scheduler::{Scheduler, StepInput};
use crate::streams::{INITIAL_STREAM, POSTERIOR_STREAM, STEP_STREAM};
use crate::unet::UNetInput;
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::{check_finite, on_pool};

/// Progress of a run, with its current latents.
#[derive(Debug)]
pub struct Progress {
    /// Number of model calls made.
    pub done: usize,
    /// Total number of model calls.
    pub of: usize,
    /// Training step of this model call.
    pub timestep: f64,
    /// The noisy latent images after this step.
    pub latents: Tensor<4>,
    /// The model's current estimate of the clean latent images: decode it for a preview.
    pub denoised: Tensor<4>,
}

/// A run of the sampler, one step per item.
///
/// Stop iterating to pause or cancel the run; [`latents`](Self::latents) returns the current state.
#[derive(Debug)]
pub struct Sampling<'a> {
    pipeline: &'a Pipeline,
    scheduler: Box<dyn Scheduler>,
    guidance: Option<Guidance>,
    /// `[images, tokens, width]`.
    prompts: Tensor<3>,
    /// Embeddings of the negative prompts, only with guidance.
    negatives: Option<Tensor<3>>,
    condition: Option<Tensor<2>>,
    sources: Vec<NoiseSource>,
    step_noise: Option<Tensor<5>>,
    images_at_once: usize,
    latents: Tensor<4>,
    first: usize,
    next: usize,
}

impl Pipeline {
    /// Starts a run, which so far only runs the text encoder (and the encoder of a start image).
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] or [`wake_nn::Error::InvalidOption`] for a request that is invalid or does not
    /// fit these models, and the errors of [`SchedulerConfig::scheduler`](crate::scheduler::SchedulerConfig::scheduler).
    pub fn sample(&self, request: &Request) -> Result<Sampling<'_>> {
        Sampling::new(self, request)
    }

    /// Samples images in [0, 1] in a whole run, `[images, channels, rows, columns]`.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample), and [`wake_nn::Error::NotFinite`] for a model whose numbers overflow.
    pub fn generate(&self, request: &Request) -> Result<Tensor<4>> {
        let latents = self.sample(request)?.finish();
        check_finite("the latents of the image", &latents)?;
        Ok(self.decode(latents))
    }
}

impl<'a> Sampling<'a> {
    fn new(pipeline: &'a Pipeline, request: &Request) -> Result<Self> {
        request.validate()?;
        let shape = pipeline.latent_shape(request)?;
        let config = request
            .scheduler
            .as_ref()
            .unwrap_or(&pipeline.parts.scheduler);
        let scheduler = config.scheduler(request.steps)?;
        let first = first_call(request, scheduler.as_ref());
        let sources = request.sources();
        let noise = initial_noise(pipeline, request, &sources, shape)?;
        let latents = match &request.start {
            None => noise * scheduler.init_noise_sigma(),
            Some((image, _)) => {
                let clean = start_latents(pipeline, image, &sources, shape)?;
                scheduler.add_noise(clean, noise, first)
            }
        };
        let calls = scheduler.timesteps().len();
        check_step_noise(request, calls, shape)?;
        pipeline.check_condition(request)?;
        Ok(Self {
            guidance: request.guided().then_some(Guidance {
                scale: request.guidance,
                rescale: request.guidance_rescale,
            }),
            prompts: pipeline.contexts(&request.prompts, request)?,
            negatives: match request.guided() {
                true => Some(pipeline.contexts(&request.negative, request)?),
                false => None,
            },
            condition: request.condition.clone(),
            step_noise: request.step_noise.clone(),
            images_at_once: request.images_at_once,
            next: first,
            pipeline,
            scheduler,
            sources,
            latents,
            first,
        })
    }

    /// Current latent images.
    pub fn latents(&self) -> Tensor<4> {
        self.latents.clone()
    }

    /// Takes all remaining steps and returns the latents.
    pub fn finish(mut self) -> Tensor<4> {
        while self.next().is_some() {}
        self.latents
    }

    /// One prediction per image, computed for a few images at a time.
    fn predict(&self, index: usize) -> Tensor<4> {
        let input = self
            .scheduler
            .scale_model_input(self.latents.clone(), index);
        let images = input.dims()[0];
        let chunks = (0..images).step_by(self.images_at_once).map(|start| {
            let length = self.images_at_once.min(images - start);
            self.predict_some(input.clone().narrow(0, start, length), index, start)
        });
        Tensor::cat(chunks.collect(), 0)
    }

    /// Predictions of some images; with guidance, both halves are computed in one batch.
    fn predict_some(&self, input: Tensor<4>, index: usize, start: usize) -> Tensor<4> {
        let images = input.dims()[0];
        let prompts = self.prompts.clone().narrow(0, start, images);
        let condition = self
            .condition
            .clone()
            .map(|rows| rows.narrow(0, start, images));
        let (Some(guidance), Some(negatives)) = (self.guidance, self.negatives.clone()) else {
            return self.call(input, prompts, condition, index);
        };
        let negatives = negatives.narrow(0, start, images);
        let both = self.call(
            input.repeat_dim(0, 2),
            Tensor::cat(vec![negatives, prompts], 0),
            condition.map(|rows| rows.repeat_dim(0, 2)),
            index,
        );
        guidance.combine(both)
    }

    fn call(
        &self,
        sample: Tensor<4>,
        context: Tensor<3>,
        condition: Option<Tensor<2>>,
        index: usize,
    ) -> Tensor<4> {
        let timestep = self.scheduler.timesteps()[index];
        let batch = sample.dims()[0];
        let timesteps = Tensor::full([batch], timestep, &self.pipeline.device);
        let input = UNetInput {
            sample,
            timesteps,
            context: Some(context),
            condition,
        };
        on_pool(&self.pipeline.device, || {
            self.pipeline.parts.unet.forward(input)
        })
    }

    /// Noise of a step, if it needs any.
    fn noise(&self, index: usize) -> Option<Tensor<4>> {
        if !self.scheduler.needs_noise(index) {
            return None;
        }
        let [images, channels, rows, columns] = self.latents.dims();
        if let Some(given) = &self.step_noise {
            let row = given.clone().narrow(0, index - self.first, 1);
            return Some(row.reshape([images, channels, rows, columns]));
        }
        let stream = STEP_STREAM + index as u32;
        let shape = [channels, rows, columns];
        Some(normal_batch(
            &self.sources,
            stream,
            shape,
            &self.pipeline.device,
        ))
    }
}

impl Iterator for Sampling<'_> {
    type Item = Progress;

    fn next(&mut self) -> Option<Progress> {
        let index = self.next;
        let timestep = *self.scheduler.timesteps().get(index)?;
        let prediction = self.predict(index);
        let (sample, noise) = (self.latents.clone(), self.noise(index));
        let output = self.scheduler.step(StepInput {
            index,
            prediction,
            sample,
            noise,
        });
        self.latents = output.sample;
        self.next += 1;
        Some(Progress {
            done: self.next - self.first,
            of: self.scheduler.timesteps().len() - self.first,
            timestep,
            latents: self.latents.clone(),
            denoised: output.denoised,
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.scheduler.timesteps().len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Sampling<'_> {}

/// First model call of a run, after the calls that its strength skips.
fn first_call(request: &Request, scheduler: &dyn Scheduler) -> usize {
    let Some((_, strength)) = request.start else {
        return 0;
    };
    let taken = ((request.steps as f64 * strength) as usize).min(request.steps);
    (request.steps - taken) * scheduler.calls_per_step()
}

fn initial_noise(
    pipeline: &Pipeline,
    request: &Request,
    sources: &[NoiseSource],
    shape: [usize; 3],
) -> Result<Tensor<4>> {
    let Some(given) = &request.latents else {
        return Ok(normal_batch(
            sources,
            INITIAL_STREAM,
            shape,
            &pipeline.device,
        ));
    };
    let expected = [sources.len(), shape[0], shape[1], shape[2]];
    check_shape("latents", &given.dims(), &expected)?;
    Ok(given.clone())
}

/// Clean latent images of a start image, one per image of the run.
fn start_latents(
    pipeline: &Pipeline,
    image: &StartImage,
    sources: &[NoiseSource],
    shape: [usize; 3],
) -> Result<Tensor<4>> {
    let images = sources.len();
    let latents = match image {
        StartImage::Latents(latents) => latents.clone(),
        StartImage::Pixels(pixels) => {
            let pixels = one_each("number of start images", pixels.clone(), images)?;
            pipeline.check_pixels(&pixels, shape)?;
            let noise = normal_batch(sources, POSTERIOR_STREAM, shape, &pipeline.device);
            pipeline.encode(pixels, noise)
        }
    };
    let latents = one_each("number of start images", latents, images)?;
    check_shape("start latents", &latents.dims()[1..], &shape)?;
    Ok(latents)
}

/// Repeats a single entry for every image.
fn one_each(name: &str, x: Tensor<4>, images: usize) -> Result<Tensor<4>> {
    match x.dims()[0] {
        1 => Ok(x.repeat_dim(0, images)),
        found if found == images => Ok(x),
        found => Err(invalid(
            name,
            found,
            format!("1 or {images}, one per image"),
        )),
    }
}

fn check_step_noise(request: &Request, calls: usize, [c, h, w]: [usize; 3]) -> Result<()> {
    let Some(noise) = &request.step_noise else {
        return Ok(());
    };
    let steps = noise.dims()[0].min(calls);
    let found = [&[steps], &noise.dims()[1..]].concat();
    check_shape("step noise", &found, &[calls, request.images(), c, h, w])
}
