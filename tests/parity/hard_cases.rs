//! Norms and attention where single precision, or half of it, runs out.
//!
//! Hard cases of other parts stand with them: schedules of 1 to 1000 steps and without terminal signal in `published.rs`,
//! guidance 0 to 1000 and hard prompts in `requests.rs`, hostile weight files in `weight_files.rs`.

use burn::tensor::{DType, Device, Distribution, FloatDType, Tensor};
use wake_nn::attention::attention;
use wake_nn::norm::GroupNorm;

use crate::golden::{devices, difference, largest, numbers};

/// The kinds of number that a device computes with, and the width of their last digit.
fn kinds(device: &Device) -> Vec<(DType, f64)> {
    let all = [(DType::F32, 6e-8), (DType::F16, 5e-4), (DType::BF16, 4e-3)];
    all.into_iter()
        .filter(|(dtype, _)| device.supports_dtype(*dtype))
        .collect()
}

fn cast<const D: usize>(x: Tensor<D>, dtype: DType) -> Tensor<D> {
    x.cast(FloatDType::from(dtype))
}

#[test]
#[cfg(feature = "flex")]
fn flex_knows_every_kind() {
    assert_eq!(kinds(&Device::flex()).len(), 3);
}

/// Constant images have no variance: the result is the bias, which starts as 0. A mean of equal numbers may
/// be off by a digit e, and ε is too small to hide that: |y| = e/√(e² + ε) < 1 at the worst.
#[test]
fn constant_images_normalise_to_the_bias() {
    for (backend, device) in devices() {
        for (dtype, _) in kinds(&device) {
            let values = [0.0_f64, 1.0, -3.5, 300.0, -3e4, 6e4, 1e-30, 1e18];
            let held = |value: &&f64| dtype != DType::F16 || value.abs() < 65504.0;
            for &value in values.iter().filter(held) {
                let norm = GroupNorm::new(4, 8, 1e-6, &device);
                let x = cast(Tensor::<4>::full([1, 8, 16, 16], value, &device), dtype);
                let y = norm.forward(x);
                assert_eq!(y.dtype(), dtype, "the precision is kept");
                let limit = if value.abs() < 2.0 { 1e-3 } else { 1.0 };
                let found = difference(&numbers(&y), &[0.0; 8 * 256]);
                assert!(found <= limit, "{backend} {dtype:?} {value}: {found}");
            }
        }
    }
}

/// Images of ±1000 square to 10⁶, beyond f16; the result is that of f32, rounded.
#[test]
fn norms_do_not_overflow_in_half_precision() {
    for (backend, device) in devices() {
        let uniform = Distribution::Uniform(-1000.0, 1000.0);
        let x = Tensor::random([2, 8, 9, 7], uniform, &device);
        for (dtype, digit) in kinds(&device) {
            let norm = GroupNorm::new(4, 8, 1e-5, &device);
            let narrow = cast(x.clone(), dtype);
            let expected = numbers(&norm.forward(cast(narrow.clone(), DType::F32)));
            let y = norm.forward(narrow);
            assert_eq!(y.dtype(), dtype, "the precision is kept");
            let worst = difference(&numbers(&y), &expected) / largest(&expected);
            assert!(worst <= digit, "{backend} {dtype:?}: {worst:e}");
        }
    }
}

/// Logits of ±10⁴ pick one token alone: the values of the token whose key points along the query.
#[test]
fn attention_is_finite_for_huge_logits() {
    for (backend, device) in devices() {
        // Short and long enough for both of flex's algorithms.
        for tokens in [16, 600] {
            let sign = |i: usize| if i.is_multiple_of(2) { 1.0_f32 } else { -1.0 };
            let query: Vec<f32> = (0..tokens * 4).map(|i| 100.0 * sign(i / 4)).collect();
            // Key 0 points one way and key 1 the other; the rest are at right angles to both.
            let key: Vec<f32> = (0..tokens * 4)
                .map(|i| match i / 4 {
                    0 => 50.0,
                    1 => -50.0,
                    _ => 0.0,
                })
                .collect();
            let value: Vec<f32> = (0..tokens * 4).map(|i| (i / 4) as f32).collect();
            let tensor = |x: &[f32]| Tensor::<1>::from_floats(x, &device).reshape([1, tokens, 4]);
            for (dtype, _) in kinds(&device) {
                let part = |x: &[f32]| cast(tensor(x), dtype);
                let out = numbers(&attention(part(&query), part(&key), part(&value), 1, false));
                let expected: Vec<f32> = (0..tokens * 4).map(|i| ((i / 4) % 2) as f32).collect();
                assert_eq!(out, expected, "{backend} {dtype:?} {tokens}: logits ±10⁴");
            }
        }
    }
}
