//! Autoencoders run tile by tile, against diffusers.

use wake_ldm::autoencoder::{AutoencoderKl, Tiling};

use crate::golden::{Golden, devices, expect, json, numbers, own_folder};

/// Every tile is as near as the whole model, and fading between two tiles adds nothing: ten times the noise
/// floor of the fixtures' autoencoders.
#[test]
fn tiles_are_cut_and_joined_as_diffusers_does() {
    let folder = own_folder().join("tiling");
    let manifest = json(&folder.join("manifest.json"));
    let model = manifest["model"].as_str().unwrap();
    let model = own_folder().with_file_name("models").join(model);
    let cases = manifest["cases"].as_object().unwrap();
    assert!(!cases.is_empty(), "no cases in {}", folder.display());
    for (backend, device) in devices() {
        let vae = AutoencoderKl::from_folder(&model, &device).unwrap();
        for (name, case) in cases {
            let golden = Golden::read(&folder.join(format!("{name}.safetensors")));
            let tiling = Tiling {
                tile: case["tile"].as_u64().unwrap() as usize,
                overlap: case["overlap"].as_f64().unwrap(),
            };
            let posterior = vae.encode_tiled(golden.tensor("image", &device), tiling);
            let moments = golden.f32s("moments");
            let means = numbers(&posterior.mode());
            let per_image = means.len() / golden.shape("image")[0];
            for (ours, both) in means.chunks(per_image).zip(moments.chunks(2 * per_image)) {
                let what = format!("{backend} {name}, means");
                expect(&what, ours, &both[..per_image], 3e-5);
            }
            let decoded = vae.decode_tiled(golden.tensor("z", &device), tiling);
            assert_eq!(decoded.dims().to_vec(), golden.shape("decoded"), "{name}");
            let what = format!("{backend} {name}, decoded");
            expect(&what, &numbers(&decoded), &golden.f32s("decoded"), 3e-5);
        }
    }
}
