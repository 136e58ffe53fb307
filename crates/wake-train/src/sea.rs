//! Training of a sea texture on patches of unlabelled images.

use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;

use super::run::{Task, Terms, number};
use super::tasks::{examples, interpolate, noise_level, noise_of};
use crate::error::Result;
use crate::streams::SEA_PLACES;
use wake_ldm::sea_texture::{SeaFlow, SeaImage, SeaStyle, WINDOW};
use wake_nn::noise::NoiseSource;

/// Largest number of patches for each one that fits into an image without overlap; more would repeat pixels.
const OVERLAP: usize = 16;
/// Largest number of places tried for each requested patch.
const TRIES: u64 = 8;
/// Random places reserved for each image.
const MOST: u64 = 1 << 32;

/// Patches of open sea in memory, 72 KiB each.
#[derive(Debug, Clone, Default)]
pub struct SeaPatches {
    patches: Vec<Patch>,
    images: u64,
}

#[derive(Debug, Clone)]
struct Patch {
    /// Amplitude of mean 0 and variance 1, `[WINDOW, WINDOW]`.
    values: Vec<f32>,
    style: SeaStyle,
}

impl SeaPatches {
    /// Adds patches of open sea from random places in an image, and returns their number.
    ///
    /// Fewer than `count` are found where targets and masks leave little sea, or the image is small.
    ///
    /// - `seed`: of the places, which differ from image to image
    pub fn push(&mut self, image: &SeaImage, count: usize, seed: u64) -> usize {
        let [rows, columns] = image.size();
        let number = self.images;
        self.images += 1;
        if rows < WINDOW || columns < WINDOW {
            return 0;
        }
        let random = NoiseSource::new(seed);
        let room = [rows - WINDOW + 1, columns - WINDOW + 1];
        let place = |n: u64| -> [usize; 2] {
            std::array::from_fn(|axis| {
                let position = 2 * (MOST * number + n) + axis as u64;
                (random.uniform(SEA_PLACES, position) * room[axis] as f64) as usize
            })
        };
        let most = OVERLAP * (rows * columns).div_ceil(WINDOW * WINDOW);
        let wanted = count.min(most) as u64;
        let (mut found, mut tried) = (Vec::new(), 0);
        while (found.len() as u64) < wanted && tried < TRIES * wanted {
            let more = wanted - found.len() as u64;
            let places = (tried..tried + more).into_par_iter().map(place);
            let patches: Vec<Option<Patch>> = places.map(|place| Patch::of(image, place)).collect();
            found.extend(patches.into_iter().flatten());
            tried += more;
        }
        let count = found.len();
        self.patches.extend(found);
        count
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.patches.len()
    }

    /// Whether there are no patches.
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// The style of every patch, in the order of the images.
    pub fn styles(&self) -> Vec<SeaStyle> {
        self.patches.iter().map(|p| p.style.clone()).collect()
    }
}

impl Patch {
    fn of(image: &SeaImage, place: [usize; 2]) -> Option<Self> {
        let (patch, style) = image.patch(place)?;
        let mean = patch.mean() as f32;
        let variance = patch.values.iter().map(|&v| f64::from(v - mean).powi(2));
        let deviation = (variance.sum::<f64>() / patch.values.len() as f64).sqrt() as f32;
        let values = patch.values.iter().map(|v| (v - mean) / deviation);
        Some(Self {
            values: values.collect(),
            style,
        })
    }
}

/// Task of the sea's flow: squared error of its velocity.
///
/// ```text
/// φ = πσ/2,    x = cos φ r + sin φ n,    loss = |v(x, σ, style) − (cos φ n − sin φ r)|²
/// ```
///
/// with r a patch of amplitude, of mean 0 and variance 1, and n Gaussian noise with the correlation of this very patch.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants".
#[derive(Debug)]
pub(crate) struct SeaTask<'a> {
    /// Training patches, at least one.
    pub patches: &'a SeaPatches,
    /// Seed of order, noise and noise levels.
    pub seed: u64,
}

