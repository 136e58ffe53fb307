//! Parser of prompts, from words to the numbers they state.

use burn::module::{Module, Param};
use burn::nn::{Embedding, EmbeddingConfig, Initializer, Linear, LinearConfig};
use burn::tensor::activation::gelu;
use burn::tensor::{DType, Device, Int, Tensor, TensorData};

use super::config::WakeModelConfig;
use crate::wake_model::conditioning::{QUANTITIES, Vocabulary};
use wake_nn::attention::CrossAttention;
use wake_nn::cast_to;

/// Number of neighbouring tokens on each side in a token's window.
const REACH: usize = 6;
/// Number of tokens in a window, including the token itself.
const WINDOW: usize = 2 * REACH + 1;
/// Number of attention heads.
const HEADS: usize = 2;

/// Small transformer that reads the values stated by a prompt.
///
/// ```text
/// h_i = MLP(E(w_{i−6}), …, E(w_{i+6}))          a token with its neighbours: digits, unit, the word before
/// v_q = a_q + attention(a_q; h_1…h_n)           one learned query a_q for each quantity q
/// [stated, a, b]_q = MLP(v_q)                   as in `conditioning::statement`
/// ```
///
/// The window covers whole numbers with their units, so attention has to find only the right one.
///
/// # References
///
/// Vaswani et al. (2017), "Attention Is All You Need", section 3.2; Jaegle et al. (2021), "Perceiver", section 3
/// (learned queries).
#[derive(Module, Debug)]
pub struct PromptParser {
    embedding: Embedding,
    window: Linear,
    mix: Linear,
    queries: Param<Tensor<2>>,
    attention: CrossAttention,
    hidden: Linear,
    out: Linear,
}

impl PromptParser {
    pub(super) fn new(config: &WakeModelConfig, device: &Device) -> Self {
        let width = config.text_width;
        let linear = |from, to| LinearConfig::new(from, to).init(device);
        let normal = Initializer::Normal {
            mean: 0.0,
            std: 1.0,
        };
        Self {
            embedding: EmbeddingConfig::new(config.vocabulary.len() + 1, width / 2).init(device),
            window: linear(WINDOW * width / 2, 2 * width),
            mix: linear(2 * width, width),
            queries: normal.init([QUANTITIES, width], device),
            attention: CrossAttention::new(width, width, HEADS, true, device),
            hidden: linear(width, 4 * width),
            out: linear(4 * width, 3),
        }
    }

    /// Reads the values that prompts state, as [`statement`](crate::wake_model::conditioning::statement), in f32.
    ///
    /// # Shapes
    ///
    /// `windows`: from [`windows`]; result `[batch, 3 · QUANTITIES]`.
    pub fn forward(&self, windows: Tensor<2, Int>, tokens: usize) -> Tensor<2> {
        let batch = windows.dims()[0] / tokens;
        let seen = self.embedding.forward(windows);
        let [_, _, width] = seen.dims();
        let seen = seen.reshape([batch, tokens, WINDOW * width]);
        let states = self.mix.forward(gelu(self.window.forward(seen)));
        let queries = self.queries.val().unsqueeze::<3>().repeat_dim(0, batch);
        let found = queries.clone() + self.attention.forward(queries, Some(states));
        let stated = self.out.forward(gelu(self.hidden.forward(found)));
        cast_to(stated.reshape([batch, 3 * QUANTITIES]), DType::F32)
    }
}

/// Windows of the tokens of some prompts as compact ids; beyond the ends they hold the unknown token.
///
/// # Shapes
///
/// `prompts`: CLIP's ids, each of the same number of tokens; result `[prompts · tokens, 13]` and that number.
pub fn windows(
    prompts: &[Vec<u32>],
    vocabulary: &Vocabulary,
    device: &Device,
) -> (Tensor<2, Int>, usize) {
    let tokens = prompts.first().map_or(0, Vec::len);
    let mut ids: Vec<i64> = Vec::with_capacity(prompts.len() * tokens * WINDOW);
    for prompt in prompts {
        let mut padded = vec![0; tokens + 2 * REACH];
        for (place, &id) in padded[REACH..].iter_mut().zip(prompt) {
            *place = vocabulary.compact(id) as i64;
        }
        padded.windows(WINDOW).for_each(|window| ids.extend(window));
    }
    let shape = [prompts.len() * tokens, WINDOW];
    (
        Tensor::from_data(TensorData::new(ids, shape), device),
        tokens,
    )
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_a_token_and_its_neighbours() {
        let vocabulary = Vocabulary::new([10, 20, 30]);
        let prompts = vec![vec![10, 20, 30, 99, 10]];
        let (windows, tokens) = windows(&prompts, &vocabulary, &Device::flex());
        assert_eq!((windows.dims(), tokens), ([5, WINDOW], 5));
        let rows: Vec<i64> = windows.into_data().iter::<i64>().collect();
        assert_eq!(rows[..WINDOW], [0, 0, 0, 0, 0, 0, 1, 2, 3, 0, 1, 0, 0]);
        assert_eq!(rows[4 * WINDOW..], [0, 0, 1, 2, 3, 0, 1, 0, 0, 0, 0, 0, 0]);
    }
}
