//! A trainer as a checkpoint, and back.

use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use serde_json::Value;

use super::checkpoint::{Checkpoint, Tensors};
use super::tensors::names;
use super::trainer::Trainer;
use crate::error::{Error, Result};

/// Groups of a checkpoint's tensors, in the order of [`Trainer::state`].
const GROUPS: [&str; 4] = ["weights", "average", "first", "second"];

impl<M: Module> Trainer<M> {
    /// Weights, their average and the optimizer's averages after the last step.
    ///
    /// - `state`: what a run must have in common with this one to go on from here
    pub fn checkpoint(&self, state: &Value) -> Checkpoint {
        let names = names(self.model());
        let mut tensors = Tensors::new();
        for (group, values) in GROUPS.iter().zip(self.state()) {
            for ((name, shape), value) in names.iter().zip(values) {
                let numbers = value.into_data().iter::<f32>().collect();
                tensors.insert(format!("{group}.{name}"), (shape.clone(), numbers));
            }
        }
        Checkpoint {
            step: self.steps(),
            state: state.clone(),
            tensors,
        }
    }

    /// Goes on where a checkpoint left off.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidOption`] for a checkpoint of another `state`, or without a tensor of the model.
    pub fn restore(&mut self, checkpoint: Checkpoint, state: &Value) -> Result<()> {
        if checkpoint.state != *state {
            return Err(Error::InvalidOption {
                option: "checkpoint".to_owned(),
                value: checkpoint.state.to_string(),
                expected: state.to_string(),
            });
        }
        let mut tensors = checkpoint.tensors;
        let devices = self.model().devices();
        let device = devices.into_iter().next().unwrap_or_default().inner();
        let names = names(self.model());
        let mut group = |group: &str| -> Result<Vec<Tensor<1>>> {
            let take = |(name, shape): &(String, Vec<usize>)| {
                let name = format!("{group}.{name}");
                let found = tensors.remove(&name).filter(|(found, _)| found == shape);
                let (_, numbers) = found.ok_or_else(|| Error::InvalidOption {
                    option: "checkpoint".to_owned(),
                    value: format!("without {name} {shape:?}"),
                    expected: "all tensors of the model".to_owned(),
                })?;
                let length = numbers.len();
                Ok(Tensor::from_data(
                    TensorData::new(numbers, [length]),
                    &device,
                ))
            };
            names.iter().map(take).collect()
        };
        let [a, b, c, d] = GROUPS;
        let state = [group(a)?, group(b)?, group(c)?, group(d)?];
        self.resume(state, checkpoint.step);
        Ok(())
    }
}
