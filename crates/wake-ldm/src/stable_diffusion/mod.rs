//! Stable Diffusion: text encoder, autoencoder, noise schedulers, low-rank adaptations, and the pipeline that joins them.

pub mod autoencoder;
pub mod lora;
pub mod pipeline;
pub mod scheduler;
pub mod text;
