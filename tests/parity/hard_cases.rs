//! Norms and attention where single precision, or half of it, runs out.

use burn::tensor::{Device, FloatDType, Tensor};
use wake_ldm::nn::attention::attention;
use wake_ldm::nn::norm::GroupNorm;

use crate::golden::{devices, numbers, tensor};

/// The backends that know half precision: flex, for one.
fn half_devices() -> Vec<(&'static str, Device)> {
    let mut devices = devices();
    devices.retain(|(_, device)| device.supports_dtype(FloatDType::F16));
    assert!(
        !devices.is_empty() || !cfg!(feature = "flex"),
        "flex should know f16"
    );
    devices
}

/// Constant images have no variance: the result is the bias, which starts as 0.
#[test]
fn constant_images_normalise_to_the_bias() {
    for (backend, device) in devices() {
        for value in [0.0_f64, 1.0, -3e4, 1e-30, 1e18] {
            let norm = GroupNorm::new(4, 8, 1e-6, &device);
            let x = Tensor::<4>::full([1, 8, 4, 4], value, &device);
            let y = numbers(&norm.forward(x));
            // A mean of equal numbers may be off by an ulp, and ε is too small to hide that:
            // |y| ≤ (2^-23 |x|)/√(2^-46 x² + ε) ≤ 1.
            let limit = if value.abs() < 1.0 + f64::EPSILON {
                1e-3
            } else {
                1.0
            };
            assert!(
                y.iter().all(|y| f64::from(y.abs()) <= limit),
                "{backend} {value}: {y:?}"
            );
        }
    }
}

/// In f16 the sum of squares of these numbers overflows; the statistics are taken in f32.
#[test]
fn half_precision_norms_do_not_overflow() {
    for (backend, device) in half_devices() {
        let ramp: Vec<f32> = (0..256).map(|i| (i as f32 - 127.5) * 200.0).collect();
        let x: Tensor<4> = tensor(ramp, vec![1, 4, 8, 8], &device);
        let norm = GroupNorm::new(1, 4, 1e-5, &device);
        let wide = numbers(&norm.forward(x.clone()));
        let half = numbers(&norm.forward(x.cast(FloatDType::F16)).cast(FloatDType::F32));
        for (a, b) in wide.iter().zip(&half) {
            // Input and output are rounded to 11 bits each: 2 · 2^-11 of at most 1.8.
            assert!((a - b).abs() < 2e-3, "{backend}: {a} {b}");
        }
    }
}

/// Logits of ±1e4: the softmax is 1 for the largest and 0 for the others, and not NaN.
#[test]
fn attention_with_huge_logits_picks_the_largest() {
    for (backend, device) in devices() {
        let has_half = device.supports_dtype(FloatDType::F16);
        for half in if has_half {
            vec![false, true]
        } else {
            vec![false]
        } {
            // One head of width 4: logits are q·k/2 = ±1e4.
            let query: Tensor<3> = tensor([100.0, 0.0, 0.0, 0.0].repeat(2), vec![1, 2, 4], &device);
            let keys = vec![
                200.0, 0.0, 0.0, 0.0, -200.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0,
            ];
            let key: Tensor<3> = tensor(keys, vec![1, 3, 4], &device);
            let values: Vec<f32> = (0..12).map(|i| i as f32).collect();
            let value: Tensor<3> = tensor(values, vec![1, 3, 4], &device);
            let narrow = |x: Tensor<3>| if half { x.cast(FloatDType::F16) } else { x };
            let out = attention(narrow(query), narrow(key), narrow(value), 1, false);
            let out = numbers(&out.cast(FloatDType::F32));
            let expected = [0.0, 1.0, 2.0, 3.0].repeat(2);
            let close = out.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(close, "{backend}: {out:?}");
        }
    }
}
