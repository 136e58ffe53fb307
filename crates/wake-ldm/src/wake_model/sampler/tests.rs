//! Tests of the embedded model through the public interface.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::module::Param;
use burn::tensor::Device;
use wake_physics::grey::GreyScale;

use super::*;
use crate::network::PhysicsPrior;
use crate::sea_texture::{SeaFlow, SeaStyle};

const PROMPT: &str = "Simulated SAR image of wakes from a ship moving at 10 mps toward 135 degrees. Ocean waves are \
                      shaped by 3 mps wind directing toward 90 degrees and 10000 meter fetch. Captured at 32 degree \
                      incidence.";

fn sampler() -> WakeSampler {
    let sampler = WakeSampler::pretrained(&Device::flex()).unwrap();
    sampler.with_steps(1).unwrap()
}

fn is_shared_by_threads<T: Clone + Send>(_: &T) {}

#[test]
fn a_prompt_becomes_an_image_with_the_labels_of_its_numbers() {
    let sampler = sampler();
    is_shared_by_threads(&sampler);
    let image = sampler.sample(PROMPT, 7).unwrap();
    assert_eq!([image.grey.rows, image.grey.columns], [256, 256]);
    assert!(image.grey.values.iter().all(|g| (0.0..=1.0).contains(g)));
    let ship = &image.scene.ships[0];
    assert!((ship.speed - 10.0).abs() < 1e-12 && (ship.heading - 135.0).abs() < 1e-12);
    assert_eq!(image.labels, labels_of(&image.scene));
    let looks = f64::from(image.scene.radar.looks);
    let ratios = image.speckled.values.iter().zip(&image.intensity.values);
    let ratios: Vec<f64> = ratios.map(|(a, b)| f64::from(a / b)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / ratios.len() as f64;
    // Speckle has mean 1 and variance 1/looks; 65,536 pixels give both to five standard errors.
    assert!(
        (mean - 1.0).abs() < 5.0 / (looks * 65536.0).sqrt(),
        "{mean}"
    );
    assert!(
        (variance * looks - 1.0).abs() < 5.0 * (12.0f64 / 65536.0).sqrt(),
        "{variance}"
    );
    let levels = image.levels();
    let scale = GreyScale::default();
    assert_eq!(levels.len(), image.speckled.values.len());
    for (&level, &value) in levels.iter().zip(&image.speckled.values) {
        let grey = 255.0 * scale.grey(f64::from(value));
        assert!((grey - f64::from(level)).abs() <= 0.5, "{level} {grey}");
    }
    // Each stage takes some time, and the stages add up to the total.
    let s = image.seconds;
    let stages = [s.text, s.expect, s.denoise, s.decode];
    assert!(
        stages
            .iter()
            .all(|&seconds| seconds > 0.0 && seconds < s.total),
        "{s:?}"
    );
    assert!(
        (stages.iter().sum::<f64>() / s.total - 1.0).abs() < 1e-12,
        "{s:?}"
    );
}

/// Levels, intensity and the image of a learnt sea all use the model's own grey mapping.
#[test]
fn grey_is_that_of_the_models_mapping() {
    let mut sampler = sampler();
    let decibel = sampler.sample(PROMPT, 3).unwrap();
    sampler.config.grey = GreyScale::amplitude_around(0.05);
    let scale = sampler.config.grey;
    let on_sea = sampler.clone().with_sea(white_sea(Some(4.0))).unwrap();
    for image in [
        sampler.sample(PROMPT, 3).unwrap(),
        on_sea.sample(PROMPT, 3).unwrap(),
    ] {
        assert_eq!(image.scale, scale);
        for (&grey, &power) in image.grey.values.iter().zip(&image.intensity.values) {
            let expected = scale.grey(f64::from(power));
            // Grey from the network may exceed its range; clamped values are not compared.
            if (0.0..=1.0).contains(&grey) {
                assert!(
                    (f64::from(grey) - expected).abs() < 1e-6,
                    "{grey} {expected}"
                );
            }
        }
        let levels = image.levels();
        for (&level, &power) in levels.iter().zip(&image.speckled.values) {
            assert_eq!(level, scale.level(f64::from(power)));
        }
    }
    // The expected image from which it starts uses that mapping, too.
    let other = sampler.sample(PROMPT, 3).unwrap();
    assert!(distance(&decibel.grey.values, &other.grey.values) > 1e-3);
}

#[test]
fn levels_fall_from_all_noise_to_none_step_after_step() {
    assert_eq!(levels(1).collect::<Vec<_>>(), [[1.0, 0.0]]);
    let (from, to): (Vec<f64>, Vec<f64>) = levels(4).map(|[from, to]| (from, to)).unzip();
    assert_eq!((from[0], to[3]), (1.0, 0.0));
    assert_eq!(from[1..].to_vec(), to[..3].to_vec());
    let drops: Vec<f64> = from.iter().zip(to).map(|(from, to)| from - to).collect();
    assert!(drops[0] > 0.0 && drops.is_sorted_by(|before, after| before < after));
}

/// A constant velocity b moves the noise by −b π/2 over the quarter circle, in any number of steps.
#[test]
fn steps_follow_the_velocity_from_noise_to_latents() {
    let mut sampler = sampler();
    sampler.model.flow = sampler.model.flow.clone().map(&mut Constant);
    let scene = sampler.base_scene();
    let patches = &sampler.model.patches;
    let physics = PhysicsPrior::new(&scene, &sampler.config.grey, patches).unwrap();
    let scenes = [scene];
    let image = images_of(&scenes, &[physics.grey], patches);
    let inputs = ConditioningInputs::new(&scenes, patches.encode(image).0, &physics.log_deviations);
    let expected = sampler.model.prior.forward(&inputs);
    let noise = expected.mean.zeros_like() + 0.5;
    let there = expected.latents(noise.clone() - 0.1 * FRAC_PI_2);
    for steps in [1, 3] {
        let sampler = sampler.clone().with_steps(steps).unwrap();
        let found = sampler.denoise(&inputs, &expected, noise.clone());
        let far: f32 = (found - there.clone()).abs().max().into_scalar();
        let moved: f32 = (expected.latents(noise.clone()) - there.clone())
            .abs()
            .max()
            .into_scalar();
        assert!(
            far < 1e-4 * moved && moved > 0.0,
            "{steps}: {far:e} {moved}"
        );
    }
}

/// Sets all weights of a network to 0 and its biases to 0.1, so that it returns 0.1 everywhere.
struct Constant;

impl burn::module::ModuleMapper for Constant {
    fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
        weight.map(|weight| weight.zeros_like() + if D == 1 { 0.1 } else { 0.0 })
    }
}

