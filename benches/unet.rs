//! The U-Net and what it spends its time in, f32, random weights.
//!
//! ```text
//! cargo bench --bench unet                       # blocks, small U-Net, Stable Diffusion's U-Net
//! cargo bench --bench unet -- attention          # some of the blocks only
//! python benches/torch_reference.py              # the same in PyTorch
//! ```
//!
//! Stable Diffusion's U-Net takes many seconds and 4 GB: it runs three times, and only where no filter
//! is given or the filter names it (`stable-diffusion`).
#![allow(
    missing_docs,
    reason = "criterion's macros make undocumented functions"
)]

use std::hint::black_box;
use std::time::Instant;

use burn::tensor::{Device, Distribution, Tensor};
use criterion::{Criterion, criterion_group};
use wake_ldm::unet::{UNet, UNetConfig, UNetInput};
use wake_nn::attention::attention;
use wake_nn::on_pool;
use wake_nn::resnet::{ResnetBlock, ResnetShape};

fn random<const D: usize>(shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::random(shape, Distribution::Normal(0.0, 1.0), device)
}

/// Residual blocks: twice group norm, SiLU and a 3 × 3 convolution.
fn residual_blocks(criterion: &mut Criterion) {
    let device = Device::flex();
    let mut group = criterion.benchmark_group("residual_block");
    group.sample_size(10);
    for (batch, channels, size) in [(2, 320, 64), (4, 64, 32), (2, 128, 16), (2, 192, 8)] {
        let shape = ResnetShape {
            channels_in: channels,
            channels_out: channels,
            time_channels: Some(4 * channels),
            groups: 32,
            epsilon: 1e-5,
        };
        let block = ResnetBlock::new(shape, &device);
        let x = random([batch, channels, size, size], &device);
        let time: Tensor<2> = random([batch, 4 * channels], &device);
        group.bench_function(format!("{batch}x{channels}x{size}x{size}"), |b| {
            b.iter(|| black_box(block.forward(x.clone(), Some(time.clone()))));
        });
    }
}

/// Attention within an image and to a prompt, at Stable Diffusion's finest level.
fn attentions(criterion: &mut Criterion) {
    let device = Device::flex();
    let mut group = criterion.benchmark_group("attention_8_heads_of_40");
    group.sample_size(10);
    let query: Tensor<3> = random([1, 4096, 320], &device);
    for tokens in [4096, 77] {
        let context: Tensor<3> = random([1, tokens, 320], &device);
        group.bench_function(format!("4096x{tokens}"), |b| {
            b.iter(|| {
                let (query, context) = (query.clone(), context.clone());
                black_box(attention(query, context.clone(), context, 8, false))
            });
        });
    }
}

fn input(config: &UNetConfig, batch: usize, size: usize, device: &Device) -> UNetInput {
    UNetInput {
        sample: random([batch, config.in_channels, size, size], device),
        timesteps: Tensor::full([batch], 500.0, device),
        context: config
            .cross_attention_dim
            .map(|channels| random([batch, 77, channels], device)),
        condition: None,
    }
}

/// As the pipelines call it.
fn call(unet: &UNet, input: &UNetInput) {
    on_pool(&Device::flex(), || {
        black_box(unet.forward(input.clone()).into_data());
    });
}

/// The small U-Net on 32 × 32 latents.
fn small_unet(criterion: &mut Criterion) {
    let device = Device::flex();
    let config = UNetConfig::small(16, Some(256), None);
    let unet = config.init(&device);
    let mut group = criterion.benchmark_group("small_unet_32x32");
    group.sample_size(10);
    for batch in [1, 2] {
        let input = input(&config, batch, 32, &device);
        group.bench_function(format!("batch {batch}"), |b| b.iter(|| call(&unet, &input)));
    }
}

/// As the training loop makes its steps.
#[cfg(feature = "train")]
fn report(name: &str, call: impl Fn() + Send) {
    on_pool(&Device::flex(), move || report_here(name, call));
}

