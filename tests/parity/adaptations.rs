//! Low-rank adaptations against diffusers with peft.

use std::path::PathBuf;

use burn::tensor::{Device, Int, Tensor, TensorData};
use wake_ldm::lora::merge_lora;
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetConfig, UNetInput};
use wake_nn::Error;
use wake_nn::weights::Layout;

use crate::golden::{Golden, devices, expect, largest, numbers, own_folder};

/// The folders of adaptations, and the pipeline that they were made for.
fn adaptations() -> (Vec<PathBuf>, PathBuf) {
    let entries = std::fs::read_dir(own_folder()).unwrap();
    let folders: Vec<PathBuf> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("pytorch_lora_weights.safetensors").is_file())
        .collect();
    assert!(
        !folders.is_empty(),
        "no adaptations in {}",
        own_folder().display()
    );
    (folders, own_folder().with_file_name("pipeline_a"))
}

fn input(golden: &Golden, device: &Device) -> UNetInput {
    UNetInput {
        sample: golden.tensor("sample", device),
        timesteps: Tensor::full([1], golden.i64s("timestep")[0] as f64, device),
        context: Some(golden.tensor("encoder_hidden_states", device)),
        condition: None,
    }
}

/// At full, half and no strength, with α as the rank and with α of its own for some layers. Ten times the
/// noise floor of the fixtures' U-Nets, which put out numbers around 3; merging rounds once more.
#[test]
fn adaptations_are_merged() {
    let (folders, models) = adaptations();
    for (backend, device) in devices() {
        for folder in &folders {
            let file = folder.join("pytorch_lora_weights.safetensors");
            let golden = Golden::read(&folder.join("case.safetensors"));
            for (scale, name) in [(1.0, "out"), (0.5, "out_half"), (0.0, "out_plain")] {
                let unet = UNet::from_folder(&models.join("unet"), &device).unwrap();
                let unet = merge_lora(unet, Layout::Diffusers, "unet", &file, scale).unwrap();
                let out = numbers(&unet.forward(input(&golden, &device)));
                let what = format!("{backend} {} {name}", folder.display());
                let expected = golden.f32s(name);
                let allowed = 2e-5 * (largest(&expected) / 3.0).max(1.0);
                expect(&what, &out, &expected, allowed);
            }
            if golden.has("text_out") {
                check_text(&golden, &models.join("text_encoder"), &file, &device);
            }
        }
    }
}

fn check_text(golden: &Golden, model: &std::path::Path, file: &std::path::Path, device: &Device) {
    let text = ClipText::from_folder(model, device).unwrap();
    let text = merge_lora(text, Layout::ClipText, "text_encoder", file, 1.0).unwrap();
    let ids = TensorData::new(golden.i64s("text_ids"), golden.shape("text_ids"));
    let out = text.forward(Tensor::<2, Int>::from_data(ids, device));
    let expected = golden.f32s("text_out");
    let ours = numbers(&out.last_hidden_state);
    expect("text encoder", &ours, &expected, 2e-5);
}

#[test]
fn adaptations_of_other_models_are_refused() {
    let (_, models) = adaptations();
    let file = own_folder().join("lora/pytorch_lora_weights.safetensors");
    let (_, device) = devices().remove(0);
    let unet = UNet::from_folder(&models.join("unet"), &device).unwrap();
    let config = unet.config().clone();
    let absent = merge_lora(unet, Layout::Diffusers, "text_encoder", &file, 1.0);
    assert!(matches!(absent, Err(Error::WeightsMismatch { .. })));
    let other = UNetConfig {
        cross_attention_dim: Some(5),
        ..config
    };
    let misfit = merge_lora(other.init(&device), Layout::Diffusers, "unet", &file, 1.0);
    let Err(Error::WeightsMismatch { mismatch, .. }) = misfit else {
        panic!("it fitted")
    };
    assert!(!mismatch.misshapen.is_empty());
}
