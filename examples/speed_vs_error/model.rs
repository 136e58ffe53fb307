//! The model: steps, batch size and rounded weights against many steps from the same noise.

use crate::rounding::{Rounding, rounded};
use crate::row::{Errors, Row, median_seconds, seconds};
use burn::tensor::Device;
use serde::Serialize;
use std::error::Error;
use wake_ldm::WakeSampler;
use wake_physics::measure::{Binning, radial_spectrum};
use wake_physics::{Field, Scene};

/// Steps of the reference.
const REFERENCE: usize = 100;
/// Numbers of steps; each image alone, weights as they ship.
const STEPS: [usize; 5] = [1, 2, 4, 8, 16];
/// Images at a time, at the sampler's own number of steps.
const BATCHES: [usize; 2] = [4, 16];
/// Runs of which the median counts.
const RUNS: usize = 3;
/// Smallest power of a ring, so that a constant image has a logarithm.
const LEAST_POWER: f64 = 1e-6;

/// One way to draw images against the reference.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ModelRow {
    /// Seconds are those of one image; the oracle is the same model with [`REFERENCE`] steps, one image at a time.
    /// Errors are those of grey, relative to the reference's standard deviation.
    #[serde(flatten)]
    pub(crate) row: Row,
    /// Steps from noise to image.
    pub(crate) steps: usize,
    /// How a step is made.
    pub(crate) sampler: &'static str,
    /// Bits of the weights; all arithmetic is in f32.
    pub(crate) precision: &'static str,
    /// Images at a time.
    pub(crate) batch: usize,
    /// Largest difference of the mean radial spectrum up to half the Nyquist frequency \[dB\].
    pub(crate) spectrum_db: f64,
}

/// All rows; `done` hears of each.
pub(crate) fn measure(done: impl Fn()) -> Result<Vec<ModelRow>, Box<dyn Error>> {
    let sampler = WakeSampler::pretrained(&Device::default())?;
    let own = sampler.steps();
    let scenes = scenes(&sampler);
    let many = sampler.clone().with_steps(REFERENCE)?;
    let (whole, images) = seconds(|| draw(&many, &scenes, 1));
    let reference = Reference {
        seconds: whole / scenes.len() as f64,
        images: images?,
        scenes,
    };
    done();
    let mut rows = Vec::new();
    let mut add = |sampler: &WakeSampler, precision, batch| -> Result<(), Box<dyn Error>> {
        rows.push(reference.row(sampler, precision, batch)?);
        done();
        Ok(())
    };
    for steps in STEPS {
        add(&sampler.clone().with_steps(steps)?, "f16", 1)?;
    }
    for batch in BATCHES {
        add(&sampler.clone().with_steps(own)?, "f16", batch)?;
    }
    for rounding in Rounding::ALL {
        let sampler = rounded(rounding)?.with_steps(own)?;
        add(&sampler, rounding.name(), 1)?;
    }
    Ok(rows)
}

/// Number of times that [`measure`] says it has done something.
pub(crate) const PARTS: usize = 1 + STEPS.len() + BATCHES.len() + Rounding::ALL.len();

/// Four seas with ships of other speeds and headings.
fn scenes(sampler: &WakeSampler) -> Vec<Scene> {
    let values = [
        (45.0, 10.0, 5.0, 90.0, 32.0),
        (135.0, 7.0, 3.0, 200.0, 25.0),
        (250.0, 12.0, 6.5, 320.0, 18.0),
        (330.0, 8.5, 4.0, 20.0, 29.0),
    ];
    let scene = |(heading, speed, wind_speed, wind_toward, incidence)| {
        let mut scene = sampler.base_scene();
        for ship in &mut scene.ships {
            (ship.heading, ship.speed) = (heading, speed);
        }
        (scene.sea.wind_speed, scene.sea.wind_toward) = (wind_speed, wind_toward);
        scene.radar.incidence = incidence;
        scene
    };
    values.map(scene).to_vec()
}

/// Draws the scenes, again from the first where a batch has more; image k has the seed k, whatever the batch.
fn draw(sampler: &WakeSampler, scenes: &[Scene], batch: usize) -> wake_ldm::Result<Vec<Field>> {
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

struct Reference {
    scenes: Vec<Scene>,
    images: Vec<Field>,
    /// For one image.
    seconds: f64,
}

impl Reference {
    fn row(
        &self,
        sampler: &WakeSampler,
        precision: &'static str,
        batch: usize,
    ) -> Result<ModelRow, Box<dyn Error>> {
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

    /// Over all images together.
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

    /// The largest difference of the mean spectra in dB.
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

/// The rows of the steps alone, for a plot.
pub(crate) fn steps(rows: &[ModelRow]) -> Vec<Row> {
    let steps = rows.iter().take(STEPS.len());
    steps.map(|row| row.row.clone()).collect()
}

/// The rows as a table in Markdown.
pub(crate) fn table(rows: &[ModelRow]) -> String {
    let mut text =
        "| steps | sampler | weights | batch | ms per image | ratio | max error | rms error | spectrum dB |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
            .to_owned();
    for r in rows {
        text += &format!(
            "| {} | {} | {} | {} | {:.1} | {:.1} | {:.1e} | {:.1e} | {:.2} |\n",
            r.steps,
            r.sampler,
            r.precision,
            r.batch,
            1e3 * r.row.fast_seconds,
            r.row.ratio,
            r.row.max_error,
            r.row.rms_error,
            r.spectrum_db
        );
    }
    let reference = rows.first().map_or(0.0, |r| r.row.oracle_seconds);
    text + &format!("\nReference: {REFERENCE} steps, {reference:.2} s per image.\n")
}
