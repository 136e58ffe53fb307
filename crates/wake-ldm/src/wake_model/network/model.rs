//! Parts of the small wake model.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use super::config::WakeModelConfig;
use super::flow::Flow;
use super::inputs::ConditioningInputs;
use super::patches::PatchTransform;
use super::prior::{Expected, Prior};
use super::prompt_parser::{PromptParser, windows};
use crate::wake_model::conditioning::{QUANTITIES, Vocabulary, said, tokens};
use wake_text::PartialScene;

/// Latent diffusion model of radar images of wakes.
///
/// ```text
/// words ─► parser ─► numbers ─► physics: expected image ─► patches: w ─┐
///                       ├───────► prior ─► mean μ, spread s ────────────┤
///                       └───────► flow: noise ─► residual r ◄───────────┘
///                    z = μ + s r;  z − w ─► patches ─► added to the expected image
/// ```
#[derive(Module, Debug)]
pub struct WakeModel {
    /// Squares of pixels to latents and back.
    pub patches: PatchTransform,
    /// Words to numbers.
    pub parser: PromptParser,
    /// Numbers to mean and spread.
    pub prior: Prior,
    /// Noise to residual.
    pub flow: Flow,
}

impl WakeModelConfig {
    /// Makes a model with random weights, and with patches that must be fitted or loaded.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init(&self, device: &Device) -> WakeModel {
        WakeModel {
            patches: PatchTransform::zeros(self.latent_channels, device),
            parser: self.init_parser(device),
            prior: self.init_prior(device),
            flow: self.init_flow(device),
        }
    }

    /// Makes a parser with random weights.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init_parser(&self, device: &Device) -> PromptParser {
        self.assert_valid();
        PromptParser::new(self, device)
    }

    /// Makes a prior with random weights.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init_prior(&self, device: &Device) -> Prior {
        self.assert_valid();
        Prior::new(self, device)
    }

    /// Makes a flow with random weights.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init_flow(&self, device: &Device) -> Flow {
        self.assert_valid();
        Flow::new(self, device)
    }

    fn assert_valid(&self) {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
    }
}

impl WakeModel {
    /// Reads the numbers that prompts state, as far as the parser finds them.
    pub fn read(
        &self,
        prompts: &[&str],
        vocabulary: &Vocabulary,
        device: &Device,
    ) -> Vec<PartialScene> {
        let ids: Vec<Vec<u32>> = prompts.iter().map(|prompt| tokens(prompt)).collect();
        let (windows, tokens) = windows(&ids, vocabulary, device);
        let read = self.parser.forward(windows, tokens).into_data();
        let numbers: Vec<f32> = read.iter::<f32>().collect();
        numbers.chunks(3 * QUANTITIES).map(said).collect()
    }

    /// Decodes latents to images, grey 0…1, `[batch, 1, rows, columns]`.
    ///
    /// The difference between the latents and the expected image's latents is decoded and added to that image, so that its
    /// finest details, which the latents do not hold, are kept.
    ///
    /// - `image`: the expected image, with the shape of the result, from which `inputs` were computed
    pub fn decode(
        &self,
        latents: Tensor<4>,
        (expected, inputs): (&Expected, &ConditioningInputs),
        image: Tensor<4>,
    ) -> Tensor<4> {
        let added = latents - inputs.wake.clone();
        (image + self.patches.decode(added, expected.grey.clone())).clamp(0.0, 1.0)
    }
}
