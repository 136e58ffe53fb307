//! Feeds the loader from a source of your own: here a quarter of the images is open sea upside down.
//! `cargo run --release --example own_source`.

use std::ops::Range;
use std::sync::Arc;

use wake_dataset::{Loader, Mixture, Pair, Recipe, Result, Simulated, Source};
use wake_nn::burn::tensor::Device;

/// Images of open sea, upside down.
#[derive(Debug)]
struct Mirrored(Simulated);

impl Source for Mirrored {
    fn size(&self) -> [usize; 2] {
        self.0.size()
    }

    /// Depends only on the position, so that a run can be stopped and continued with any number of threads.
    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        let mut pairs = self.0.items(positions)?;
        for Pair { image, .. } in &mut pairs {
            let rows = image.pixels.chunks(image.columns).rev();
            image.pixels = rows.flatten().copied().collect();
        }
        Ok(pairs)
    }
}

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let size = ["scene.grid.rows = 64", "scene.grid.columns = 64"];
    let ships = Recipe::default().with_assignments(&size)?;
    let sea = ships.with_assignments(&["draw.count = 0"])?;
    // Three images with ships for every image of open sea.
    let source = Mixture::new(vec![
        (3.0, Arc::new(Simulated::new(ships, 1)?)),
        (1.0, Arc::new(Mirrored(Simulated::new(sea, 2)?))),
    ])?;
    let loader = Loader::new(source).batch(4).threads(2);
    for batch in loader.on(&Device::default())?.take(3) {
        let batch = batch?;
        let objects: Vec<usize> = batch.objects.iter().map(Vec::len).collect();
        println!("images {:?}, objects {objects:?}", batch.images.dims());
    }
    Ok(())
}
