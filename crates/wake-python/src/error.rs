//! Errors of the libraries as Python exceptions, one class per kind, with the texts of the libraries.

use pyo3::PyErr;
use std::any::Any;

/// The exceptions, as `shipwake/errors.py` defines them.
pub(crate) mod exceptions {
    pyo3::import_exception!(shipwake.errors, SceneError);
    pyo3::import_exception!(shipwake.errors, UnknownKeyError);
    pyo3::import_exception!(shipwake.errors, PromptError);
    pyo3::import_exception!(shipwake.errors, RecipeError);
    pyo3::import_exception!(shipwake.errors, OptionError);
    pyo3::import_exception!(shipwake.errors, ArrayError);
    pyo3::import_exception!(shipwake.errors, DatasetError);
    pyo3::import_exception!(shipwake.errors, WeightsError);
    pyo3::import_exception!(shipwake.errors, ProductError);
    pyo3::import_exception!(shipwake.errors, FileError);
    pyo3::import_exception!(shipwake.errors, TooLargeError);
    pyo3::import_exception!(shipwake.errors, ModelError);
    pyo3::import_exception!(shipwake.errors, InternalError);
}

#[cfg(feature = "models")]
use exceptions::ModelError;
use exceptions::{
    ArrayError, DatasetError, FileError, InternalError, OptionError, ProductError, PromptError,
    RecipeError, SceneError, TooLargeError, UnknownKeyError, WeightsError,
};

/// A Python exception, which can be made without the interpreter's lock.
#[derive(Debug)]
pub(crate) struct Fault(pub(crate) PyErr);

/// Result of fallible work.
pub(crate) type Outcome<T> = Result<T, Fault>;

impl Fault {
    /// An array argument of the wrong shape or kind of numbers.
    pub(crate) fn array(text: String) -> Self {
        Self(ArrayError::new_err(text))
    }

    /// An argument out of its range.
    pub(crate) fn option(text: String) -> Self {
        Self(OptionError::new_err(text))
    }

    /// A result that would not fit in memory.
    pub(crate) fn too_large(text: String) -> Self {
        Self(TooLargeError::new_err(text))
    }

    /// A panic of a library, which is a defect.
    pub(crate) fn of_panic(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        Self(InternalError::new_err(format!(
            "internal error of shipwake, please report it: {}",
            text.unwrap_or("no message")
        )))
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        fault.0
    }
}

impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl From<wake_physics::Error> for Fault {
    fn from(error: wake_physics::Error) -> Self {
        use wake_physics::Error as E;
        let text = error.to_string();
        Self(match error {
            E::File { .. } => FileError::new_err(text),
            E::TooLarge { .. } => TooLargeError::new_err(text),
            E::Assignment { message, .. } if message.contains("unknown field") => {
                UnknownKeyError::new_err(text)
            }
            _ => SceneError::new_err(text),
        })
    }
}

impl From<wake_text::Error> for Fault {
    fn from(error: wake_text::Error) -> Self {
        use wake_text::Error as E;
        let text = error.to_string();
        match error {
            E::Scene(error) => error.into(),
            E::File { .. } | E::Write { .. } | E::NoVocabulary { .. } => {
                Self(FileError::new_err(text))
            }
            _ => Self(PromptError::new_err(text)),
        }
    }
}

impl From<wake_nn::Error> for Fault {
    fn from(error: wake_nn::Error) -> Self {
        use wake_nn::Error as E;
        let text = error.to_string();
        Self(match error {
            E::Unsupported { .. } | E::OutOfRange { .. } | E::InvalidOption { .. } => {
                OptionError::new_err(text)
            }
            E::Io { .. } | E::MissingFile { .. } => FileError::new_err(text),
            #[cfg(feature = "models")]
            E::UnsupportedPrecision { .. }
            | E::UnknownDevice { .. }
            | E::NoDevice { .. }
            | E::NotFinite { .. }
            | E::WrongNumbers { .. } => ModelError::new_err(text),
            _ => WeightsError::new_err(text),
        })
    }
}

impl From<wake_dataset::Error> for Fault {
    fn from(error: wake_dataset::Error) -> Self {
        use wake_dataset::Error as E;
        let text = error.to_string();
        match error {
            E::Scene(error) => error.into(),
            E::Text(error) => error.into(),
            E::Value(error) => error.into(),
            E::Recipe { .. } => Self(RecipeError::new_err(text)),
            E::Threads { .. } => Self(OptionError::new_err(text)),
            _ => Self(DatasetError::new_err(text)),
        }
    }
}

impl From<wake_geo::Error> for Fault {
    fn from(error: wake_geo::Error) -> Self {
        use wake_geo::Error as E;
        let text = error.to_string();
        Self(match error {
            E::Io { .. } | E::Missing { .. } => FileError::new_err(text),
            E::OutOfRange { .. } | E::Window { .. } | E::Part { .. } => OptionError::new_err(text),
            _ => ProductError::new_err(text),
        })
    }
}

#[cfg(feature = "models")]
impl From<wake_ldm::Error> for Fault {
    fn from(error: wake_ldm::Error) -> Self {
        use wake_ldm::Error as E;
        let text = error.to_string();
        match error {
            E::Model(error) => error.into(),
            E::Text(error) => error.into(),
            E::Scene(error) => error.into(),
            _ => Self(PromptError::new_err(text)),
        }
    }
}

#[cfg(feature = "models")]
impl From<wake_detector::Error> for Fault {
    fn from(error: wake_detector::Error) -> Self {
        use wake_detector::Error as E;
        let text = error.to_string();
        match error {
            E::Model(error) => error.into(),
            E::WrongMaps { .. } | E::Calibration { .. } => Self(WeightsError::new_err(text)),
            E::WrongSize { .. } => Self(ArrayError::new_err(text)),
            E::Io { .. } | E::NoImages { .. } | E::Unreadable { .. } => {
                Self(FileError::new_err(text))
            }
            _ => Self(TooLargeError::new_err(text)),
        }
    }
}

#[cfg(feature = "models")]
impl From<wake_map::Error> for Fault {
    fn from(error: wake_map::Error) -> Self {
        let text = error.to_string();
        match error {
            wake_map::Error::Product(error) => error.into(),
            _ => Self(FileError::new_err(text)),
        }
    }
}
