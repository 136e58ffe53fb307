//! The second part: the prompt parser, trained on wordings of simulated scenes.

use burn::tensor::Device;
use serde_json::json;

use super::super::run::Run;
use super::super::stage_options::StageOptions;
use super::super::tasks::ParserTask;
use super::{WakeTraining, keep};
use crate::error::Result;
use crate::prompts::Prompts;
use wake_dataset::{Recipe, Simulated};
use wake_ldm::conditioning::Vocabulary;
use wake_ldm::network::{Part, PromptParser};

/// Ranges of the scenes in training prompts, wider than the ranges of images.
const PROMPT_RANGES: [&str; 4] = [
    "draw.ship.speed = [1.0, 15.0]",
    "draw.sea.wind_speed = [1.0, 12.0]",
    "draw.sea.fetch = { log = [1e3, 1e6] }",
    "draw.radar.incidence = [10.0, 40.0]",
];

impl WakeTraining<'_> {
    /// Trains the parser; it needs no pairs.
    pub(super) fn train_parser(&mut self, options: &StageOptions) -> Result<()> {
        let recipe = Recipe::default().with_assignments(&PROMPT_RANGES)?;
        let identity = json!({"prompts": recipe});
        let prompts = Prompts::new(Simulated::new(recipe, options.seed)?);
        let vocabulary = Vocabulary::new(self.config.vocabulary.iter().copied());
        let config = &self.config;
        let init = |device: &Device| config.init_parser(device);
        let run = self.run_of(Part::Parser, options, identity, init)?;
        let task = ParserTask {
            prompts: &prompts,
            vocabulary: &vocabulary,
        };
        let file = self.out(Part::Parser.file());
        let show = |run: &Run<PromptParser>| keep(&run.averaged(), &file);
        let stage = Self::stage(Part::Parser, options);
        stage.train(&mut self.folder, run, &task, self.progress, show)
    }
}
