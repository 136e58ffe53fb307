//! Models and weight files in half precision: as near as the numbers' own width allows.

use burn::tensor::{DType, Tensor};
use wake_ldm::autoencoder::AutoencoderKl;
use wake_ldm::unet::UNetInput;
use wake_nn::Error;
use wake_nn::weights::{self, Layout, Precision};

use crate::golden::{Golden, devices, difference, folder, json, largest, numbers};

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
                context: Some(golden.tensor("encoder_hidden_states", &device)),
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
        let back = AutoencoderKl::from_folder(&folder, &device).unwrap();
        assert_eq!(back.config(), &config, "the configuration comes back");
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
