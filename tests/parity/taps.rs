//! Single layers inside the models against torch: what went into them and what came out.
//!
//! The whole models are compared elsewhere; these tell which layer is at fault. Plain convolutions and linear layers are
//! burn's own, and blocks of layers are only seen from outside.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use burn::module::Module;
use burn::tensor::activation::silu;
use burn::tensor::{Device, Int, Tensor, TensorData};
use safetensors::tensor::TensorView;
use serde_json::Value;
use wake_ldm::text::ClipText;
use wake_nn::attention::CrossAttention;
use wake_nn::feed_forward::FeedForward;
use wake_nn::norm::GroupNorm;
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::resnet::{ResnetBlock, ResnetShape};
use wake_nn::timestep::{TimestepEmbedding, sinusoidal_embedding};
use wake_nn::transformer::{Transformer2d, TransformerShape};
use wake_nn::weights::{self, Layout};

use crate::golden::{Golden, devices, expect, folder, json, largest, numbers};

/// One tapped layer: the model that it belongs to, its place, and its numbers.
struct Tap<'a> {
    config: &'a Value,
    weights: &'a Golden,
    taps: &'a Golden,
    path: &'a str,
    device: &'a Device,
}

/// What a layer is called here, where its file name depends on what stands before it.
const ALONE: [(&str, &str); 3] = [
    ("to_out.0.", "to_out."),
    ("net.0.proj.", "proj."),
    ("net.2.", "out."),
];

