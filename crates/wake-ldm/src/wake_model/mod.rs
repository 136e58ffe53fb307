//! The wake model: what it is told, its networks, and the sampler that joins them.

pub mod conditioning;
pub mod network;
pub mod sea_texture;
pub mod sampler;
