//! Generates a labelled radar image from a sentence with the diffusion model:
//! `cargo run --release --example generate -- "a ship at 8 m/s toward 135 degrees, wind 5 m/s"`.

use std::path::Path;

use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::Device;
use wake_physics::output;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let prompt = std::env::args().nth(1).unwrap_or_else(|| {
        "a ship at 10 m/s toward 120 degrees, wind 3 m/s toward 60 degrees".to_owned()
    });
    // The weights are part of the crate.
    let sampler = WakeSampler::pretrained(&Device::default())?;
    let image = sampler.sample(&prompt, 7)?;
    println!("{}", wake_text::prompt(&image.scene)?);
    for ship in &image.labels.ships {
        println!("wake from pixel {:.0?}", ship.wake.tip_px);
    }
    let out = Path::new("out/generate");
    std::fs::create_dir_all(out)?;
    let [rows, columns] = [image.grey.rows, image.grey.columns];
    output::write_png(&out.join("image.png"), &image.levels(), rows, columns)?;
    std::fs::write(
        out.join("labels.json"),
        serde_json::to_string_pretty(&image.labels)?,
    )?;
    println!("image.png and labels.json in {}", out.display());
    Ok(())
}
