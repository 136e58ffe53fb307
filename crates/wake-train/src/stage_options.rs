//! Options of a training stage.

use burn::tensor::{DType, Device};
use serde_json::Value;

use super::optimizer::LrSchedule;
use super::run::RunOptions;
use super::trainer::TrainerOptions;
use crate::error::{Error, Result};

/// Warm-up steps of the learning rate.
const WARMUP: usize = 100;

/// Defaults of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StageDefaults {
    /// Total number of steps.
    pub steps: usize,
    /// Examples in a batch.
    pub batch: usize,
    /// Peak learning rate.
    pub rate: f64,
}

/// Options of a stage of training.
#[derive(Debug, Clone)]
pub struct StageOptions {
    /// Total number of steps; `None`: the default of the stage.
    pub steps: Option<usize>,
    /// Examples in a batch; `None`: the default of the stage.
    pub batch: Option<usize>,
    /// Peak learning rate; `None`: the default of the stage.
    pub rate: Option<f64>,
    /// Parts of its batch that a device processes one after the other, to save memory.
    pub grad_accumulation_steps: usize,
    /// Steps between checkpoints, at least 1.
    pub every: usize,
    /// Number of checkpoints to keep, at least 1.
    pub keep: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether to resume from the newest checkpoint.
    pub resume: bool,
    /// Gradient checkpointing: recomputes burn's elementwise operations instead of storing their results. It does not affect the
    /// kernels of `wake-nn` on the CPU, and saves no memory there.
    pub checkpointing: bool,
    /// Whether losses and gradients are computed in bfloat16; weights keep 32 bits.
    pub bf16: bool,
    /// Devices, outside autodiff: at least one.
    pub devices: Vec<Device>,
}

impl Default for StageOptions {
    fn default() -> Self {
        Self {
            steps: None,
            batch: None,
            rate: None,
            grad_accumulation_steps: 1,
            every: 500,
            keep: 2,
            seed: 7,
            resume: false,
            checkpointing: false,
            bf16: false,
            devices: vec![Device::default()],
        }
    }
}

impl StageOptions {
    /// Total number of steps.
    pub(crate) fn steps(&self, usual: &StageDefaults) -> usize {
        self.steps.unwrap_or(usual.steps)
    }

    /// Constants of the stage's run.
    ///
    /// - `identity`: identity of the training data, see [`RunOptions::identity`]
    pub(crate) fn run(&self, usual: &StageDefaults, identity: Value) -> RunOptions {
        RunOptions {
            batch: self.batch.unwrap_or(usual.batch),
            seed: self.seed,
            identity,
            trainer: TrainerOptions {
                rate: LrSchedule {
                    peak: self.rate.unwrap_or(usual.rate),
                    warmup: WARMUP,
                    steps: self.steps(usual),
                },
                grad_accumulation_steps: self.grad_accumulation_steps,
                bf16: self.bf16,
                ..TrainerOptions::default()
            },
        }
    }

    /// Device for computations without gradients.
    #[must_use]
    pub fn device(&self) -> Device {
        self.devices.first().cloned().unwrap_or_default()
    }

    /// Autodiff devices for training.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::UnsupportedPrecision`] for a device without bfloat16 if that is requested.
    pub fn learning_devices(&self) -> Result<Vec<Device>> {
        let learning = |device: &Device| {
            if self.bf16 && !device.supports_dtype(DType::BF16) {
                return Err(Error::Value(wake_nn::Error::UnsupportedPrecision {
                    device: wake_nn::device_label(device),
                    precision: "bf16",
                }));
            }
            let device = device.clone().autodiff();
            Ok(match self.checkpointing {
                true => device.gradient_checkpointing(),
                false => device,
            })
        };
        self.devices.iter().map(learning).collect()
    }

    /// Options of an earlier stage that a later one needs, and that may have been stopped half-way.
    ///
    /// - `left`: steps that the stage was begun for, 0 if it never began
    /// - `state`: state of its last checkpoint, `Null` if there is none
    pub(super) fn before(&self, left: usize, state: &Value) -> Self {
        Self {
            steps: Some(left).filter(|&steps| steps > 0),
            batch: state["batch"].as_u64().map(|batch| batch as usize),
            rate: state["trainer"]["rate"].as_f64(),
            bf16: state["trainer"]["bf16"].as_bool().unwrap_or(self.bf16),
            seed: state["seed"].as_u64().unwrap_or(self.seed),
            resume: left > 0,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const DEFAULTS: StageDefaults = StageDefaults {
        steps: 40,
        batch: 8,
        rate: 1e-3,
    };

    /// Given options are used; the others take the defaults.
    #[test]
    fn what_is_left_open_is_usual() {
        let options = StageOptions {
            rate: Some(5e-4),
            ..StageOptions::default()
        };
        let run = options.run(&DEFAULTS, Value::Null);
        let rate = run.trainer.rate;
        assert!((rate.peak - 5e-4).abs() < 1e-15);
        assert_eq!((rate.steps, run.batch), (40, 8));
    }

    /// A stopped stage continues with the options it was begun with; one that never began takes its defaults.
    #[test]
    fn an_earlier_stage_goes_on_as_it_was_begun() {
        let later = StageOptions {
            steps: Some(9),
            batch: Some(2),
            rate: Some(1.0),
            ..StageOptions::default()
        };
        let state = json!({"batch": 4, "seed": 3, "trainer": {"rate": 0.25, "bf16": false}});
        let stopped = later.before(6, &state);
        assert_eq!((stopped.steps, stopped.batch), (Some(6), Some(4)));
        assert_eq!(
            (stopped.rate, stopped.seed, stopped.resume),
            (Some(0.25), 3, true)
        );
        let begun = later.before(0, &Value::Null);
        assert_eq!((begun.steps, begun.batch, begun.rate), (None, None, None));
        assert!(!begun.resume && begun.seed == later.seed);
    }
}
