//! Low-rank adaptation as a trainable module, and its file in diffusers' format.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io::Write;
use std::path::Path;

use burn::module::{Initializer, Module, Param};
use burn::tensor::{DType, Tensor};
use safetensors::tensor::{Dtype, TensorView};

use wake_nn::cast_to;
use wake_nn::weights::Layout;
use wake_nn::weights::visit::{Change, Weight, map, visit};
use wake_nn::{Result, check_range};
use whole_files::write_synced;

/// Low-rank changes of some linear layers of a model.
///
/// ```text
/// W' = W + B A
/// ```
///
/// A is drawn at random and B starts at 0, so the model is unchanged at first.
///
/// # References
///
/// Hu et al. (2022), "Low-Rank Adaptation of Large Language Models", section 4.1.
#[derive(Module, Debug)]
pub struct LowRank {
    /// Aᵀ of each layer, `[in, rank]`.
    down: Vec<Param<Tensor<2>>>,
    /// Bᵀ of each layer, `[rank, out]`.
    up: Vec<Param<Tensor<2>>>,
    #[module(skip)]
    layers: Vec<String>,
    #[module(skip)]
    layout: Layout,
}

impl LowRank {
    /// Makes changes of rank `rank` for the attention layers of a model.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`](wake_nn::Error::OutOfRange) for a rank of 0 or above 1024.
    pub fn of_attentions<M: Module>(model: &M, layout: Layout, rank: usize) -> Result<Self> {
        check_range("rank", rank as f64, 1.0, 1024.0)?;
        let mut found = Self {
            down: Vec::new(),
            up: Vec::new(),
            layers: Vec::new(),
            layout,
        };
        let normal = Initializer::Normal {
            mean: 0.0,
            std: 1.0 / rank as f64,
        };
        visit(model, layout, |weight, _| {
            if let Some(layer) = attention_layer(&weight) {
                let (shape, device) = (&weight.shape, &weight.device);
                found.down.push(normal.init([shape[1], rank], device));
                let up = Initializer::Zeros.init([rank, shape[0]], device);
                found.up.push(up);
                found.layers.push(layer.to_owned());
            }
        });
        Ok(found)
    }

    /// Names of the changed layers in files.
    pub fn layers(&self) -> &[String] {
        &self.layers
    }

    /// Returns a model with the changes added; gradients flow into the changes.
    pub fn merged<M: Module>(&self, model: M) -> M {
        let mut factors = self.down.iter().zip(&self.up);
        let Ok(model) = map(model, self.layout, |weight| {
            let layer = attention_layer(weight).and_then(|_| factors.next());
            Ok::<_, Infallible>(match layer {
                None => Change::Kept,
                Some((down, up)) => Change::Added(cast_to(down.val().matmul(up.val()), DType::F32)),
            })
        });
        model
    }

    /// Writes the file that diffusers' `load_lora_weights` and [`merge_lora`](super::merge_lora) read.
    ///
    /// - `prefix`: the model that is changed, `unet` or `text_encoder`
    ///
    /// # Errors
    ///
    /// [`Error::Io`](wake_nn::Error::Io) when the file cannot be written.
    pub fn save(&self, prefix: &str, path: &Path) -> Result<()> {
        let factors = (self.layers.iter().enumerate()).flat_map(|(i, layer)| {
            let both = [("lora_A", &self.down[i]), ("lora_B", &self.up[i])];
            both.map(|(name, factor)| (format!("{prefix}.{layer}.{name}.weight"), factor))
        });
        let tensors = factors.map(|(name, factor)| {
            let matrix = factor.val().transpose();
            let shape = matrix.dims();
            let bytes: Vec<u8> = matrix
                .into_data()
                .iter::<f32>()
                .flat_map(f32::to_le_bytes)
                .collect();
            (name, shape, bytes)
        });
        let tensors: Vec<_> = tensors.collect();
        let views = tensors.iter().map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.to_vec(), bytes).map(|view| (name, view))
        });
        let format = HashMap::from([("format".to_owned(), "pt".to_owned())]);
        let file = views
            .collect::<Result<Vec<_>, _>>()
            .and_then(|views| safetensors::serialize(views, Some(format)));
        Ok(write_synced(path, |writer| {
            writer.write_all(&file.map_err(std::io::Error::other)?)
        })?)
    }
}

