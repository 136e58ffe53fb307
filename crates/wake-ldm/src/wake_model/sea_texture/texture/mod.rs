//! A learnt sea: its flow, the styles from which it was learnt, and sampling.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use wake_physics::{Field, Scene, available_memory, expected_intensity};

use super::flow::{MULTIPLE, SeaFlow};
use super::style::{LAGS, NUMBERS, SeaStyle};
use crate::error::{Error, Result};
use crate::streams;
use wake_nn::check_range;
use wake_nn::noise::NoiseSource;
use wake_nn::weights::files::WeightFiles;
use wake_nn::weights::{Layout, Precision, load, save_noted};

/// Number of styles of a learnt sea.
const STYLES: usize = 64;
/// Number of steps from noise to amplitude.
const STEPS: usize = 4;
/// Margin in pixels that is sampled around an image and cut off, because the network sees zeros beyond it.
const MARGIN: usize = 32;
/// Memory per pixel during sampling \[bytes\]: the network's widest layers, the noise and its transform, rounded up.
const BYTES_OF_A_PIXEL: u64 = 400;
/// Largest ratio between the pixel sizes of a scene and of the learnt sea (chosen).
const LARGEST_RATIO: f64 = 1.25;
/// Header entry with the side of a pixel.
const SPACING: &str = "spacing";

/// Sea learnt from images, which samples amplitude with the speckle of their sensors.
///
/// Each image has the style of one of the training patches, selected by the image's seed. Amplitude is proportional to the
/// grey of the images; if their black was not an amplitude of 0, it is off by that offset.
#[derive(Debug, Clone)]
pub struct SeaTexture {
    flow: SeaFlow,
    styles: Vec<SeaStyle>,
    spacing: Option<f64>,
}

/// A learnt sea as stored in a file.
#[derive(Module, Debug)]
struct Stored {
    flow: SeaFlow,
    /// `[STYLES, NUMBERS]`
    numbers: Param<Tensor<2>>,
    /// `[STYLES, LAGS + 1, 2 LAGS + 1]`
    correlations: Param<Tensor<3>>,
}

