//! The error type of this crate.

use whole_files::quoted;

/// Result of the functions of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Failure to build, read, write or run a model.
///
/// Passing wrong shapes to a model is a programming error and panics; files, options and numbers that a user chose are
/// reported here.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Weights, options, numbers or a device that a network does not accept.
    #[error(transparent)]
    Model(#[from] wake_nn::Error),

    /// A vocabulary could not be read, or a prompt could not be parsed.
    #[error(transparent)]
    Text(#[from] wake_text::Error),

    /// A scene is not valid, or could not be simulated.
    #[cfg(feature = "wake-model")]
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),

    /// A prompt states nothing about a scene.
    #[error(
        "the prompt '{}' states nothing about a scene; say, for example, whether there is a ship, its speed and heading, the \
         wind, or the incidence",
        quoted(prompt)
    )]
    NothingStated { prompt: String },
}

impl From<whole_files::Error> for Error {
    fn from(error: whole_files::Error) -> Self {
        Self::Model(error.into())
    }
}

#[cfg(feature = "dataset")]
impl From<Error> for wake_dataset::Error {
    fn from(error: Error) -> Self {
        match error {
            Error::Model(error) => Self::Value(error),
            Error::Text(error) => Self::Text(error),
            Error::Scene(error) => Self::Scene(error),
            other => Self::Source(Box::new(other)),
        }
    }
}
