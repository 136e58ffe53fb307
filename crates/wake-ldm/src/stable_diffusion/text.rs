//! CLIP text transformer, from token ids to the embeddings that condition the U-Net.

use std::path::Path;

use burn::config::Config;
use burn::module::Module;
use burn::nn::{Embedding, EmbeddingConfig, Initializer, LayerNorm, LayerNormConfig};
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Int, Tensor};
use serde_json::{Value, json};

use crate::options::Options;
use wake_nn::activation::Activation;
use wake_nn::attention::attention;
use wake_nn::linear::linear;
use wake_nn::weights::{Layout, load};
use wake_nn::{Error, Result, check_range};

/// Widths and options of a [`ClipText`], by default as in Stable Diffusion v1.4.
#[derive(Config, Debug, PartialEq)]
pub struct ClipTextConfig {
    /// Number of tokens in the vocabulary.
    #[config(default = 49408)]
    pub vocab_size: usize,
    /// Channels of a token.
    #[config(default = 768)]
    pub hidden_size: usize,
    /// Channels between the two matrices of the feed-forward layer.
    #[config(default = 3072)]
    pub intermediate_size: usize,
    /// Number of transformer layers.
    #[config(default = 12)]
    pub layers: usize,
    /// Number of attention heads.
    #[config(default = 12)]
    pub heads: usize,
    /// Longest prompt in tokens, including start and end marks.
    #[config(default = 77)]
    pub max_tokens: usize,
    /// Activation of the feed-forward layer.
    #[config(default = "Activation::QuickGelu")]
    pub activation: Activation,
    /// ε of the normalisations.
    #[config(default = 1e-5)]
    pub norm_epsilon: f64,
    /// Id of the end mark. Files written before 2023 give 2 for any vocabulary; the mark is then the largest id of the prompt.
    #[config(default = 2)]
    pub end_token: i64,
}

const COMPONENT: &str = "CLIPTextModel";

impl ClipTextConfig {
    /// Reads the `config.json` of a transformers `CLIPTextModel`.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for an option that would change the result and is not implemented, and the errors of
    /// [`validate`](Self::validate); [`Error::Io`], [`Error::Json`] for a bad file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_json(&whole_files::read_text(path)?, path)
    }

    /// Reads the text of a `config.json`; `path` is used only in messages.
    ///
    /// transformers writes many options that do not concern this model; only those that shape a CLIP text transformer are read.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        let mut options = Options::parse(COMPONENT, text, path)?;
        options.only("model_type", &["clip_text_model"])?;
        options.only("attention_dropout", &[0.0])?;
        let activations = [
            ("quick_gelu", Activation::QuickGelu),
            ("gelu", Activation::Gelu),
        ];
        let config = Self {
            vocab_size: options.usize("vocab_size", 49408)?,
            hidden_size: options.usize("hidden_size", 512)?,
            intermediate_size: options.usize("intermediate_size", 2048)?,
            layers: options.usize("num_hidden_layers", 12)?,
            heads: options.usize("num_attention_heads", 8)?,
            max_tokens: options.usize("max_position_embeddings", 77)?,
            activation: options.choice("hidden_act", "quick_gelu", &activations)?,
            norm_epsilon: options.f64("layer_norm_eps", 1e-5)?,
            end_token: i64::try_from(options.usize("eos_token_id", 49407)?).unwrap_or(i64::MAX),
        };
        config.validate()?;
        Ok(config)
    }

    /// `config.json` from which transformers reads this model.
    pub fn to_json(&self) -> Value {
        json!({
            "architectures": [COMPONENT],
            "attention_dropout": 0.0,
            "bos_token_id": 0,
            "eos_token_id": self.end_token,
            "hidden_act": match self.activation {
                Activation::QuickGelu => "quick_gelu",
                Activation::Gelu => "gelu",
            },
            "hidden_size": self.hidden_size,
            "intermediate_size": self.intermediate_size,
            "layer_norm_eps": self.norm_epsilon,
            "max_position_embeddings": self.max_tokens,
            "model_type": "clip_text_model",
            "num_attention_heads": self.heads,
            "num_hidden_layers": self.layers,
            "pad_token_id": 1,
            "projection_dim": self.hidden_size,
            "vocab_size": self.vocab_size,
        })
    }

    /// Checks that a model of these widths can be built.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a number outside its range, [`Error::InvalidOption`] if the
    /// heads do not divide the width.
    pub fn validate(&self) -> Result<()> {
        let counts = [
            ("vocab_size", self.vocab_size, 16_777_216.0),
            ("hidden_size", self.hidden_size, 65536.0),
            ("intermediate_size", self.intermediate_size, 1_048_576.0),
            ("num_hidden_layers", self.layers, 1024.0),
            ("num_attention_heads", self.heads, 65536.0),
            ("max_position_embeddings", self.max_tokens, 1_048_576.0),
        ];
        for (name, value, max) in counts {
            check_range(name, value as f64, 1.0, max)?;
        }
        check_range("layer_norm_eps", self.norm_epsilon, 1e-12, 1.0)?;
        if self.hidden_size.is_multiple_of(self.heads) {
            return Ok(());
        }
        Err(Error::InvalidOption {
            option: "num_attention_heads".to_owned(),
            value: self.heads.to_string(),
            expected: format!("a divisor of hidden_size {}", self.hidden_size),
        })
    }

    /// Makes a text transformer with random weights, which are drawn on first use.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init(&self, device: &Device) -> ClipText {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
        let embedding = |count| {
            EmbeddingConfig::new(count, self.hidden_size)
                .with_initializer(Initializer::Normal {
                    mean: 0.0,
                    std: 0.02,
                })
                .init(device)
        };
        ClipText {
            token_embedding: embedding(self.vocab_size),
            position_embedding: embedding(self.max_tokens),
            layers: (0..self.layers)
                .map(|_| ClipLayer::new(self, device))
                .collect(),
            final_layer_norm: self.norm(device),
            config: self.clone(),
        }
    }

    fn norm(&self, device: &Device) -> LayerNorm {
        LayerNormConfig::new(self.hidden_size)
            .with_epsilon(self.norm_epsilon)
            .init(device)
    }
}

