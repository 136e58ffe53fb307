//! The reader learns from endless prompts.

use std::ops::Range;

use super::run::{Task, Terms, number};
use crate::conditioning::{QUANTITIES, Vocabulary, statement, tokens};
use crate::dataset::Prompts;
use crate::network::{PromptParser, windows};
use burn::tensor::{Device, Tensor, TensorData};

/// Reading what prompts state: squared error of each quantity, and of whether it is stated.
#[derive(Debug)]
pub struct WordsTask<'a> {
    /// The prompts.
    pub prompts: &'a Prompts,
    /// The ids that the reader knows.
    pub vocabulary: &'a Vocabulary,
}

impl Task<PromptParser> for WordsTask<'_> {
    fn loss(
        &self,
        model: &PromptParser,
        device: &Device,
        positions: Range<u64>,
    ) -> (Tensor<1>, Terms) {
        let drawn = positions.filter_map(|position| self.prompts.prompt(position).ok());
        let (prompts, said): (Vec<_>, Vec<_>) = drawn
            .map(|(text, conditions)| (tokens(&text), statement(&conditions)))
            .unzip();
        let (windows, length) = windows(&prompts, self.vocabulary, device);
        let count = prompts.len() * QUANTITIES;
        let said: Tensor<2> = Tensor::from_data(TensorData::new(said.concat(), [count, 3]), device);
        let read = model.forward(windows, length).reshape([count, 3]);
        let error = (read - said.clone()).square();
        let flags = said.narrow(1, 0, 1);
        let stated = error.clone().narrow(1, 0, 1).mean();
        let values = (error.narrow(1, 1, 2) * flags).mean();
        let terms = vec![("stated", number(&stated)), ("values", number(&values))];
        (stated + values, terms)
    }
}
