//! Weights in the files of diffusers and transformers: reading, checking by name, writing.

pub mod files;
mod header;
mod index;
mod names;
mod precision;
mod save;
pub mod visit;

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::Module;
use burn::tensor::TensorData;

use crate::error::{Error, Mismatch, Misshapen, Result};
use files::{Stored, WeightFiles};
use visit::{Change, map, visit};

pub use names::Layout;
pub use precision::Precision;
pub use save::save_noted;
pub use save::{save_as, save_folder};

/// Reads weights into a model, as f32; see [`load_as`].
///
/// # Errors
///
/// As [`load_as`].
pub fn load<M: Module>(model: M, layout: Layout, path: &Path) -> Result<M> {
    load_as(model, layout, path, Precision::F32)
}

/// Reads weights into a model: all of them, or none.
///
/// `path` is a safetensors file, or a folder that holds one, in one piece or in shards with an index.
/// Tensors are read and converted to `precision` one by one, whatever the file holds, so the model is
/// never in memory twice. The attention names of early autoencoders (`query`, `key`, `value`,
/// `proj_attn`) are recognised, and the buffer `position_ids` is ignored.
///
/// # Errors
///
/// [`Error::MissingFile`], [`Error::Io`] and [`Error::InvalidSafetensors`] for files that are missing or
/// invalid; [`Error::InvalidWeight`] for a number that is infinite or NaN;
/// [`Error::WeightsMismatch`] with every tensor that is missing, unexpected or of
/// another shape; [`Error::UnsupportedPrecision`] if the device cannot compute with it.
pub fn load_as<M: Module>(
    model: M,
    layout: Layout,
    path: &Path,
    precision: Precision,
) -> Result<M> {
    precision.check(&model.devices())?;
    load_files(model, layout, path, precision, &WeightFiles::open(path)?)
}

/// Reads weights that are embedded in the program, as f32; `name` is used only in messages.
///
/// # Errors
///
/// As [`load_as`], for bytes that are not a weight file or belong to another model.
pub fn load_bytes<M: Module>(
    model: M,
    layout: Layout,
    name: &str,
    bytes: &'static [u8],
) -> Result<M> {
    let files = WeightFiles::embedded(name, bytes)?;
    load_files(model, layout, Path::new(name), Precision::F32, &files)
}

fn load_files<M: Module>(
    model: M,
    layout: Layout,
    path: &Path,
    precision: Precision,
    files: &WeightFiles,
) -> Result<M> {
    let stored = files.tensors()?;
    let expected = shapes(&model, layout);
    let mismatch = compare(&expected, &stored);
    if !mismatch.is_empty() {
        return Err(Error::WeightsMismatch {
            path: path.to_owned(),
            mismatch: Box::new(mismatch),
        });
    }
    map(model, layout, |weight| {
        let Some(tensor) = stored.get(&weight.name) else {
            return Ok(Change::Kept);
        };
        let shape = tensor.shape()[..weight.shape.len()].to_vec();
        let values = TensorData::new(tensor.read()?, shape);
        Ok(Change::Replaced(values, precision.dtype()))
    })
}

/// Whether a file has tensors with this first part of their dotted names.
///
/// # Errors
///
/// As [`load_as`], for files that are missing or damaged.
pub fn has_prefix(path: &Path, prefix: &str) -> Result<bool> {
    let files = WeightFiles::open(path)?;
    Ok(files
        .tensors()?
        .keys()
        .any(|name| name.split('.').next() == Some(prefix)))
}

/// Writes a model's weights as f32; see [`save_as`].
///
/// # Errors
///
/// As [`save_as`].
pub fn save<M: Module>(model: &M, layout: Layout, path: &Path) -> Result<()> {
    save_as(model, layout, path, Precision::F32)
}

/// Names and shapes of a model's weights in a file, without computing the weights.
pub fn shapes<M: Module>(model: &M, layout: Layout) -> BTreeMap<String, Vec<usize>> {
    let mut shapes = BTreeMap::new();
    visit(model, layout, |weight, _| {
        shapes.insert(weight.name, weight.shape);
    });
    shapes
}

/// Differences between a model and its files.
fn compare(
    expected: &BTreeMap<String, Vec<usize>>,
    stored: &BTreeMap<String, Stored<'_>>,
) -> Mismatch {
    let mut mismatch = Mismatch::default();
    for (name, shape) in expected {
        match stored.get(name) {
            None => mismatch.missing.push(name.clone()),
            Some(tensor) if fits(shape, tensor) => {}
            Some(tensor) => mismatch.misshapen.push(Misshapen {
                name: name.clone(),
                expected: format!("float {shape:?}"),
                found: format!("{tensor:?}"),
            }),
        }
    }
    let unknown = |name: &&String| !expected.contains_key(*name) && !names::is_buffer(name);
    mismatch.unexpected = stored.keys().filter(unknown).cloned().collect();
    mismatch
}

/// Whether a tensor is a weight of that shape; matrices may be stored as 1 × 1 convolutions.
fn fits(shape: &[usize], tensor: &Stored<'_>) -> bool {
    let found = tensor.shape();
    let as_convolution = shape.len() == 2 && found.len() == 4 && found[2..] == [1, 1];
    tensor.is_float() && (found == shape || (as_convolution && found[..2] == *shape))
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use burn::nn::{Linear, LinearConfig};
    use burn::tensor::Device;

    use super::*;

    #[derive(Module, Debug)]
    struct Two {
        good: Linear,
        bad: Linear,
    }

    #[test]
    fn a_weight_that_is_not_finite_is_refused_with_the_name_of_its_tensor() {
        let device = Device::flex();
        let layer = || LinearConfig::new(3, 2).init(&device);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("two.safetensors");
        for value in [f32::NAN, f32::INFINITY] {
            let mut bad = layer();
            bad.weight = bad.weight.map(|weight| weight * 0.0 + value);
            let model = Two { good: layer(), bad };
            for precision in [Precision::F32, Precision::F16, Precision::BF16] {
                save_as(&model, Layout::Diffusers, &path, precision).unwrap();
                let refused = load(model.clone(), Layout::Diffusers, &path);
                let Err(Error::InvalidWeight { tensor, .. }) = refused else {
                    panic!("{value} in {precision:?} was accepted")
                };
                assert_eq!(tensor, "bad.weight");
            }
        }
    }
}