/// If all words are recognised, the base scene and not the model gives the values that they leave open.
#[test]
fn nothing_is_added_to_words_that_are_understood() {
    let sampler = sampler();
    let base = sampler.base_scene();
    for prompt in [
        "A ship moving at 8 mps toward 45 degrees.",
        "wind 6 m/s toward 200 degrees",
        // Descriptive words state nothing that the model could add.
        "a red ship moving at 8 mps toward 45 degrees",
    ] {
        let scene = sampler.sample(prompt, 3).unwrap().scene;
        let said = Reading::of(prompt).unwrap().scene;
        let mut expected = said.onto(&base).unwrap();
        expected.seed = 3;
        assert_eq!(scene, expected, "{prompt}");
    }
}

/// Scenes that differ only in their seeds.
fn scenes(sampler: &WakeSampler, seeds: &[u64]) -> Vec<Scene> {
    let base = sampler.base_scene();
    let scene = |&seed: &u64| Scene {
        seed,
        ..base.clone()
    };
    seeds.iter().map(scene).collect()
}

/// Largest difference between two images.
fn distance(a: &[f32], b: &[f32]) -> f32 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f32::max)
}

/// Allowed difference for the same image: matrix products of another size may sum in another order.
const SAME: f32 = 1e-4;
/// Two seas differ by more than this in some pixel.
const OTHER: f32 = 1e-2;

/// A loop that increases its seed by one must not repeat a sea of the batch before.
#[test]
fn the_seed_of_a_scene_is_its_own_in_every_batch() {
    let sampler = sampler();
    let draw = |seeds: &[u64]| -> Vec<Vec<f32>> {
        let images = sampler.sample_scenes(&scenes(&sampler, seeds)).unwrap();
        assert!(
            images
                .iter()
                .zip(seeds)
                .all(|(image, &seed)| image.scene.seed == seed)
        );
        images.into_iter().map(|image| image.grey.values).collect()
    };
    let (first, second) = (draw(&[3, 9]), draw(&[4, 3]));
    assert!(distance(&first[0], &second[1]) < SAME);
    for (a, b) in [
        (&first[0], &first[1]),
        (&first[1], &second[0]),
        (&first[0], &second[0]),
    ] {
        assert!(distance(a, b) > OTHER);
    }
    let (batch, labels) = sampler.sample_batch(&scenes(&sampler, &[9])).unwrap();
    assert_eq!((batch.dims(), labels.len()), ([1, 1, 256, 256], 1));
    let pixels: Vec<f32> = batch.into_data().iter::<f32>().collect();
    assert!(distance(&pixels, &first[1]) < SAME);
    let prompts = sampler.sample_many(&[PROMPT, PROMPT], u64::MAX).unwrap();
    assert_eq!(
        [u64::MAX, 0],
        [prompts[0].scene.seed, prompts[1].scene.seed]
    );
}

