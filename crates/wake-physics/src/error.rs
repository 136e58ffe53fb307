//! Errors of this crate.

use std::path::PathBuf;

/// Error of reading or simulating a scene.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter lies outside its closed range.
    #[error("{name} is {value}, outside {min} to {max}{}", after_space(unit))]
    OutOfRange {
        name: String,
        value: f64,
        min: f64,
        max: f64,
        unit: &'static str,
    },
    /// A parameter is not a finite number.
    #[error("{name} is {value}, but must be a finite number of {unit}")]
    NotFinite {
        name: String,
        value: f64,
        unit: &'static str,
    },
    /// Two parameters contradict each other.
    #[error("{name} is {value}, {requirement}")]
    Conflict {
        name: String,
        value: String,
        requirement: String,
    },
    /// The text is not a valid scene file.
    #[error("cannot read the scene: {message}")]
    Parse { message: String },
    /// An assignment `key=value` does not name a parameter or has no value.
    #[error(
        "cannot set '{assignment}': {message}; write KEY=VALUE with a key of the scene file, such as ship.speed=10"
    )]
    Assignment { assignment: String, message: String },
    /// A file could not be read or written.
    #[error("cannot {action} {}: {message}", path.display())]
    File {
        action: &'static str,
        path: PathBuf,
        message: String,
    },
    /// The fields would not fit in memory.
    #[error(
        "a grid of {rows} x {columns} pixels with a margin of {} x {} for displaced echoes needs about {needed_gib:.1} GiB, but {available_gib:.1} GiB are free; {advice}", margin[0], margin[1]
    )]
    TooLarge {
        rows: usize,
        columns: usize,
        margin: [usize; 2],
        needed_gib: f64,
        available_gib: f64,
        /// Advice on what to change, beginning with a verb.
        advice: &'static str,
    },
}

impl From<whole_files::Error> for Error {
    fn from(error: whole_files::Error) -> Self {
        Self::File {
            action: error.action,
            path: error.path,
            message: error.source.to_string(),
        }
    }
}

/// A unit after a space; nothing for a number without a unit.
fn after_space(unit: &str) -> String {
    match unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    }
}

/// Result of this crate's fallible functions.
pub type Result<T> = std::result::Result<T, Error>;

/// Checks that `value` lies in the closed range `[min, max]`; NaN is rejected.
///
/// # Errors
///
/// [`Error::OutOfRange`] with the name, the value and the range if it does not.
pub(crate) fn in_range(
    name: &str,
    value: f64,
    min: f64,
    max: f64,
    unit: &'static str,
) -> Result<()> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(Error::OutOfRange {
        name: name.to_owned(),
        value,
        min,
        max,
        unit,
    })
}

/// Checks that `value` is finite.
///
/// # Errors
///
/// [`Error::NotFinite`] with the name and the value if it is not.
pub(crate) fn finite(name: &str, value: f64, unit: &'static str) -> Result<()> {
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::NotFinite {
        name: name.to_owned(),
        value,
        unit,
    })
}
