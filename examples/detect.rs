//! Finds the wakes in an image file, or in a simulated image: `cargo run --release --example detect -- FILE`.

use wake_detector::drawing::Drawing;
use wake_detector::{Detector, GreyImage};
use wake_nn::burn::tensor::Device;
use wake_physics::{Scene, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let image = match std::env::args().nth(1) {
        Some(file) => GreyImage::read(file.as_ref())?,
        None => simulated()?,
    };
    let detector = Detector::pretrained(&Device::default())?;
    let mut found = detector.find(&image);
    found.retain(|one| one.sure);
    for one in &found {
        let ([column, row], axis) = (one.wake.tip, one.wake.axis_deg);
        let probability = one.probability.unwrap_or(one.score);
        println!("{probability:.2}: from ({column:.0}, {row:.0}) toward {axis:.0} degrees");
    }
    let mut drawing = Drawing::new(&image);
    drawing.found(found.iter());
    std::fs::create_dir_all("out/detect")?;
    drawing.into_picture().save("out/detect/wakes.png")?;
    println!("{} wakes, drawn in out/detect/wakes.png", found.len());
    Ok(())
}

/// A ship under light wind.
fn simulated() -> Result<GreyImage, Box<dyn std::error::Error>> {
    let scene = Scene::default().with_assignments(&[
        "grid.rows=256",
        "grid.columns=256",
        "grid.spacing=4",
        "sea.wind_speed=4",
        "ship.heading=200",
        "ship.position=[-120, -250]",
    ])?;
    let simulation = simulate(&scene)?;
    let levels = simulation.levels(&simulation.quick_look());
    Ok(GreyImage::eight_bits(256, 256, levels)?)
}
