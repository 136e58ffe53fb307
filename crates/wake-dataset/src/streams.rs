//! Streams of uniform numbers that this crate draws from a seed; see [`wake_nn::noise`].

/// Seeds of scenes.
pub const SEEDS: u32 = 1000;
/// Wordings of scenes.
pub const WORDINGS: u32 = 1001;
/// The order of examples; round i of the shuffle has `ORDER + i`.
pub const ORDER: u32 = 1 << 20;
/// Values of a scene: each key has one of the streams from here on.
pub const VALUES: u32 = 1 << 31;
