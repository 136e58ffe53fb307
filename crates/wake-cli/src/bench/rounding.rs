//! The shipped model with weights rounded further.

use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};
use std::path::Path;
use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::{Device, bf16, f16};

use crate::exit::Outcome;

/// Precision of weights coarser than the file's 16 bits (10 of them for the fraction).
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rounding {
    /// 16 bits, 7 of them for the fraction.
    Bf16,
    /// 8 bits, with a scale for each row of a matrix (each output channel).
    Int8,
}

impl Rounding {
    pub(crate) const ALL: [Self; 2] = [Self::Bf16, Self::Int8];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Bf16 => "bf16",
            Self::Int8 => "int8",
        }
    }

    fn round(self, values: &mut [f32], shape: &[usize]) {
        match self {
            Self::Bf16 => values
                .iter_mut()
                .for_each(|v| *v = bf16::from_f32(*v).to_f32()),
            // Biases and scales of norms are few and are not rounded.
            Self::Int8 if shape.len() < 2 => {}
            Self::Int8 => {
                let row: usize = shape[1..].iter().product();
                values.chunks_mut(row.max(1)).for_each(to_8_bits);
            }
        }
    }
}

fn to_8_bits(row: &mut [f32]) {
    let scale = row.iter().fold(0.0f32, |most, v| most.max(v.abs())) / 127.0;
    if scale > 0.0 {
        row.iter_mut()
            .for_each(|v| *v = (*v / scale).round() * scale);
    }
}

/// The shipped model with rounded weights; it still computes in f32.
pub(crate) fn rounded(rounding: Rounding) -> Outcome<WakeSampler> {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../wake-ldm/assets");
    let folder = tempfile::tempdir()?;
    for entry in std::fs::read_dir(assets)? {
        let from = entry?.path();
        let to = folder.path().join(from.file_name().unwrap_or_default());
        let bytes = std::fs::read(&from)?;
        let is_weights = from.extension().is_some_and(|e| e == "safetensors");
        let bytes = if is_weights {
            round_file(rounding, &bytes)?
        } else {
            bytes
        };
        std::fs::write(to, bytes)?;
    }
    Ok(WakeSampler::from_folder(folder.path(), &Device::default())?)
}

/// A weight file with its numbers rounded, as f32; other tensors stay unchanged.
fn round_file(rounding: Rounding, bytes: &[u8]) -> Outcome<Vec<u8>> {
    let file = SafeTensors::deserialize(bytes)?;
    let mut tensors = Vec::new();
    for (name, view) in file.iter() {
        let (kind, shape) = (view.dtype(), view.shape().to_vec());
        let pairs = || view.data().chunks_exact(2).map(|b| [b[0], b[1]]);
        let mut values: Vec<f32> = match kind {
            Dtype::F16 => pairs().map(|b| f16::from_le_bytes(b).to_f32()).collect(),
            Dtype::BF16 => pairs().map(|b| bf16::from_le_bytes(b).to_f32()).collect(),
            Dtype::F32 => {
                let numbers = view.data().chunks_exact(4);
                numbers
                    .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                    .collect()
            }
            _ => {
                tensors.push((name, kind, shape, view.data().to_vec()));
                continue;
            }
        };
        rounding.round(&mut values, &shape);
        let data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        tensors.push((name, Dtype::F32, shape, data));
    }
    let views = tensors.iter().map(|(name, kind, shape, data)| {
        TensorView::new(*kind, shape.clone(), data).map(|view| (*name, view))
    });
    let views: Vec<_> = views.collect::<Result<_, _>>()?;
    Ok(safetensors::serialize(views, None)?)
}
