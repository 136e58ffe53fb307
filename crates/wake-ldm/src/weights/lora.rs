//! Low-rank adaptations, merged into the weights.

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{DType, Device, Tensor, TensorData};

use super::files::{MappedFiles, Stored};
use super::names::{Layout, Path as ModulePath};
use super::{shapes, widened};
use crate::error::{Error, Mismatch, Misshapen, Result};

/// The two factors of one layer's change.
#[derive(Debug)]
struct Factors<'a> {
    down: &'a Stored<'a>,
    up: &'a Stored<'a>,
}

impl Factors<'_> {
    fn rank(&self) -> usize {
        self.down.view.shape().first().copied().unwrap_or(0)
    }

    /// Whether the product has as many rows and columns as the weight.
    fn fit(&self, shape: &[usize]) -> bool {
        let (down, up) = (self.down.view.shape(), self.up.view.shape());
        let count = |shape: &[usize]| shape.iter().product::<usize>();
        let rank = self.rank();
        rank > 0
            && shape.len() > 1
            && down.len() > 1
            && up.len() > 1
            && up[..2] == [shape[0], rank]
            && count(up) == shape[0] * rank
            && count(&down[1..]) == count(&shape[1..])
    }

    /// The change of the weight, flattened to rows and columns.
    fn product(&self, rows: usize, device: &Device) -> Tensor<2> {
        let rank = self.rank();
        let matrix = |stored: &Stored<'_>, rows: usize| -> Tensor<2> {
            let numbers = widened(&stored.view);
            let columns = numbers.len() / rows;
            Tensor::from_data(
                TensorData::new(numbers, [rows, columns]),
                (device, DType::F32),
            )
        };
        matrix(self.up, rows).matmul(matrix(self.down, rank))
    }
}

/// Adds a low-rank adaptation in diffusers' format to the weights of a model.
///
/// ```text
/// W' = W + scale · B A
/// ```
///
/// - A, B: `PREFIX.LAYER.lora_A.weight` and `….lora_B.weight` of the file, with α equal to the rank
/// - `prefix`: whose layers to take, `unet` or `text_encoder`; the others are left alone
///
/// # Errors
///
/// As [`load`](super::load); a layer that the model does not have, or whose factors do not fit it, is a
/// [`Error::WeightsMismatch`], and so is a file without any layer of this prefix.
/// [`Error::Unsupported`] for a file that brings its own α.
///
/// # References
///
/// Hu et al. (2022), "Low-Rank Adaptation of Large Language Models", Eq. 3.
pub fn merge_lora<M: Module>(
    model: M,
    layout: Layout,
    prefix: &str,
    path: &Path,
    scale: f64,
) -> Result<M> {
    let files = MappedFiles::open(path)?;
    files.refuse_metadata("lora_adapter_metadata")?;
    let stored = files.tensors()?;
    let layers = layers(&stored, prefix)
        .and_then(|layers| checked(layers, &shapes(&model, layout), prefix))
        .map_err(|mismatch| Error::WeightsMismatch {
            path: path.to_owned(),
            mismatch: Box::new(mismatch),
        })?;
    Ok(model.map(&mut Merger {
        path: ModulePath::default(),
        layout,
        layers,
        scale,
    }))
}

/// The factors of each weight, by its name in the model.
fn layers<'a>(
    stored: &'a BTreeMap<String, Stored<'a>>,
    prefix: &str,
) -> Result<BTreeMap<String, Factors<'a>>, Mismatch> {
    let (mut layers, mut mismatch) = (BTreeMap::new(), Mismatch::default());
    for (name, down) in stored {
        let Some(layer) = name
            .strip_prefix(prefix)
            .and_then(|name| name.strip_prefix('.'))
        else {
            continue;
        };
        if let Some(layer) = layer.strip_suffix(".lora_A.weight") {
            let up = format!("{prefix}.{layer}.lora_B.weight");
            match stored.get(&up) {
                Some(up) => drop(layers.insert(format!("{layer}.weight"), Factors { down, up })),
                None => mismatch.missing.push(up),
            }
        } else if !stored.contains_key(&name.replace(".lora_B.", ".lora_A."))
            || !name.contains(".lora_B.")
        {
            mismatch.unexpected.push(name.clone());
        }
    }
    if layers.is_empty() && mismatch.is_empty() {
        mismatch.missing.push(format!("{prefix}.….lora_A.weight"));
    }
    if mismatch.is_empty() {
        Ok(layers)
    } else {
        Err(mismatch)
    }
}

/// The same, once every layer is one of the model's and fits.
fn checked<'a>(
    layers: BTreeMap<String, Factors<'a>>,
    shapes: &BTreeMap<String, Vec<usize>>,
    prefix: &str,
) -> Result<BTreeMap<String, Factors<'a>>, Mismatch> {
    let mut mismatch = Mismatch::default();
    for (name, factors) in &layers {
        match shapes.get(name) {
            None => mismatch.unexpected.push(format!("{prefix}.{name}")),
            Some(shape) if factors.fit(shape) => {}
            Some(shape) => mismatch.misshapen.push(Misshapen {
                name: format!("{prefix}.{name}"),
                expected: format!("factors of {shape:?}"),
                found: format!(
                    "{:?} {:?}",
                    factors.up.view.shape(),
                    factors.down.view.shape()
                ),
            }),
        }
    }
    if mismatch.is_empty() {
        Ok(layers)
    } else {
        Err(mismatch)
    }
}

struct Merger<'a> {
    path: ModulePath,
    layout: Layout,
    layers: BTreeMap<String, Factors<'a>>,
    scale: f64,
}

impl ModuleMapper for Merger<'_> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(factors) = self.layers.get(&self.path.file_name(self.layout)) else {
            return param;
        };
        let transposed = self.path.is_transposed(D);
        let scale = self.scale;
        param.map(|weight| {
            let dims = weight.dims();
            let rows = if transposed { dims[1] } else { dims[0] };
            let change = factors.product(rows, &weight.device()) * scale;
            let change = if transposed {
                change.swap_dims(0, 1)
            } else {
                change
            };
            let dtype: burn::tensor::FloatDType = weight.dtype().into();
            weight + change.reshape(dims).cast(dtype)
        })
    }
}
