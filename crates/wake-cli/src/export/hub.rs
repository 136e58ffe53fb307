//! `wake export hub`: a model as a folder for upload to a hub.

use std::path::PathBuf;

use clap::ValueEnum;
use wake_detector::{Detector, onnx};
use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::Device;
use whole_files::write_atomically;

use crate::exit::{self, Outcome};

/// Write a model with its model card as a folder for upload to Hugging Face.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Model to export
    #[arg(value_enum)]
    model: Model,
    /// Folder for the files, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/hub")]
    out: PathBuf,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// Network of the detector, as safetensors and ONNX
    Detector,
    /// The wake model
    WakeModel,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let out = &arguments.out;
    whole_files::make_folder(out)?;
    let card = match arguments.model {
        Model::Detector => {
            let detector = Detector::pretrained(&Device::default())?;
            let weights = out.join("detector.safetensors");
            write_atomically(&weights, Detector::pretrained_weights())?;
            write_atomically(&out.join("detector.onnx"), &onnx(detector.network()))?;
            include_str!("detector.md")
        }
        Model::WakeModel => {
            for (name, content) in WakeSampler::pretrained_files() {
                write_atomically(&out.join(name), content)?;
            }
            include_str!("wake_model.md")
        }
    };
    let card = card.replace("VERSION", env!("CARGO_PKG_VERSION"));
    write_atomically(&out.join("README.md"), card.as_bytes())?;
    Ok(exit::say(&format!("{}", out.display()))?)
}