/// The result holds the sampled scene: sampling it again from its numbers gives the same image and labels.
#[test]
fn image_labels_and_scene_are_one() {
    let sampler = sampler();
    let only_in_words = "a ship steaming at 8 mps due north, 4 mps wind toward 90 degrees";
    let mut open = sampler.base_scene();
    open.ships.clear();
    let no_ship = Wording::Paper.prompt(&open).unwrap();
    let mut elsewhere = sampler.base_scene();
    elsewhere.ships[0].position = [150.0, -100.0];
    for conditioning in [PromptMode::Both, PromptMode::Words, PromptMode::Numbers] {
        let told = sampler.clone().with_prompt_mode(conditioning);
        let mut images = vec![
            told.sample_scenes(std::slice::from_ref(&elsewhere))
                .unwrap()
                .remove(0),
        ];
        images.extend(
            told.sample_many(&[PROMPT, only_in_words, &no_ship], 5)
                .unwrap(),
        );
        let drawn: Vec<Scene> = images.iter().map(|image| image.scene.clone()).collect();
        let numbers = sampler.clone().with_prompt_mode(PromptMode::Numbers);
        let again = numbers.sample_scenes(&drawn).unwrap();
        for (image, again) in images.iter().zip(&again) {
            let far = distance(&image.grey.values, &again.grey.values);
            assert!(far < SAME, "{conditioning:?} {far}: {:?}", image.scene);
            assert_eq!(image.labels, labels_of(&image.scene));
            assert_eq!(image.scene, again.scene);
        }
        let [x, y] = drawn[0].ships[0].position;
        let expected = match conditioning {
            PromptMode::Words => [0.0, 0.0],
            _ => [150.0, -100.0],
        };
        let far = (x - expected[0]).hypot(y - expected[1]);
        assert!(far < 1e-9, "{conditioning:?}: {far} m");
        assert!(drawn[3].ships.is_empty(), "{conditioning:?}");
    }
}

/// A given scene is returned unchanged: without wind, with its direction, and with a second ship.
#[test]
fn a_given_scene_is_drawn_untouched() {
    let sampler = sampler();
    let mut calm = sampler.base_scene();
    (calm.sea.wind_speed, calm.sea.wind_toward) = (0.0, 77.0);
    let mut two = sampler.base_scene();
    (two.seed, two.sea.wind_toward) = (3, 12.34567);
    two.ships.push(two.ships[0].clone());
    two.ships[1].position = [120.0, 250.0];
    for scene in [calm, two] {
        let input = [Input {
            unread: None,
            words: String::new(),
            scene: scene.clone(),
        }];
        assert_eq!(sampler.resolved(&input).unwrap(), [scene]);
    }
}

/// With words alone, the parser decides whether there is a ship, and labels and image follow it.
#[test]
fn an_open_sea_that_only_the_words_state_has_no_labels_of_a_ship() {
    let sampler = sampler().with_prompt_mode(PromptMode::Words);
    let mut scene = sampler.base_scene();
    scene.ships.clear();
    let mut told = Input {
        unread: None,
        words: Wording::Paper.prompt(&scene).unwrap(),
        scene: sampler.base_scene(),
    };
    let open = sampler
        .run(&[told], Instant::now())
        .unwrap()
        .images()
        .unwrap()
        .remove(0);
    assert!(open.scene.ships.is_empty());
    assert_eq!(open.labels, labels_of(&open.scene));
    told = Input {
        words: PROMPT.to_owned(),
        unread: None,
        scene,
    };
    let with_ship = sampler
        .run(&[told], Instant::now())
        .unwrap()
        .images()
        .unwrap()
        .remove(0);
    assert!(!with_ship.scene.ships.is_empty());
    assert_eq!(with_ship.labels, labels_of(&with_ship.scene));
}

#[test]
fn a_prompt_that_states_nothing_is_refused_before_drawing() {
    for prompt in ["a photo of a cat", ""] {
        let refused = sampler().sample(prompt, 0);
        assert!(
            matches!(&refused, Err(Error::NothingStated { .. })),
            "{prompt}"
        );
    }
}

#[test]
fn a_model_with_a_number_that_is_none_says_so() {
    let good = sampler();
    let mut model = good.model.clone();
    let broken = good.config.init_prior(&Device::flex());
    model.prior = broken.map(&mut Poison);
    let sampler = WakeSampler::new(model, good.config).unwrap();
    let refused = sampler.sample(PROMPT, 0);
    assert!(
        matches!(
            &refused,
            Err(Error::Model(wake_nn::Error::NotFinite { .. }))
        ),
        "{refused:?}"
    );
}

/// Makes every weight infinite.
struct Poison;

impl burn::module::ModuleMapper for Poison {
    fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
        weight.map(|weight| weight * f64::INFINITY)
    }
}

