//! Weight files: written and read again, in shards, and those that must be refused.

use std::path::{Path, PathBuf};

use burn::tensor::Tensor;
use serde_json::{Map, Value, json};
use wake_ldm::unet::{UNet, UNetConfig, UNetInput};
use wake_nn::weights::{self, Layout};
use wake_nn::{Error, Mismatch};

use crate::golden::{self, Golden, devices, folder, numbers};

/// Any U-Net of the fixtures.
fn some_unet() -> PathBuf {
    let models = folder().join("models");
    let manifest = golden::json(&models.join("manifest.json"));
    let found = manifest["models"].as_object().unwrap().iter();
    let unets = found.filter(|(_, model)| model["class"] == "UNet2DConditionModel");
    models.join(unets.map(|(name, _)| name).next().unwrap())
}

#[test]
fn what_is_written_is_what_was_read() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let unet = UNet::from_folder(&folder, &device).unwrap();
    let written = tempfile::tempdir().unwrap();
    let path = written.path().join("diffusion_pytorch_model.safetensors");
    weights::save(&unet, Layout::Diffusers, &path).unwrap();
    let [ours, original] =
        [&path, &folder.join("diffusion_pytorch_model.safetensors")].map(|p| Golden::read(p));
    let mut names: Vec<&str> = original.names().collect();
    names.sort_unstable();
    for name in &names {
        assert_eq!(ours.shape(name), original.shape(name), "{name}");
        assert!(ours.f32s(name) == original.f32s(name), "{name}");
    }
    assert_eq!(ours.names().count(), names.len());
}

/// A file with one tensor gone, one too many and one of another shape: all named, nothing loaded.
#[test]
fn files_that_do_not_fit_are_refused_with_every_name() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let golden = Golden::read(&folder.join("diffusion_pytorch_model.safetensors"));
    let mut tensors: Vec<(String, Vec<usize>, Vec<u8>)> = golden
        .names()
        .filter(|name| *name != "conv_in.bias")
        .map(|name| {
            let bytes = golden
                .f32s(name)
                .iter()
                .flat_map(|x| x.to_le_bytes())
                .collect();
            (name.to_owned(), golden.shape(name), bytes)
        })
        .collect();
    tensors.push(("stranger".to_owned(), vec![1], vec![0; 4]));
    for (name, shape, _) in &mut tensors {
        if name == "conv_out.weight" {
            shape.reverse();
        }
    }
    let views = tensors.iter().map(|(name, shape, bytes)| {
        let view =
            safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape.clone(), bytes);
        (name, view.unwrap())
    });
    let path = tempfile::tempdir().unwrap().keep().join("odd.safetensors");
    safetensors::serialize_to_file(views, None, &path).unwrap();
    let error = weights::load(config.init(&device), Layout::Diffusers, &path).unwrap_err();
    let Error::WeightsMismatch { mismatch, .. } = error else {
        panic!("{error}")
    };
    let Mismatch {
        missing,
        unexpected,
        misshapen,
    } = *mismatch;
    assert_eq!(
        (missing, unexpected),
        (vec!["conv_in.bias".to_owned()], vec!["stranger".to_owned()])
    );
    assert_eq!(misshapen.len(), 1);
    assert_eq!(misshapen[0].name, "conv_out.weight");
}

