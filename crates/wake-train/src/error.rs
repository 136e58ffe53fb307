//! The crate's error type.

use std::path::PathBuf;

/// Result of the functions of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A training or an evaluation that could not be started, continued or finished.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option, file or device is invalid.
    #[error(transparent)]
    Value(#[from] wake_nn::Error),

    /// A model could not be built, read or run.
    #[error(transparent)]
    Model(wake_ldm::Error),

    /// A data set could not be made or read.
    #[error(transparent)]
    Data(wake_dataset::Error),

    /// A detector could not be read or run.
    #[error(transparent)]
    Detector(#[from] wake_detector::Error),

    /// A scene is not valid, or could not be simulated.
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),

    /// A prompt could not be read or written.
    #[error(transparent)]
    Text(#[from] wake_text::Error),

    /// A `labels.json` does not have the expected form.
    #[error("{}: {message}", path.display())]
    Labels { path: PathBuf, message: String },

    /// Training diverged.
    #[error("training diverged at step {step} ({what}); lower the learning rate or check the data")]
    Diverged { step: usize, what: String },
}

impl From<whole_files::Error> for Error {
    fn from(error: whole_files::Error) -> Self {
        Self::Value(error.into())
    }
}

impl From<wake_ldm::Error> for Error {
    fn from(error: wake_ldm::Error) -> Self {
        match error {
            wake_ldm::Error::Model(error) => Self::Value(error),
            wake_ldm::Error::Text(error) => Self::Text(error),
            wake_ldm::Error::Scene(error) => Self::Scene(error),
            other => Self::Model(other),
        }
    }
}

impl From<wake_dataset::Error> for Error {
    fn from(error: wake_dataset::Error) -> Self {
        match error {
            wake_dataset::Error::Value(error) => Self::Value(error),
            wake_dataset::Error::Text(error) => Self::Text(error),
            wake_dataset::Error::Scene(error) => Self::Scene(error),
            other => Self::Data(other),
        }
    }
}
