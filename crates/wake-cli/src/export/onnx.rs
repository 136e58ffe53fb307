//! `wake export onnx`: the detector's network as an ONNX file.

use std::path::PathBuf;

use safetensors::tensor::{Dtype, TensorView};
use wake_detector::network::{INPUTS, MULTIPLE, OUTPUTS, STRIDE};
use wake_detector::{Detector, normalize, onnx};
use wake_nn::burn::tensor::{Tensor, TensorData};
use wake_nn::noise::NoiseSource;

use crate::exit::{self, Outcome};
use crate::named;

/// Write the network of the detector as an ONNX file, which onnxruntime can run without this program.
#[derive(clap::Args)]
#[command(after_help = "Inputs, maps, and how wakes follow from them: docs/onnx.md")]
pub(crate) struct Arguments {
    /// Weights of the network [default: the shipped weights]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// ONNX file to write
    #[arg(long, value_name = "FILE", default_value = "out/detector.onnx")]
    out: PathBuf,
    /// Also write inputs and maps of ten images to this file (safetensors), to compare another program with this one
    #[arg(long, value_name = "FILE")]
    samples: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let detector = named::network(arguments.weights.as_deref(), "flex", 0.25)?;
    if let Some(folder) = arguments.out.parent() {
        whole_files::make_folder(folder)?;
    }
    let bytes = onnx(detector.network());
    whole_files::write_atomically(&arguments.out, &bytes)?;
    if let Some(path) = &arguments.samples {
        whole_files::write_atomically(path, &samples(&detector)?)?;
    }
    let mebibytes = bytes.len() as f64 / f64::from(1 << 20);
    Ok(exit::say(&format!(
        "{} ({mebibytes:.1} MiB)",
        arguments.out.display()
    ))?)
}

/// Ten images of speckle with a brighter line, of several sizes, as network inputs, and their maps.
fn samples(detector: &Detector) -> Outcome<Vec<u8>> {
    let mut tensors = Vec::new();
    for n in 0..10usize {
        let [rows, columns] = [MULTIPLE * (1 + n % 3), MULTIPLE * (1 + n % 4)];
        let inputs = inputs(n as u64, rows, columns);
        let data = TensorData::new(inputs.clone(), [1, INPUTS, rows, columns]);
        let images = Tensor::from_data(data, &wake_nn::burn::tensor::Device::default());
        let maps = detector.network().forward(images).into_data();
        let maps: Vec<f32> = maps.iter::<f32>().collect();
        let size = vec![1, OUTPUTS, rows / STRIDE, columns / STRIDE];
        tensors.push((
            format!("inputs.{n}"),
            vec![1, INPUTS, rows, columns],
            bytes(&inputs),
        ));
        tensors.push((format!("maps.{n}"), size, bytes(&maps)));
    }
    let views: Result<Vec<_>, _> = tensors
        .iter()
        .map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.clone(), bytes).map(|view| (name.as_str(), view))
        })
        .collect();
    Ok(safetensors::serialize(views?, None)?)
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// An image of amplitudes as network inputs: `[INPUTS, rows, columns]`.
fn inputs(seed: u64, rows: usize, columns: usize) -> Vec<f32> {
    let mut pixels = NoiseSource::new(seed).normal(0, rows * columns);
    for (row, line) in pixels.chunks_exact_mut(columns).enumerate() {
        line[(row + seed as usize) % columns] += 2.0;
    }
    let contrast = normalize::contrast(&pixels, rows, columns);
    let each = contrast.into_iter().map(normalize::inputs);
    let each: Vec<[f32; INPUTS]> = each.collect();
    (0..INPUTS)
        .flat_map(|k| each.iter().map(move |inputs| inputs[k]))
        .collect()
}
