//! Comparison of a model's images with the simulator's of the same scenes: pixels, measured values and speckle.

use wake_physics::measure::open_sea;
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, Scene};

use super::baseline::Baseline;
use super::pixels::{PixelRow, PixelTally, blur, constant};
use super::reading::{Reading, raster};
use super::source::{ImageSource, Named, Told, other_sea};
use super::statistics::quantile;
use super::view::View;
use crate::error::Result;
use crate::metrics::Perceptual;

/// Kinds of images after the model, in the order of the tallies.
const KINDS: [&str; 4] = [
    "simulator, other sea",
    "expected image, Gaussian sea",
    "constant",
    "blurred simulator",
];

/// Figures over scenes, added batch by batch.
#[derive(Debug, Clone, Default)]
pub(super) struct Comparison {
    view: View,
    /// Tallies of the model, of the kinds in [`KINDS`], and of other sources.
    tallies: Vec<PixelTally>,
    /// Values measured in simulated images, scene by scene.
    pub simulated: Vec<Reading>,
    /// Values measured in the model's images.
    pub generated: Vec<Reading>,
    /// Values measured in expected images with a Gaussian sea.
    pub gaussian: Vec<Reading>,
    looks: [Vec<f64>; 2],
}

impl Comparison {
    /// Empty comparison.
    pub(super) fn new(view: View) -> Self {
        Self {
            view,
            ..Self::default()
        }
    }

    /// Draws scenes from all sources and compares the images with simulated ones.
    ///
    /// - `model`: the source to evaluate, conditioned on sentence and numbers
    /// - `beside`: other sources, of which only pixels are compared
    ///
    /// # Errors
    ///
    /// As [`ImageSource::draw`] and [`Reading::of`], and [`wake_nn::Error::InvalidOption`] for a source that
    /// returns images of a wrong number or size.
    pub(super) fn add(
        &mut self,
        scenes: &[Scene],
        model: &dyn ImageSource,
        beside: &[Named<'_>],
        perceptual: &Perceptual,
    ) -> Result<()> {
        let view = self.view;
        let draw = |source: &dyn ImageSource, scenes| view.draw(source, scenes, Told::Both);
        let references = draw(&Baseline::Simulator, scenes)?;
        let others: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 1)).collect();
        let seconds = draw(&Baseline::Simulator, &others)?;
        let generated = draw(model, scenes)?;
        let linear = draw(&Baseline::Gaussian, scenes)?;
        let others: Vec<Vec<Field>> = beside
            .iter()
            .map(|(_, source)| draw(*source, scenes))
            .collect::<Result<_>>()?;
        self.tallies
            .resize_with(1 + KINDS.len() + others.len(), PixelTally::default);
        for (n, scene) in scenes.iter().enumerate() {
            let images = [&references[n], &seconds[n], &generated[n], &linear[n]];
            let [reference, second, model, gaussian] = images.map(|image| view.grey(image));
            let (flat, soft) = (constant(&reference), blur(&second));
            let images = [&model, &second, &gaussian, &flat, &soft];
            for (tally, image) in self.tallies.iter_mut().zip(images) {
                tally.add(&reference, image, perceptual);
            }
            for (tally, images) in self.tallies[1 + KINDS.len()..].iter_mut().zip(&others) {
                tally.add(&reference, &view.grey(&images[n]), perceptual);
            }
            self.simulated.push(view.read(&references[n], scene)?);
            self.generated.push(view.read(&generated[n], scene)?);
            self.gaussian.push(view.read(&linear[n], scene)?);
            for (looks, image) in self.looks.iter_mut().zip([&references[n], &generated[n]]) {
                looks.extend(equivalent_looks(image, scene, &view));
            }
        }
        Ok(())
    }

    /// Pixel figures: the model first, the simulator with another sea second, other sources last.
    ///
    /// - `model`: name of the model
    #[must_use]
    pub(super) fn pixels(&self, model: &str, beside: &[Named<'_>]) -> Vec<PixelRow> {
        let names = [model].into_iter().chain(KINDS);
        let names = names.chain(beside.iter().map(|(name, _)| *name));
        let rows = self.tallies.iter().zip(names);
        rows.map(|(tally, name)| tally.row(name)).collect()
    }

    /// Equivalent number of looks of the open sea with speckle, medians over the scenes: on simulated images, and on the
    /// model's.
    #[must_use]
    pub(super) fn looks(&self) -> [Option<f64>; 2] {
        self.looks.each_ref().map(|looks| quantile(looks, 0.5))
    }
}

/// Equivalent number of looks of the open sea, mean²/variance, with speckle.
fn equivalent_looks(intensity: &Field, scene: &Scene, view: &View) -> Option<f64> {
    let mut image = intensity.clone();
    if !view.speckle {
        speckle(&mut image, scene.radar.looks, scene.seed);
    }
    let ship = scene.ships.first();
    let ship = ship.map(|ship| (ship.position, ship.heading));
    let sea = open_sea(&image, &raster(scene), ship)?;
    Some(sea.contrast.powi(-2))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use burn::tensor::Device;

    /// Speckle of L looks on a constant image: L, to the scatter of a variance of 256² pixels, some 1 %.
    #[test]
    fn a_sea_without_waves_has_the_looks_of_its_speckle() {
        let mut scene = Scene::default();
        scene.ships.clear();
        let image = Field::constant(&raster(&scene), 0.05);
        let looks = equivalent_looks(&image, &scene, &View::default()).unwrap();
        let expected = f64::from(scene.radar.looks);
        assert!((looks / expected - 1.0).abs() < 0.05, "{looks}");
    }

    /// With the simulator as the model, its image equals the reference.
    #[test]
    fn a_model_that_is_the_simulator_has_its_pixels() {
        let keys = ["grid.rows = 32", "grid.columns = 32"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let perceptual = Perceptual::new(None, &Device::flex()).unwrap();
        let mut comparison = Comparison::default();
        comparison
            .add(&[scene], &Baseline::Simulator, &[], &perceptual)
            .unwrap();
        let rows = comparison.pixels("model", &[]);
        assert_eq!(rows.len(), 5);
        assert!(rows[0].ssim.is_some_and(|ssim| (ssim - 1.0).abs() < 1e-9));
        assert!(rows[1].ssim.is_some_and(|ssim| ssim < 0.99));
        let [simulator, model] = comparison.looks();
        assert_eq!(simulator, model);
    }

    /// In the features of the detector, another sea is nearer than a constant and a blurred image, which SSIM prefers. The figures
    /// are those of `docs/reports/evaluation.md`.
    #[test]
    fn features_tell_lost_texture() {
        let keys = ["grid.rows = 128", "grid.columns = 128"];
        let scenes: Vec<Scene> = (0..4)
            .map(|seed| Scene {
                seed,
                ..Scene::default().with_assignments(&keys).unwrap()
            })
            .collect();
        let perceptual = Perceptual::new(None, &Device::flex()).unwrap();
        let mut comparison = Comparison::default();
        comparison
            .add(&scenes, &Baseline::Simulator, &[], &perceptual)
            .unwrap();
        let rows = comparison.pixels("model", &[]);
        for (row, expected) in rows.iter().zip([0.0, 0.29, 0.24, 0.88, 0.50]) {
            let found = row.features.unwrap();
            assert!((found - expected).abs() < 0.006, "{}: {found}", row.image);
        }
    }
}
