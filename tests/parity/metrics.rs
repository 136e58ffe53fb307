//! SSIM, PSNR, radial spectrum and LPIPS against scikit-image, numpy and the package `lpips`.

use crate::golden::{Golden, folder, json};
use burn::tensor::{Device, Tensor, TensorData};
use serde_json::Value;
use wake_physics::Field;
use wake_physics::measure::{Binning, radial_spectrum};
use wake_train::metrics::{
    Lpips, LpipsNetwork, Plane, SsimWindow, mean_square_error, psnr, ssim, ssim_map,
};

/// Values of images are f32 and sums f64, as in the reference: only the order of sums differs.
const ROUNDING: f64 = 1e-9;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| {
        if value == "inf" {
            f64::INFINITY
        } else {
            panic!("{value}")
        }
    })
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    let both_infinite = found.is_infinite() && expected.is_infinite();
    let close = both_infinite || (found - expected).abs() <= tolerance * expected.abs().max(1.0);
    assert!(close, "{what}: {found}, expected {expected}");
}

/// The channels of an image, H × W or H × W × 3, each as a plane of its own.
fn channels(file: &Golden, name: &str) -> (Vec<Vec<f32>>, usize) {
    let (values, shape) = (file.f32s(name), file.shape(name));
    let count = shape.get(2).copied().unwrap_or(1);
    let channel = |c: usize| values.iter().skip(c).step_by(count).copied().collect();
    ((0..count).map(channel).collect(), shape[1])
}

#[test]
fn ssim_and_psnr_are_scikit_images() {
    let folder = folder().join("metrics");
    let cases = json(&folder.join("ssim_psnr.json"));
    let file = Golden::read(&folder.join("images.safetensors"));
    let pairs = cases["pairs"].as_object().unwrap();
    assert!(!pairs.is_empty());
    for (name, case) in pairs {
        let (a, columns) = channels(&file, &format!("{name}/a"));
        let (b, _) = channels(&file, &format!("{name}/b"));
        let planes: Vec<(Plane<'_>, Plane<'_>)> = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (Plane::new(a, columns), Plane::new(b, columns)))
            .collect();
        let mean = |value: &dyn Fn(&Plane<'_>, &Plane<'_>) -> f64| {
            planes.iter().map(|(a, b)| value(a, b)).sum::<f64>() / planes.len() as f64
        };
        let check = |key: &str, found: f64| {
            if let Some(expected) = case.get(key) {
                assert_close(found, number(expected), ROUNDING, &format!("{name} {key}"));
            }
        };
        check("mse", mean(&mean_square_error));
        let error = mean(&mean_square_error);
        check("psnr_range1", 10.0 * (1.0 / error).log10());
        if planes.len() == 1 {
            check("psnr_range1", psnr(&planes[0].0, &planes[0].1, 1.0));
        }
        for (key, window) in [
            ("gauss", SsimWindow::Gaussian),
            ("default", SsimWindow::Uniform),
        ] {
            check(
                &format!("ssim_{key}"),
                mean(&|a, b| ssim(a, b, 1.0, window)),
            );
            let map = format!("{name}/ssim_map_{key}");
            if file.has(&map) {
                let found = ssim_map(&planes[0].0, &planes[0].1, 1.0, window);
                for (found, expected) in found.iter().zip(file.f64s(&map)) {
                    assert_close(*found, expected, ROUNDING, &map);
                }
            }
        }
    }
}

#[test]
fn radial_spectra_are_numpys() {
    let file = Golden::read(&folder().join("metrics/images.safetensors"));
    let mut images: Vec<&str> = file
        .names()
        .filter_map(|name| name.strip_prefix("radial/")?.strip_suffix("/image"))
        .collect();
    images.sort_unstable();
    assert!(!images.is_empty());
    for name in images {
        let at = |what: &str| format!("radial/{name}/{what}");
        let shape = file.shape(&at("image"));
        let image = Field {
            rows: shape[0],
            columns: shape[1],
            values: file.f32s(&at("image")),
        };
        let sum: f64 = image.values.iter().map(|v| f64::from(v.abs())).sum();
        for (key, binning) in [("floor", Binning::Floor), ("round", Binning::Round)] {
            let found = radial_spectrum(&image, binning);
            let counts: Vec<i64> = found.count.iter().map(|&c| c as i64).collect();
            assert_eq!(counts, file.i64s(&at(&format!("{key}/count"))), "{name}");
            // |F| comes as two f32: 2⁻²⁴ of itself, and rounding errors of the sum where it should vanish. A power of
            // 2 doubles that, and ln(1 + |F|) lessens it.
            for (what, values, power) in [
                ("mean_log1p_mag", &found.log_magnitude, 1),
                ("mean_mag", &found.magnitude, 1),
                ("mean_power", &found.power, 2),
            ] {
                let expected = file.f64s(&at(&format!("{key}/{what}")));
                assert_eq!(values.len(), expected.len());
                for (found, expected) in values.iter().zip(expected) {
                    let allowed = 2e-7 * expected.abs() + (1e-12 * sum).powi(power);
                    assert!(
                        (found - expected).abs() <= allowed,
                        "{name} {what}: {found} {expected}"
                    );
                }
            }
        }
    }
}

