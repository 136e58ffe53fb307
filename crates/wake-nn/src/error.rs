//! The error type of this crate.

use std::path::PathBuf;
use whole_files::{quoted, sentence};

/// Result of the functions of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Failure to build, read, write or run a model.
///
/// Passing wrong shapes to a model is a programming error and panics; files, options and numbers
/// that a user chose are reported here.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option that would change the numbers and is not implemented in this crate.
    #[error(
        "{} = {} is not supported; supported: {supported}",
        quoted(option),
        quoted(value)
    )]
    Unsupported {
        option: String,
        value: String,
        supported: String,
    },

    /// A number outside its valid closed range.
    #[error("{name} is {}, {}", number(*value), expectation(*min, *max))]
    OutOfRange {
        name: String,
        value: f64,
        min: f64,
        max: f64,
    },

    /// An option of the wrong type, or one that conflicts with another.
    #[error("{} is {}, expected {expected}", quoted(option), sentence(value))]
    InvalidOption {
        option: String,
        value: String,
        expected: String,
    },

    /// A file or folder could not be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },

    /// A folder holds none of the expected files.
    #[error("{} has none of the expected files: {}", folder.display(), expected.join(", "))]
    MissingFile {
        folder: PathBuf,
        expected: Vec<String>,
    },

    /// A file is not valid JSON.
    #[error("{} is not valid JSON: {}", path.display(), sentence(&source.to_string()))]
    Json {
        path: PathBuf,
        source: serde_json::Error,
    },

    /// A weight file breaks the safetensors format, so nothing in it is used.
    #[error("{} is not a valid safetensors file: {}", path.display(), sentence(&reason.to_string()))]
    InvalidSafetensors {
        path: PathBuf,
        #[source]
        reason: Box<dyn std::error::Error + Send + Sync>,
    },

    /// A weight is not finite.
    #[error("{} is damaged: tensor {} holds {value}; all weights must be finite", path.display(), quoted(tensor))]
    InvalidWeight {
        path: PathBuf,
        tensor: String,
        value: f64,
    },

    /// The tensors of a file do not match the tensors of the model; nothing was loaded.
    #[error("{} does not fit the model: {mismatch}", path.display())]
    WeightsMismatch {
        path: PathBuf,
        mismatch: Box<Mismatch>,
    },

    /// The device does not support this floating-point type.
    #[error("device {device} cannot compute in {}; use f32", precision.to_lowercase())]
    UnsupportedPrecision {
        device: String,
        precision: &'static str,
    },

    /// No backend of this build has a device with this name.
    #[error(
        "device '{}' is not in this build, which has {}; the features flex, ndarray, wgpu and cuda add devices, and a \
         GPU's number follows a colon, as in cuda:1",
        quoted(name),
        compiled.join(", ")
    )]
    UnknownDevice {
        name: String,
        compiled: Vec<&'static str>,
    },

    /// The backend is compiled in, but this machine lacks the device.
    #[error(
        "device '{}' is not available: its backend finds {}; install the driver, name another GPU, or use flex",
        quoted(name),
        gpus(*found)
    )]
    NoDevice {
        name: String,
        /// Number of devices that the backend finds.
        found: usize,
    },

    /// A model produced numbers that are infinite or NaN.
    #[error(
        "numbers in {what} are NaN or infinite: the weights are damaged or do not fit the model; load other weights"
    )]
    NotFinite { what: String },

    /// The results of a device differ from the results of the reference backend.
    #[error(
        "device {device} computes wrong numbers: {stage} differs by {difference:e} of its largest \
         value, allowed {allowed:e}; use another device or driver"
    )]
    WrongNumbers {
        device: String,
        stage: &'static str,
        difference: f64,
        allowed: f64,
    },
}

impl From<whole_files::Error> for Error {
    fn from(error: whole_files::Error) -> Self {
        Self::Io {
            action: error.action,
            path: error.path,
            source: error.source,
        }
    }
}

/// Tensors of a weight file that do not fit a model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mismatch {
    /// Tensors that the model has and the file lacks.
    pub missing: Vec<String>,
    /// Tensors that the file has and the model does not.
    pub unexpected: Vec<String>,
    /// Tensors that both have, with different shapes or with a number type that is not one of weights.
    pub misshapen: Vec<Misshapen>,
}

/// One tensor whose shape or element type in the file is not the model's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misshapen {
    /// Name of the tensor in the file.
    pub name: String,
    /// Tensor that the model needs, for example `float [320, 4, 3, 3]`.
    pub expected: String,
    /// Tensor in the file, for example `I64 [1, 77]`.
    pub found: String,
}

impl Mismatch {
    /// Whether the file and the model agree.
    pub fn is_empty(&self) -> bool {
        self.missing.is_empty() && self.unexpected.is_empty() && self.misshapen.is_empty()
    }
}

/// Largest number of names of each kind in a message; the fields hold all of them.
const SHOWN: usize = 6;

impl std::fmt::Display for Mismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let misshapen: Vec<String> = self.misshapen.iter().map(ToString::to_string).collect();
        let parts: Vec<String> = [
            ("missing", &self.missing),
            ("unexpected", &self.unexpected),
            ("misshapen", &misshapen),
        ]
        .into_iter()
        .filter(|(_, names)| !names.is_empty())
        .map(|(kind, names)| format!("{} {kind} ({})", names.len(), shorten(names)))
        .collect();
        write!(f, "{}", parts.join("; "))
    }
}