/// Embedding of a prompt.
#[derive(Debug, Clone)]
pub struct ClipTextOutput {
    /// All tokens after the last layer and its normalisation, `[batch, tokens, hidden_size]`, to which the
    /// U-Net of Stable Diffusion v1 attends.
    pub last_hidden_state: Tensor<3>,
    /// The token at the end mark, `[batch, hidden_size]`: one vector for the whole prompt.
    pub pooled: Tensor<2>,
}

/// Transformer in which every token attends to itself and to earlier tokens.
///
/// # References
///
/// Radford et al. (2021), "Learning Transferable Visual Models From Natural Language Supervision",
/// section 2.4.
#[derive(Module, Debug)]
pub struct ClipText {
    token_embedding: Embedding,
    position_embedding: Embedding,
    layers: Vec<ClipLayer>,
    final_layer_norm: LayerNorm,
    #[module(skip)]
    config: ClipTextConfig,
}

impl ClipText {
    /// Reads a folder with `config.json` and weights, as f32.
    ///
    /// # Errors
    ///
    /// The errors of [`load`] and of [`ClipTextConfig::read`].
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let config = ClipTextConfig::read(&folder.join("config.json"))?;
        load(config.init(device), Layout::ClipText, folder)
    }

    /// The configuration of the model.
    pub fn config(&self) -> &ClipTextConfig {
        &self.config
    }

    /// Channels of a token.
    pub fn width(&self) -> usize {
        self.config.hidden_size
    }

    /// Encodes prompts.
    ///
    /// Padding is not masked: Stable Diffusion was trained that way.
    ///
    /// # Shapes
    ///
    /// `ids`: `[batch, tokens]` with at most `max_tokens` tokens; result: see [`ClipTextOutput`].
    ///
    /// # Panics
    ///
    /// When a prompt is longer than the model allows.
    pub fn forward(&self, ids: Tensor<2, Int>) -> ClipTextOutput {
        let last_hidden_state = self.last_hidden_state(ids.clone());
        let pooled = self.pool(ids, &last_hidden_state);
        ClipTextOutput {
            last_hidden_state,
            pooled,
        }
    }

    /// Embeddings of the tokens, without the pooled one, whose position must be found on the host.
    ///
    /// # Shapes
    ///
    /// `ids`: `[batch, tokens]`; result: `[batch, tokens, hidden_size]`.
    ///
    /// # Panics
    ///
    /// When a prompt is longer than the model allows.
    pub fn last_hidden_state(&self, ids: Tensor<2, Int>) -> Tensor<3> {
        let tokens = self.embed(ids);
        let layers = self.layers.iter();
        let tokens = layers.fold(tokens, |x, layer| layer.forward(x));
        self.final_layer_norm.forward(tokens)
    }

    /// Tokens at the input of each layer and at the output of the last, before its normalisation.
    ///
    /// # Shapes
    ///
    /// `ids`: `[batch, tokens]`; each of the `layers + 1` results: `[batch, tokens, hidden_size]`.
    ///
    /// # Panics
    ///
    /// When a prompt is longer than the model allows.
    pub fn hidden_states(&self, ids: Tensor<2, Int>) -> Vec<Tensor<3>> {
        let mut states = vec![self.embed(ids)];
        for (i, layer) in self.layers.iter().enumerate() {
            states.push(layer.forward(states[i].clone()));
        }
        states
    }

    fn embed(&self, ids: Tensor<2, Int>) -> Tensor<3> {
        let [_, tokens] = ids.dims();
        let longest = self.config.max_tokens;
        assert!(
            tokens <= longest,
            "the prompt has {tokens} tokens, expected at most {longest}"
        );
        let positions = self.position_embedding.weight.val().narrow(0, 0, tokens);
        self.token_embedding.forward(ids) + positions.unsqueeze::<3>()
    }

    /// Returns each prompt's token at the end mark, for which ids are read back to the host.
    fn pool(&self, ids: Tensor<2, Int>, states: &Tensor<3>) -> Tensor<2> {
        let [batch, tokens] = ids.dims();
        let ids: Vec<i64> = ids.into_data().iter::<i64>().collect();
        let ends = ids
            .chunks(tokens)
            .map(|prompt| end_of(prompt, self.config.end_token));
        let [_, _, width] = states.dims();
        let rows = ends.zip(0..batch).map(|(end, i)| {
            states
                .clone()
                .slice([i..i + 1, end..end + 1])
                .reshape([1, width])
        });
        Tensor::cat(rows.collect(), 0)
    }
}

