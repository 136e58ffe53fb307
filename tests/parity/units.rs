//! Single layers and formulas against torch.

use burn::tensor::{Device, Tensor};
use wake_ldm::autoencoder::GaussianPosterior;
use wake_nn::activation::{gelu, quick_gelu, silu};
use wake_nn::norm::GroupNorm;
use wake_nn::resample::nearest;
use wake_nn::timestep::sinusoidal_embedding;

use crate::golden::{Golden, devices, difference, folder, largest, numbers};

fn units() -> Golden {
    Golden::read(&folder().join("models/units.safetensors"))
}

/// Compares relative to the largest value.
fn expect<const D: usize>(what: &str, ours: &Tensor<D>, expected: &[f32], relative: f64) {
    let difference = difference(&numbers(ours), expected);
    let allowed = relative * largest(expected).max(1.0);
    assert!(
        difference <= allowed,
        "{what}: {difference:e}, allowed {allowed:e}"
    );
}

/// Every embedding `tembN_(no)flip_shiftS(_frac)` of the file.
///
/// An angle t ω of up to 999 is rounded to 2⁻¹⁵ of a radian, and ω itself to half a unit in its last
/// place on both sides; two such roundings make 1.2e-4.
#[test]
fn embeddings_of_the_step_agree() {
    let units = units();
    for (backend, device) in devices() {
        let mut count = 0;
        for name in units.names().filter(|name| name.starts_with("temb")) {
            let steps: Vec<f32> = if name.ends_with("_frac") {
                units.f32s("timesteps_frac")
            } else {
                units.i64s("timesteps").iter().map(|&t| t as f32).collect()
            };
            let shift = if name.contains("_shift1") { 1.0 } else { 0.0 };
            let channels = units.shape(name)[1];
            let ours = sinusoidal_embedding(
                Tensor::from_floats(steps.as_slice(), &device),
                channels,
                !name.contains("_noflip"),
                shift,
            );
            expect(
                &format!("{backend} {name}"),
                &ours,
                &units.f32s(name),
                1.2e-4,
            );
            count += 1;
        }
        assert!(count > 0, "no embeddings in the file");
    }
}

#[test]
fn activations_agree() {
    let units = units();
    for (backend, device) in devices() {
        let x = || units.tensor::<1>("act_x", &device);
        // A few roundings of an exponential or an error function.
        for (name, ours) in [
            ("act_silu", silu(x())),
            ("act_quick_gelu", quick_gelu(x())),
            ("act_gelu_exact", gelu(x())),
        ] {
            expect(&format!("{backend} {name}"), &ours, &units.f32s(name), 1e-6);
        }
    }
}

/// A normalisation with the weights of the file: `gnC_G_EPS_{x,w,b,y}`.
#[test]
fn group_norms_agree() {
    let units = units();
    for (backend, device) in devices() {
        let mut count = 0;
        for name in units
            .names()
            .filter(|name| name.starts_with("gn") && name.ends_with("_y"))
        {
            let stem = name.trim_end_matches("_y");
            let parts: Vec<&str> = stem.trim_start_matches("gn").split('_').collect();
            let [channels, groups, epsilon] = parts[..] else {
                panic!("{name}")
            };
            let norm = GroupNorm::new(
                groups.parse().unwrap(),
                channels.parse().unwrap(),
                epsilon.parse().unwrap(),
                &device,
            );
            // Fresh layers neither scale nor shift; that is left to the reference here.
            let plain = norm.forward(units.tensor(&format!("{stem}_x"), &device));
            let per_channel = |suffix: &str| {
                let values: Tensor<1> = units.tensor(&format!("{stem}_{suffix}"), &device);
                values.reshape([1, -1, 1, 1])
            };
            let ours = plain * per_channel("w") + per_channel("b");
            expect(&format!("{backend} {name}"), &ours, &units.f32s(name), 2e-6);
            count += 1;
        }
        assert!(count > 0, "no group norms in the file");
        let x = units.tensor("gn_const_x", &device);
        let [_, channels, _, _] = units.shape("gn_const_x")[..] else {
            panic!("no image")
        };
        let ours = GroupNorm::new(4, channels, 1e-6, &device).forward(x);
        expect(
            backend,
            &ours,
            &units.f32s("gn_const_y_groups4_eps1e-6"),
            1e-6,
        );
    }
}

#[test]
fn nearest_pixels_agree() {
    let units = units();
    for (_, device) in devices() {
        for name in ["up_nearest2x", "up_nearest_to_9x13"] {
            let shape = units.shape(name);
            let ours = nearest(units.tensor("up_x", &device), [shape[2], shape[3]]);
            assert_eq!(
                numbers(&ours),
                units.f32s(name),
                "{name}: pixels are copied"
            );
        }
    }
}

#[test]
fn posteriors_agree() {
    let units = units();
    for (backend, device) in devices() {
        let posterior = |name: &str, device: &Device| {
            GaussianPosterior::from_moments(units.tensor(name, device))
        };
        let first = posterior("gauss_params", &device);
        let noise = units.tensor("gauss_noise", &device);
        let sample = first.sample(noise);
        for (name, ours) in [
            ("gauss_mean", first.mode()),
            ("gauss_std", first.std()),
            ("gauss_logvar", first.logvar.clone()),
            ("gauss_sample", sample),
        ] {
            expect(&format!("{backend} {name}"), &ours, &units.f32s(name), 1e-6);
        }
        let second = posterior("gauss2_params", &device);
        let columns = second.mean.dims()[3];
        let roll = |x: &Tensor<4>| {
            let last = x.clone().narrow(3, columns - 1, 1);
            Tensor::cat(vec![last, x.clone().narrow(3, 0, columns - 1)], 3)
        };
        let rolled = GaussianPosterior {
            mean: roll(&second.mean),
            logvar: roll(&second.logvar),
        };
        // Sums of some sixty terms of very different size.
        for (name, ours) in [
            ("gauss_kl", first.kl()),
            ("gauss2_kl", second.kl()),
            ("gauss2_kl_to_gauss2rolled", second.kl_to(&rolled)),
        ] {
            expect(&format!("{backend} {name}"), &ours, &units.f32s(name), 1e-5);
        }
        // torch's `gauss_nll_of_sample` hangs on the last bit of a sample where σ is 3e-7: one such
        // bit adds 12. So the density of the stored sample is summed here in f64.
        let stored = units.tensor("gauss_sample", &device);
        let expected = density(&units);
        let ours = first.negative_log_likelihood(stored);
        expect(&format!("{backend} density"), &ours, &expected, 1e-5);
    }
}

/// ½ Σ (ln 2π + ln σ² + (z − μ)² / σ²) of each stored sample.
fn density(units: &Golden) -> Vec<f32> {
    let [z, mean, logvar] =
        ["gauss_sample", "gauss_mean", "gauss_logvar"].map(|name| units.f32s(name));
    let term = |i: usize| {
        let distance = f64::from(z[i]) - f64::from(mean[i]);
        let logvar = f64::from(logvar[i]);
        0.5 * (std::f64::consts::TAU.ln() + logvar + distance * distance * (-logvar).exp())
    };
    let batch = units.shape("gauss_sample")[0];
    let per_image = z.len() / batch;
    (0..batch)
        .map(|i| (i * per_image..(i + 1) * per_image).map(term).sum::<f64>() as f32)
        .collect()
}