/// Truncated, oversized, overlapping and senseless files end in an error, not in a panic.
#[test]
fn hostile_files_are_refused() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let whole = std::fs::read(folder.join("diffusion_pytorch_model.safetensors")).unwrap();
    let with_header = |header: &str, data: usize| {
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.as_bytes());
        bytes.resize(bytes.len() + data, 0);
        bytes
    };
    let entry = |shape: &str, from: usize, to: usize| {
        format!(r#"{{"dtype":"F32","shape":{shape},"data_offsets":[{from},{to}]}}"#)
    };
    let one = |shape: &str, from, to| format!(r#"{{"a":{}}}"#, entry(shape, from, to));
    let overlapping = format!(
        r#"{{"a":{},"b":{}}}"#,
        entry("[2]", 0, 8),
        entry("[2]", 4, 12)
    );
    let mut padded = whole.clone();
    padded.extend([0; 64]);
    let files = [
        vec![],
        whole[..7].to_vec(),
        whole[..whole.len() / 2].to_vec(),
        whole[..whole.len() - 1].to_vec(),
        padded,
        u64::MAX.to_le_bytes().repeat(4),
        (1_u64 << 60).to_le_bytes().to_vec(),
        with_header("{", 0),
        with_header("[]", 0),
        with_header(&one("[1]", 0, usize::MAX), 4),
        with_header(&one("[9223372036854775807, 4]", 0, 4), 4),
        with_header(&one("[2]", 8, 0), 8),
        with_header(&one("[2]", 0, 4), 4),
        with_header(&overlapping, 12),
        with_header(&"[".repeat(200_000), 0),
    ];
    let temporary = tempfile::tempdir().unwrap();
    for (i, bytes) in files.into_iter().enumerate() {
        let path = temporary.path().join(format!("{i}.safetensors"));
        std::fs::write(&path, bytes).unwrap();
        let error = weights::load(config.init(&device), Layout::Diffusers, &path).unwrap_err();
        assert!(
            matches!(error, Error::InvalidSafetensors { .. }),
            "{i}: {error}"
        );
    }
    let missing = weights::load(config.init(&device), Layout::Diffusers, temporary.path());
    assert!(matches!(missing, Err(Error::MissingFile { .. })));
}

/// Writes some tensors of a file into a shard.
fn write_shard(golden: &Golden, names: &[&str], path: &Path) {
    let bytes = |name: &&str| -> Vec<u8> {
        let numbers = golden.f32s(name);
        numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
    };
    let bytes: Vec<Vec<u8>> = names.iter().map(bytes).collect();
    let views = names.iter().zip(&bytes).map(|(name, bytes)| {
        let dtype = safetensors::Dtype::F32;
        let view = safetensors::tensor::TensorView::new(dtype, golden.shape(name), bytes);
        (*name, view.unwrap())
    });
    safetensors::serialize_to_file(views, None, path).unwrap();
}

/// The same weights in two files with an index, under every name that an index has. An index that
/// leaves the folder, or that says other than the shards hold, is refused.
#[test]
fn shards_are_read_through_their_index() {
    let folder = some_unet();
    let (_, device) = devices().remove(0);
    let config = UNetConfig::read(&folder.join("config.json")).unwrap();
    let golden = Golden::read(&folder.join("diffusion_pytorch_model.safetensors"));
    let temporary = tempfile::tempdir().unwrap();
    let files = ["part-0.safetensors", "part-1.safetensors"];
    let mut map = Map::new();
    for (shard, file) in files.iter().enumerate() {
        let chosen = |name: &&str| name.len() % 2 == shard;
        let names: Vec<&str> = golden.names().filter(chosen).collect();
        map.extend(
            names
                .iter()
                .map(|name| ((*name).to_owned(), (*file).into())),
        );
        write_shard(&golden, &names, &temporary.path().join(file));
    }
    let write = |name: &str, map: &Map<String, Value>| {
        let path = temporary.path().join(name);
        std::fs::write(&path, json!({"weight_map": map}).to_string()).unwrap();
        path
    };
    let load = || weights::load(config.init(&device), Layout::Diffusers, temporary.path());
    let whole = UNet::from_folder(&folder, &device).unwrap();
    let input = |x: f64| UNetInput {
        sample: Tensor::full([1, config.in_channels, 8, 8], x, &device),
        timesteps: Tensor::full([1], 7.0, &device),
        context: config
            .cross_attention_dim
            .map(|channels| Tensor::full([1, 3, channels], 0.5, &device)),
        condition: None,
    };
    let expected = numbers(&whole.forward(input(0.3)));
    for name in [
        "diffusion_pytorch_model.safetensors.index.fp16.json",
        "diffusion_pytorch_model.safetensors.fp16.index.json",
        "model.safetensors.index.json",
        "diffusion_pytorch_model.safetensors.index.json",
    ] {
        let index = write(name, &map);
        let sharded = load().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(numbers(&sharded.forward(input(0.3))) == expected, "{name}");
        std::fs::remove_file(index).unwrap();
    }
    let name = "diffusion_pytorch_model.safetensors.index.json";
    let (tensor, shard) = map.iter().next().unwrap();
    let other = files.iter().find(|file| shard != *file).unwrap();
    let changed = |tensor: &str, file: Option<&str>| {
        let mut map = map.clone();
        match file {
            Some(file) => drop(map.insert(tensor.to_owned(), file.into())),
            None => drop(map.remove(tensor)),
        }
        map
    };
    for (map, reason) in [
        (changed("a", Some("../../etc/passwd")), "outside the folder"),
        (changed(tensor, Some(other)), tensor.as_str()),
        (changed("stranger", Some(other)), "does not hold stranger"),
        (changed(tensor, None), "which is not listed"),
    ] {
        write(name, &map);
        let error = load().unwrap_err();
        assert!(matches!(error, Error::InvalidSafetensors { .. }), "{error}");
        assert!(error.to_string().contains(reason), "{error}");
    }
    std::fs::remove_file(temporary.path().join(files[0])).unwrap();
    write(name, &map);
    assert!(matches!(load(), Err(Error::Io { .. })));
}
