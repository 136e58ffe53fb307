//! Parts of the wake model by name.

/// Part of a [`WakeModel`](super::WakeModel).
///
/// Its field, the file of its weights and the training stage that makes it all have its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The linear autoencoder, [`PatchTransform`](super::PatchTransform), fitted in closed form.
    Patches,
    /// The prompt parser, [`PromptParser`](super::PromptParser).
    Parser,
    /// Mean and standard deviation of the latents, [`Prior`](super::Prior).
    Prior,
    /// The flow that samples the sea, [`Flow`](super::Flow).
    Flow,
}

impl Part {
    /// All parts, in the order in which they are trained.
    pub const ALL: [Self; 4] = [Self::Patches, Self::Parser, Self::Prior, Self::Flow];

    /// Name of the part, such as `prior`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Parser => "parser",
            Self::Prior => "prior",
            Self::Flow => "flow",
        }
    }

    /// File name of the weights in the folder of a model, such as `prior.safetensors`.
    #[must_use]
    pub const fn file(self) -> &'static str {
        match self {
            Self::Patches => "patches.safetensors",
            Self::Parser => "parser.safetensors",
            Self::Prior => "prior.safetensors",
            Self::Flow => "flow.safetensors",
        }
    }
}
