//! Our models, schedulers and pipeline against torch, diffusers and transformers.
//!
//! The reference files are those of the folder named by `WAKE_FIXTURES`, by default the copy in
//! `tests/fixtures`; every case that their manifests list is run, on every CPU backend compiled in.
#![cfg(feature = "ldm")]
#![allow(clippy::unwrap_used, reason = "in tests, a panic is the report")]

mod adaptations;
mod golden;
#[cfg(feature = "train")]
mod gradients;
mod hard_cases;
mod metrics;
mod models;
mod pipeline;
mod precision;
mod published;
mod requests;
mod saving;
mod schedulers;
#[cfg(feature = "flex")]
mod shipped;
mod taps;
mod tiling;
mod units;
mod weight_files;
