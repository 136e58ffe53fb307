//! What a stage is told on the command line.

use std::error::Error;
use std::path::PathBuf;

use burn::tensor::{DType, Device};
use clap::Args;
use serde_json::Value;
use wake_ldm::dataset::Recipe;
use wake_ldm::device_named;
use wake_ldm::train::{Rate, RunOptions, TrainerOptions};

#[derive(Args, Clone)]
pub(crate) struct Options {
    /// Folder that `make_dataset` wrote; without it, pairs are simulated first
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// paper, ranges, detector or model, or a recipe file: the pairs to simulate where there is no --data
    #[arg(long, default_value = "model", conflicts_with = "data")]
    pub(crate) recipe: String,
    /// Pairs to simulate where there is no --data
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(8..=10_000_000))]
    pub(crate) count: u64,
    /// JSON file with the widths of the model [default: those of the model that ships]
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Go on from the newest checkpoint in --out
    #[arg(long)]
    pub(crate) resume: bool,
    /// Steps of the whole stage [default: words 4000, mean 6000, diffusion 6000]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: Option<u32>,
    /// Examples of a batch [default: words 128, mean 32, diffusion 8]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) batch: Option<u16>,
    /// Parts of a batch that are computed one after the other, to save memory
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) accumulation: u16,
    /// Largest step of the optimizer [default: words 1e-3, mean 2e-3, diffusion 1e-3]
    #[arg(long)]
    pub(crate) rate: Option<f64>,
    /// Steps between checkpoints and sheets
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) every: u32,
    /// Seed of the run, and of simulated pairs
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Keep less for the way back through the model, and compute it again; slower
    #[arg(long)]
    pub(crate) checkpointing: bool,
    /// Compute losses and gradients in bfloat16, where the device can; weights keep 32 bits
    #[arg(long)]
    pub(crate) bf16: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in; a comma between several
    #[arg(long, default_value = "flex")]
    pub(crate) device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/train")]
    pub(crate) out: PathBuf,
}

impl Options {
    /// The same for a stage that runs because a later one needs it, and that may have been stopped half-way.
    ///
    /// - `left`: the steps that it was begun for, 0 if it never was
    /// - `state`: of its last checkpoint, if there is one
    pub(crate) fn before(&self, left: usize, state: &Value) -> Self {
        let batch = state["batch"].as_u64().and_then(|n| u16::try_from(n).ok());
        Self {
            steps: u32::try_from(left).ok().filter(|&steps| steps > 0),
            batch,
            rate: state["trainer"]["rate"].as_f64(),
            bf16: state["trainer"]["bf16"].as_bool().unwrap_or(self.bf16),
            seed: state["seed"].as_u64().unwrap_or(self.seed),
            resume: left > 0,
            ..self.clone()
        }
    }

    /// Steps of a stage.
    pub(crate) fn steps(&self, default: u32) -> usize {
        self.steps.unwrap_or(default) as usize
    }

    /// Constants of a run.
    ///
    /// - `usual`: batch and rate of its stage
    /// - `identity`: what it learns from
    pub(crate) fn run(&self, steps: usize, usual: (u16, f64), identity: Value) -> RunOptions {
        RunOptions {
            batch: usize::from(self.batch.unwrap_or(usual.0)),
            seed: self.seed,
            identity,
            trainer: TrainerOptions {
                rate: Rate {
                    peak: self.rate.unwrap_or(usual.1),
                    warmup: 100,
                    steps,
                },
                accumulation: usize::from(self.accumulation),
                bf16: self.bf16,
                ..TrainerOptions::default()
            },
        }
    }

    /// The recipe of simulated pairs.
    pub(crate) fn recipe(&self) -> wake_ldm::Result<Recipe> {
        Recipe::named_or_read(&self.recipe)
    }

    /// The devices, outside autodiff.
    pub(crate) fn devices(&self) -> wake_ldm::Result<Vec<Device>> {
        self.device.split(',').map(device_named).collect()
    }

    /// The devices that a model learns on.
    pub(crate) fn learning_devices(&self) -> Result<Vec<Device>, Box<dyn Error>> {
        let devices = self.devices()?.into_iter();
        devices
            .map(|device| learning(device, self.checkpointing, self.bf16))
            .collect()
    }
}

/// A device that a model learns on.
pub(crate) fn learning(
    device: Device,
    checkpointing: bool,
    bf16: bool,
) -> Result<Device, Box<dyn Error>> {
    if bf16 && !device.supports_dtype(DType::BF16) {
        return Err(
            "--bf16: this device does not compute in bfloat16; leave the option out".into(),
        );
    }
    let device = device.autodiff();
    Ok(match checkpointing {
        true => device.gradient_checkpointing(),
        false => device,
    })
}
