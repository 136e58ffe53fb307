//! Writing a model so that diffusers and transformers read it.

use std::io::Write;
use std::path::Path;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use half::{bf16, f16};
use serde_json::{Map, Value, json};

use super::Precision;
use super::names::{Layout, ModulePath};
use crate::error::Result;
use whole_files::{write_atomically, write_synced};

/// Writes a model's weights into one safetensors file that diffusers or transformers read.
///
/// Tensors are written one by one, so that the model is not held twice; the file takes its name when
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

/// [`save_as`] with an entry in the free text of the header, its key and its value.
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
        let mut tensors = TensorWriter {
            path: ModulePath::default(),
            precision,
            writer,
            result: Ok(()),
        };
        model.visit(&mut tensors);
        tensors.result
    })?)
}

/// Writes a model's `config.json` and weights into a folder that `from_pretrained` reads.
///
/// - `config`: what the `to_json` of the model's configuration gives
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

/// The header, in the order in which the parameters are visited, padded to a multiple of 8 bytes.
fn header<M: Module>(
    model: &M,
    layout: Layout,
    precision: Precision,
    note: Option<(&str, &str)>,
) -> String {
    let mut collector = HeaderCollector {
        path: ModulePath::default(),
        layout,
        precision,
        end: 0,
        tensors: Map::new(),
    };
    let mut metadata = Map::from_iter([("format".to_owned(), json!("pt"))]);
    metadata.extend(note.map(|(key, value)| (key.to_owned(), json!(value))));
    collector
        .tensors
        .insert("__metadata__".to_owned(), Value::Object(metadata));
    model.visit(&mut collector);
    let mut header = Value::Object(collector.tensors).to_string();
    while !header.len().is_multiple_of(8) {
        header.push(' ');
    }
    header
}

struct HeaderCollector {
    path: ModulePath,
    layout: Layout,
    precision: Precision,
    end: usize,
    tensors: Map<String, Value>,
}

impl ModuleVisitor for HeaderCollector {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let mut shape = param.lazy_shape().to_vec();
        if self.path.is_transposed(D) {
            shape.reverse();
        }
        let start = self.end;
        self.end += shape.iter().product::<usize>() * self.precision.dtype().size();
        let tensor = json!({
            "dtype": self.precision.name(), "shape": shape, "data_offsets": [start, self.end],
        });
        self.tensors
            .insert(self.path.file_name(self.layout), tensor);
    }
}

struct TensorWriter<'a, W: Write> {
    path: ModulePath,
    precision: Precision,
    writer: &'a mut W,
    result: std::io::Result<()>,
}

impl<W: Write> ModuleVisitor for TensorWriter<'_, W> {
    fn enter_module(&mut self, name: &str, container: &str) {
        self.path.enter(name, container);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.exit();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if self.result.is_err() {
            return;
        }
        let mut tensor = param.transform_for_save().val();
        if self.path.is_transposed(D) {
            tensor = tensor.swap_dims(0, 1);
        }
        self.result = self.write(tensor);
    }
}

impl<W: Write> TensorWriter<'_, W> {
    fn write<const D: usize>(&mut self, tensor: Tensor<D>) -> std::io::Result<()> {
        let data = tensor.try_into_data().map_err(std::io::Error::other)?;
        let numbers = data.iter::<f32>();
        match self.precision {
            Precision::F32 => write_each(self.writer, numbers.map(f32::to_le_bytes)),
            Precision::F16 => {
                write_each(self.writer, numbers.map(|x| f16::from_f32(x).to_le_bytes()))
            }
            Precision::BF16 => write_each(
                self.writer,
                numbers.map(|x| bf16::from_f32(x).to_le_bytes()),
            ),
        }
    }
}

fn write_each<const N: usize>(
    writer: &mut impl Write,
    mut numbers: impl Iterator<Item = [u8; N]>,
) -> std::io::Result<()> {
    numbers.try_for_each(|bytes| writer.write_all(&bytes))
}