impl std::fmt::Display for Misshapen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: expected {}, found {}",
            quoted(&self.name),
            self.expected,
            quoted(&self.found)
        )
    }
}

/// Closed range, as the end of a message.
fn expectation(min: f64, max: f64) -> String {
    if max > min {
        return format!("outside [{}, {}]", number(min), number(max));
    }
    match max < min {
        true => format!("expected at least {}", number(min)),
        false => format!("expected {}", number(min)),
    }
}

/// A number in a message, with an exponent instead of many zeros.
fn number(value: f64) -> String {
    match value == 0.0 || !value.is_finite() || (1e-6..1e16).contains(&value.abs()) {
        true => value.to_string(),
        false => format!("{value:e}"),
    }
}

fn gpus(count: usize) -> String {
    match count {
        0 => "no GPU".to_owned(),
        1 => "1 GPU".to_owned(),
        count => format!("{count} GPUs"),
    }
}

fn shorten(names: &[String]) -> String {
    let shown: Vec<String> = names
        .iter()
        .take(SHOWN)
        .map(|name| sentence(name))
        .collect();
    let mut text = shown.join(", ");
    if names.len() > SHOWN {
        text.push_str(&format!(" and {} more", names.len() - SHOWN));
    }
    text
}

/// Checks that a number lies in a closed range.
///
/// # Errors
///
/// [`Error::OutOfRange`] when it does not, or is not a number.
pub fn check_range(name: &str, value: f64, min: f64, max: f64) -> Result<()> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(Error::OutOfRange {
        name: name.to_owned(),
        value,
        min,
        max,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text from files reaches a terminal in short lines without control characters.
    #[test]
    fn foreign_text_is_escaped_and_cut() {
        let foreign = format!("\u{1b}[31m\0\u{7}\n{}", "x".repeat(100_000));
        let path = || PathBuf::from("weights.safetensors");
        let json = format!("[\"{}\"]", "y\\u001b".repeat(10_000));
        let mismatch = Mismatch {
            missing: vec![foreign.clone()],
            unexpected: vec![foreign.clone(); 3],
            misshapen: vec![Misshapen {
                name: foreign.clone(),
                expected: "float [1]".to_owned(),
                found: foreign.clone(),
            }],
        };
        let errors = [
            Error::Unsupported {
                option: foreign.clone(),
                value: foreign.clone(),
                supported: "none".to_owned(),
            },
            Error::InvalidOption {
                option: foreign.clone(),
                value: foreign.clone(),
                expected: "a number".to_owned(),
            },
            Error::Json {
                path: path(),
                source: serde_json::from_str::<Vec<u8>>(&json).unwrap_err(),
            },
            Error::InvalidSafetensors {
                path: path(),
                reason: foreign.clone().into(),
            },
            Error::InvalidWeight {
                path: path(),
                tensor: foreign.clone(),
                value: f64::NAN,
            },
            Error::WeightsMismatch {
                path: path(),
                mismatch: Box::new(mismatch),
            },
            Error::UnknownDevice {
                name: foreign.clone(),
                compiled: vec!["flex"],
            },
            Error::NoDevice {
                name: foreign,
                found: 0,
            },
        ];
        for error in errors {
            let text = error.to_string();
            assert!(!text.chars().any(char::is_control), "{text}");
            assert!(text.len() < 5000, "{}: {}", text.len(), &text[..200]);
        }
    }

    #[test]
    fn a_mismatch_names_its_tensors_and_counts_the_rest() {
        let mismatch = Mismatch {
            missing: (0..9).map(|i| format!("a.{i}")).collect(),
            unexpected: vec!["b".to_owned()],
            misshapen: vec![],
        };
        let text = mismatch.to_string();
        assert_eq!(
            text,
            "9 missing (a.0, a.1, a.2, a.3, a.4, a.5 and 3 more); 1 unexpected (b)"
        );
        assert!(!mismatch.is_empty());
        assert!(Mismatch::default().is_empty());
    }

    #[test]
    fn ranges_are_closed_and_refuse_nan() {
        assert!(check_range("x", 1.0, 1.0, 2.0).is_ok());
        assert!(check_range("x", 2.0, 1.0, 2.0).is_ok());
        let refused = check_range("x", f64::NAN, 1.0, 2.0);
        assert!(matches!(refused, Err(Error::OutOfRange { .. })));
        let text = check_range("steps", 0.0, 1.0, 1000.0).map_err(|e| e.to_string());
        assert_eq!(text, Err("steps is 0, outside [1, 1000]".to_owned()));
        let text = check_range("rows", 128.0, 256.0, 256.0).map_err(|e| e.to_string());
        assert_eq!(text, Err("rows is 128, expected 256".to_owned()));
        let text = check_range("sigma", 0.0, 1e-300, 1e300).map_err(|e| e.to_string());
        assert_eq!(text, Err("sigma is 0, outside [1e-300, 1e300]".to_owned()));
    }
}
