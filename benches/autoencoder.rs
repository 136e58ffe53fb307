//! Encoding of a prompt and decoding of an image with Stable Diffusion v1.4's models, f32, random weights.
//!
//! ```text
//! cargo bench --bench autoencoder
//! python benches/torch_reference.py              # the same in PyTorch
//! ```
//!
//! Each runs once to warm up and three times to be measured.

use std::hint::black_box;
use std::time::Instant;

use burn::tensor::{Device, Distribution, Int, Tensor};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::text::ClipTextConfig;

/// Sorted seconds of three calls after one to warm up.
fn measure(call: impl Fn()) -> Vec<f64> {
    call();
    let timed = |_| {
        let begin = Instant::now();
        call();
        begin.elapsed().as_secs_f64()
    };
    let mut seconds: Vec<f64> = (0..3).map(timed).collect();
    seconds.sort_by(f64::total_cmp);
    seconds
}

fn main() {
    let device = Device::flex();
    let text = ClipTextConfig::new().init(&device);
    let ids: Tensor<2, Int> = Tensor::full([2, 77], 320, &device);
    let seconds = measure(|| {
        black_box(text.forward(ids.clone()).last_hidden_state.into_data());
    });
    println!("text encoder, batch 2: {seconds:.3?} s");
    drop(text);

    let small = AutoencoderKlConfig::small(16, 3).init(&device);
    let latents: Tensor<4> =
        Tensor::random([1, 16, 32, 32], Distribution::Normal(0.0, 1.0), &device);
    let seconds = measure(|| {
        black_box(small.decode(latents.clone()).into_data());
    });
    println!("small decoder, 32x32 latents: {seconds:.4?} s");

    let autoencoder = AutoencoderKlConfig::new().init(&device);
    let latents: Tensor<4> =
        Tensor::random([1, 4, 64, 64], Distribution::Normal(0.0, 1.0), &device);
    let seconds = measure(|| {
        black_box(autoencoder.decode(latents.clone()).into_data());
    });
    println!(
        "decoder to 512x512: {seconds:.2?} s, peak memory {}",
        peak_memory()
    );
}

/// The most memory that this process has held, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or_else(|| "unknown".to_owned(), |line| line.trim().to_owned())
}
