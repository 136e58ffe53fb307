//! Writing a model so that diffusers and transformers read it.

use std::io::Write;
use std::path::Path;

use burn::module::Module;
use burn::tensor::TensorData;
use half::{bf16, f16};
use serde_json::{Map, Value, json};

use super::Precision;
use super::names::Layout;
use super::visit::{Weight, visit};
use crate::error::Result;
use whole_files::{write_atomically, write_synced};

/// Writes a model's weights into one safetensors file that diffusers or transformers read.
///
/// Tensors are written one by one, so the model is never in memory twice; the file gets its name once
/// all of it is on disk.
///
/// # Errors
///
/// [`Error::Io`](crate::Error::Io) when the file cannot be written.
pub fn save_as<M: Module>(
    model: &M,
    layout: Layout,
    path: &Path,
    precision: Precision,
) -> Result<()> {
    save_noted(model, layout, path, precision, None)
}

/// Writes weights as [`save_as`] does, with one entry, key and value, in the free text of the header.
///
/// # Errors
///
/// As [`save_as`].
pub fn save_noted<M: Module>(
    model: &M,
    layout: Layout,
    path: &Path,
    precision: Precision,
    note: Option<(&str, &str)>,
) -> Result<()> {
    let header = header(model, layout, precision, note);
    Ok(write_synced(path, |writer| {
        writer.write_all(&(header.len() as u64).to_le_bytes())?;
        writer.write_all(header.as_bytes())?;
        let mut written = Ok(());
        visit(model, layout, |_, values| {
            if written.is_ok() {
                written = values().and_then(|values| write(&values, precision, writer));
            }
        });
        written
    })?)
}

/// Writes a model's `config.json` and weights into a folder that `from_pretrained` reads.
///
/// - `config`: JSON from `to_json` of the model's configuration
///
/// # Errors
///
/// [`Error::Io`](crate::Error::Io) when a file cannot be written.
pub fn save_folder<M: Module>(
    model: &M,
    layout: Layout,
    config: &Value,
    folder: &Path,
    precision: Precision,
) -> Result<()> {
    let name = match layout {
        Layout::Diffusers => "diffusion_pytorch_model.safetensors",
        Layout::ClipText => "model.safetensors",
    };
    save_as(model, layout, &folder.join(name), precision)?;
    let config = format!("{config:#}\n");
    Ok(write_atomically(
        &folder.join("config.json"),
        config.as_bytes(),
    )?)
}

/// Header with the parameters in the order of the visit, padded to a multiple of 8 bytes.
fn header<M: Module>(
    model: &M,
    layout: Layout,
    precision: Precision,
    note: Option<(&str, &str)>,
) -> String {
    let mut metadata = Map::from_iter([("format".to_owned(), json!("pt"))]);
    metadata.extend(note.map(|(key, value)| (key.to_owned(), json!(value))));
    let mut tensors = Map::from_iter([("__metadata__".to_owned(), Value::Object(metadata))]);
    let mut end = 0;
    visit(model, layout, |Weight { name, shape, .. }, _| {
        let start = end;
        end += shape.iter().product::<usize>() * precision.dtype().size();
        let tensor = json!({
            "dtype": precision.name(), "shape": shape, "data_offsets": [start, end],
        });
        tensors.insert(name, tensor);
    });
    let mut header = Value::Object(tensors).to_string();
    while !header.len().is_multiple_of(8) {
        header.push(' ');
    }
    header
}

fn write(
    values: &TensorData,
    precision: Precision,
    writer: &mut impl Write,
) -> std::io::Result<()> {
    values.iter::<f32>().try_for_each(|x| match precision {
        Precision::F32 => writer.write_all(&x.to_le_bytes()),
        Precision::F16 => writer.write_all(&f16::from_f32(x).to_le_bytes()),
        Precision::BF16 => writer.write_all(&bf16::from_f32(x).to_le_bytes()),
    })
}
