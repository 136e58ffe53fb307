//! Options shared by all trainings.

use std::path::PathBuf;

use clap::{Arg, Args};
use wake_nn::burn::tensor::Device;
use wake_nn::device_named;
use wake_train::{Result, StageOptions};

/// Options for checkpoints, device and output.
#[derive(Args, Clone)]
pub(crate) struct Place {
    /// Steps between checkpoints and results
    #[arg(long, visible_alias = "checkpoint-every", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) every: u32,
    /// Number of checkpoints to keep
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) keep: u16,
    /// Seed of all random numbers, including simulated pairs
    #[arg(long, default_value_t = 7)]
    pub(crate) seed: u64,
    /// Continue from the newest checkpoint in --out
    #[arg(long)]
    pub(crate) resume: bool,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in; separate several with commas
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// Length and learning rate of a training.
#[derive(Args, Clone)]
pub(crate) struct Pace {
    /// Training steps
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) steps: u32,
    /// Examples per batch
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) batch: u16,
    /// Peak learning rate
    #[arg(long)]
    rate: f64,
}

/// Options that save memory.
#[derive(Args, Clone)]
pub(crate) struct Thrift {
    /// Gradient accumulation: number of parts of a batch that are computed one after another, to save memory
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    accumulation: u16,
    /// Gradient checkpointing: recompute burn's elementwise operations instead of storing them; saves no memory on the CPU
    #[arg(long)]
    checkpointing: bool,
    /// Compute losses and gradients in bfloat16 if the device supports it; weights stay in 32 bits
    #[arg(long)]
    bf16: bool,
}

/// Sets the defaults of a subcommand, given as pairs of option name and value.
pub(crate) fn defaults(
    values: &'static [(&'static str, &'static str)],
) -> impl FnMut(Arg) -> Arg + 'static {
    move |arg| {
        let found = values.iter().find(|(name, _)| arg.get_id() == *name);
        match found {
            Some((_, value)) => arg.required(false).default_value(value),
            None => arg,
        }
    }
}

impl Place {
    /// The devices, without autodiff.
    pub(crate) fn devices(&self) -> Result<Vec<Device>> {
        let devices = self.device.split(',').map(device_named);
        Ok(devices.collect::<wake_nn::Result<_>>()?)
    }

    /// Stage options with default pace.
    pub(crate) fn stage(&self, thrift: &Thrift) -> Result<StageOptions> {
        Ok(StageOptions {
            grad_accumulation_steps: usize::from(thrift.accumulation),
            checkpointing: thrift.checkpointing,
            bf16: thrift.bf16,
            every: self.every as usize,
            keep: usize::from(self.keep),
            seed: self.seed,
            resume: self.resume,
            devices: self.devices()?,
            ..StageOptions::default()
        })
    }

    /// Stage options with the given pace.
    pub(crate) fn paced(&self, pace: &Pace, thrift: &Thrift) -> Result<StageOptions> {
        Ok(StageOptions {
            steps: Some(pace.steps as usize),
            batch: Some(usize::from(pace.batch)),
            rate: Some(pace.rate),
            ..self.stage(thrift)?
        })
    }
}
