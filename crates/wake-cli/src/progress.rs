//! Progress of long work, on standard error.

use indicatif::{ProgressBar, ProgressStyle};

/// Progress bar of `length` things.
#[cfg(any(feature = "simulate", feature = "detect"))]
pub(crate) fn bar(length: u64, things: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}, {per_sec}, {eta} left");
    ProgressBar::new(length)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(things)
}

/// Spinner with the elapsed time, for work whose progress is unknown.
#[cfg(feature = "simulate")]
pub(crate) fn clock(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {msg}, {elapsed} elapsed");
    let clock = ProgressBar::new_spinner()
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
        .with_message(what);
    clock.enable_steady_tick(std::time::Duration::from_millis(200));
    clock
}
