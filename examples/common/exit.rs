//! How every example ends.

use std::fmt::Display;
use std::process::ExitCode;

/// Exit code 0; or 2, and what was wrong as one sentence on standard error.
pub(crate) fn code<E: Display>(result: Result<(), E>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