/// Name of the layer that a weight belongs to, if the layer is one of those changed.
fn attention_layer(weight: &Weight) -> Option<&str> {
    const ENDS: [&str; 4] = [".to_q", ".to_k", ".to_v", ".to_out.0"];
    let layer = weight.name.strip_suffix(".weight");
    layer.filter(|layer| weight.transposed && ENDS.iter().any(|end| layer.ends_with(end)))
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use burn::module::{ModuleMapper, ModuleVisitor};
    use burn::tensor::Device;

    use super::*;
    use crate::stable_diffusion::lora::merge_lora;
    use wake_nn::attention::CrossAttention;

    #[derive(Module, Debug)]
    struct Block {
        attn1: CrossAttention,
    }

    #[test]
    fn a_saved_change_does_what_the_module_did() {
        let device = Device::flex();
        let block = Block {
            attn1: CrossAttention::new(6, 4, 2, false, &device),
        };
        let mut change = LowRank::of_attentions(&block, Layout::Diffusers, 2).unwrap();
        let expected: Vec<String> = ["to_q", "to_k", "to_v", "to_out.0"]
            .map(|end| format!("attn1.{end}"))
            .into();
        assert_eq!(change.layers(), expected);
        let x = Tensor::<3>::from_floats([[[1.0, -0.5, 0.2, 0.0, 0.7, 0.1], [0.3; 6]]], &device);
        let context = Tensor::<3>::from_floats([[[0.5, -1.0, 0.25, 2.0], [0.1; 4]]], &device);
        let run = |block: &Block| block.attn1.forward(x.clone(), Some(context.clone()));
        let distance = |a: Tensor<3>, b: Tensor<3>| (a - b).abs().max().into_scalar::<f32>();
        // B = 0 changes nothing.
        assert!(distance(run(&change.merged(block.clone())), run(&block)) < f32::MIN_POSITIVE);
        for (i, up) in change.up.iter_mut().enumerate() {
            *up = up.clone().map(|zero| zero + 0.1 * (i + 1) as f64);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lora.safetensors");
        change.save("unet", &path).unwrap();
        let read = merge_lora(block.clone(), Layout::Diffusers, "unet", &path, 1.0).unwrap();
        let merged = run(&change.merged(block.clone()));
        assert!(distance(run(&block), merged.clone()) > 1e-3);
        // The same sums with the same precision, in another order.
        assert!(distance(run(&read), merged) < 1e-5);
        assert!(LowRank::of_attentions(&block, Layout::Diffusers, 0).is_err());
    }

    /// Factors and weights may have different number types; the weights keep theirs.
    #[test]
    fn narrow_weights_take_wide_changes() {
        let device = Device::flex();
        let attn1 = CrossAttention::new(6, 4, 2, false, &device);
        let block = Block { attn1 };
        let mut change = LowRank::of_attentions(&block, Layout::Diffusers, 2).unwrap();
        for up in &mut change.up {
            *up = up.clone().map(|zero| zero + 0.25);
        }
        let narrow = block.clone().map(&mut Narrow);
        let wide = change.merged(block);
        let merged = change.merged(narrow);
        let weights = |block: Block| {
            let mut all = All(Vec::new());
            block.visit(&mut all);
            all.0
        };
        for ((a, kind), (b, _)) in weights(merged).into_iter().zip(weights(wide)) {
            assert_eq!(kind, DType::BF16);
            // The weight and the sum are rounded once each, to 8 bits.
            let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 2.0 / 256.0 * (b.abs() + 1.0);
            assert!(a.iter().zip(&b).all(near));
        }
    }

    /// Converts weights to 16 bits.
    struct Narrow;

    impl ModuleMapper for Narrow {
        fn map_float<const D: usize>(&mut self, weight: Param<Tensor<D>>) -> Param<Tensor<D>> {
            weight.map(|weight| cast_to(weight, DType::BF16))
        }
    }

    /// All weights with their number types.
    struct All(Vec<(Vec<f32>, DType)>);

    impl ModuleVisitor for All {
        fn visit_float<const D: usize>(&mut self, weight: &Param<Tensor<D>>) {
            let weight = weight.val();
            let kind = weight.dtype();
            let values = cast_to(weight, DType::F32)
                .into_data()
                .iter::<f32>()
                .collect();
            self.0.push((values, kind));
        }
    }
}
