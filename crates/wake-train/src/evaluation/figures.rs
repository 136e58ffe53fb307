//! All figures of a model on held-out scenes, in one call.

use burn::tensor::Device;
use serde::Serialize;
use wake_physics::Scene;

use super::ablation::{AblationRow, ablation};
use super::baseline::Baseline;
use super::comparison::Comparison;
use super::controllability::{ControllabilityRow, controllability};
use super::held_out::HeldOut;
use super::measurements::MeasurementRow;
use super::pixels::PixelRow;
use super::reading::{Quantity, Reading};
use super::source::{BATCH, ImageSource, Named, Told};
use super::view::View;
use super::wake_correlation::{WakeCorrelation, wake_correlation};
use crate::error::Result;
use crate::metrics::Perceptual;

/// First index of the scenes whose values are changed, apart from the scenes of the other figures.
const FIRST_CHANGED: u64 = 1 << 20;

/// A source of images to evaluate, and the number of scenes.
#[derive(Clone)]
pub struct Evaluation<'a> {
    /// Source of the images.
    pub source: &'a dyn ImageSource,
    /// Its name in the report.
    pub name: &'static str,
    /// Whether the source is a model, and not the simulator itself.
    pub has_network: bool,
    /// Other sources, whose pixels and sea are compared too.
    pub beside: Vec<Named<'a>>,
    /// The scenes.
    pub held_out: HeldOut,
    /// View of the images: grey and speckle.
    pub view: View,
    /// Conditions to evaluate besides sentence and numbers together; none for the simulator.
    pub conditions: Vec<Told>,
    /// Number of scenes; some figures use a part of them.
    pub scenes: usize,
}

/// Every figure of an [`Evaluation`].
#[derive(Debug, Serialize)]
pub struct Figures {
    /// Name of the evaluated source.
    pub judged: &'static str,
    /// Number of scenes.
    pub scenes: usize,
    /// Pixel figures against simulated images.
    pub pixels: Vec<PixelRow>,
    /// Kinds of images from a constant to the simulator's.
    pub ablation: Vec<AblationRow>,
    /// Equivalent number of looks.
    pub speckle: Speckle,
    /// Correlation of mean images of a wake over many seas.
    pub wake_correlation: WakeCorrelation,
    /// Values measured in the images.
    pub measurements: Vec<MeasurementRow>,
    /// Measured values under other conditions.
    pub conditions: Vec<ConditionRow>,
    /// Shares of images that follow a changed value.
    pub controllability: Vec<ControllabilityRow>,
}

/// The open sea's equivalent number of looks, median over the scenes.
#[derive(Debug, Serialize)]
pub struct Speckle {
    /// Looks of the scenes' radar.
    pub looks: u32,
    /// In simulated images.
    pub simulator: Option<f64>,
    /// In the images of the source.
    pub model: Option<f64>,
}

/// The measurements under one condition.
#[derive(Debug, Serialize)]
pub struct ConditionRow {
    /// Inputs of the source.
    pub told: &'static str,
    /// Values measured in its images under this condition.
    pub measurements: Vec<MeasurementRow>,
}

impl std::fmt::Debug for Evaluation<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Evaluation")
            .field("name", &self.name)
            .field("scenes", &self.scenes)
            .finish_non_exhaustive()
    }
}