/// Weights from the formula that the fixture states.
fn formula_weights(net: &Value, seed: u64, path: &std::path::Path) {
    let tensors: Vec<(String, Vec<usize>, Vec<u8>)> = net["tensors"]
        .as_array()
        .unwrap()
        .iter()
        .enumerate()
        .map(|(k, entry)| {
            let name = entry[0].as_str().unwrap().to_owned();
            let shape: Vec<usize> = entry[1]
                .as_array()
                .unwrap()
                .iter()
                .map(|n| n.as_u64().unwrap() as usize)
                .collect();
            let fan_in: usize = shape[1..].iter().product();
            let scale = if shape.len() > 1 {
                (6.0 / fan_in as f64).sqrt()
            } else {
                0.1
            };
            let count: usize = shape.iter().product();
            let values: Vec<f32> = (0..count as u64)
                .map(|i| {
                    let x = i.wrapping_add(seed << 40).wrapping_add((k as u64) << 28);
                    let u = (splitmix64(x) >> 40) as f64 / 2f64.powi(24);
                    ((2.0 * u - 1.0) * scale) as f32
                })
                .collect();
            let check = &net["check"][&name];
            for (found, expected) in values.iter().zip(check["first4"].as_array().unwrap()) {
                assert_close(f64::from(*found), number(expected), 1e-9, &name);
            }
            let sum: f64 = values.iter().map(|&v| f64::from(v)).sum();
            assert_close(sum, number(&check["sum_f64"]), 1e-7, &name);
            (
                name,
                shape,
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            )
        })
        .collect();
    let views = tensors.iter().map(|(name, shape, bytes)| {
        let view =
            safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape.clone(), bytes);
        (name.clone(), view.unwrap())
    });
    std::fs::write(path, safetensors::serialize(views, None).unwrap()).unwrap();
}

fn splitmix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[test]
fn lpips_is_the_packages() {
    let folder = folder().join("metrics");
    let manifest = json(&folder.join("lpips.json"));
    let images = Golden::read(&folder.join("lpips_images.safetensors"));
    let scratch = tempfile::tempdir().unwrap();
    let device = Device::default();
    let mut cases_run = 0;
    for (name, net) in manifest["nets"].as_object().unwrap() {
        let network = match name.as_str() {
            "alex" => LpipsNetwork::Alex,
            "squeeze" => LpipsNetwork::Squeeze,
            other => panic!("no network {other}"),
        };
        let backbone = scratch.path().join(format!("{name}.safetensors"));
        formula_weights(net, manifest["seed"].as_u64().unwrap(), &backbone);
        let linear = folder.join("lpips_lin.safetensors");
        let lpips = Lpips::load(network, &backbone, &linear, &device).unwrap();
        for (case, expected) in net["cases"].as_object().unwrap() {
            let image = |side: &str| -> Tensor<4> {
                // A case without images of its own compares an image with itself.
                let pair = if images.has(&format!("{case}/a")) {
                    case.as_str()
                } else {
                    "wake"
                };
                let side = if pair == case { side } else { "a" };
                let name = format!("{pair}/{side}");
                let mut shape = images.shape(&name);
                shape.insert(0, 1);
                Tensor::from_data(TensorData::new(images.f32s(&name), shape), &device)
            };
            let found = lpips.distance(image("a"), image("b")).remove(0);
            // f32 against f64 differs by 1e-9 in the reference's own arithmetic; ours sums in another order.
            let what = format!("{name} {case}");
            assert_close(found.total, number(&expected["distance"]), 1e-6, &what);
            let layers = expected["per_layer"].as_array().unwrap();
            assert_eq!(found.layers.len(), layers.len());
            for (found, expected) in found.layers.iter().zip(layers) {
                assert_close(*found, number(expected), 1e-6, &what);
            }
            cases_run += 1;
        }
    }
    assert!(cases_run > 0);
}

/// Missing and foreign weights are named.
#[test]
fn wrong_lpips_weights_are_refused() {
    let linear = folder().join("metrics/lpips_lin.safetensors");
    let device = Device::default();
    let refused = Lpips::load(LpipsNetwork::Alex, &linear, &linear, &device).unwrap_err();
    assert!(
        refused.to_string().contains("features.0.weight"),
        "{refused}"
    );
    let absent = std::path::Path::new("no such file");
    assert!(Lpips::load(LpipsNetwork::Squeeze, absent, &linear, &device).is_err());
}
