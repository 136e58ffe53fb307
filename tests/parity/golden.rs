//! Where the reference files lie, and how they are read.

use std::collections::HashMap;
use std::path::PathBuf;

use burn::tensor::{DType, Device, Tensor, TensorData};
use safetensors::SafeTensors;
use serde_json::Value;

/// The folder named by `WAKE_FIXTURES`, by default the copy beside the tests.
pub(crate) fn folder() -> PathBuf {
    match std::env::var_os("WAKE_FIXTURES") {
        Some(folder) => folder.into(),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures"),
    }
}

/// The folder of what the reference files lack, made by the scripts in it.
pub(crate) fn own_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/own")
}

/// Reads a JSON file.
pub(crate) fn json(path: &std::path::Path) -> Value {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// One safetensors file in memory.
pub(crate) struct Golden {
    tensors: HashMap<String, Entry>,
}

/// One tensor of a file.
struct Entry {
    dtype: safetensors::Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Golden {
    pub(crate) fn read(path: &std::path::Path) -> Self {
        let bytes =
            std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let entry = |view: safetensors::tensor::TensorView<'_>| Entry {
            dtype: view.dtype(),
            shape: view.shape().to_vec(),
            bytes: view.data().to_vec(),
        };
        Self {
            tensors: file
                .iter()
                .map(|(name, view)| (name.to_owned(), entry(view)))
                .collect(),
        }
    }

    fn get(&self, name: &str, dtype: safetensors::Dtype) -> &Entry {
        let entry = self
            .tensors
            .get(name)
            .unwrap_or_else(|| panic!("no tensor {name}"));
        assert_eq!(entry.dtype, dtype, "{name}");
        entry
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.tensors.keys().map(String::as_str)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    pub(crate) fn shape(&self, name: &str) -> Vec<usize> {
        self.tensors
            .get(name)
            .unwrap_or_else(|| panic!("no tensor {name}"))
            .shape
            .clone()
    }

    /// Numbers of an f32 tensor.
    pub(crate) fn f32s(&self, name: &str) -> Vec<f32> {
        f32s(&self.get(name, safetensors::Dtype::F32).bytes)
    }

    /// Numbers of an f64 tensor.
    pub(crate) fn f64s(&self, name: &str) -> Vec<f64> {
        let bytes = &self.get(name, safetensors::Dtype::F64).bytes;
        bytes
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect()
    }

    /// Numbers of an i64 tensor.
    pub(crate) fn i64s(&self, name: &str) -> Vec<i64> {
        let bytes = &self.get(name, safetensors::Dtype::I64).bytes;
        bytes
            .chunks_exact(8)
            .map(|b| i64::from_le_bytes(b.try_into().unwrap()))
            .collect()
    }

    /// Bytes of a u8 tensor.
    pub(crate) fn u8s(&self, name: &str) -> Vec<u8> {
        self.get(name, safetensors::Dtype::U8).bytes.clone()
    }

    /// A tensor of f32.
    pub(crate) fn tensor<const D: usize>(&self, name: &str, device: &Device) -> Tensor<D> {
        tensor(self.f32s(name), self.shape(name), device)
    }

    /// Images `[1, channels, rows, columns]` named `single`, and all that have steps before those axes, as batches of two: the
    /// second image is the first with its numbers in reverse. What is done number by number does the same to both.
    pub(crate) fn in_pairs(mut self, single: &[&str]) -> Self {
        for (name, entry) in &mut self.tensors {
            let steps = match entry.shape.len() {
                4 if single.contains(&name.as_str()) => 1,
                4 => {
                    entry.shape.insert(1, 1);
                    entry.shape[0]
                }
                5 => entry.shape[0],
                _ => continue,
            };
            let axis = entry.shape.len() - 4;
            entry.shape[axis] *= 2;
            let pairs = entry.bytes.chunks_exact(entry.bytes.len() / steps);
            let pair = |image: &[u8]| -> Vec<u8> {
                let reversed = image.chunks_exact(4).rev().flatten();
                image.iter().chain(reversed).copied().collect()
            };
            entry.bytes = pairs.flat_map(pair).collect();
        }
        self
    }

    /// Numbers of entry `i` along the first axis, whatever the others.
    pub(crate) fn f32s_of(&self, name: &str, i: usize) -> Vec<f32> {
        let length: usize = self.shape(name)[1..].iter().product();
        self.f32s(name)[i * length..(i + 1) * length].to_vec()
    }

    /// Entry `i` along the first axis.
    pub(crate) fn entry<const D: usize>(&self, name: &str, i: usize, device: &Device) -> Tensor<D> {
        let shape = self.shape(name);
        let length: usize = 4 * shape[1..].iter().product::<usize>();
        let bytes = &self.get(name, safetensors::Dtype::F32).bytes[i * length..(i + 1) * length];
        tensor(f32s(bytes), shape[1..].to_vec(), device)
    }
}

fn f32s(bytes: &[u8]) -> Vec<f32> {
    bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect()
}

/// A tensor of numbers.
pub(crate) fn tensor<const D: usize>(
    numbers: Vec<f32>,
    shape: Vec<usize>,
    device: &Device,
) -> Tensor<D> {
    Tensor::from_data(TensorData::new(numbers, shape), device)
}

/// The numbers of a tensor.
pub(crate) fn numbers<const D: usize>(tensor: &Tensor<D>) -> Vec<f32> {
    tensor
        .to_data()
        .convert_dtype(DType::F32)
        .try_to_vec()
        .unwrap()
}

/// The largest absolute difference, infinite where anything is not a number.
pub(crate) fn difference(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let worst = |worst: f64, (a, b): (&f32, &f32)| {
        let difference = f64::from((a - b).abs());
        if difference.is_nan() {
            f64::INFINITY
        } else {
            worst.max(difference)
        }
    };
    a.iter().zip(b).fold(0.0, worst)
}

/// Fails where numbers differ by more than is allowed.
pub(crate) fn expect(what: &str, ours: &[f32], expected: &[f32], allowed: f64) {
    let difference = difference(ours, expected);
    assert!(
        difference <= allowed,
        "{what}: differs by {difference:e}, allowed {allowed:e}"
    );
}

/// The largest absolute value.
pub(crate) fn largest(a: &[f32]) -> f64 {
    a.iter()
        .fold(0.0, |largest, x| f64::from(x.abs()).max(largest))
}

/// Every CPU backend that was compiled.
#[allow(clippy::vec_init_then_push, reason = "each entry has its own feature")]
pub(crate) fn devices() -> Vec<(&'static str, Device)> {
    let mut devices = Vec::new();
    #[cfg(feature = "flex")]
    devices.push(("flex", Device::flex()));
    #[cfg(feature = "ndarray")]
    #[allow(deprecated, reason = "kept and tested until burn drops it")]
    devices.push(("ndarray", Device::ndarray()));
    devices
}
