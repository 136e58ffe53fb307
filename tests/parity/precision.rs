//! Half precision and extreme numbers: finite, and as near as the numbers' own width allows.

use burn::tensor::{DType, Device, Distribution, Tensor};
use wake_ldm::Error;
use wake_ldm::nn::attention::attention;
use wake_ldm::nn::norm::GroupNorm;
use wake_ldm::unet::UNetInput;
use wake_ldm::weights::{self, Layout, Precision};

use crate::golden::{Golden, devices, difference, folder, json, largest, numbers};

/// The kinds of number that a device computes with, and the width of their last digit.
fn kinds(device: &Device) -> Vec<(DType, f64)> {
    let all = [(DType::F32, 6e-8), (DType::F16, 5e-4), (DType::BF16, 4e-3)];
    all.into_iter()
        .filter(|(dtype, _)| device.supports_dtype(*dtype))
        .collect()
}

fn cast<const D: usize>(x: Tensor<D>, dtype: DType) -> Tensor<D> {
    x.cast(burn::tensor::FloatDType::from(dtype))
}

/// Constant images have no variance; large ones overflow when squared in f16. Both give 0, up to the
/// rounding of the mean, which 1/√ε = 1000 enlarges.
#[test]
fn group_norm_of_constant_images_is_finite() {
    for (backend, device) in devices() {
        for (dtype, _) in kinds(&device) {
            for value in [0.0, 1.0, -3.5, 300.0, 60_000.0] {
                let x = cast(Tensor::full([1, 8, 16, 16], value, &device), dtype);
                let y = numbers(&GroupNorm::new(4, 8, 1e-6, &device).forward(x));
                let allowed = 1e3 * 6e-8 * f64::from(value as f32).abs() * 2048.0_f64.sqrt();
                assert!(
                    largest(&y) <= allowed,
                    "{backend} {dtype:?} {value}: {}",
                    largest(&y)
                );
            }
        }
    }
}

/// Images of ±1000 square to 10⁶, beyond f16; the result is that of f32, rounded.
#[test]
fn group_norm_does_not_overflow_in_half_precision() {
    for (backend, device) in devices() {
        let x = Tensor::random(
            [2, 8, 9, 7],
            Distribution::Uniform(-1000.0, 1000.0),
            &device,
        );
        for (dtype, digit) in kinds(&device) {
            let norm = GroupNorm::new(4, 8, 1e-5, &device);
            let narrow = cast(x.clone(), dtype);
            let expected = numbers(&norm.forward(cast(narrow.clone(), DType::F32)));
            let y = norm.forward(narrow);
            assert_eq!(y.dtype(), dtype, "the precision is kept");
            let worst = difference(&numbers(&y), &expected) / largest(&expected);
            assert!(worst <= digit, "{backend} {dtype:?}: {worst:e}");
        }
    }
}

/// Logits of ±10⁴ pick one token alone: the values of the token whose key points along the query.
#[test]
fn attention_is_finite_for_huge_logits() {
    for (backend, device) in devices() {
        // Short and long enough for both of flex's algorithms.
        for tokens in [16, 600] {
            let sign = |i: usize| if i.is_multiple_of(2) { 1.0_f32 } else { -1.0 };
            let query: Vec<f32> = (0..tokens * 4).map(|i| 100.0 * sign(i / 4)).collect();
            // Key 0 points one way and key 1 the other; the rest are at right angles to both.
            let key: Vec<f32> = (0..tokens * 4)
                .map(|i| match i / 4 {
                    0 => 50.0,
                    1 => -50.0,
                    _ => 0.0,
                })
                .collect();
            let value: Vec<f32> = (0..tokens * 4).map(|i| (i / 4) as f32).collect();
            let tensor = |x: &[f32]| Tensor::<1>::from_floats(x, &device).reshape([1, tokens, 4]);
            for (dtype, _) in kinds(&device) {
                let part = |x: &[f32]| cast(tensor(x), dtype);
                let out = numbers(&attention(part(&query), part(&key), part(&value), 1, false));
                let expected: Vec<f32> = (0..tokens * 4).map(|i| ((i / 4) % 2) as f32).collect();
                assert_eq!(out, expected, "{backend} {dtype:?} {tokens}: logits ±10⁴");
            }
        }
    }
}

/// A U-Net held in half precision is as near to torch's f32 as its digits allow, through some forty
/// layers, and the sample keeps its own precision. Devices without it refuse by name.
#[test]
fn models_run_in_half_precision_where_the_device_does() {
    let models = folder().join("models");
    let manifest = json(&models.join("manifest.json"));
    let mut unets = manifest["models"].as_object().unwrap().iter();
    let (name, model) = unets
        .find(|(_, model)| model["class"] == "UNet2DConditionModel")
        .expect("no U-Net");
    let folder = models.join(name);
    let case = model["cases"].as_object().unwrap().keys().next().unwrap();
    let golden = Golden::read(&folder.join(format!("{case}.safetensors")));
    let path = folder.join("diffusion_pytorch_model.safetensors");
    let config = wake_ldm::unet::UNetConfig::read(&folder.join("config.json")).unwrap();
    for (backend, device) in devices() {
        let steps: Vec<f32> = golden.i64s("timestep").iter().map(|&t| t as f32).collect();
        for (precision, digit) in [(Precision::F16, 5e-4), (Precision::BF16, 4e-3)] {
            let loaded =
                weights::load_as(config.init(&device), Layout::Diffusers, &path, precision);
            if !device.supports_dtype(precision.dtype()) {
                assert!(
                    matches!(loaded, Err(Error::UnsupportedPrecision { .. })),
                    "{backend}"
                );
                continue;
            }
            let out = loaded.unwrap().forward(UNetInput {
                sample: golden.tensor("sample", &device),
                timesteps: Tensor::from_floats(steps.as_slice(), &device),
                context: golden.tensor("encoder_hidden_states", &device),
                condition: None,
            });
            assert_eq!(out.dtype(), DType::F32, "the sample's own precision");
            let expected = golden.f32s("out_ref");
            let worst = difference(&numbers(&out), &expected) / largest(&expected);
            assert!(worst <= 40.0 * digit, "{backend} {precision:?}: {worst:e}");
        }
    }
}

/// Weights written in each precision come back as the nearest such numbers, under the same names.
#[test]
fn weights_are_written_in_every_precision() {
    let config = wake_ldm::autoencoder::AutoencoderKlConfig::small(8, 2);
    let (_, device) = devices().remove(0);
    let model = config.init(&device);
    let written = tempfile::tempdir().unwrap();
    let read = |precision: Precision, digit: f64| {
        let folder = written.path().join(format!("{precision:?}"));
        weights::save_folder(
            &model,
            Layout::Diffusers,
            &config.to_json(),
            &folder,
            precision,
        )
        .unwrap();
        let (back, again) = weights::load_autoencoder(&folder, &device).unwrap();
        assert_eq!(again, config, "the configuration comes back");
        assert_eq!(
            std::fs::read_dir(&folder).unwrap().count(),
            2,
            "no temporary file is left"
        );
        let z = Tensor::full([1, 8, 4, 4], 0.3, &device);
        let expected = numbers(&model.decode(z.clone()));
        let worst = difference(&numbers(&back.decode(z)), &expected) / largest(&expected);
        // Some twenty layers, each with weights rounded to the digit.
        assert!(worst <= 20.0 * digit, "{precision:?}: {worst:e}");
    };
    read(Precision::F32, 0.0);
    read(Precision::F16, 5e-4);
    read(Precision::BF16, 4e-3);
}
