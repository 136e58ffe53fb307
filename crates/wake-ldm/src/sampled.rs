//! Pairs sampled from the wake model instead of the simulator.

use crate::wake_model::sampler::WakeSampler;
use crate::wake_model::sea_texture::SeaTexture;
use std::ops::Range;
use wake_dataset::{Pair, Result, Sea, Simulated, Source};
use wake_physics::{Field, Scene};

impl Sea for SeaTexture {
    fn check_spacing(&self, spacing: f64) -> Result<()> {
        Ok(Self::check_spacing(self, spacing)?)
    }

    fn image(&self, scene: &Scene) -> Result<Field> {
        Ok(Self::image(self, scene)?)
    }
}

/// Scenes of a recipe with images sampled from the wake model, one batch at a time.
///
/// The model samples only scenes within its training ranges; the embedded model covers all scenes of the recipes
/// `ranges`, `satellites` and `model`.
#[derive(Debug, Clone)]
pub struct Sampled {
    sampler: WakeSampler,
    scenes: Simulated,
}

impl Sampled {
    /// Makes a source of sampled images for the scenes of a set.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for scenes outside the model's training ranges. The first scenes are checked here, each
    /// later one when it is sampled.
    pub fn new(sampler: WakeSampler, scenes: Simulated) -> Result<Self> {
        for index in 0..LOOKED_AT {
            sampler.check_scene(&scenes.scene(index)?)?;
        }
        Ok(Self { sampler, scenes })
    }
}

/// Number of scenes checked before the first image.
const LOOKED_AT: u64 = 16;

impl Source for Sampled {
    fn size(&self) -> [usize; 2] {
        self.scenes.size()
    }

    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        let pairs = positions.map(|p| self.scenes.pair_without_image(p));
        let pairs: Vec<Pair> = pairs.collect::<Result<_>>()?;
        let scenes: Vec<_> = pairs.iter().map(|pair| pair.scene.clone()).collect();
        let images = match scenes.is_empty() {
            true => Vec::new(),
            false => self.sampler.sample_scenes(&scenes)?,
        };
        let speckle = self.scenes.recipe().speckle;
        let drawn = pairs.into_iter().zip(images).map(|(pair, image)| {
            let power = match speckle {
                true => &image.speckled,
                false => &image.intensity,
            };
            let (grey, amplitudes) = self.scenes.grey(power, pair.index);
            Pair {
                image: grey,
                amplitudes,
                scene: image.scene,
                labels: image.labels,
                ..pair
            }
        });
        Ok(drawn.collect())
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::tensor::Device;
    use wake_dataset::{Loader, Recipe};

    fn sampled(changes: &[&str]) -> Result<Sampled> {
        let sampler = WakeSampler::pretrained(&Device::flex())?.with_steps(1)?;
        let recipe = Recipe::default().with_assignments(changes)?;
        Sampled::new(sampler, Simulated::new(recipe, 3)?)
    }

    /// A pair is the same alone, in a batch or on another thread, except for sums rounded in another order: 2,000 ulps of
    /// single precision for values of order 1.
    #[test]
    fn pairs_do_not_depend_on_their_company() {
        let source = sampled(&[]).unwrap();
        let together = source.items(4..7).unwrap();
        let alone = source.items(5..6).unwrap().remove(0);
        assert_eq!((&alone.scene, alone.index), (&together[1].scene, 5));
        assert_eq!(alone.labels, together[1].labels);
        let pixels = alone.image.pixels.iter().zip(&together[1].image.pixels);
        let largest = pixels.fold(0f32, |max, (a, b)| max.max((a - b).abs()));
        assert!(largest < 2000.0 * f32::EPSILON, "{largest}");
        let (one, other) = (&together[0].image.pixels, &together[1].image.pixels);
        assert!(one.iter().zip(other).any(|(a, b)| (a - b).abs() > 0.01));
        let batches = |threads| {
            let loader = Loader::new(source.clone()).batch(2).threads(threads);
            let batches = loader.on(&Device::flex()).unwrap().take(2);
            let images = batches.map(|batch| batch.unwrap().images.into_data());
            images
                .map(|data| data.try_to_vec::<f32>().unwrap())
                .collect::<Vec<_>>()
        };
        assert_eq!(batches(1), batches(2));
    }

    /// A run resumed after its first step has the same images as an uninterrupted one, bit for bit.
    #[test]
    fn batches_of_a_resumed_run_are_the_same() {
        let sampler = WakeSampler::pretrained(&Device::flex()).unwrap();
        let recipe = Recipe::satellites().unwrap();
        let scenes = Simulated::new(recipe, 3).unwrap();
        let source = Sampled::new(sampler.with_steps(1).unwrap(), scenes).unwrap();
        let second = |start: u64| -> Vec<u32> {
            let loader = Loader::new(source.clone()).batch(2).start(start);
            let mut batches = loader.on(&Device::flex()).unwrap();
            let batch = batches.nth(1 - start as usize).unwrap().unwrap();
            let pixels = batch.images.into_data().try_to_vec::<f32>().unwrap();
            pixels.into_iter().map(f32::to_bits).collect()
        };
        assert!(second(0) == second(1));
    }

    #[test]
    fn scenes_that_the_model_never_saw_are_refused_before_the_first_image() {
        let message = sampled(&["scene.grid.rows = 128"]).unwrap_err().to_string();
        assert!(
            message.contains("128") && message.contains("256"),
            "{message}"
        );
        let message = sampled(&["scene.grid.spacing = 40"])
            .unwrap_err()
            .to_string();
        assert!(message.contains("grid.spacing"), "{message}");
    }

    /// The satellite recipe covers sensors, ships and gusts; every image has about the mean of the simulated one.
    #[test]
    fn the_recipe_of_satellites_is_drawn() {
        let sampler = WakeSampler::pretrained(&Device::flex()).unwrap();
        let recipe = Recipe::satellites().unwrap();
        let recipe = recipe
            .with_assignments(&["draw.quick_look.gain=0.2", "draw.quick_look.offset=0.0"])
            .unwrap();
        let scenes = Simulated::new(recipe, 5).unwrap();
        let source = Sampled::new(sampler, scenes.clone()).unwrap();
        let drawn = source.items(0..4).unwrap();
        for (pair, simulated) in drawn.iter().zip(scenes.items(0..4).unwrap()) {
            assert_eq!(
                (&pair.scene, &pair.labels),
                (&simulated.scene, &simulated.labels)
            );
            // Amplitude of grey 0.2, the median, of both images.
            let [a, b] = [pair, &simulated].map(|p| p.amplitudes.unwrap()[1]);
            assert!(
                (a / b - 1.0).abs() < 0.1,
                "{:?}: {a} {b}",
                pair.scene.radar.sensor
            );
        }
    }
}
