//! Simulates a labelled radar image of a scene: `cargo run --release --no-default-features --example simulate`.

use std::path::Path;

use wake_physics::{Scene, Simulator};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Arguments are keys of a scene file, such as `ship.speed=8`.
    let changes: Vec<String> = std::env::args().skip(1).collect();
    let scene = Scene::default()
        .with_assignments(&["sea.wind_speed=3"])?
        .with_assignments(&changes)?;
    // A simulator reuses plans and memory for the next scene of the same size.
    let mut simulator = Simulator::default();
    let simulation = simulator.simulate(&scene)?;
    println!("{}", simulation.plan);
    for ship in &simulation.labels.ships {
        println!("wake from pixel {:.0?}", ship.wake.tip_px);
    }
    let out = Path::new("out/simulate");
    simulation.write_in(out, &simulation.quick_look())?;
    println!(
        "image.png, labels.json, fields.safetensors and report.json in {}",
        out.display()
    );
    Ok(())
}
