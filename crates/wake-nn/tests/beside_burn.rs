//! What the CPU kernels of this crate give beside burn's own, on flex:
//! `cargo test --release -p wake-nn --features autodiff --test beside_burn -- --ignored --nocapture`.

#![cfg(all(feature = "flex", feature = "autodiff"))]
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::time::Instant;

use burn::nn::conv::Conv2d;
use burn::nn::{GroupNormConfig, Linear, LinearConfig};
use burn::tensor::module::attention as burns_attention;
use burn::tensor::ops::AttentionModuleOptions;
use burn::tensor::{Device, Distribution, Tensor, activation};
use wake_nn::attention::attention;
use wake_nn::burn;
use wake_nn::conv::{conv3x3, convolve};
use wake_nn::linear::linear;
use wake_nn::norm::GroupNorm;

/// Least milliseconds of seven calls after one that warms up.
fn least(mut call: impl FnMut()) -> f64 {
    call();
    let times = (0..7).map(|_| {
        let start = Instant::now();
        call();
        1e3 * start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

/// A row: forward pass and gradients of both, and how many times as long burn takes.
fn row<const D: usize>(
    name: &str,
    shape: [usize; D],
    ours: impl Fn(Tensor<D>) -> Tensor<D>,
    burns: impl Fn(Tensor<D>) -> Tensor<D>,
) {
    let learning = Device::flex().autodiff();
    let x = Tensor::<D>::random(shape, Distribution::Default, &learning);
    let forward = |layer: &dyn Fn(Tensor<D>) -> Tensor<D>| {
        least(|| {
            let y = layer(x.clone()).sum();
            std::hint::black_box(y.into_scalar::<f32>());
        })
    };
    let both = |layer: &dyn Fn(Tensor<D>) -> Tensor<D>| {
        least(|| {
            let x = x.clone().require_grad();
            let gradients = layer(x.clone()).square().sum().backward();
            let gradient = x.grad(&gradients).expect("a gradient").sum();
            std::hint::black_box(gradient.into_scalar::<f32>());
        })
    };
    let [a, b, c, d] = [forward(&ours), forward(&burns), both(&ours), both(&burns)];
    println!(
        "| {name} | {a:.1} | {b:.1} | {:.1} | {c:.1} | {d:.1} | {:.1} |",
        b / a,
        d / c
    );
}

#[test]
#[ignore = "a table of times"]
fn times_beside_burn() {
    let device = Device::flex().autodiff();
    println!(
        "| operation | ours [ms] | burn | burn/ours | with gradients, ours | burn | burn/ours |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (batch, channels, side) in [(16, 64, 32), (16, 128, 16), (1, 320, 64)] {
        let shape = [batch, channels, side, side];
        let layer: Conv2d = conv3x3(channels, channels, &device);
        let name = format!("3 × 3 convolution, {batch} × {channels} × {side}²");
        row(&name, shape, |x| convolve(&layer, x), |x| layer.forward(x));
        let ours = GroupNorm::new(32, channels, 1e-5, &device);
        let burns = GroupNormConfig::new(32, channels).init(&device);
        let name = format!("group norm + SiLU, {batch} × {channels} × {side}²");
        let silu = |x| activation::silu(burns.forward(x));
        row(&name, shape, |x| ours.forward_silu(x), silu);
    }
    for (tokens, channels, heads) in [(256, 128, 4), (1024, 320, 8), (4096, 320, 8)] {
        let name = format!("attention, {tokens} tokens × {channels}, {heads} heads");
        let split = |x: Tensor<3>| {
            x.reshape([1, tokens, heads, channels / heads])
                .swap_dims(1, 2)
        };
        let burns = |x: Tensor<3>| {
            let [q, k, v] = [0; 3].map(|_| split(x.clone()));
            let options = AttentionModuleOptions::default();
            let y = burns_attention(q, k, v, None, None, options);
            y.swap_dims(1, 2).reshape([1, tokens, channels])
        };
        let ours = |x: Tensor<3>| attention(x.clone(), x.clone(), x, heads, false);
        row(&name, [1, tokens, channels], ours, burns);
    }
    for (tokens, from, to) in [
        (256, 128, 1024),
        (4096, 320, 320),
        (4096, 320, 2560),
        (1024, 2560, 640),
        (256, 1280, 10240),
    ] {
        let layer: Linear = LinearConfig::new(from, to).init(&device);
        let name = format!("linear layer, {tokens} tokens × {from} to {to}");
        let shape = [1, tokens, from];
        row(&name, shape, |x| linear(&layer, x), |x| layer.forward(x));
    }
}
