//! Images of intensity from files.

use crate::exit::Outcome;
use image::{DynamicImage, ImageReader};
use safetensors::SafeTensors;
use safetensors::tensor::Dtype;
use std::io::Cursor;
use std::path::Path;
use wake_physics::Field;
use wake_physics::grey::GreyScale;

use super::arguments::GreyName;

/// The field of a simulation that has speckle.
const FIELD: &str = "speckled";

/// An image, and whether its brightness is σ⁰.
pub(crate) fn intensity(path: &Path, grey: GreyName) -> Outcome<(Field, bool)> {
    let bytes = whole_files::read_bytes(path)?;
    if path.extension().is_some_and(|e| e == "safetensors") {
        let field =
            tensor(&bytes).map_err(|why| format!("cannot read {}: {why}", path.display()))?;
        return Ok((field, true));
    }
    let reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format()?;
    let image = reader
        .decode()
        .map_err(|why| format!("cannot read {}: {why}", path.display()))?;
    Ok((of_grey(&image, grey), false))
}

fn tensor(bytes: &[u8]) -> Result<Field, String> {
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let tensor = tensors
        .tensor(FIELD)
        .map_err(|_| format!("it has no field {FIELD}"))?;
    let [rows, columns] = tensor.shape() else {
        return Err(format!("its field {FIELD} has not two axes"));
    };
    if tensor.dtype() != Dtype::F32 {
        return Err(format!("its field {FIELD} is not of 32-bit numbers"));
    }
    let values = tensor.data().as_chunks::<4>().0.iter();
    Ok(Field {
        rows: *rows,
        columns: *columns,
        values: values.map(|bytes| f32::from_le_bytes(*bytes)).collect(),
    })
}

/// σ⁰, but for a factor: of decibels on the scale of `wake simulate`, of amplitudes the square.
fn of_grey(image: &DynamicImage, grey: GreyName) -> Field {
    let levels = image.to_luma16();
    let scale = GreyScale::default();
    let intensity = |level: u16| {
        let grey_level = f64::from(level) / f64::from(u16::MAX);
        match grey {
            GreyName::Decibel => scale.sigma0(grey_level),
            GreyName::Amplitude => grey_level * grey_level,
        }
    };
    Field {
        rows: levels.height() as usize,
        columns: levels.width() as usize,
        values: levels.pixels().map(|p| intensity(p.0[0]) as f32).collect(),
    }
}
