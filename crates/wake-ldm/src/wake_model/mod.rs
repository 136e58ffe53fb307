//! The wake model: its inputs, its networks, and the sampler.

pub mod conditioning;
pub mod network;
pub mod sea_texture;
pub mod sampler;
