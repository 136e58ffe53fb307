//! Start, output and exit codes of the program.

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

/// Result of a subcommand.
pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Largest accepted number of threads, more than any machine has cores.
const MOST_THREADS: usize = 1024;
/// Longest message on standard error \[characters\].
const LONGEST: usize = 2000;

/// Runs a subcommand. Returns exit code 0, or prints one sentence on standard error and returns 2 for bad input
/// (arguments, files that they name, folders that cannot be written to) or 1 for any other failure (such as a full
/// disk).
pub(crate) fn code(work: impl FnOnce() -> Outcome<()>) -> ExitCode {
    match threads().map_err(Into::into).and_then(|()| work()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {error}"));
            ExitCode::from(if is_failure(error.as_ref()) { 1 } else { 2 })
        }
    }
}

/// Returns whether an error of a crate is a failure: it wraps one in one of these variants, or is of a kind that always
/// is.
macro_rules! is_failure_of {
    ($error:ident: $crate_error:ty, $($wraps:ident)|+ $(, always $kind:pat)?) => {
        if let Some(error) = $error.downcast_ref::<$crate_error>() {
            type E = $crate_error;
            return match error {
                $(E::$wraps(error) => is_failure(error),)+
                $($kind => true,)?
                _ => false,
            };
        }
    };
}

/// Whether an error has a cause other than the input.
fn is_failure(error: &(dyn Error + 'static)) -> bool {
    #[cfg(feature = "train")]
    is_failure_of!(error: wake_train::Error, Value | Model | Data | Detector | Scene, always E::Diverged { .. });
    #[cfg(feature = "dataset")]
    if let Some(wake_dataset::Error::Source(error)) = error.downcast_ref() {
        return is_failure(error.as_ref());
    }
    #[cfg(feature = "dataset")]
    is_failure_of!(error: wake_dataset::Error, Value | Scene, always E::Threads { .. });
    #[cfg(feature = "generate")]
    is_failure_of!(error: wake_ldm::Error, Model | Scene);
    #[cfg(feature = "detect")]
    is_failure_of!(error: wake_map::Error, Product | File);
    #[cfg(feature = "detect")]
    is_failure_of!(error: wake_detector::Error, Model);
    #[cfg(feature = "simulate")]
    is_failure_of!(error: wake_product::Error, Product | Scene | File);
    #[cfg(any(feature = "dataset", feature = "generate", feature = "detect"))]
    if let Some(error) = error.downcast_ref::<wake_nn::Error>() {
        use wake_nn::Error as E;
        return match error {
            E::Io { action, .. } => is_of_writing(action),
            E::NotFinite { .. } | E::WrongNumbers { .. } => true,
            _ => false,
        };
    }
    #[cfg(feature = "locate")]
    if let Some(error) = error.downcast_ref::<wake_geo::Error>() {
        return matches!(error, wake_geo::Error::Unwritable { .. });
    }
    #[cfg(feature = "simulate")]
    if let Some(wake_physics::Error::File { action, .. }) = error.downcast_ref() {
        return is_of_writing(action);
    }
    match error.downcast_ref::<whole_files::Error>() {
        Some(error) => is_of_writing(error.action),
        None => error.is::<io::Error>(),
    }
}

/// Whether a file failed while it was being written; a folder that cannot be written to counts as bad input.
fn is_of_writing(action: &str) -> bool {
    matches!(action, "write" | "encode")
}

/// Prints a result. A closed pipe, as with `head`, is not an error; a full disk is.
pub(crate) fn say(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let message = format!("cannot write to standard output: {error}");
            Err(io::Error::new(error.kind(), message))
        }
        _ => Ok(()),
    }
}

/// Prints a message on standard error, with control characters escaped; failures to print are ignored.
pub(crate) fn note(text: &str) {
    let harmless = text.chars().take(LONGEST).map(|c| match c {
        '\n' => "\n".to_owned(),
        c if c.is_control() => c.escape_unicode().to_string(),
        c => c.to_string(),
    });
    let harmless: String = harmless.collect();
    let _ = writeln!(io::stderr(), "{harmless}");
}

/// Rejects numbers of threads that no machine can start, because rayon would try.
fn threads() -> Result<(), String> {
    let name = "RAYON_NUM_THREADS";
    let Some(number) = std::env::var(name)
        .ok()
        .and_then(|n| n.trim().parse::<usize>().ok())
    else {
        return Ok(());
    };
    if number > MOST_THREADS {
        return Err(format!(
            "{name} is {number}, outside 0 to {MOST_THREADS}; 0 uses one per core"
        ));
    }
    Ok(())
}
