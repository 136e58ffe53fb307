//! A model's images beside the simulator's of the same scenes: pixels, what is read from them, and speckle.

use wake_physics::measure::open_sea;
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, Scene};

use super::baseline::Baseline;
use super::pixels::{PixelRow, PixelTally, blur, constant, grey};
use super::reading::{Reading, raster};
use super::source::{ImageSource, Told, drawn, other_sea};
use super::statistics::quantile;
use crate::error::Result;
use crate::metrics::Lpips;

/// Kinds of images, in the order of the tallies.
const KINDS: [&str; 6] = [
    "model",
    "simulator, other sea",
    "expected image, Gaussian sea",
    "constant",
    "blurred simulator",
    "text to image",
];

/// Figures over scenes, which are added some at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct Comparison {
    /// By kind, see [`KINDS`].
    tallies: [PixelTally; 6],
    /// What is read from simulated images, scene by scene.
    pub simulated: Vec<Reading>,
    /// What is read from the model's.
    pub generated: Vec<Reading>,
    /// What is read from expected images with a Gaussian sea.
    pub gaussian: Vec<Reading>,
    looks: [Vec<f64>; 2],
}

impl Comparison {
    /// Draws scenes in every way and counts the images against simulated ones.
    ///
    /// - `model`: what is judged, told sentence and numbers
    /// - `beside`: a second model, whose pixels count alone
    ///
    /// # Errors
    ///
    /// As [`ImageSource::draw`] and [`Reading::of`], and [`wake_nn::Error::InvalidOption`] for a source that
    /// gives other images than were asked for.
    pub(super) fn add(
        &mut self,
        scenes: &[Scene],
        model: &dyn ImageSource,
        beside: Option<&dyn ImageSource>,
        lpips: Option<&Lpips>,
    ) -> Result<()> {
        let references = drawn(&Baseline::Simulator, scenes, Told::Both)?;
        let others: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 1)).collect();
        let seconds = drawn(&Baseline::Simulator, &others, Told::Both)?;
        let generated = drawn(model, scenes, Told::Both)?;
        let linear = drawn(&Baseline::Gaussian, scenes, Told::Both)?;
        let latent = beside.map_or(Ok(Vec::new()), |source| drawn(source, scenes, Told::Both))?;
        for (n, scene) in scenes.iter().enumerate() {
            let images = [&references[n], &seconds[n], &generated[n], &linear[n]];
            let [reference, second, model, gaussian] = images.map(grey);
            let (flat, soft) = (constant(&reference), blur(&second));
            let images = [&model, &second, &gaussian, &flat, &soft];
            for (tally, image) in self.tallies.iter_mut().zip(images) {
                tally.add(&reference, image, lpips);
            }
            if let Some(image) = latent.get(n) {
                self.tallies[5].add(&reference, &grey(image), lpips);
            }
            self.simulated.push(Reading::of(&references[n], scene)?);
            self.generated.push(Reading::of(&generated[n], scene)?);
            self.gaussian.push(Reading::of(&linear[n], scene)?);
            for (looks, image) in self.looks.iter_mut().zip([&references[n], &generated[n]]) {
                looks.extend(equivalent_looks(image, scene));
            }
        }
        Ok(())
    }

    /// The figures of pixels: of the model first, of the simulator with another sea second; the last is that of the model
    /// beside, where there was one.
    #[must_use]
    pub(super) fn pixels(&self) -> Vec<PixelRow> {
        let kinds = self.tallies.iter().zip(KINDS);
        let drawn = kinds.filter(|(tally, kind)| !tally.is_empty() || *kind != KINDS[5]);
        drawn.map(|(tally, kind)| tally.row(kind)).collect()
    }

    /// Equivalent looks of the open sea after speckle is applied, medians over the scenes: on simulated images, and on the
    /// model's.
    #[must_use]
    pub(super) fn looks(&self) -> [Option<f64>; 2] {
        self.looks.each_ref().map(|looks| quantile(looks, 0.5))
    }
}

/// Equivalent number of looks of the open sea, mean²/variance, after speckle is applied.
fn equivalent_looks(intensity: &Field, scene: &Scene) -> Option<f64> {
    let mut image = intensity.clone();
    speckle(&mut image, scene.radar.looks, scene.seed);
    let ship = scene.ships.first();
    let ship = ship.map(|ship| (ship.position, ship.heading));
    let sea = open_sea(&image, &raster(scene), ship)?;
    Some(sea.contrast.powi(-2))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// Speckle of L looks on a constant image: L, to the scatter of a variance of 256² pixels, some 1 %.
    #[test]
    fn a_sea_without_waves_has_the_looks_of_its_speckle() {
        let mut scene = Scene::default();
        scene.ships.clear();
        let image = Field::constant(&raster(&scene), 0.05);
        let looks = equivalent_looks(&image, &scene).unwrap();
        let expected = f64::from(scene.radar.looks);
        assert!((looks / expected - 1.0).abs() < 0.05, "{looks}");
    }

    /// The simulator in the place of the model: nothing is between its image and the reference.
    #[test]
    fn a_model_that_is_the_simulator_has_its_pixels() {
        let keys = ["grid.rows = 32", "grid.columns = 32"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let mut comparison = Comparison::default();
        comparison
            .add(&[scene], &Baseline::Simulator, None, None)
            .unwrap();
        let rows = comparison.pixels();
        assert_eq!(rows.len(), 5);
        assert!(rows[0].ssim.is_some_and(|ssim| (ssim - 1.0).abs() < 1e-9));
        assert!(rows[1].ssim.is_some_and(|ssim| ssim < 0.99));
        let [simulator, model] = comparison.looks();
        assert_eq!(simulator, model);
    }
}
