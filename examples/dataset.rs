//! Writes a small labelled data set and reads it back: `cargo run --release --example dataset`.

use std::path::Path;

use wake_dataset::{Folder, Manifest, Recipe, write};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let recipe = Recipe::detector()?.with_assignments(&[
        "scene.grid.rows = 128",
        "scene.grid.columns = 128",
        "draw.\"sea.wind_speed\" = [3.0, 6.0]",
    ])?;
    let manifest = Manifest::new(recipe, 7, 12)?.with_val_share(0.25)?;
    // Writes PNG images, prompts, and boxes for YOLO, COCO and DOTA; a second run continues where the first one
    // stopped.
    let out = Path::new("out/dataset");
    write(out, &manifest, &manifest.source()?, 2, |progress| {
        println!("{} of {} images", progress.done, progress.total);
    })?;
    let folder = Folder::open(out)?;
    let pair = folder.pair(0)?;
    println!("image 0: {}", pair.prompt);
    println!("objects: {:?}", pair.labels.objects());
    println!("{} images in {}", folder.len(), out.display());
    Ok(())
}
