//! Random streams that this crate uses of a seed; see [`wake_nn::noise`].

/// Seeds of scenes.
pub const SEEDS: u32 = 1000;
/// Wordings of scenes.
pub const WORDINGS: u32 = 1001;
/// Order of examples; round i of the shuffle uses `ORDER + i`.
pub const ORDER: u32 = 1 << 20;
/// Values of a scene; each key uses a stream from here up.
pub const VALUES: u32 = 1 << 31;
