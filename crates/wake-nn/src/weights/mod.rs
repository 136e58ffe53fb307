//! Weights in the files of diffusers and transformers: reading, checking by name, writing.

pub mod files;
mod header;
mod index;
pub mod names;
mod precision;
mod save;

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

use crate::error::{Error, Mismatch, Misshapen, Result};
use files::{Stored, WeightFiles};
use names::ModulePath;

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
/// Tensors are read and converted to `precision` one by one, whatever the file holds, so that the model
/// is never held twice. The attention names of early autoencoders (`query`, `key`, `value`,
/// `proj_attn`) and the buffer `position_ids` are known.
///
/// # Errors
///
/// [`Error::MissingFile`], [`Error::Io`] and [`Error::InvalidSafetensors`] for files that are not there
/// or not to be trusted; [`Error::InvalidWeight`] for a number that is infinite or none;
/// [`Error::WeightsMismatch`] with every tensor that is missing, unexpected or of
/// another shape; [`Error::UnsupportedPrecision`] where the device cannot compute with it.
pub fn load_as<M: Module>(
    model: M,
    layout: Layout,
    path: &Path,
    precision: Precision,
) -> Result<M> {
    precision.check(&model.devices())?;
    load_files(model, layout, path, precision, &WeightFiles::open(path)?)
}

/// Reads weights that are part of the program, as f32; `name` only serves messages.
///
/// # Errors
///
/// As [`load_as`], for what is no weight file or that of another model.
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
    let mut loader = Loader {
        path: ModulePath::default(),
        layout,
        precision,
        stored: &stored,
        result: Ok(()),
    };
    let model = model.map(&mut loader);
    loader.result.map(|()| model)
}

/// Whether a file has tensors below a prefix.
///
/// # Errors
///
/// As [`load_as`], for files that are not there or are damaged.
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

/// Names and shapes that a model has in a file, without making its weights.
pub fn shapes<M: Module>(model: &M, layout: Layout) -> BTreeMap<String, Vec<usize>> {
    let mut lister = Lister {
        path: ModulePath::default(),
        layout,
        shapes: BTreeMap::new(),
    };
    model.visit(&mut lister);
    lister.shapes
}

/// What does not fit between a model and its files.
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

struct Lister {
    path: ModulePath,
    layout: Layout,
    shapes: BTreeMap<String, Vec<usize>>,
}

impl ModuleVisitor for Lister {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let mut shape = param.lazy_shape().to_vec();
        if self.path.is_transposed(D) {
            shape.reverse();
        }
        self.shapes.insert(self.path.file_name(self.layout), shape);
    }
}

struct Loader<'a> {
    path: ModulePath,
    layout: Layout,
    precision: Precision,
    stored: &'a BTreeMap<String, Stored<'a>>,
    /// The first tensor that could not be read.
    result: Result<()>,
}

impl ModuleMapper for Loader<'_> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(tensor) = self.stored.get(&self.path.file_name(self.layout)) else {
            return param;
        };
        if self.result.is_err() {
            return param;
        }
        let numbers = match tensor.read() {
            Ok(numbers) => numbers,
            Err(error) => {
                self.result = Err(error);
                return param;
            }
        };
        let data = TensorData::new(numbers, tensor.shape()[..D].to_vec());
        let device = param.lazy_device();
        let mut value = Tensor::from_data(data, (&device, self.precision.dtype()));
        if self.path.is_transposed(D) {
            value = value.swap_dims(0, 1);
        }
        let id = param.id;
        param.transform_for_load(value, id)
    }
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
