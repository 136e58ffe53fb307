//! Options shared by evaluations of images.

use crate::exit::Outcome;
use clap::Args;
use std::path::PathBuf;
use wake_nn::burn::tensor::Device;
use wake_train::metrics::{Lpips, LpipsNetwork, Perceptual};

/// Options shared by evaluations of images.
#[derive(Args)]
pub(crate) struct Common {
    /// Number of held-out scenes
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) count: u32,
    /// Weights of torchvision's alexnet (safetensors), for LPIPS [default: no LPIPS]
    #[arg(long, value_name = "FILE", requires = "lpips_linear")]
    lpips_backbone: Option<PathBuf>,
    /// Linear weights of the package lpips (safetensors)
    #[arg(long, value_name = "FILE", requires = "lpips_backbone")]
    lpips_linear: Option<PathBuf>,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in; a GPU's number may follow, as in cuda:1
    #[arg(long, default_value = "flex")]
    pub(crate) device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate")]
    pub(crate) out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

impl Common {
    /// Loads the networks of perceptual distances; LPIPS only if its weights are given.
    pub(crate) fn perceptual(&self, device: &Device) -> Outcome<Perceptual> {
        let lpips = match (&self.lpips_backbone, &self.lpips_linear) {
            (Some(backbone), Some(linear)) => {
                Some(Lpips::load(LpipsNetwork::Alex, backbone, linear, device)?)
            }
            _ => None,
        };
        Ok(Perceptual::new(lpips, device)?)
    }
}
