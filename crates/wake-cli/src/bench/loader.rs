//! Images per second of the data set loader, as in a training loop.

use serde::Serialize;
use std::sync::Arc;
use std::time::{Duration, Instant};
use wake_dataset::{Loader, Recipe, Simulated, Source};
use wake_ldm::{Sampled, WakeSampler};
use wake_nn::device_named;

use crate::exit::Outcome;

/// Numbers of threads that make batches, limited by the number of cores; each computes the physics of one batch while
/// the device draws another.
const THREADS: [usize; 5] = [1, 2, 4, 8, 16];
/// Images per batch.
const BATCH: usize = 16;
/// Least time that is measured, with at least a batch of each thread, after as many warm-up batches.
const LEAST: Duration = Duration::from_secs(5);
/// Seed of both sources, which draw scenes of the recipe `satellites`.
const SEED: u64 = 3;

/// Speed of one source through the loader.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LoaderRow {
    pub(crate) stage: &'static str,
    /// Source of the images, the simulator or the model, with the same scenes.
    pub(crate) source: &'static str,
    /// Device of the model and of the batches.
    pub(crate) device: String,
    pub(crate) threads: usize,
    pub(crate) batch: usize,
    pub(crate) images_per_second: f64,
}

/// Number of calls of `done` in [`measure`].
pub(crate) fn parts() -> u64 {
    2 * threads().count() as u64
}

/// Entries of [`THREADS`] that this machine has cores for.
fn threads() -> impl Iterator<Item = usize> {
    let cores = rayon::current_num_threads();
    THREADS.into_iter().filter(move |&threads| threads <= cores)
}

/// Measures all rows and calls `done` after each.
pub(crate) fn measure(device: &str, done: impl Fn()) -> Outcome<Vec<LoaderRow>> {
    let scenes = Simulated::new(Recipe::satellites()?, SEED)?;
    let sampler = WakeSampler::pretrained(&device_named(device)?)?;
    let sampled = Sampled::new(sampler, scenes.clone())?;
    let sources: [(_, Arc<dyn Source>); 2] = [
        ("simulator", Arc::new(scenes)),
        ("model", Arc::new(sampled)),
    ];
    let mut rows = Vec::new();
    for (name, source) in sources {
        for threads in threads() {
            rows.push(LoaderRow {
                stage: "loader",
                source: name,
                device: device.to_owned(),
                threads,
                batch: BATCH,
                images_per_second: images_per_second(Arc::clone(&source), threads, device)?,
            });
            done();
        }
    }
    Ok(rows)
}

/// Images per second of a loop that does nothing with them.
fn images_per_second(source: Arc<dyn Source>, threads: usize, device: &str) -> Outcome<f64> {
    let loader = Loader::new(source).batch(BATCH).threads(threads);
    let mut batches = loader.on(&device_named(device)?)?;
    for batch in batches.by_ref().take(threads) {
        batch?;
    }
    let begin = Instant::now();
    let mut made = 0;
    for batch in batches {
        batch?;
        made += 1;
        if made >= threads && begin.elapsed() >= LEAST {
            break;
        }
    }
    Ok((BATCH * made) as f64 / begin.elapsed().as_secs_f64())
}

/// Markdown table of images per second by number of threads.
pub(crate) fn table(rows: &[LoaderRow]) -> String {
    let cores = rayon::current_num_threads();
    let mut text =
        format!("{cores} cores, batches of {BATCH}; images per second.\n\n| images of | device |");
    for threads in threads() {
        text += &format!(" threads {threads} |");
    }
    text += &format!("\n| --- | --- |{}\n", " --- |".repeat(threads().count()));
    for of_source in rows.chunk_by(|a, b| a.source == b.source) {
        text += &format!("| {} | {} |", of_source[0].source, of_source[0].device);
        for row in of_source {
            text += &format!(" {:.1} |", row.images_per_second);
        }
        text += "\n";
    }
    text
}