impl Tap<'_> {
    fn input<const D: usize>(&self, name: &str) -> Option<Tensor<D>> {
        let name = format!("{}::{name}", self.path);
        let there = self.taps.has(&name);
        there.then(|| self.taps.tensor(&name, self.device))
    }

    /// The first input.
    fn x<const D: usize>(&self) -> Tensor<D> {
        self.input("in0").expect("an input")
    }

    fn out_shape(&self) -> Vec<usize> {
        self.taps.shape(&format!("{}::out", self.path))
    }

    fn number(&self, key: &str) -> usize {
        self.config[key].as_u64().unwrap() as usize
    }

    fn is_unet(&self) -> bool {
        self.config["_class_name"] == "UNet2DConditionModel"
    }

    fn groups(&self) -> usize {
        self.number("norm_num_groups")
    }

    /// ε of the normalisations: in a U-Net's transformers, and all over an autoencoder, 1e-6.
    fn epsilon(&self) -> f64 {
        if self.is_unet() && !self.path.contains("attentions") {
            self.config["norm_eps"].as_f64().unwrap()
        } else {
            1e-6
        }
    }

    /// Fills a layer with its weights, and with no others.
    fn load<M: Module>(&self, layer: M, below: &str) -> M {
        let prefix = format!("{}{below}.", self.path);
        let alone = |name: &str| {
            let named = ALONE.iter().find(|(file, _)| name.starts_with(file));
            named.map_or_else(
                || name.to_owned(),
                |(file, here)| name.replacen(file, here, 1),
            )
        };
        let named: Vec<(String, &str)> = self
            .weights
            .names()
            .filter_map(|name| Some((alone(name.strip_prefix(&prefix)?), name)))
            .collect();
        let bytes: Vec<Vec<u8>> = named
            .iter()
            .map(|(_, name)| self.weights.f32s(name))
            .map(|numbers| numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
            .collect();
        let views = named.iter().zip(&bytes).map(|((here, name), bytes)| {
            let shape = self.weights.shape(name);
            let view = TensorView::new(safetensors::Dtype::F32, shape, bytes);
            (here, view.unwrap())
        });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layer.safetensors");
        safetensors::serialize_to_file(views, None, &file).unwrap();
        weights::load(layer, Layout::Diffusers, &file).unwrap()
    }

    fn resnet(&self) -> Vec<f32> {
        let [_, channels_in, ..] = self.x::<4>().dims();
        let time: Option<Tensor<2>> = self.input("in1");
        let shape = ResnetShape {
            channels_in,
            channels_out: self.out_shape()[1],
            time_channels: time.as_ref().map(|time| time.dims()[1]),
            groups: self.groups(),
            epsilon: self.epsilon(),
        };
        let block = self.load(ResnetBlock::new(shape, self.device), "");
        numbers(&block.forward(self.x(), time.map(silu)))
    }

    fn heads(&self) -> usize {
        self.number("attention_head_dim")
    }

    fn transformer(&self, context: Tensor<3>) -> Vec<f32> {
        let shape = TransformerShape {
            channels: self.out_shape()[1],
            context_channels: Some(context.dims()[2]),
            heads: self.heads(),
            layers: 1,
            groups: self.groups(),
            linear_projection: self.config["use_linear_projection"].as_bool() == Some(true),
        };
        let layer = self.load(Transformer2d::new(shape, self.device), "");
        numbers(&layer.forward(self.x(), Some(&context)))
    }

    /// The autoencoder's attention: a normalisation, one head over all pixels, and the input added.
    fn pixel_attention(&self) -> Vec<f32> {
        let x = self.x::<4>();
        let [batch, channels, rows, columns] = x.dims();
        let norm = GroupNorm::new(self.groups(), channels, 1e-6, self.device);
        let norm = self.load(norm, ".group_norm");
        // Today's names, and those of files written before 2023.
        let names = [
            ("to_q", "query"),
            ("to_k", "key"),
            ("to_v", "value"),
            ("to_out.0", "proj_attn"),
        ];
        let parts = names.map(|(name, old)| {
            let [today, old] = [name, old].map(|name| format!("{}.{name}", self.path));
            let path = if self.weights.has(&format!("{today}.weight")) {
                today
            } else {
                old
            };
            let [weight, bias] = ["weight", "bias"].map(|end| format!("{path}.{end}"));
            (
                self.weights.tensor::<2>(&weight, self.device).transpose(),
                self.weights.tensor::<1>(&bias, self.device),
            )
        });
        let tokens = norm
            .forward(x.clone())
            .reshape([batch, channels, rows * columns]);
        let tokens: Tensor<3> = tokens.swap_dims(1, 2);
        let linear = |x: Tensor<3>, i: usize| {
            let (weight, bias) = parts[i].clone();
            burn::tensor::module::linear(x, weight, Some(bias))
        };
        let [q, k, v] = [0, 1, 2].map(|i| linear(tokens.clone(), i));
        let out = linear(wake_nn::attention::attention(q, k, v, 1, false), 3);
        numbers(&(out.swap_dims(1, 2).reshape(x.dims()) + x))
    }

    fn cross_attention(&self) -> Vec<f32> {
        let context: Option<Tensor<3>> = self.input("in_encoder_hidden_states");
        let [_, _, channels] = self.x::<3>().dims();
        let width = context
            .as_ref()
            .map_or(channels, |context| context.dims()[2]);
        let layer = CrossAttention::new(channels, width, self.heads(), false, self.device);
        numbers(&self.load(layer, "").forward(self.x(), context))
    }

    fn feed_forward(&self) -> Vec<f32> {
        let [_, _, channels] = self.x::<3>().dims();
        let layer = self.load(FeedForward::new(channels, self.device), "");
        numbers(&layer.forward(self.x()))
    }

    fn group_norm(&self) -> Vec<f32> {
        let [_, channels, ..] = self.x::<4>().dims();
        let layer = GroupNorm::new(self.groups(), channels, self.epsilon(), self.device);
        numbers(&self.load(layer, "").forward(self.x()))
    }

    fn downsample(&self) -> Vec<f32> {
        let channels = self.out_shape()[1];
        let layer = if self.is_unet() {
            Downsample::padded(channels, self.device)
        } else {
            Downsample::padded_at_end(channels, self.device)
        };
        numbers(&self.load(layer, "").forward(self.x()))
    }

    fn upsample(&self) -> Vec<f32> {
        let [_, channels, rows, columns] = self.out_shape()[..] else {
            panic!("no image")
        };
        let layer = self.load(Upsample::new(channels, self.device), "");
        numbers(&layer.forward(self.x(), Some([rows, columns])))
    }

    fn time_embedding(&self) -> Vec<f32> {
        let [_, channels] = self.x::<2>().dims();
        let layer = TimestepEmbedding::new(channels, self.out_shape()[1], self.device);
        numbers(&self.load(layer, "").forward(self.x()))
    }

    fn time_proj(&self) -> Vec<f32> {
        let name = format!("{}::in0", self.path);
        let steps: Vec<f32> = self.taps.i64s(&name).iter().map(|&t| t as f32).collect();
        let steps = Tensor::from_floats(steps.as_slice(), self.device);
        numbers(&sinusoidal_embedding(steps, self.out_shape()[1], true, 0.0))
    }

    /// The kind of layer and what ours makes of the input; `None` for blocks and plain layers.
    fn answer(&self) -> Option<(&'static str, Vec<f32>)> {
        let parts: Vec<&str> = self.path.split('.').collect();
        let (last, before) = (parts[parts.len() - 1], parts.iter().rev().nth(1));
        let image = self.out_shape().len() == 4;
        Some(match (before.copied(), last) {
            (Some("resnets"), _) => ("residual block", self.resnet()),
            (Some("attentions"), _) => match self.input("in_encoder_hidden_states") {
                Some(context) => ("transformer", self.transformer(context)),
                None => ("pixel attention", self.pixel_attention()),
            },
            (Some("downsamplers"), _) => ("downsampling", self.downsample()),
            (Some("upsamplers"), _) => ("upsampling", self.upsample()),
            (_, "attn1" | "attn2") => ("cross attention", self.cross_attention()),
            (_, "ff") => ("feed forward", self.feed_forward()),
            (_, "norm" | "norm1" | "norm2" | "conv_norm_out") if image => {
                ("group norm", self.group_norm())
            }
            (_, "time_embedding") => ("time embedding", self.time_embedding()),
            (_, "time_proj") => ("waves of the step", self.time_proj()),
            _ => return None,
        })
    }
}

