//! Attack on the readers of learnt seas, low-rank adaptations and the labels of real images.

use std::path::Path;

use burn::tensor::Device;
use wake_ldm::lora::merge_lora;
use wake_ldm::sea_texture::{SeaFlow, SeaStyle, SeaTexture};
use wake_ldm::unet::UNet;
use wake_nn::weights::Layout;
use wake_physics::Field;
use wake_train::detector::judging::Tile;

use crate::attack::{attack, said, with_file};

/// A file with a part overwritten by the input, whose first two bytes say where.
fn damaged(file: &[u8], input: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let place = input
        .iter()
        .take(2)
        .fold(0, |n, &b| 256 * n + usize::from(b));
    let start = place * file.len() / (1 << 16);
    let bytes = file[start..].iter_mut().zip(input.iter().skip(2));
    bytes.for_each(|(old, new)| *old = *new);
    file
}

/// Files that are whole seas but for a few bytes, and files that are none.
#[test]
fn learnt_seas() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = Device::default();
    let values = (0..128 * 128).map(|n| 1.0 + 0.3 * (n as f32 * 0.7).sin());
    let patch = Field {
        rows: 128,
        columns: 128,
        values: values.collect(),
    };
    let style = SeaStyle::of(&patch).expect("a style");
    let sea = SeaTexture::new(SeaFlow::new(&device), &[style], Some(10.0)).expect("a sea");
    let path = folder.path().join("whole.safetensors");
    sea.save(&path).expect("a file");
    let whole = std::fs::read(&path).expect("a file");
    attack("weights", |input| {
        for bytes in [input, &damaged(&whole, input)] {
            with_file(folder.path(), "sea.safetensors", bytes, |path| {
                said(SeaTexture::load(path, &device));
            });
        }
    });
}

#[test]
fn adaptations() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = Device::default();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let unet = UNet::from_folder(&fixtures.join("pipeline_a/unet"), &device).expect("a model");
    let file = fixtures.join("own/lora_alpha/pytorch_lora_weights.safetensors");
    let whole = std::fs::read(file).expect("a file");
    attack("weights", |input| {
        for bytes in [input, &damaged(&whole, input)] {
            with_file(folder.path(), "lora.safetensors", bytes, |path| {
                let model = unet.clone();
                said(merge_lora(model, Layout::Diffusers, "unet", path, 1.0));
            });
        }
    });
}

/// A folder of one image whose `labels.json` is the input.
#[test]
fn labels_of_real_images() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/labels/image.png");
    std::fs::copy(picture, folder.path().join("image.png")).expect("an image");
    attack("labels", |input| {
        with_file(folder.path(), "labels.json", input, |_| {
            for tile in said(Tile::read_all(folder.path())).unwrap_or_default() {
                tile.wakes();
            }
        });
    });
}