#[cfg(feature = "autodiff")]
#[test]
fn a_sampler_made_for_training_holds_no_gradients() {
    let device = Device::flex().autodiff();
    let good = sampler();
    let model = good.model.clone().map(&mut Tracked);
    assert!(model.devices().iter().all(Device::is_autodiff));
    let tracked = WakeSampler::new(model, good.config.clone()).unwrap();
    assert!(!tracked.device.is_autodiff());
    let one = scenes(&good, &[1]);
    let (batch, _) = tracked.sample_batch(&one).unwrap();
    assert!(!batch.is_autodiff());
    let read = WakeSampler::pretrained(&device).unwrap();
    let (batch, _) = read.with_steps(1).unwrap().sample_batch(&one).unwrap();
    assert!(!batch.is_autodiff());
}

/// Moves every weight to an autodiff device.
#[cfg(feature = "autodiff")]
struct Tracked;

#[cfg(feature = "autodiff")]
impl burn::module::ModuleMapper for Tracked {
    fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
        weight.map(|weight| Tensor::from_inner(weight).require_grad())
    }
}

#[test]
fn words_and_numbers_each_move_the_image() {
    let sampler = sampler();
    let grey = |told: PromptMode, prompt: &str| {
        sampler
            .clone()
            .with_prompt_mode(told)
            .sample(prompt, 1)
            .unwrap()
            .grey
            .values
    };
    let turned = PROMPT.replace("135", "315");
    for told in [PromptMode::Both, PromptMode::Words, PromptMode::Numbers] {
        let (a, b) = (grey(told, PROMPT), grey(told, &turned));
        assert!(
            a.iter().zip(&b).any(|(a, b)| (a - b).abs() > 1e-3),
            "{told:?}"
        );
    }
}

/// A learnt sea of white noise with an untrained flow.
fn white_sea(spacing: Option<f64>) -> SeaTexture {
    let white = NoiseSource::new(2).normal(0, 128 * 128);
    let patch = Field {
        rows: 128,
        columns: 128,
        values: white.into_iter().map(|n| 50.0 + 5.0 * n).collect(),
    };
    let style = SeaStyle::of(&patch).unwrap();
    SeaTexture::new(SeaFlow::new(&Device::flex()), &[style], spacing).unwrap()
}

/// A learnt sea changes only the sea: labels and scenes are the same as with the model's own sea.
#[test]
fn a_learnt_sea_changes_the_image_and_no_label() {
    let plain = sampler();
    let sea = white_sea(Some(4.0));
    let on_sea = plain.clone().with_sea(sea.clone()).unwrap();
    let [one, other] = [&plain, &on_sea].map(|s| s.sample(PROMPT, 3).unwrap());
    assert_eq!(one.labels, other.labels);
    assert_eq!(one.scene, other.scene);
    assert!(distance(&one.speckled.values, &other.speckled.values) > 1e-3);
    // One sea with one speckle: intensity and grey are those of the speckled image.
    assert_eq!(other.intensity, other.speckled);
    assert_eq!(other.intensity, sea.image(&other.scene).unwrap());
    let scale = GreyScale::default();
    for (grey, value) in other.grey.values.iter().zip(&other.intensity.values) {
        assert!((f64::from(*grey) - scale.grey(f64::from(*value))).abs() < 1e-6);
    }
    let again = on_sea.sample(PROMPT, 3).unwrap();
    assert_eq!(again.speckled, other.speckled);
    let seeds = on_sea.sample_many(&[PROMPT, PROMPT], 2).unwrap();
    assert_eq!(seeds[1].speckled, other.speckled);
    assert!(distance(&seeds[0].speckled.values, &other.speckled.values) > 1e-3);
    let (batch, labels) = on_sea
        .sample_batch(std::slice::from_ref(&other.scene))
        .unwrap();
    let grey: Vec<f32> = batch.into_data().iter::<f32>().collect();
    assert_eq!(labels, [other.labels]);
    assert_eq!(grey, other.grey.values);
    let coarse = plain
        .with_sea(white_sea(Some(10.0)))
        .unwrap_err()
        .to_string();
    assert!(
        coarse.contains("4 m") && coarse.contains("10 m"),
        "{coarse}"
    );
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let sampler = sampler();
    assert!(sampler.clone().with_steps(0).is_err() && sampler.clone().with_steps(1001).is_err());
    let message = sampler
        .sample_batch(&[Scene::default()])
        .unwrap_err()
        .to_string();
    assert!(message.contains("512 × 512 pixels of 2.5 m"), "{message}");
    assert!(sampler.sample("a ship at 900 m/s", 0).is_err());
    assert!(sampler.sample_many(&[], 0).is_err() && sampler.sample_batch(&[]).is_err());
    let nowhere = WakeSampler::from_folder("no/such/folder".as_ref(), &Device::flex());
    assert!(nowhere.is_err());
}
