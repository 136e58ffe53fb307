//! Streams of random numbers in this crate; see [`wake_nn::noise`].

/// Normal numbers: noise of the first sample.
pub const INITIAL_STREAM: u32 = 0;
/// Normal numbers: noise for sampling the latents of an encoded image.
pub const POSTERIOR_STREAM: u32 = 1;
/// Normal numbers: the white part of the noise from which a flow starts.
#[cfg(feature = "wake-model")]
pub const WHITE_STREAM: u32 = 2;
/// Normal numbers: the noise from which a learnt sea starts.
#[cfg(feature = "wake-model")]
pub const SEA_TEXTURE_STREAM: u32 = 4;
/// Normal numbers: noise of the first step; the stream of step i is `STEP_STREAM + i`.
pub const STEP_STREAM: u32 = 16;

/// Uniform numbers: styles of learnt seas.
#[cfg(feature = "wake-model")]
pub const STYLES: u32 = 1100;
