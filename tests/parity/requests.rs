//! What the pipeline promises whatever the models: seeds, batches, cancelling, hard prompts, errors.

use std::path::PathBuf;

use burn::tensor::Tensor;
use wake_ldm::pipeline::{Pipeline, Prompts, Request, StartImage};
use wake_ldm::scheduler::{SchedulerConfig, SchedulerOption};
use wake_nn::Error;

use crate::golden::{devices, difference, folder, numbers};

/// The folder of any pipeline among the fixtures.
fn models() -> PathBuf {
    let entries = std::fs::read_dir(folder()).expect("the folder of fixtures");
    let mut folders = entries.map(|entry| entry.unwrap().path());
    folders
        .find(|path| path.join("model_index.json").is_file())
        .expect("a pipeline")
}

fn pipelines() -> Vec<(&'static str, Pipeline)> {
    let models = models();
    let load = |device| Pipeline::load(&models, &device).unwrap();
    devices()
        .into_iter()
        .map(|(name, device)| (name, load(device)))
        .collect()
}

/// A small run that draws noise at every step.
fn noisy(prompts: impl Into<Prompts>) -> Request {
    let scheduler = SchedulerConfig::stable_diffusion("ddim")
        .unwrap()
        .with(SchedulerOption::Eta(1.0))
        .unwrap();
    Request::new(prompts)
        .with_scheduler(scheduler)
        .with_steps(3)
        .with_size(16, 24)
}

fn image(x: &Tensor<4>, k: usize) -> Vec<f32> {
    numbers(&x.clone().narrow(0, k, 1))
}

#[test]
#[allow(clippy::float_cmp, reason = "bit-identical is what is promised")]
fn an_image_of_a_batch_is_bit_identical_to_its_seed_alone() {
    for (backend, pipeline) in pipelines() {
        for guidance in [1.0, 7.5] {
            let seeds = [11, 7, 400, 2, 3];
            let of = |seeds: &[u64]| {
                let request = noisy("a ship and its wake").with_guidance(guidance);
                let request = request.with_count(seeds.len()).with_seeds(seeds.to_vec());
                let latents = pipeline.sample(&request).unwrap().finish();
                (pipeline.decode(latents.clone()), latents)
            };
            let alone: Vec<_> = seeds.iter().map(|&seed| of(&[seed])).collect();
            for batch in [1, 2, 5] {
                let (images, latents) = of(&seeds[..batch]);
                for (k, (alone_image, alone_latents)) in alone[..batch].iter().enumerate() {
                    let what = format!("{backend}, guidance {guidance}, image {k} of {batch}");
                    assert_eq!(image(&latents, k), image(alone_latents, 0), "{what}");
                    assert_eq!(image(&images, k), image(alone_image, 0), "{what}");
                }
            }
            assert_ne!(image(&alone[0].1, 0), image(&alone[1].1, 0));
        }
    }
}

#[test]
#[allow(clippy::float_cmp, reason = "the same computation twice")]
fn prompts_of_a_batch_do_not_mix() {
    for (_, pipeline) in pipelines() {
        let texts = ["a ship", "calm sea"].map(str::to_owned);
        let both = noisy(texts.to_vec()).with_seeds(vec![5, 5]);
        let both = pipeline.sample(&both).unwrap().finish();
        for (k, text) in texts.iter().enumerate() {
            let alone = pipeline
                .sample(&noisy(text.as_str()).with_seed(5))
                .unwrap()
                .finish();
            assert_eq!(image(&both, k), image(&alone, 0), "{text}");
        }
        let embedded = noisy(pipeline.embed(&texts)).with_seeds(vec![5, 5]);
        let embedded = pipeline.sample(&embedded).unwrap().finish();
        assert_eq!(numbers(&embedded), numbers(&both));
    }
}

/// Several images at once may differ in the last bits, and only there.
#[test]
fn images_at_once_agree_with_images_one_by_one() {
    for (backend, pipeline) in pipelines() {
        let request = noisy("a ship").with_count(5);
        let one = pipeline.sample(&request).unwrap().finish();
        let all = pipeline
            .sample(&request.with_images_at_once(4))
            .unwrap()
            .finish();
        let difference = difference(&numbers(&one), &numbers(&all));
        println!("{backend}: four images at once differ by {difference:e}");
        assert!(difference < 2e-4, "{difference}");
    }
}

/// Guidance at 1 and below runs the prompt's half alone: the negative prompt has no effect.
#[test]
#[allow(clippy::float_cmp, reason = "the same computation twice")]
fn without_guidance_the_negative_prompt_has_no_effect() {
    for (_, pipeline) in pipelines() {
        let of = |guidance: f64, negative: &str| {
            let request = noisy("a ship")
                .with_guidance(guidance)
                .with_negative(negative);
            numbers(&pipeline.sample(&request).unwrap().finish())
        };
        let plain = of(1.0, "");
        assert_eq!(of(1.0, "speckle"), plain);
        assert_eq!(of(0.0, "speckle"), plain);
        assert_ne!(of(1.5, "speckle"), of(1.5, ""));
        for guidance in [0.0, 1.0, 30.0, 1000.0] {
            assert!(of(guidance, "").iter().all(|x| x.is_finite()), "{guidance}");
        }
    }
}

#[test]
#[allow(clippy::float_cmp, reason = "the same computation twice")]
fn a_run_can_be_stopped_and_tells_how_far_it_is() {
    for (_, pipeline) in pipelines() {
        let request = noisy("a ship");
        let mut sampling = pipeline.sample(&request).unwrap();
        assert_eq!(sampling.len(), 3);
        let done: Vec<_> = sampling
            .by_ref()
            .take(2)
            .map(|p| (p.done, p.of, p.latents))
            .collect();
        assert_eq!(
            done.iter().map(|p| (p.0, p.1)).collect::<Vec<_>>(),
            [(1, 3), (2, 3)]
        );
        assert_eq!(sampling.len(), 1);
        assert_eq!(numbers(&sampling.latents()), numbers(&done[1].2));
        let whole = numbers(&pipeline.sample(&request).unwrap().finish());
        assert_eq!(numbers(&sampling.finish()), whole);
    }
}

