//! Mean images with derivatives, and bounds, through the public interface.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed; what was measured is printed"
)]

mod bounds;
mod derivatives;
mod refined;
mod report;
