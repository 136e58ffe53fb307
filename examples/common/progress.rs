//! Progress of long work, on standard error.

use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar of so many `things`.
pub(crate) fn bar(length: u64, things: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}, {per_sec}, {eta} left");
    ProgressBar::new(length)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(things)
}
