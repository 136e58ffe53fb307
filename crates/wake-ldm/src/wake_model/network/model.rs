//! The parts of the small wake model.

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

/// A latent diffusion model of radar images of wakes.
///
/// ```text
/// words ─► parser ─► numbers ─► physics: expected image ─► patches: w ─┐
///                       ├───────► prior ─► mean μ, spread s ────────────┤
///                       └───────► flow: noise ─► residual r ◄───────────┘
///                    z = μ + s r;  z − w ─► patches ─► added to the expected image
/// ```
#[derive(Module, Debug)]
pub struct WakeModel {
    /// Squares of pixels as latents.
    pub patches: PatchTransform,
    /// Words to numbers.
    pub parser: PromptParser,
    /// Numbers to mean and spread.
    pub prior: Prior,
    /// Noise to residual.
    pub flow: Flow,
}

impl WakeModelConfig {
    /// A model with random weights, and patches that still have to be fitted or loaded.
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

    /// A parser with random weights.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init_parser(&self, device: &Device) -> PromptParser {
        self.assert_valid();
        PromptParser::new(self, device)
    }

    /// A prior with random weights.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init_prior(&self, device: &Device) -> Prior {
        self.assert_valid();
        Prior::new(self, device)
    }

    /// A flow with random weights.
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
    /// The numbers that prompts state, as far as the parser finds them.
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

    /// The image of latents, grey 0…1, `[batch, 1, rows, columns]`.
    ///
    /// What the latents have beyond those of the image that is expected is added to that image, so that its finest details,
    /// which no latents hold, stay.
    ///
    /// - `image`: the expected one, of the result's shape, and `known` what was made of it
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
