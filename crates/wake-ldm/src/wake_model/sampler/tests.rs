//! The model in the crate, as a user calls it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::tensor::Device;
use wake_physics::Scene;

use super::*;

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
    let ship = image.scene.ship.as_ref().unwrap();
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
    let seconds = image.seconds;
    assert!(seconds.total >= seconds.text.max(seconds.denoise).max(seconds.decode));
}

#[test]
fn an_image_is_the_same_alone_and_in_a_batch_and_differs_by_seed() {
    let sampler = sampler();
    let scenes = vec![sampler.base_scene(); 2];
    let (batch, labels) = sampler.sample_batch(&scenes, 3).unwrap();
    assert_eq!((batch.dims(), labels.len()), ([2, 1, 256, 256], 2));
    assert!(!batch.is_autodiff());
    let (alone, _) = sampler.sample_batch(&scenes[..1], 4).unwrap();
    let second = batch.clone().narrow(0, 1, 1);
    let distance = |a: Tensor<4>, b: Tensor<4>| (a - b).abs().max().into_scalar::<f32>();
    // Matrix products of another size may sum in another order.
    assert!(distance(second.clone(), alone) < 1e-4);
    assert!(distance(second, batch.narrow(0, 0, 1)) > 1e-2);
}

#[test]
fn words_and_numbers_each_move_the_image() {
    let sampler = sampler();
    let grey = |told: Conditioning, prompt: &str| {
        sampler
            .clone()
            .with_conditioning(told)
            .sample(prompt, 1)
            .unwrap()
            .grey
            .values
    };
    let turned = PROMPT.replace("135", "315");
    for told in [
        Conditioning::Both,
        Conditioning::Words,
        Conditioning::Numbers,
    ] {
        let (a, b) = (grey(told, PROMPT), grey(told, &turned));
        assert!(
            a.iter().zip(&b).any(|(a, b)| (a - b).abs() > 1e-3),
            "{told:?}"
        );
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let sampler = sampler();
    assert!(sampler.clone().with_steps(0).is_err() && sampler.clone().with_steps(1001).is_err());
    let message = sampler
        .sample_batch(&[Scene::default()], 0)
        .unwrap_err()
        .to_string();
    assert!(message.contains("512 × 512 pixels of 2.5 m"), "{message}");
    assert!(sampler.sample("a ship at 900 m/s", 0).is_err());
    assert!(sampler.sample_many(&[], 0).is_err() && sampler.sample_batch(&[], 0).is_err());
    let nowhere = WakeSampler::from_folder("no/such/folder".as_ref(), &Device::flex());
    assert!(nowhere.is_err());
}