#[test]
fn hard_prompts_give_finite_images() {
    let long = "a ship in the sea ".repeat(10_000 / 18 + 1);
    let prompts = [
        "",
        &long[..10_000],
        "Ein Schiff · 船と航跡 · кильватер 🚢",
        "\0\u{202e}<|endoftext|>",
    ];
    for (_, pipeline) in pipelines() {
        for prompt in prompts {
            let request = noisy(prompt).with_steps(1).with_negative(prompt);
            let images = numbers(&pipeline.generate(&request).unwrap());
            assert!(images.iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }
}

/// A start at full strength forgets nothing but noise; pixels and their latents start alike.
#[test]
fn a_start_image_steers_the_result() {
    for (_, pipeline) in pipelines() {
        let channels = pipeline.autoencoder().image_channels();
        let pixels = Tensor::<4>::full([1, channels, 16, 24], 0.8, pipeline.device());
        let at = |strength: f64| {
            let request = Request::new("a ship")
                .with_steps(10)
                .with_start(StartImage::Pixels(pixels.clone()), strength);
            let sampling = pipeline.sample(&request).unwrap();
            (sampling.len(), numbers(&sampling.latents()))
        };
        let zero = pipeline
            .sample(&noisy("a ship").with_size(16, 24))
            .unwrap()
            .latents();
        let ((few, near), (many, far)) = (at(0.1), at(1.0));
        assert!(few < many);
        let noise = numbers(&zero);
        assert!(difference(&far, &noise) > 0.0);
        // The less is replaced, the less of the start is noise.
        let energy = |x: &[f32]| x.iter().map(|x| f64::from(x * x)).sum::<f64>();
        let share = |x: &[f32]| {
            let dot: f64 = x.iter().zip(&noise).map(|(a, b)| f64::from(a * b)).sum();
            dot / (energy(x) * energy(&noise)).sqrt()
        };
        assert!(
            share(&near) < share(&far),
            "{} {}",
            share(&near),
            share(&far)
        );
    }
}

#[test]
fn requests_that_make_no_sense_are_refused_by_name() {
    let (_, pipeline) = pipelines().remove(0);
    let device = pipeline.device().clone();
    let [latent, channels] = {
        let autoencoder = pipeline.autoencoder();
        [autoencoder.latent_channels(), autoencoder.image_channels()]
    };
    let zeros = |shape: [usize; 4]| Tensor::<4>::zeros(shape, &device);
    let none: Vec<String> = vec![];
    let start = |shape| StartImage::Pixels(zeros(shape));
    let three = vec![String::new(), String::new(), String::new()];
    for (name, request) in [
        ("guidance", noisy("a").with_guidance(-1.0)),
        ("guidance", noisy("a").with_guidance(f64::NAN)),
        ("guidance_rescale", noisy("a").with_guidance_rescale(1.1)),
        ("steps", noisy("a").with_steps(0)),
        ("steps", noisy("a").with_steps(1001)),
        ("number of prompts", noisy(none)),
        ("count", noisy("a").with_count(0)),
        ("images_at_once", noisy("a").with_images_at_once(0)),
        ("number of seeds", noisy("a").with_seeds(vec![1, 2])),
        (
            "number of negative prompts",
            noisy("a").with_negative(three),
        ),
        ("rows", noisy("a").with_size(0, 16)),
        ("columns", noisy("a").with_size(16, 17)),
        ("rows", noisy("a").with_size(usize::MAX, 16)),
        (
            "shape of latents",
            noisy("a").with_latents(zeros([1, latent + 1, 8, 12])),
        ),
        (
            "strength",
            noisy("a").with_start(start([1, channels, 16, 24]), 0.0),
        ),
        (
            "shape of the start image",
            noisy("a").with_start(start([1, channels + 1, 16, 24]), 1.0),
        ),
        (
            "shape of the start image",
            noisy("a").with_start(start([1, channels, 16, 16]), 1.0),
        ),
        (
            "number of start images",
            noisy("a").with_start(start([3, channels, 16, 24]), 1.0),
        ),
        (
            "width of embeddings",
            noisy(Tensor::<3>::zeros([1, 77, 5], &device)),
        ),
        (
            "shape of condition",
            noisy("a").with_condition(Tensor::zeros([1, 6], &device)),
        ),
    ] {
        let error = pipeline.sample(&request).expect_err(name);
        let named = match &error {
            wake_ldm::Error::Model(Error::OutOfRange { name, .. }) => name,
            wake_ldm::Error::Model(Error::InvalidOption { option, .. }) => option,
            other => panic!("{name}: {other}"),
        };
        assert_eq!(named, name, "{error}");
    }
}

#[test]
#[cfg(feature = "flex")]
fn every_compiled_device_passes_the_self_check() {
    for (backend, device) in devices() {
        let failed = |error: &dyn std::fmt::Display| panic!("{backend}: {error}");
        wake_ldm::self_check(&device).unwrap_or_else(|error| failed(&error));
        #[cfg(feature = "train")]
        {
            wake_ldm::sampler::self_check(&device).unwrap_or_else(|error| failed(&error));
            wake_detector::self_check::check_device(&device).unwrap_or_else(|error| failed(&error));
            wake_train::self_check(&device).unwrap_or_else(|error| failed(&error));
        }
    }
}
