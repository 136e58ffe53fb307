//! Checks of weights and devices on one fixed image: the maps must be usable, and a device must reproduce the CPU's values.

use std::path::Path;
use std::sync::Mutex;

use burn::tensor::{Device, Tensor, TensorData};
use wake_nn::self_check::{self as check, Stage};

use crate::error::{Error, Result};
use crate::network::{INPUTS, Network, OUTPUTS};
use crate::normalize;

/// Maps computed by flex.
const REFERENCE: &[u8] = include_bytes!("../assets/self_check.safetensors");
/// Rows and columns of the image \[pixels\].
const SIZE: usize = 256;
/// Products summed for one value of a map: 3 × 3 cells of 24 channels.
const PRODUCTS: f32 = 9.0 * 24.0;

/// Runs a network on a fixed image with one obvious wake, and refuses maps that training cannot produce.
///
/// Every value must be finite. Logits and log-lengths go through the exponential function, so at least half of the values of
/// each map must lie where it neither overflows nor vanishes, |x| ≤ ln(largest f32) = 88.7. Each map must vary by more than
/// rounding, and no two may be equal. The check does not ask how well the wake is found: random initial weights pass.
///
/// # Errors
///
/// [`Error::WrongMaps`] with the file and the fault.
pub fn self_check(network: &Network, weights: &Path, device: &Device) -> Result<()> {
    let maps = maps(network, device);
    let values: Vec<f32> = maps.into_data().iter::<f32>().collect();
    match fault(&values) {
        None => Ok(()),
        Some(why) => Err(Error::WrongMaps {
            path: weights.to_owned(),
            device: wake_nn::device_label(device),
            why,
        }),
    }
}

/// Compares the maps of the shipped network on a device with its maps on the CPU backend flex.
///
/// # Errors
///
/// [`wake_nn::Error::WrongNumbers`] with the difference and the allowed difference.
pub fn check_device(device: &Device) -> wake_nn::Result<()> {
    check::compare(device, REFERENCE, [stage(device)?])
}

/// Checks a device other than a CPU once per process, when a detector is made on it.
pub(crate) fn check_once(device: &Device) -> wake_nn::Result<()> {
    static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    check::check_once(&CHECKED, device, check_device)
}

fn stage(device: &Device) -> wake_nn::Result<Stage> {
    Ok(Stage::new(
        "detector",
        maps(&Network::pretrained(device)?, device),
    ))
}

/// Maps of the fixed image.
fn maps(network: &Network, device: &Device) -> Tensor<4> {
    let contrast = normalize::contrast(&plain_wake(), SIZE, SIZE);
    let seen: Vec<[f32; INPUTS]> = contrast.into_iter().map(normalize::inputs).collect();
    let inputs: Vec<f32> = (0..INPUTS)
        .flat_map(|k| seen.iter().map(move |x| x[k]))
        .collect();
    let inputs = TensorData::new(inputs, [1, INPUTS, SIZE, SIZE]);
    network.forward(Tensor::from_data(inputs, device))
}

/// First fault of the maps `[OUTPUTS, rows, columns]`; `None` for good maps.
fn fault(values: &[f32]) -> Option<&'static str> {
    if !values.iter().all(|x| x.is_finite()) {
        return Some("not finite");
    }
    let maps: Vec<&[f32]> = values.chunks_exact(values.len() / OUTPUTS).collect();
    let largest = f32::MAX.ln();
    let saturated = |map: &&[f32]| {
        let outside = map.iter().filter(|x| x.abs() > largest).count();
        2 * outside > map.len()
    };
    if maps.iter().any(saturated) {
        return Some("saturated");
    }
    let rounding = |map: &[f32]| {
        let largest = map.iter().fold(0.0f32, |largest, x| largest.max(x.abs()));
        PRODUCTS * f32::EPSILON * largest
    };
    let same = |map: &[f32], other: &[f32]| {
        let allowed = rounding(map).max(rounding(other));
        map.iter().zip(other).all(|(a, b)| (a - b).abs() <= allowed)
    };
    if maps.iter().any(|map| same(map, &vec![map[0]; map.len()])) {
        return Some("constant");
    }
    let equal = |(k, map): (usize, &&[f32])| maps[..k].iter().any(|other| same(map, other));
    maps.iter()
        .enumerate()
        .any(equal)
        .then_some("equal to each other")
}

