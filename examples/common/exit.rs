//! How every example begins, speaks and ends.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;

/// More threads than any machine has cores.
const MOST_THREADS: usize = 1024;
/// No sentence on standard error is longer.
const LONGEST: usize = 2000;

/// Does the work of an example: exit code 0; or 2, and what was wrong as one sentence on standard error.
pub(crate) fn code<E: Display>(work: impl FnOnce() -> Result<(), E>) -> ExitCode {
    let refused = match threads() {
        Ok(()) => work().map_err(|error| error.to_string()),
        Err(error) => Err(error),
    };
    match refused {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {error}"));
            ExitCode::from(2)
        }
    }
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
