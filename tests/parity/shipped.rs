//! The shipped weights draw and find what they did when they were made: images of 8 bits stand in `tests/fixtures/own/shipped`.
//!
//! Processors with other vectors add in other orders and take other convolutions by tiles, so that numbers differ by rounding:
//! 2⁻²⁴ of a value in each of some hundred sums one after the other, 10⁻⁴ of the range if all roundings had one sign. That is
//! 0.03 of a level: a level changes by one at most, and only where the number lies so close to the border of two.
//! `DRAW=1 cargo test --test parity shipped` writes the images anew.

use std::path::Path;

use burn::tensor::Device;
use wake_ldm::WakeSampler;
use wake_ldm::sampler::PromptMode;

/// Largest share of the pixels whose level may differ: those within 0.03 levels of a border, on either side.
const AT_BORDERS: f64 = 0.06;

/// Compares numbers from 0 to 1 with a stored picture.
fn agree(name: &str, values: impl Iterator<Item = f32>, columns: usize) {
    let levels: Vec<u8> = values.map(|x| (255.0 * x).round() as u8).collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/own/shipped");
    let (path, rows) = (folder.join(name), levels.len() / columns);
    if std::env::var_os("DRAW").is_some() {
        std::fs::create_dir_all(&folder).unwrap();
        wake_physics::output::write_png(&path, &levels, rows, columns).unwrap();
    }
    let stored = image::open(&path).unwrap().into_luma8();
    assert_eq!(stored.dimensions(), (columns as u32, rows as u32), "{name}");
    let differences = stored.iter().zip(&levels).map(|(a, b)| a.abs_diff(*b));
    let largest = differences.clone().max().unwrap();
    let share = differences.filter(|&d| d > 0).count() as f64 / levels.len() as f64;
    println!("{name}: {share:.4} of the pixels differ, by {largest} levels at most");
    assert!(largest <= 1, "{name}: a level differs by {largest}");
    assert!(
        share <= AT_BORDERS,
        "{name}: {share:.4} of the pixels differ"
    );
}

#[test]
fn shipped_weights_draw_the_stored_images() {
    let sampler = WakeSampler::pretrained(&Device::flex()).unwrap();
    let prompt = "a ship at 10 m/s toward 120 degrees, wind 3 m/s toward 60 degrees";
    let image = sampler.sample(prompt, 7).unwrap();
    agree(
        "ship.png",
        image.grey.values.into_iter(),
        image.grey.columns,
    );
    // The network that reads prompts takes part here.
    let by_words = sampler.clone().with_prompt_mode(PromptMode::Words);
    let mut scene = sampler.base_scene();
    (scene.sea.wind_speed, scene.sea.wind_toward, scene.seed) = (6.0, 250.0, 5);
    let image = by_words.sample_scenes(&[scene]).unwrap().swap_remove(0);
    agree(
        "words.png",
        image.grey.values.into_iter(),
        image.grey.columns,
    );
}

#[cfg(feature = "detector")]
#[test]
fn shipped_weights_map_a_stored_image_to_the_stored_maps() {
    use burn::tensor::{Tensor, TensorData};
    use wake_detector::network::{INPUTS, Network, OUTPUTS, STRIDE};
    use wake_detector::normalize;
    use wake_nn::weights::{Layout, load};

    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let device = Device::flex();
    let file = root.join("crates/wake-detector/assets/detector.safetensors");
    let network = load(Network::new(&device), Layout::Diffusers, &file).unwrap();
    let image = image::open(root.join("tests/fixtures/own/shipped/ship.png")).unwrap();
    let (columns, rows) = (image.width() as usize, image.height() as usize);
    let pixels: Vec<f32> = image.into_luma8().iter().map(|&x| f32::from(x)).collect();
    let contrast = normalize::contrast(&pixels, rows, columns);
    let seen: Vec<[f32; INPUTS]> = contrast.into_iter().map(normalize::inputs).collect();
    let inputs = (0..INPUTS).flat_map(|k| seen.iter().map(move |x| x[k]));
    let inputs = TensorData::new(inputs.collect::<Vec<f32>>(), [1, INPUTS, rows, columns]);
    let maps = network.forward(Tensor::from_data(inputs, &device));
    assert_eq!(maps.dims(), [1, OUTPUTS, rows / STRIDE, columns / STRIDE]);
    // Logits and lengths beyond ±8 are as good as ±8.
    let levels = maps
        .into_data()
        .iter::<f32>()
        .map(|x| 0.5 + 0.5 * (0.25 * x).tanh())
        .collect::<Vec<_>>();
    agree("maps.png", levels.into_iter(), columns / STRIDE);
}
