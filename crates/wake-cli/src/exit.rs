//! How every example begins, speaks and ends.

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

/// More threads than any machine has cores.
const MOST_THREADS: usize = 1024;
/// No sentence on standard error is longer.
const LONGEST: usize = 2000;

/// Does the work of an example: exit code 0; or one sentence on standard error and exit code 2 for what was asked wrongly
/// (arguments, files that they name, places that cannot be written to), 1 for what went wrong on the way (a full disk).
pub(crate) fn code<E: Into<Box<dyn Error>>>(work: impl FnOnce() -> Result<(), E>) -> ExitCode {
    let refused: Result<(), Box<dyn Error>> = match threads() {
        Ok(()) => work().map_err(Into::into),
        Err(error) => Err(error.into()),
    };
    match refused {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {error}"));
            ExitCode::from(if is_fault(error.as_ref()) { 1 } else { 2 })
        }
    }
}

/// Whether an error is none of the asker's.
fn is_fault(error: &(dyn Error + 'static)) -> bool {
    #[cfg(feature = "ldm")]
    if let Some(error) = error.downcast_ref::<wake_ldm::Error>() {
        use wake_ldm::Error as E;
        return match error {
            E::Scene(scene) => is_fault(scene),
            E::Io { action, .. } => is_of_writing(action),
            E::NotFinite { .. }
            | E::Threads { .. }
            | E::Diverged { .. }
            | E::WrongNumbers { .. } => true,
            _ => false,
        };
    }
    match error.downcast_ref::<wake_physics::Error>() {
        Some(wake_physics::Error::File { action, .. }) => is_of_writing(action),
        Some(_) => false,
        None => error.is::<io::Error>(),
    }
}

/// Whether a file failed while it was written; a folder that cannot be written to was named wrongly.
fn is_of_writing(action: &str) -> bool {
    matches!(action, "write" | "encode")
}

/// Prints a result. That its reader has left, as `head` does, is no error; that a disk is full is one.
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

/// Says something on standard error, without the control characters of foreign text; if nobody can hear it, nobody does.
pub(crate) fn note(text: &str) {
    let harmless = text.chars().take(LONGEST).map(|c| match c {
        '\n' => "\n".to_owned(),
        c if c.is_control() => c.escape_unicode().to_string(),
        c => c.to_string(),
    });
    let harmless: String = harmless.collect();
    let _ = writeln!(io::stderr(), "{harmless}");
}

/// Refuses numbers of threads that no machine can start: rayon would try.
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
            "{name} is {number}, outside 0 to {MOST_THREADS}; 0 takes one for each core"
        ));
    }
    Ok(())
}
