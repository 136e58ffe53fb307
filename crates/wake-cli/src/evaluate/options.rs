//! The command line, and what it names.

use super::{calibration, detector, domain, sea};
use crate::exit::Outcome;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use wake_nn::burn::tensor::Device;
use wake_train::metrics::{Lpips, LpipsNetwork};

/// Evaluate the models against the simulator.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) task: Option<Task>,
    /// Judge the simulator itself, with another random sea, in the place of a model: what a perfect model would get
    #[arg(long)]
    pub(crate) simulator_only: bool,
    /// Folder of a small model that `wake train` wrote; without it, the model in the crate
    #[arg(long, value_name = "DIR", conflicts_with = "simulator_only")]
    pub(crate) weights: Option<PathBuf>,
    /// Steps from noise to image; without it, the sampler's own number
    #[arg(long, conflicts_with = "simulator_only")]
    pub(crate) steps: Option<usize>,
    /// Folder of a model that `wake train text-to-image` wrote, to stand beside the model
    #[arg(long, value_name = "DIR")]
    pub(crate) text_to_image: Option<PathBuf>,
    /// Held-out scenes
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) count: u32,
    /// Weights of torchvision's alexnet as safetensors, for LPIPS; without them LPIPS is left out
    #[arg(long, value_name = "FILE", requires = "lpips_linear")]
    lpips_backbone: Option<PathBuf>,
    /// Linear weights of the package lpips as safetensors
    #[arg(long, value_name = "FILE", requires = "lpips_backbone")]
    lpips_linear: Option<PathBuf>,
    /// flex, ndarray, wgpu or cuda, where compiled in; a GPU's number may follow, as in cuda:1
    #[arg(long, default_value = "flex")]
    pub(crate) device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate")]
    pub(crate) out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Subcommand)]
pub(crate) enum Task {
    Domain(domain::Options),
    Sea(sea::Options),
    Detector(detector::Options),
    Calibration(calibration::Options),
}

impl Arguments {
    /// The networks of LPIPS, where they are named.
    pub(crate) fn lpips(&self, device: &Device) -> Outcome<Option<Lpips>> {
        let (Some(backbone), Some(linear)) = (&self.lpips_backbone, &self.lpips_linear) else {
            return Ok(None);
        };
        let lpips = Lpips::load(LpipsNetwork::Alex, backbone, linear, device)?;
        Ok(Some(lpips))
    }
}
