//! Uses the wake model as the data source of your own training loop: a layer learns to mark where a wake begins.
//! `cargo run --release --example training_loop -- STEPS`.

use wake_dataset::{Batch, Loader, Recipe, Simulated};
use wake_ldm::{Sampled, WakeSampler};
use wake_nn::burn::nn::conv::{Conv2d, Conv2dConfig};
use wake_nn::burn::optim::{AdamWConfig, GradientsParams};
use wake_nn::burn::tensor::{Device, Tensor, TensorData};

/// Rows and columns of the images.
const SIZE: usize = 256;
/// Images per batch.
const BATCH: usize = 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let steps: usize = std::env::args().nth(1).map_or(Ok(20), |n| n.parse())?;
    // The model draws the images of the scenes; to simulate the images instead, put the scenes into the loader
    // directly.
    let scenes = Simulated::new(Recipe::default(), 1)?;
    let sampler = WakeSampler::pretrained(&Device::default())?;
    let source = Sampled::new(sampler, scenes)?;
    let device = Device::default().autodiff();
    // Batch number n is always the same, so `start(n)` continues a run.
    let loader = Loader::new(source).batch(BATCH).threads(2).start(0);
    let mut model: Conv2d = Conv2dConfig::new([1, 1], [5, 5]).init(&device);
    let mut optimizer = AdamWConfig::new().init();
    for (step, batch) in loader.on(&device)?.take(steps).enumerate() {
        let batch = batch?;
        let seen = model.forward(batch.images.clone());
        let [_, _, rows, columns] = seen.dims();
        let wanted = tips(&batch, &device).slice([0..BATCH, 0..1, 0..rows, 0..columns]);
        let loss = (seen - wanted).square().mean();
        println!("step {step}: loss {:.4}", loss.clone().into_scalar::<f32>());
        let gradients = GradientsParams::from_grads(loss.backward(), &model);
        model = optimizer.step(1e-2, model, gradients);
    }
    Ok(())
}

/// Target: one where a wake begins, zero elsewhere, `[batch, 1, rows, columns]`.
fn tips(batch: &Batch, device: &Device) -> Tensor<4> {
    let mut tips = vec![0.0f32; BATCH * SIZE * SIZE];
    for (image, objects) in batch.objects.iter().enumerate() {
        for [column, row] in objects.iter().filter_map(|object| object.tip) {
            let [row, column] = [row, column].map(|at| (at as usize).min(SIZE - 1));
            tips[(image * SIZE + row) * SIZE + column] = 1.0;
        }
    }
    Tensor::from_data(TensorData::new(tips, [BATCH, 1, SIZE, SIZE]), device)
}
