//! Streams of numbers that this crate draws from a seed; see [`wake_nn::noise`].

/// Normal numbers: the noise that the first sample is made of.
pub const INITIAL_STREAM: u32 = 0;
/// Normal numbers: the noise that an encoded image is drawn with.
pub const POSTERIOR_STREAM: u32 = 1;
/// Normal numbers: the white share of the noise that a flow starts from.
#[cfg(feature = "wake-model")]
pub const WHITE_STREAM: u32 = 2;
/// Normal numbers: the noise that a learnt sea starts from.
#[cfg(feature = "wake-model")]
pub const SEA_TEXTURE_STREAM: u32 = 4;
/// Normal numbers: the noise of the first step; that of step i is `STEP_STREAM + i`.
pub const STEP_STREAM: u32 = 16;

/// Uniform numbers: styles of learnt seas.
#[cfg(feature = "wake-model")]
pub const STYLES: u32 = 1100;
