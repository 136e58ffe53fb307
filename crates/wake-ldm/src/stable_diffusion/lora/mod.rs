//! Low-rank adaptations: merged into the weights, trained, and as files in diffusers' format.

mod low_rank;
mod strength;

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{DType, Device, Tensor, TensorData};

use strength::{NOTE, Strength};
use wake_nn::cast_to;
use wake_nn::weights::files::{Stored, WeightFiles};
use wake_nn::weights::names::ModulePath;
use wake_nn::weights::{Layout, shapes};
use wake_nn::{Error, Mismatch, Misshapen, Result};

pub use low_rank::LowRank;

/// The two factors of one layer's change.
#[derive(Debug)]
struct Factors<'a> {
    down: &'a Stored<'a>,
    up: &'a Stored<'a>,
}

impl Factors<'_> {
    fn rank(&self) -> usize {
        self.down.shape().first().copied().unwrap_or(0)
    }

    /// Whether the product has as many rows and columns as the weight.
    fn fit(&self, shape: &[usize]) -> bool {
        let (down, up) = (self.down.shape(), self.up.shape());
        let count = |shape: &[usize]| shape.iter().product::<usize>();
        let rank = self.rank();
        let float = self.down.is_float() && self.up.is_float();
        float
            && rank > 0
            && shape.len() > 1
            && down.len() > 1
            && up.len() > 1
            && up[..2] == [shape[0], rank]
            && count(up) == shape[0] * rank
            && count(&down[1..]) == count(&shape[1..])
    }

    /// The change of the weight, flattened to rows and columns.
    fn product(&self, rows: usize, device: &Device) -> Result<Tensor<2>> {
        let matrix = |stored: &Stored<'_>, rows: usize| -> Result<Tensor<2>> {
            let numbers = stored.read()?;
            let columns = numbers.len() / rows;
            let data = TensorData::new(numbers, [rows, columns]);
            Ok(Tensor::from_data(data, (device, DType::F32)))
        };
        Ok(matrix(self.up, rows)?.matmul(matrix(self.down, self.rank())?))
    }
}

/// Adds a low-rank adaptation in diffusers' format to the weights of a model.
///
/// ```text
/// W' = W + scale · α/r · B A
/// ```
///
/// - A, B: `PREFIX.LAYER.lora_A.weight` and `….lora_B.weight` of the file, of rank r
/// - α: as the file's header says, for all layers or for single ones; where it says nothing, r
/// - `prefix`: whose layers to take, `unet` or `text_encoder`; the others are left alone
///
/// # Errors
///
/// As [`load`](wake_nn::weights::load); a layer that the model does not have, or whose factors do not fit it, is a
/// [`Error::WeightsMismatch`], and so is a file without any layer of this prefix.
/// [`Error::Unsupported`] for a file trained with an option that changes the sum, such as `use_dora`.
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
    let files = WeightFiles::open(path)?;
    let strength = Strength::read(files.note(NOTE), prefix, path)?;
    let stored = files.tensors()?;
    let layers = layers(&stored, prefix)
        .and_then(|layers| checked(layers, &shapes(&model, layout), prefix))
        .map_err(|mismatch| Error::WeightsMismatch {
            path: path.to_owned(),
            mismatch: Box::new(mismatch),
        })?;
    let mut merger = Merger {
        path: ModulePath::default(),
        layout,
        layers,
        strength,
        scale,
        result: Ok(()),
    };
    let model = model.map(&mut merger);
    merger.result.map(|()| model)
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
                found: format!("{:?} {:?}", factors.up, factors.down),
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
    strength: Strength,
    scale: f64,
    /// The first factor that could not be read.
    result: Result<()>,
}

impl Merger<'_> {
    /// The change of a layer's weight, as it is stored: `[out, in]`, or flattened to that.
    fn change(&self, name: &str, rows: usize, device: &Device) -> Result<Option<Tensor<2>>> {
        let Some(factors) = self.layers.get(name) else {
            return Ok(None);
        };
        let layer = name.strip_suffix(".weight").unwrap_or(name);
        let factor = self.scale * self.strength.factor(layer, factors.rank());
        Ok(Some(factors.product(rows, device)? * factor))
    }
}

impl ModuleMapper for Merger<'_> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let transposed = self.path.is_transposed(D);
        let dims = param.lazy_shape();
        let rows = if transposed { dims[1] } else { dims[0] };
        let name = self.path.file_name(self.layout);
        let mut change = match self.change(&name, rows, &param.lazy_device()) {
            Ok(Some(change)) => change,
            Ok(None) => return param,
            Err(error) => {
                self.result = Err(error);
                return param;
            }
        };
        if transposed {
            change = change.swap_dims(0, 1);
        }
        param.map(|weight| {
            // Summed in f32 and rounded once, whatever the weights are held in.
            let (dims, dtype) = (weight.dims(), weight.dtype());
            cast_to(cast_to(weight, DType::F32) + change.reshape(dims), dtype)
        })
    }
}