impl Task<SeaFlow> for SeaTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(&self, model: &SeaFlow, device: &Device, positions: &Range<u64>) -> (Tensor<1>, Terms) {
        let random = NoiseSource::new(self.seed);
        let indices = examples(self.seed, positions.clone(), self.patches.len());
        let patches: Vec<&Patch> = indices.iter().map(|&i| &self.patches.patches[i]).collect();
        let levels: Vec<f32> = positions
            .clone()
            .map(|p| noise_level(random, p) as f32)
            .collect();
        let drawn: Vec<(&Patch, u64)> = patches.iter().copied().zip(positions.clone()).collect();
        let noise = drawn.par_iter().map(|(patch, position)| {
            let source = noise_of(self.seed, *position);
            patch.style.noise(source, WINDOW, WINDOW).values
        });
        let noise: Vec<f32> = noise.collect::<Vec<_>>().concat();
        let residual: Vec<f32> = patches.iter().flat_map(|p| &p.values).copied().collect();
        let features: Vec<f32> = patches.iter().flat_map(|p| p.style.features()).collect();
        let count = patches.len();
        let image = |values| -> Tensor<4> {
            Tensor::from_data(TensorData::new(values, [count, 1, WINDOW, WINDOW]), device)
        };
        let told = features.len() / count.max(1);
        let features = Tensor::from_data(TensorData::new(features, [count, told]), device);
        let (x, target, levels) = interpolate(image(residual), image(noise), &levels);
        let error = model.velocity(x, levels, features) - target.clone();
        let loss = error.square().mean();
        // Loss of a flow with zero velocity.
        let still = number(&target.square().mean());
        let terms = vec![("sea", number(&loss)), ("still", still)];
        (loss, terms)
    }
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use wake_physics::Field;

    use super::*;
    use crate::checkpoint::Tensors;
    use crate::{Checkpoint, LrSchedule, Run, RunOptions, TrainerOptions};
    use wake_ldm::sea_texture::SeaTexture;

    /// Amplitudes exp(0.3 g) of Gaussian noise g with a correlation of ½ between neighbours in a row.
    fn skewed(rows: usize, columns: usize, seed: u64) -> Field {
        let white = NoiseSource::new(seed).normal(0, rows * columns + 1);
        let value = |n: usize| (0.3 * (white[n] + white[n + 1]) / f32::sqrt(2.0)).exp();
        Field {
            rows,
            columns,
            values: (0..rows * columns).map(value).collect(),
        }
    }

    fn patches(count: usize) -> SeaPatches {
        let mut patches = SeaPatches::default();
        let image = SeaImage::new(skewed(320, 320, 4), None).unwrap();
        assert_eq!(patches.push(&image, count, 9), count);
        patches
    }

    fn options(batch: usize, steps: usize) -> RunOptions {
        RunOptions {
            batch,
            seed: 5,
            identity: serde_json::Value::Null,
            trainer: TrainerOptions {
                rate: LrSchedule {
                    peak: 3e-3,
                    warmup: 5,
                    steps,
                },
                ema_decay: 0.95,
                ..TrainerOptions::default()
            },
        }
    }

    fn run(batch: usize, steps: usize) -> Run<SeaFlow> {
        let devices = vec![Device::flex().autodiff()];
        let options = options(batch, steps);
        Run::of("sea", &SeaFlow::shape(), SeaFlow::new, options, devices).unwrap()
    }

    /// A stripe of one bright value, ten columns wide and below three medians, passes every other test for open sea.
    #[test]
    fn nothing_that_a_mask_marks_is_in_any_patch() {
        let mut image = skewed(400, 500, 2);
        let mut mask = Field {
            values: vec![0.0; image.values.len()],
            ..image
        };
        for n in (0..image.values.len()).filter(|n| (200..210).contains(&(n % 500))) {
            (image.values[n], mask.values[n]) = (2.5, 255.0);
        }
        let count = |mask: Option<Field>| {
            let mut patches = SeaPatches::default();
            let found = patches.push(&SeaImage::new(image.clone(), mask).unwrap(), 60, 3);
            assert_eq!(found, patches.len());
            let striped = patches.patches.iter().filter(|patch| {
                // Only in the stripe do neighbours have equal values.
                patch
                    .values
                    .windows(2)
                    .any(|two| two[0].to_bits() == two[1].to_bits())
            });
            (found, striped.count())
        };
        assert_eq!(count(Some(mask)), (60, 0));
        let (found, striped) = count(None);
        assert!(found == 60 && striped > 10, "{striped}");
    }

    #[test]
    fn places_are_drawn_anew_in_every_image_and_small_images_give_none() {
        let image = SeaImage::new(skewed(300, 300, 1), None).unwrap();
        let mut patches = SeaPatches::default();
        // Six patches fit, counted by area.
        assert_eq!(patches.push(&image, 1000, 3), 96);
        assert_eq!(patches.push(&image, 4, 3), 4);
        let first = |n: usize| patches.patches[n].values[0].to_bits();
        assert!((0..4).all(|n| first(n) != first(96 + n)));
        let mut again = SeaPatches::default();
        again.push(&image, 4, 3);
        assert!((0..4).all(|n| again.patches[n].values[0].to_bits() == first(n)));
        let small = SeaImage::new(skewed(127, 400, 1), None).unwrap();
        assert_eq!(again.push(&small, 4, 3), 0);
        assert_eq!(again.styles().len(), 4);
    }

    #[test]
    fn a_stopped_run_goes_on_to_the_bit() {
        let (patches, folder) = (patches(6), tempfile::tempdir().unwrap());
        let task = SeaTask {
            patches: &patches,
            seed: 5,
        };
        let weights = |run: &Run<SeaFlow>, name: &str| -> Tensors {
            let folder = folder.path().join(name);
            run.checkpoint(&folder, 2).unwrap();
            Checkpoint::newest(&folder).unwrap().unwrap().tensors
        };
        let start = run(2, 4);
        weights(&start, "start");
        let checkpoint = |name: &str| {
            let found = Checkpoint::newest(&folder.path().join(name));
            found.unwrap().unwrap()
        };
        let go_on = |name: &str, steps: usize| {
            let mut run = run(2, 4);
            run.resume(checkpoint(name)).unwrap();
            for _ in 0..steps {
                run.step(&task).unwrap();
            }
            run
        };
        let whole = weights(&go_on("start", 4), "whole");
        weights(&go_on("start", 2), "half");
        assert_eq!(weights(&go_on("half", 2), "rest"), whole);
        let begun = checkpoint("start").tensors;
        assert_ne!(begun, whole);
    }

    fn skewness(field: &Field) -> f64 {
        let mean = field.mean();
        let moment = |power: i32| {
            let powers = field
                .values
                .iter()
                .map(|&v| (f64::from(v) - mean).powi(power));
            powers.sum::<f64>() / field.values.len() as f64
        };
        moment(3) / moment(2).powf(1.5)
    }

    /// Squares of 8 pixels, four in five at 100 and the others at 40, with noise of standard deviation 5.
    fn squares(side: usize) -> Field {
        let random = NoiseSource::new(1);
        let white = random.normal(0, side * side);
        let value = |n: usize| {
            let square = n / side / 8 * side + n % side / 8;
            let level = match random.uniform(7, square as u64) < 0.2 {
                true => 40.0,
                false => 100.0,
            };
            level + 5.0 * white[n]
        };
        Field {
            rows: side,
            columns: side,
            values: (0..side * side).map(value).collect(),
        }
    }

    /// Two levels, the lower with probability p = 0.2, have the skewness −(1 − 2p)/√(p(1 − p)) = −1.5; noise of 1/24 of their
    /// variance leaves (24/25)^{3/2} of it, −1.41. Gaussian noise has 0 ± √(6/N), 0.1 for the 512 squares of two images. A short
    /// training reaches at least a third of −1.41, over four times that error.
    #[test]
    fn a_learnt_sea_is_skewed_as_its_images_are() {
        let mut patches = SeaPatches::default();
        patches.push(&SeaImage::new(squares(320), None).unwrap(), 64, 9);
        let task = SeaTask {
            patches: &patches,
            seed: 5,
        };
        let mut run = run(4, STEPS);
        let terms: Vec<Terms> = (0..STEPS).map(|_| run.step(&task).unwrap().1).collect();
        let late = &terms[STEPS - 10..];
        let mean = |term: usize| late.iter().map(|t| t[term].1).sum::<f64>() / 10.0;
        // The mean of 40 patches of 256 squares each has an error of 1 %.
        assert!(mean(0) < 0.9 * mean(1), "{} {}", mean(0), mean(1));
        let styles = patches.styles();
        let texture = SeaTexture::new(run.averaged(), &styles, None).unwrap();
        let drawn = (0..2).map(|n| {
            let sea = texture.amplitude(&styles[n], n as u64, WINDOW, WINDOW);
            skewness(&sea.unwrap())
        });
        let (found, asked) = (drawn.sum::<f64>() / 2.0, -1.41);
        assert!(
            found < asked / 3.0 && found > 1.5 * asked,
            "{found} {asked}"
        );
        let gaussian =
            (0..2).map(|n| skewness(&styles[n].noise(NoiseSource::new(n as u64), WINDOW, WINDOW)));
        let still = gaussian.sum::<f64>() / 2.0;
        assert!(still.abs() < 0.4, "{still}");
    }

    const STEPS: usize = 80;
}