impl SeaTexture {
    /// Makes a sea from a flow and some styles, of which 64 are kept.
    ///
    /// - `spacing`: side of the training pixels \[m\], if known
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] without styles, [`wake_nn::Error::OutOfRange`] for a pixel below 0.1 or above 1000 m.
    pub fn new(flow: SeaFlow, styles: &[SeaStyle], spacing: Option<f64>) -> Result<Self> {
        if let Some(spacing) = spacing {
            check_range("spacing", spacing, 0.1, 1000.0)?;
        }
        if styles.is_empty() {
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "styles".to_owned(),
                value: "an empty list".to_owned(),
                expected: "the style of at least one patch of open sea".to_owned(),
            }));
        }
        #[cfg(feature = "autodiff")]
        let flow = flow.valid();
        // Evenly selected from all styles, or repeated from the first if there are fewer.
        let at = |n: usize| match styles.len() {
            count if count < STYLES => n % count,
            count => n * count / STYLES,
        };
        Ok(Self {
            flow,
            styles: (0..STYLES).map(|n| styles[at(n)].clone()).collect(),
            spacing,
        })
    }

    /// Reads a file that [`save`](Self::save) wrote.
    ///
    /// # Errors
    ///
    /// As [`load`] for a file that is missing, broken or from another model; [`wake_nn::Error::InvalidOption`] with the
    /// value for a style or a pixel that is out of range.
    pub fn load(path: &Path, device: &Device) -> Result<Self> {
        let empty = Stored {
            flow: SeaFlow::new(device),
            numbers: Param::from_tensor(Tensor::zeros([STYLES, NUMBERS], device)),
            correlations: Param::from_tensor(Tensor::zeros(
                [STYLES, LAGS + 1, 2 * LAGS + 1],
                device,
            )),
        };
        let stored = load(empty, Layout::Diffusers, path)?;
        let numbers: Vec<f32> = stored.numbers.val().into_data().iter::<f32>().collect();
        let correlations = stored.correlations.val().into_data();
        let correlations: Vec<f32> = correlations.iter::<f32>().collect();
        let rows = numbers.chunks(NUMBERS);
        let rows = rows.zip(correlations.chunks((LAGS + 1) * (2 * LAGS + 1)));
        let broken = |what: String| {
            Error::Model(wake_nn::Error::InvalidOption {
                option: path.display().to_string(),
                value: format!("not a learnt sea ({what})"),
                expected: "a file written by `wake train sea`".to_owned(),
            })
        };
        let style = |(n, (numbers, correlation)): (usize, (&[f32], &[f32]))| {
            SeaStyle::of_rows(numbers, correlation).map_err(|e| broken(format!("style {n}: {e}")))
        };
        let styles = rows.enumerate().map(style).collect::<Result<Vec<_>>>()?;
        let files = WeightFiles::open(path)?;
        let spacing = files.note(SPACING).map(str::parse).transpose();
        let spacing = spacing.map_err(|e| broken(format!("{SPACING}: {e}")))?;
        Self::new(stored.flow, &styles, spacing).map_err(|e| broken(e.to_string()))
    }

    /// Writes flow, styles and the side of a pixel into one file, in 16 bits.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] when the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let device = self.flow.devices().into_iter().next().unwrap_or_default();
        let numbers: Vec<f32> = self.styles.iter().flat_map(|s| *s.numbers()).collect();
        let correlations = self.styles.iter().flat_map(SeaStyle::correlations);
        let correlations: Vec<f32> = correlations.copied().collect();
        let numbers = TensorData::new(numbers, [STYLES, NUMBERS]);
        let correlations = TensorData::new(correlations, [STYLES, LAGS + 1, 2 * LAGS + 1]);
        let stored = Stored {
            flow: self.flow.clone(),
            numbers: Param::from_tensor(Tensor::from_data(numbers, &device)),
            correlations: Param::from_tensor(Tensor::from_data(correlations, &device)),
        };
        let spacing = self.spacing.map(|spacing| spacing.to_string());
        let note = spacing.as_ref().map(|spacing| (SPACING, spacing.as_str()));
        let precision = Precision::F16;
        Ok(save_noted(
            &stored,
            Layout::Diffusers,
            path,
            precision,
            note,
        )?)
    }

    /// Side of the training pixels \[m\], if known.
    pub fn spacing(&self) -> Option<f64> {
        self.spacing
    }

    /// Styles from which images are sampled.
    pub fn styles(&self) -> &[SeaStyle] {
        &self.styles
    }

    /// Checks that a pixel size is within a quarter of the training images' pixel size. If the latter is unknown, any size passes.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for another size.
    pub fn check_spacing(&self, spacing: f64) -> Result<()> {
        match self.spacing {
            Some(learnt) if (spacing / learnt).max(learnt / spacing) > LARGEST_RATIO => {
                Err(Error::Model(wake_nn::Error::InvalidOption {
                    option: "grid.spacing".to_owned(),
                    value: format!("{spacing} m"),
                    expected: format!(
                        "{:.3} to {:.3} m, within a quarter of the learnt sea's {learnt} m; train on images of your \
                         spacing, or without a spacing",
                        learnt / LARGEST_RATIO,
                        learnt * LARGEST_RATIO
                    ),
                }))
            }
            _ => Ok(()),
        }
    }

    /// Samples a sea: intensity of mean 1 with its speckle, in the style selected by the seed.
    ///
    /// Opposite edges are independent. With the same seed, images of different sizes have different seas.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] without rows or columns, [`wake_nn::Error::InvalidOption`] for an image that does
    /// not fit in
    /// memory, [`wake_nn::Error::NotFinite`] for weights whose numbers overflow.
    pub fn sample(&self, seed: u64, rows: usize, columns: usize) -> Result<Field> {
        let draw = NoiseSource::new(seed).uniform(streams::STYLES, 0);
        let style = &self.styles[(draw * STYLES as f64) as usize];
        let mut sea = self.amplitude(style, seed, rows, columns)?;
        sea.values.iter_mut().for_each(|a| *a *= *a);
        let mean = sea.mean();
        if mean > 0.0 {
            let factor = (1.0 / mean) as f32;
            sea.values.iter_mut().for_each(|i| *i *= factor);
        }
        Ok(sea)
    }

    /// Samples amplitudes of a sea in a style, divided by their median.
    ///
    /// # Errors
    ///
    /// As [`sample`](Self::sample).
    pub fn amplitude(
        &self,
        style: &SeaStyle,
        seed: u64,
        rows: usize,
        columns: usize,
    ) -> Result<Field> {
        check_size(rows, columns)?;
        let device = self.flow.devices().into_iter().next().unwrap_or_default();
        let [high, wide] = [rows, columns].map(|n| (n + 2 * MARGIN).next_multiple_of(MULTIPLE));
        let noise = style.noise(NoiseSource::new(seed), high, wide);
        let data = TensorData::new(noise.values, [1, 1, high, wide]);
        let mut x: Tensor<4> = Tensor::from_data(data, &device);
        let features: Tensor<2> = Tensor::from_data([style.features()], &device);
        for step in 0..STEPS {
            let sigma = 1.0 - step as f64 / STEPS as f64;
            let sigma = Tensor::full([1], sigma, &device);
            let velocity = self.flow.velocity(x.clone(), sigma, features.clone());
            x = x - velocity * (FRAC_PI_2 / STEPS as f64);
        }
        let x = x
            .narrow(2, MARGIN, rows)
            .narrow(3, MARGIN, columns)
            .to_data();
        let (mean, spread) = (style.mean(), style.spread());
        let amplitude = |x: f32| (mean + spread * x).max(0.0);
        let values: Vec<f32> = x.iter::<f32>().map(amplitude).collect();
        // The maximum of 0 and NaN is 0, so the numbers themselves are checked.
        match x.iter::<f32>().all(f32::is_finite) {
            true => Ok(Field {
                rows,
                columns,
                values,
            }),
            false => Err(Error::Model(wake_nn::Error::NotFinite {
                what: "the learnt sea".to_owned(),
            })),
        }
    }

    /// Image of a scene on this sea, as intensity in the unit of σ⁰.
    ///
    /// ```text
    /// I = E s + echo
    /// ```
    ///
    /// - E: the expected image of the scene over all seas, with wakes and noise, without echoes
    /// - s: a sea of mean 1 with its speckle, [`sample`](Self::sample) with the scene's seed
    /// - echo: the bright points of the ships, random by the scene's seed; they have no speckle
    ///
    /// The sea does not depend on the wake: where the wake doubles the intensity, it doubles sea and speckle.
    ///
    /// # Errors
    ///
    /// As [`check_spacing`](Self::check_spacing) and [`sample`](Self::sample); [`Error::Scene`] for a scene that is invalid
    /// or does not fit in memory.
    pub fn image(&self, scene: &Scene) -> Result<Field> {
        self.check_spacing(scene.grid.spacing)?;
        let all = expected_intensity(scene)?;
        let mut silent = scene.clone();
        for ship in &mut silent.ships {
            (ship.echo, ship.roll, ship.halo) = (false, 0.0, None);
            (ship.roll_period, ship.scatterers) = (None, None);
        }
        let sea = match silent == *scene {
            true => all.clone(),
            false => expected_intensity(&silent)?,
        };
        let mut image = self.sample(scene.seed, scene.grid.rows, scene.grid.columns)?;
        let expected = sea.values.iter().zip(&all.values);
        for (value, (sea, all)) in image.values.iter_mut().zip(expected) {
            *value = *value * sea + (all - sea);
        }
        Ok(image)
    }
}

/// Checks that an image has pixels, and fits into memory during sampling.
fn check_size(rows: usize, columns: usize) -> Result<()> {
    check_range("rows", rows as f64, 1.0, 65536.0)?;
    check_range("columns", columns as f64, 1.0, 65536.0)?;
    let pixels = ((rows + 2 * MARGIN) * (columns + 2 * MARGIN)) as u64;
    let needed = BYTES_OF_A_PIXEL * pixels;
    match available_memory().filter(|&free| free < needed) {
        None => Ok(()),
        Some(free) => {
            let [needed, free] = [needed, free].map(|bytes| bytes as f64 / (1u64 << 30) as f64);
            Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "image".to_owned(),
                value: format!("{rows} x {columns} pixels, which need {needed:.1} GiB"),
                expected: format!(
                    "at most the {free:.1} GiB of free memory; ask for a smaller image"
                ),
            }))
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