/// Prints the median seconds of seven calls after one to warm up, and the mean of the seconds that all
/// cores together worked on one, which a busy machine does not change.
#[cfg(feature = "train")]
fn report_here(name: &str, call: impl Fn()) {
    call();
    let busy = cpu_seconds();
    let timed = |_| {
        let begin = Instant::now();
        call();
        begin.elapsed().as_secs_f64()
    };
    let mut seconds: Vec<f64> = (0..7).map(timed).collect();
    seconds.sort_by(f64::total_cmp);
    let work = (cpu_seconds() - busy) / 7.0;
    println!("{name:45} {:.4} s, {work:.4} s of all cores", seconds[3]);
}

/// Seconds that this process has worked, where the system tells (in hundredths).
#[cfg(feature = "train")]
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace();
    let ticks = fields
        .skip(11)
        .take(2)
        .filter_map(|field| field.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

/// Forward, and forward with gradients: two residual blocks, and the small U-Net, at a batch of 16.
#[cfg(feature = "train")]
fn training() {
    let (plain, tracking) = (Device::flex(), Device::flex().autodiff());
    for (batch, channels, size) in [(16, 64, 32), (16, 128, 16), (16, 192, 8), (1, 64, 32)] {
        let shape = ResnetShape {
            channels_in: channels,
            channels_out: channels,
            time_channels: None,
            groups: 16,
            epsilon: 1e-5,
        };
        let call = |device: &Device| {
            let blocks = [
                ResnetBlock::new(shape, device),
                ResnetBlock::new(shape, device),
            ];
            let x: Tensor<4> = random([batch, channels, size, size], device);
            move || {
                let forward = |x, block: &ResnetBlock| block.forward(x, None);
                blocks.iter().fold(x.clone(), forward)
            }
        };
        let (forward, tracked) = (call(&plain), call(&tracking));
        let name = format!("training: b{batch} c{channels} s{size}");
        report(&format!("{name}, forward"), || drop(black_box(forward())));
        report(&format!("{name}, with gradients"), || {
            drop(black_box(tracked().square().mean().backward()));
        });
    }
    let config = UNetConfig::small(16, Some(256), None);
    let (unet, tracked) = (config.init(&plain), config.init(&tracking));
    let (x, y) = (
        input(&config, 16, 32, &plain),
        input(&config, 16, 32, &tracking),
    );
    let name = "training: small U-Net, batch 16";
    report(&format!("{name}, forward"), || call(&unet, &x));
    report(&format!("{name}, with gradients"), || {
        black_box(tracked.forward(y.clone()).square().mean().backward());
    });
}

/// Stable Diffusion v1.4's U-Net: one guided step is batch 2.
fn stable_diffusion_unet() {
    let device = Device::flex();
    let config = UNetConfig::new();
    let unet = config.init(&device);
    let input = input(&config, 2, 64, &device);
    call(&unet, &input);
    let mut seconds: Vec<f64> = (0..3)
        .map(|_| {
            let begin = Instant::now();
            call(&unet, &input);
            begin.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    println!(
        "stable-diffusion U-Net, batch 2, 64x64: {seconds:.2?} s, peak memory {}",
        peak_memory()
    );
}

/// The most memory that this process has held, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or_else(|| "unknown".to_owned(), |line| line.trim().to_owned())
}

criterion_group!(benches, residual_blocks, attentions, small_unet);

fn main() {
    benches();
    let filters: Vec<String> = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with('-'))
        .collect();
    let wanted = |name: &str| {
        filters.is_empty() || filters.iter().any(|filter| name.contains(filter.as_str()))
    };
    #[cfg(feature = "train")]
    if wanted("training") {
        training();
    }
    if wanted("stable-diffusion") {
        stable_diffusion_unet();
    }
    Criterion::default().configure_from_args().final_summary();
}
