//! Low-rank adaptations: merging into weights, training, and files in diffusers' format.

mod low_rank;
mod strength;

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::Module;
use burn::tensor::{DType, Device, Tensor, TensorData};

use strength::{NOTE, Strength};
use wake_nn::weights::files::{Stored, WeightFiles};
use wake_nn::weights::visit::{Change, map};
use wake_nn::weights::{Layout, shapes};
use wake_nn::{Error, Mismatch, Misshapen, Result};

pub use low_rank::LowRank;

/// The two factors of a layer's change.
#[derive(Debug)]
struct Factors<'a> {
    down: &'a Stored<'a>,
    up: &'a Stored<'a>,
}

impl Factors<'_> {
    fn rank(&self) -> usize {
        self.down.shape().first().copied().unwrap_or(0)
    }

    /// Whether the product has the shape of the weight.
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

    /// Change of the weight, flattened to rows and columns.
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
/// - α: from the file's header, for all layers or for single ones; without an entry, r
/// - `prefix`: the model whose layers are merged, `unet` or `text_encoder`; other layers are ignored
///
/// # Errors
///
/// As [`load`](wake_nn::weights::load); [`Error::WeightsMismatch`] for a layer that the model does not have or whose
/// factors do not fit it, and for a file without any layer of this prefix;
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
    let layers = layers(&stored, &shapes(&model, layout), prefix);
    let layers = layers.map_err(|mismatch| Error::WeightsMismatch {
        path: path.to_owned(),
        mismatch: Box::new(mismatch),
    })?;
    map(model, layout, |weight| {
        let name = &weight.name;
        let Some(factors) = layers.get(name) else {
            return Ok(Change::Kept);
        };
        let layer = name.strip_suffix(".weight").unwrap_or(name);
        let factor = scale * strength.factor(layer, factors.rank());
        let change = factors.product(weight.shape[0], &weight.device)? * factor;
        Ok(Change::Added(match weight.transposed {
            true => change.swap_dims(0, 1),
            false => change,
        }))
    })
}

/// Factors of each weight by its name in the model, after checking that all belong to layers of the model and fit them.
fn layers<'a>(
    stored: &'a BTreeMap<String, Stored<'a>>,
    shapes: &BTreeMap<String, Vec<usize>>,
    prefix: &str,
) -> Result<BTreeMap<String, Factors<'a>>, Mismatch> {
    let (mut layers, mut mismatch) = (BTreeMap::new(), Mismatch::default());
    let below = |name: &'a str| name.strip_prefix(prefix)?.strip_prefix('.');
    for (name, down) in stored {
        let Some(layer) = below(name) else { continue };
        let Some(layer) = layer.strip_suffix(".lora_A.weight") else {
            let other = name.replace(".lora_B.", ".lora_A.");
            if !name.contains(".lora_B.") || !stored.contains_key(&other) {
                mismatch.unexpected.push(name.clone());
            }
            continue;
        };
        let up = format!("{prefix}.{layer}.lora_B.weight");
        let Some(up) = stored.get(&up) else {
            mismatch.missing.push(up);
            continue;
        };
        let (weight, factors) = (format!("{layer}.weight"), Factors { down, up });
        match shapes.get(&weight) {
            None => mismatch.unexpected.push(format!("{prefix}.{weight}")),
            Some(shape) if factors.fit(shape) => drop(layers.insert(weight, factors)),
            Some(shape) => mismatch.misshapen.push(Misshapen {
                name: format!("{prefix}.{weight}"),
                expected: format!("factors of {shape:?}"),
                found: format!("{up:?} {down:?}"),
            }),
        }
    }
    if layers.is_empty() && mismatch.is_empty() {
        mismatch.missing.push(format!("{prefix}.….lora_A.weight"));
    }
    match mismatch.is_empty() {
        true => Ok(layers),
        false => Err(mismatch),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::{Dtype, TensorView};

    /// Compares factors of these shapes with a weight; true if they fit.
    fn fit(down: &[usize], up: &[usize], weight: &[usize], dtype: Dtype) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lora.safetensors");
        let zeros = |shape: &[usize]| vec![0; 4 * shape.iter().product::<usize>()];
        let (a, b) = (zeros(down), zeros(up));
        let view = |shape: &[usize], bytes| TensorView::new(dtype, shape.to_vec(), bytes).unwrap();
        let views = [
            ("unet.to_q.lora_A.weight", view(down, &a)),
            ("unet.to_q.lora_B.weight", view(up, &b)),
        ];
        safetensors::serialize_to_file(views, None, &path).unwrap();
        let files = WeightFiles::open(&path).unwrap();
        let stored = files.tensors().unwrap();
        let shapes = BTreeMap::from([("to_q.weight".to_owned(), weight.to_vec())]);
        match layers(&stored, &shapes, "unet") {
            Ok(layers) => {
                assert_eq!(layers.len(), 1);
                true
            }
            Err(mismatch) => {
                assert_eq!(mismatch.misshapen.len(), 1, "{mismatch:?}");
                false
            }
        }
    }

    /// Each case differs from a fitting one in a single number.
    #[test]
    fn factors_fit_a_weight_of_their_outer_sizes() {
        let linear = |down: &[usize], up: &[usize]| fit(down, up, &[6, 8], Dtype::F32);
        assert!(linear(&[2, 8], &[6, 2]));
        assert!(!linear(&[2, 7], &[6, 2]), "columns");
        assert!(!linear(&[2, 8], &[5, 2]), "rows");
        assert!(!linear(&[2, 8], &[6, 3]), "rank");
        assert!(!linear(&[0, 8], &[6, 0]), "no rank");
        assert!(!linear(&[2, 8], &[6, 2, 3]), "numbers left over");
        assert!(!linear(&[16], &[6, 2]), "a list");
        assert!(!linear(&[2, 8], &[12]), "a list");
        assert!(!fit(&[2, 8], &[6, 2], &[6, 8], Dtype::I32), "whole numbers");
        assert!(!fit(&[1, 1], &[6, 1], &[6], Dtype::F32), "a bias");
        let convolution = |up: &[usize]| fit(&[2, 8, 3, 3], up, &[6, 8, 3, 3], Dtype::F32);
        assert!(convolution(&[6, 2, 1, 1]));
        assert!(!convolution(&[6, 2, 3, 3]), "a second window");
    }
}