impl<'a> Evaluation<'a> {
    /// Kinds of images from the simplest upward, without the simulator's own.
    #[must_use]
    pub fn kinds(&self) -> Vec<Named<'a>> {
        let baseline = |of: &'static Baseline| (of.name(), of as &dyn ImageSource);
        let mut kinds = vec![
            baseline(&Baseline::Constant),
            baseline(&Baseline::Expected),
            baseline(&Baseline::Gaussian),
        ];
        if self.has_network {
            kinds.push((self.name, self.source));
        }
        kinds.extend(&self.beside);
        kinds.push(baseline(&Baseline::OtherSea));
        kinds
    }

    fn wake_scenes(&self) -> usize {
        self.scenes.div_ceil(12)
    }

    fn condition_scenes(&self) -> usize {
        self.scenes.div_ceil(4)
    }

    fn pairs(&self) -> usize {
        self.scenes.div_ceil(5)
    }

    /// Number of steps that [`figures`](Self::figures) counts in all.
    #[must_use]
    pub fn steps(&self) -> u64 {
        let conditions = self.condition_scenes() * self.conditions.len();
        let pairs = Quantity::ALL.len() * self.pairs();
        let kinds = self.kinds().len() + 1;
        (self.scenes + 8 * self.wake_scenes() + conditions + pairs + kinds) as u64
    }

    /// Draws all images and computes all figures.
    ///
    /// - `perceptual`: perceptual distances of the pixel figures
    /// - `device`: device of the classifiers, without autodiff
    /// - `step`: called with the name of a part and the number of its steps just done
    ///
    /// # Errors
    ///
    /// As [`ImageSource::draw`].
    ///
    /// # Panics
    ///
    /// When there is no scene.
    pub fn figures(
        &self,
        perceptual: &Perceptual,
        device: &Device,
        step: &dyn Fn(&'static str, u64),
    ) -> Result<Figures> {
        let scenes = self.held_out.scenes(0, self.scenes);
        let mut compared = Comparison::new(self.view);
        for batch in scenes.chunks(BATCH) {
            compared.add(batch, self.source, &self.beside, perceptual)?;
            step("pixels and values", batch.len() as u64);
        }
        let ablation = ablation(&scenes, &self.kinds(), &self.view, device, || {
            step("ablation", 1);
        })?;
        let with_wake = &scenes[..self.wake_scenes()];
        let wake_correlation = wake_correlation(with_wake, self.source, &self.view, || {
            step("wake correlation", 8);
        })?;
        let conditions = self.conditions(&scenes[..self.condition_scenes()], &compared, step)?;
        let controllability = self.controllability(step)?;
        let [simulator, model] = compared.looks();
        Ok(Figures {
            judged: self.name,
            scenes: scenes.len(),
            pixels: compared.pixels(self.name, &self.beside),
            ablation,
            speckle: Speckle {
                looks: scenes[0].radar.looks,
                simulator,
                model,
            },
            wake_correlation,
            measurements: MeasurementRow::of_all(
                &scenes,
                &compared.simulated,
                Some(&compared.generated),
                Some(&compared.gaussian),
            ),
            conditions,
            controllability,
        })
    }

    /// The measurements under other conditions.
    fn conditions(
        &self,
        scenes: &[Scene],
        compared: &Comparison,
        step: &dyn Fn(&'static str, u64),
    ) -> Result<Vec<ConditionRow>> {
        let simulated = &compared.simulated[..scenes.len()];
        let row = |told: Told, generated: &[Reading]| ConditionRow {
            told: told.name(),
            measurements: MeasurementRow::of_all(scenes, simulated, Some(generated), None),
        };
        let mut all = vec![row(Told::Both, &compared.generated[..scenes.len()])];
        for &told in &self.conditions {
            let images = self
                .view
                .draw_all(self.source, scenes, told, |n| step("conditions", n))?;
            let read = images.iter().zip(scenes);
            let read = read.map(|(image, scene)| self.view.read(image, scene));
            let read: Vec<Reading> = read.collect::<Result<_>>()?;
            all.push(row(told, &read));
        }
        Ok(all)
    }

    /// Controllability of all quantities.
    fn controllability(&self, step: &dyn Fn(&'static str, u64)) -> Result<Vec<ControllabilityRow>> {
        let told = [&[Told::Both][..], &self.conditions].concat();
        let mut rows = Vec::new();
        for quantity in Quantity::ALL {
            let first = FIRST_CHANGED + ((quantity as u64) << 12);
            let scenes = self.held_out.scenes(first, self.pairs());
            let model = (self.source, told.as_slice());
            let done = || step("controllability", 1);
            rows.extend(controllability(quantity, &scenes, model, &self.view, done)?);
        }
        Ok(rows)
    }
}
