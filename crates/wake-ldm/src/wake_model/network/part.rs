//! The parts of the wake model by name.

/// A part of a [`WakeModel`](super::WakeModel): one of its fields, the file of its weights, and the stage of training that
/// makes it all have this name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The linear autoencoder, [`PatchTransform`](super::PatchTransform), fitted in closed form.
    Patches,
    /// The reader of prompts, [`PromptParser`](super::PromptParser).
    Parser,
    /// Mean and standard deviation of the latents, [`Prior`](super::Prior).
    Prior,
    /// The flow that draws the sea, [`Flow`](super::Flow).
    Flow,
}

impl Part {
    /// All parts, in the order in which they are trained.
    pub const ALL: [Self; 4] = [Self::Patches, Self::Parser, Self::Prior, Self::Flow];

    /// Its name, such as `prior`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Parser => "parser",
            Self::Prior => "prior",
            Self::Flow => "flow",
        }
    }

    /// The file of its weights in the folder of a model, such as `prior.safetensors`.
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