/// Position of the first end mark, or of the first largest id under the old convention.
fn end_of(prompt: &[i64], end_token: i64) -> usize {
    let mark = if end_token == 2 {
        prompt.iter().copied().max()
    } else {
        Some(end_token)
    };
    prompt.iter().position(|&id| Some(id) == mark).unwrap_or(0)
}

/// One layer: attention and a feed-forward layer, each normalised before and added to its input.
#[derive(Module, Debug)]
struct ClipLayer {
    layer_norm1: LayerNorm,
    self_attn: ClipAttention,
    layer_norm2: LayerNorm,
    mlp: ClipMlp,
}

impl ClipLayer {
    fn new(config: &ClipTextConfig, device: &Device) -> Self {
        Self {
            layer_norm1: config.norm(device),
            self_attn: ClipAttention::new(config, device),
            layer_norm2: config.norm(device),
            mlp: ClipMlp::new(config, device),
        }
    }

    fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let x = self.self_attn.forward(self.layer_norm1.forward(x.clone())) + x;
        self.mlp.forward(self.layer_norm2.forward(x.clone())) + x
    }
}

/// Causal self-attention.
#[derive(Module, Debug)]
struct ClipAttention {
    q_proj: Linear,
    k_proj: Linear,
    v_proj: Linear,
    out_proj: Linear,
    heads: usize,
}

impl ClipAttention {
    fn new(config: &ClipTextConfig, device: &Device) -> Self {
        let linear = || LinearConfig::new(config.hidden_size, config.hidden_size).init(device);
        Self {
            q_proj: linear(),
            k_proj: linear(),
            v_proj: linear(),
            out_proj: linear(),
            heads: config.heads,
        }
    }

    fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let key = linear(&self.k_proj, x.clone());
        let value = linear(&self.v_proj, x.clone());
        let query = linear(&self.q_proj, x);
        let seen = attention(query, key, value, self.heads, true);
        linear(&self.out_proj, seen)
    }
}

/// The feed-forward layer.
#[derive(Module, Debug)]
struct ClipMlp {
    fc1: Linear,
    fc2: Linear,
    #[module(skip)]
    activation: Activation,
}

impl ClipMlp {
    fn new(config: &ClipTextConfig, device: &Device) -> Self {
        Self {
            fc1: LinearConfig::new(config.hidden_size, config.intermediate_size).init(device),
            fc2: LinearConfig::new(config.intermediate_size, config.hidden_size).init(device),
            activation: config.activation,
        }
    }

    fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        linear(&self.fc2, self.activation.forward(linear(&self.fc1, x)))
    }
}