/// The layers of a text encoder, one after the other: all that can be seen of it from outside.
fn check_text(path: &Path, taps: &Golden, what: &str, device: &Device) -> usize {
    let text = ClipText::from_folder(path, device).unwrap();
    let name = "text_model.embeddings::in_input_ids";
    let ids = || -> Tensor<2, Int> {
        Tensor::from_data(TensorData::new(taps.i64s(name), taps.shape(name)), device)
    };
    let states = text.hidden_states(ids());
    let mut answers = BTreeMap::from([
        ("text_model.embeddings".to_owned(), numbers(&states[0])),
        (
            "text_model.final_layer_norm".to_owned(),
            numbers(&text.forward(ids()).last_hidden_state),
        ),
    ]);
    for (i, state) in states.iter().skip(1).enumerate() {
        answers.insert(format!("text_model.encoder.layers.{i}"), numbers(state));
    }
    let tapped = answers
        .iter()
        .filter(|(layer, _)| taps.has(&format!("{layer}::out")));
    tapped
        .map(|(layer, ours)| check(what, layer, ours, taps))
        .count()
}

/// A layer alone has at most the noise of a whole model, which is some 1e-6 of the largest value in the
/// fixtures; ten times that.
fn check(what: &str, path: &str, ours: &[f32], taps: &Golden) {
    let expected = taps.f32s(&format!("{path}::out"));
    let allowed = 1e-5 * largest(&expected).max(1.0);
    expect(&format!("{what} {path}"), ours, &expected, allowed);
}

fn taps_of(model: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(model).unwrap();
    let is_tap = |path: &PathBuf| {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        name.starts_with("taps_") && name.ends_with(".safetensors")
    };
    entries
        .map(|entry| entry.unwrap().path())
        .filter(is_tap)
        .collect()
}

#[test]
fn every_kind_of_layer_agrees_with_torch() {
    let models = folder().join("models");
    let manifest = json(&models.join("manifest.json"));
    for (backend, device) in devices() {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for (name, model) in manifest["models"].as_object().unwrap() {
            let path = models.join(name);
            for file in taps_of(&path) {
                let taps = Golden::read(&file);
                let what = format!("{backend} {name}");
                if model["class"] == "CLIPTextModel" {
                    *seen.entry("text layer").or_default() +=
                        check_text(&path, &taps, &what, &device);
                    continue;
                }
                let config = json(&path.join("config.json"));
                let weights = Golden::read(&path.join("diffusion_pytorch_model.safetensors"));
                for tapped in taps.names().filter_map(|name| name.strip_suffix("::out")) {
                    let tap = Tap {
                        config: &config,
                        weights: &weights,
                        taps: &taps,
                        path: tapped,
                        device: &device,
                    };
                    if let Some((kind, ours)) = tap.answer() {
                        check(&what, tapped, &ours, &taps);
                        *seen.entry(kind).or_default() += 1;
                    }
                }
            }
        }
        println!("{backend}: {seen:?}");
        assert!(!seen.is_empty(), "no tapped layers in {}", models.display());
    }
}
