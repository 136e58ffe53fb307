//! Gradients of whole models against torch's.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Gradients, Tensor};
use wake_ldm::unet::{UNet, UNetInput};
use wake_nn::weights::{self, Layout};

use crate::golden::{Golden, devices, difference, folder, json, numbers};

/// Puts its gradient in place of every parameter, so that a weight file of gradients can be written
/// and read by name.
struct GradientsOf<'a>(&'a Gradients);

impl ModuleMapper for GradientsOf<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let gradient = param
            .val()
            .grad(self.0)
            .expect("every parameter has a gradient");
        Param::initialized(param.id, gradient)
    }
}

fn norm(gradient: &[f32]) -> f64 {
    gradient
        .iter()
        .map(|&x| f64::from(x) * f64::from(x))
        .sum::<f64>()
        .sqrt()
}

fn input(golden: &Golden, device: &Device) -> UNetInput {
    let steps: Vec<f32> = golden.i64s("timestep").iter().map(|&t| t as f32).collect();
    UNetInput {
        sample: golden.tensor("sample", device).require_grad(),
        timesteps: Tensor::from_floats(steps.as_slice(), device),
        context: Some(
            golden
                .tensor("encoder_hidden_states", device)
                .require_grad(),
        ),
        condition: None,
    }
}

/// The loss, the norm of every gradient and every element of those that the file holds: within ten
/// times the noise floor of torch's own f32 gradients, relative to the gradient's norm.
#[test]
fn gradients_agree_with_torch() {
    let models = folder().join("models");
    let manifest = json(&models.join("manifest.json"));
    let trained: Vec<_> = manifest["models"]
        .as_object()
        .unwrap()
        .iter()
        .filter(|(_, model)| model.get("grad").is_some())
        .collect();
    assert!(!trained.is_empty(), "no gradients in {}", models.display());
    for (backend, device) in devices() {
        for (name, model) in &trained {
            let grad = &model["grad"];
            let floor = grad["worst_rel_grad_norm_f32_vs_f64"].as_f64().unwrap();
            check(
                &models.join(name),
                &format!("{backend} {name}"),
                10.0 * floor,
                &device,
            );
        }
    }
}

fn check(folder: &std::path::Path, what: &str, relative: f64, device: &Device) {
    let device = device.clone().autodiff();
    let unet = UNet::from_folder(folder, &device).unwrap();
    let case = Golden::read(&folder.join("case00.safetensors"));
    let expected = Golden::read(&folder.join("grad_case00.safetensors"));
    let norms = json(&folder.join("grad_case00_norms.json"));

    let input = input(&case, &device);
    let (sample, context) = (input.sample.clone(), input.context.clone().unwrap());
    let target: Tensor<4> = expected.tensor("target", &device);
    let loss = (unet.forward(input) - target).square().mean();
    let ours = f64::from(numbers(&loss)[0]);
    let torch = norms["loss"].as_f64().unwrap();
    assert!(
        (ours - torch).abs() <= 1e-6 * torch,
        "{what}: loss {ours}, torch {torch}"
    );

    let gradients = loss.backward();
    let near = |name: &str, ours: &[f32], torch: &[f32]| {
        let allowed = relative * norm(torch);
        let worst = difference(ours, torch);
        assert!(
            worst <= allowed,
            "{what} {name}: {worst:e}, allowed {allowed:e}"
        );
    };
    near(
        "sample",
        &numbers(&sample.grad(&gradients).unwrap()),
        &expected.f32s("grad_in::sample"),
    );
    near(
        "context",
        &numbers(&context.grad(&gradients).unwrap()),
        &expected.f32s("grad_in::encoder_hidden_states"),
    );

    let written = tempfile::tempdir().unwrap();
    let path = written.path().join("gradients.safetensors");
    let module = unet.map(&mut GradientsOf(&gradients));
    weights::save(&module, Layout::Diffusers, &path).unwrap();
    let ours = Golden::read(&path);
    let norms = norms["l2_norm_of_grad"].as_object().unwrap();
    assert_eq!(
        ours.names().count(),
        norms.len(),
        "{what}: every parameter has a gradient"
    );
    for (name, torch) in norms {
        let (ours, torch) = (norm(&ours.f32s(name)), torch.as_f64().unwrap());
        assert!(
            (ours - torch).abs() <= relative * torch,
            "{what} {name}: {ours} {torch}"
        );
    }
    for name in expected
        .names()
        .filter_map(|name| name.strip_prefix("grad::"))
    {
        near(
            name,
            &ours.f32s(name),
            &expected.f32s(&format!("grad::{name}")),
        );
    }
}