/// Grey levels, row by row, of a dark line from (77, 128) to the right behind a bright ship, on noise.
fn plain_wake() -> Vec<f32> {
    let level = |i: usize| {
        let (right, down) = ((i % SIZE) as f32 - 77.0, (i / SIZE) as f32 - 128.0);
        let dark = match right > 0.0 {
            true => -0.4 * (-0.5 * (down / 4.0).powi(2) - right / 250.0).exp(),
            false => 0.0,
        };
        let ship = (-0.5 * ((right + 14.0).powi(2) / 20.0 + down.powi(2) / 6.0)).exp();
        (76.0 * (1.0 + 0.2 * normal(i as u64) + dark) + 500.0 * ship)
            .round()
            .clamp(0.0, 255.0)
    };
    (0..SIZE * SIZE).map(level).collect()
}

/// Pseudorandom number of mean 0 and variance 1, fixed for each place: the sum of twelve uniform ones, less 6.
fn normal(place: u64) -> f32 {
    let mut state = place.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut uniform = || {
        state = (state ^ (state >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        state ^= state >> 31;
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..12).map(|_| uniform()).sum::<f32>() - 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Detector, GreyImage};

    /// With `DRAW=1`, rewrites the file.
    #[test]
    fn the_file_has_what_flex_computes() {
        let device = Device::flex();
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/self_check.safetensors");
        check::draw(path.as_ref(), &[stage(&device).expect("a stage")]);
        check_device(&device).expect("flex against flex");
    }

    /// Acceptable maps: each varies, no two are equal.
    fn good() -> Vec<f32> {
        let cell = |i: usize| (i * 7 % 11) as f32 - 5.0;
        (0..OUTPUTS * 16)
            .map(|i| cell(i % 16) + (i / 16) as f32)
            .collect()
    }

    #[test]
    fn maps_without_a_number_without_contrast_or_alike_are_wrong() {
        assert_eq!(fault(&good()), None);
        let changed = |places: std::ops::Range<usize>, value: &dyn Fn(usize) -> f32| {
            let mut maps = good();
            for i in places {
                maps[i] = value(i);
            }
            fault(&maps)
        };
        assert_eq!(changed(5..6, &|_| f32::NAN), Some("not finite"));
        assert_eq!(changed(5..6, &|_| f32::INFINITY), Some("not finite"));
        // More than half of a map of 16 values above ln(f32::MAX).
        assert_eq!(changed(16..25, &|i| 89.0 + i as f32), Some("saturated"));
        assert_eq!(changed(16..24, &|i| 89.0 + i as f32), None);
        assert_eq!(changed(16..32, &|_| -3.9), Some("constant"));
        assert_eq!(
            changed(16..32, &|i| good()[i - 16]),
            Some("equal to each other")
        );
    }

    /// The shipped network finds the wake where it is; random initial weights pass for any of eight seeds.
    #[test]
    fn the_wake_is_plain_and_first_weights_pass() {
        let device = Device::flex();
        let levels = plain_wake().into_iter().map(|x| x as u8).collect();
        let image = GreyImage::eight_bits(SIZE, SIZE, levels).expect("an image");
        let found = Detector::pretrained(&device).expect("weights").find(&image);
        let first = found.first().expect("a wake");
        // Bounds of the ray rule.
        assert!((first.wake.axis_deg - 90.0).abs() < 10.0, "{first:?}");
        let [x, y] = first.wake.tip;
        assert!((x - 77.0).hypot(y - 128.0) < 60.0, "{first:?}");
        for seed in 0..8 {
            device.seed(seed);
            self_check(&Network::new(&device), Path::new("first"), &device).expect("sane maps");
        }
    }
}
