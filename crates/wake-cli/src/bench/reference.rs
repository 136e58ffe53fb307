//! Reference images of the model with many steps, and comparisons with images of the same noise.

use super::model_row::ModelRow;
use super::row::{Errors, Row, median_seconds};
use wake_ldm::WakeSampler;
use wake_physics::measure::{Binning, radial_spectrum};
use wake_physics::{Field, Scene};

use crate::exit::Outcome;

/// Timed runs, of which the median is reported.
const RUNS: usize = 3;
/// Smallest power of a ring, which keeps logarithms of constant images finite.
const LEAST_POWER: f64 = 1e-6;

/// The same model with many steps, one image at a time.
pub(crate) struct Reference {
    pub(crate) scenes: Vec<Scene>,
    pub(crate) images: Vec<Field>,
    /// Seconds per image.
    pub(crate) seconds: f64,
}

impl Reference {
    /// Compares a sampler with the reference.
    pub(crate) fn row(
        &self,
        sampler: &WakeSampler,
        precision: &'static str,
        batch: usize,
    ) -> Outcome<ModelRow> {
        let (seconds, images) = median_seconds(RUNS, || draw(sampler, &self.scenes, batch));
        let images = images?;
        let seconds = seconds / images.len() as f64;
        let errors = self.errors(&images);
        Ok(ModelRow {
            row: Row {
                stage: "model",
                size: self.images[0].rows,
                tolerance: None,
                fast_seconds: seconds,
                oracle_seconds: self.seconds,
                pixels: self.images[0].values.len(),
                matrix_product_seconds: None,
                ratio: self.seconds / seconds,
                max_error: errors.max,
                rms_error: errors.rms,
            },
            steps: sampler.steps(),
            sampler: "euler",
            precision,
            batch,
            spectrum_db: self.spectrum_db(&images),
        })
    }

    /// Errors over all images together.
    fn errors(&self, images: &[Field]) -> Errors {
        let all = |images: &[Field]| -> Vec<f64> {
            let values = images.iter().flat_map(|image| &image.values);
            values.map(|&v| f64::from(v)).collect()
        };
        let exact = all(&self.images);
        let squares: f64 = self
            .images
            .iter()
            .map(|image| {
                let mean = image.mean();
                let values = image.values.iter();
                values.map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>()
            })
            .sum();
        let deviation = (squares / exact.len() as f64).sqrt();
        Errors::of(all(images).into_iter(), &exact, deviation)
    }

    /// Largest difference of the mean spectra \[dB\].
    fn spectrum_db(&self, images: &[Field]) -> f64 {
        let half = self.images[0].rows.min(self.images[0].columns) / 4;
        let mut difference = vec![0.0; half + 1];
        for (reference, image) in self.images.iter().zip(images) {
            let [of_reference, of_image] =
                [reference, image].map(|field| radial_spectrum(field, Binning::Round).power);
            for (ring, sum) in difference.iter_mut().enumerate() {
                let ratio = of_image[ring].max(LEAST_POWER) / of_reference[ring].max(LEAST_POWER);
                *sum += 10.0 * ratio.log10() / self.images.len() as f64;
            }
        }
        // Ring 0 is the mean.
        difference[1..]
            .iter()
            .fold(0.0, |most, d| most.max(d.abs()))
    }
}

/// Draws the scenes, repeated if a batch is larger; image k has the seed k, whatever the batch size.
pub(crate) fn draw(
    sampler: &WakeSampler,
    scenes: &[Scene],
    batch: usize,
) -> wake_ldm::Result<Vec<Field>> {
    let count = scenes.len().max(batch);
    let seeded = |(seed, scene): (u64, &Scene)| Scene {
        seed,
        ..scene.clone()
    };
    let all: Vec<Scene> = (0..)
        .zip(scenes.iter().cycle().take(count))
        .map(seeded)
        .collect();
    let mut images = Vec::with_capacity(count);
    for scenes in all.chunks(batch) {
        let drawn = sampler.sample_scenes(scenes)?;
        images.extend(drawn.into_iter().map(|image| image.grey));
    }
    Ok(images)
}
