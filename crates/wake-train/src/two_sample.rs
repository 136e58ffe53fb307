//! Classifier two-sample test: how well a small network separates two kinds of images that it has not seen.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor, TensorData};
use wake_physics::Field;

use super::optimizer::LrSchedule;
use super::trainer::{Trainer, TrainerOptions};
use crate::error::{Error, Result};
use crate::streams::PLACES;
use wake_nn::check_range;
use wake_nn::conv::{conv1x1, conv3x3, convolve};
use wake_nn::noise::NoiseSource;
use wake_nn::norm::GroupNorm;
use wake_nn::resample::Downsample;

/// Channels after each halving of the patch.
const WIDTHS: [usize; 3] = [16, 32, 64];
const GROUPS: usize = 8;
const EPSILON: f64 = 1e-5;
/// Peak learning rate.
const RATE: f64 = 4e-3;
/// Standard errors on each side of a 95 % interval.
const STANDARD_ERRORS: f64 = 1.96;
/// Largest number of patches of one kind in a step.
const MOST: u64 = 1024;
/// Patches classified per image.
const JUDGED: usize = 8;

/// Options of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoSampleOptions {
    /// Rows and columns of a patch, a multiple of 8, no larger than the images.
    pub patch: usize,
    /// Steps of training, each on `batch` patches of each kind.
    pub steps: usize,
    /// Patches of each kind in a step.
    pub batch: usize,
    /// Seed of weights and patches.
    pub seed: u64,
}

impl Default for TwoSampleOptions {
    fn default() -> Self {
        Self {
            patch: 64,
            steps: 300,
            batch: 16,
            seed: 1,
        }
    }
}

/// Result of a test.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TwoSample {
    /// Share of patches of unseen images that are classified correctly: ½ where the kinds are alike, 1 where no patch is
    /// mistaken.
    pub accuracy: f64,
    /// Half-width of its 95 % interval, from the spread over the unseen images.
    pub half_width: f64,
    /// Difference of the network's mean outputs for the two kinds, over patches of unseen images, in standard deviations of the
    /// output. It is 0 where the kinds are alike or the outputs have no deviation, and keeps growing where the accuracy ends
    /// at 1.
    pub distance: f64,
    /// Number of unseen images of both kinds.
    pub images: usize,
}

/// Trains a small network to classify the even images of two kinds, and measures its accuracy on patches of the odd ones.
///
/// Each patch is scaled to mean 0 and standard deviation 1, so that only its texture counts. Patches lie anywhere in the
/// image, at the same places for both kinds, and are not turned or mirrored, so that steep fronts and backs of waves count.
/// The network has two convolutions at the patch's own size, three halvings and a global mean, 60,000 weights.
///
/// - `first`, `second`: images of one size, equally many of both kinds, at least four; image k of both may show the same scene
/// - `device`: device without autodiff
///
/// # Errors
///
/// [`wake_nn::Error::OutOfRange`] for numbers of images, patches or steps out of range, [`wake_nn::Error::InvalidOption`] for
/// images of different sizes or numbers, [`Error::Diverged`] for training that diverges.
///
/// # References
///
/// Lopez-Paz & Oquab (2017), "Revisiting Classifier Two-Sample Tests".
pub fn classifier_two_sample_test(
    first: &[Field],
    second: &[Field],
    options: &TwoSampleOptions,
    device: &Device,
) -> Result<TwoSample> {
    check(first, second, options)?;
    let learning = device.clone().autodiff();
    learning.seed(options.seed);
    let trainer_options = TrainerOptions {
        rate: LrSchedule {
            peak: RATE,
            warmup: 20.min(options.steps),
            steps: options.steps,
        },
        ema_decay: 0.98,
        ..TrainerOptions::default()
    };
    let mut trainer = Trainer::new(Network::new(&learning), trainer_options, vec![learning]);
    let half = first.len() / 2;
    while trainer.steps() < options.steps {
        let places = places(options, trainer.steps() as u64, options.batch, half, first);
        trainer.step(|network, device, _| {
            let logits = network.forward(patches([first, second], &places, 0, options, device));
            let [count] = logits.dims();
            let sign = signs(count / 2, device);
            // ln(1 + e^(−y x)), without overflow.
            let margin = logits * sign;
            let loss = margin.clone().clamp_max(0.0).neg() + (-margin.abs()).exp().log1p();
            loss.mean()
        });
        trainer.check()?;
    }
    let network = trainer.averaged().valid();
    let mut shares = Vec::new();
    let mut answers = [Vec::new(), Vec::new()];
    for image in 0..half {
        let mut places = places(options, (1 << 40) + image as u64, JUDGED, 1, first);
        places.iter_mut().for_each(|place| place[0] = image);
        let logits = network.forward(patches([first, second], &places, 1, options, device));
        let logits: Vec<f32> = logits.to_data().iter::<f32>().collect();
        for (n, kind) in logits.chunks(JUDGED).enumerate() {
            let right = kind
                .iter()
                .filter(|&&x| if n == 0 { x > 0.0 } else { x < 0.0 });
            shares.push(right.count() as f64 / JUDGED as f64);
            answers[n].extend(kind.iter().map(|&x| f64::from(x)));
        }
    }
    let count = shares.len() as f64;
    let accuracy = shares.iter().sum::<f64>() / count;
    let squares: f64 = shares.iter().map(|share| (share - accuracy).powi(2)).sum();
    Ok(TwoSample {
        accuracy,
        half_width: STANDARD_ERRORS * (squares / (count - 1.0) / count).sqrt(),
        distance: apart(&answers),
        images: shares.len(),
    })
}

/// Difference of the means of two sets of numbers, in their common standard deviation.
fn apart(numbers: &[Vec<f64>; 2]) -> f64 {
    let [one, other] = numbers.each_ref().map(|numbers| {
        let count = numbers.len() as f64;
        let mean = numbers.iter().sum::<f64>() / count;
        let squares = numbers.iter().map(|x| (x - mean).powi(2));
        [mean, squares.sum::<f64>() / (count - 1.0)]
    });
    let variance = 0.5 * (one[1] + other[1]);
    match variance > 0.0 {
        true => (one[0] - other[0]) / variance.sqrt(),
        false => 0.0,
    }
}

fn check(first: &[Field], second: &[Field], options: &TwoSampleOptions) -> Result<()> {
    let images = first.len().min(second.len());
    check_range("number of images of each kind", images as f64, 4.0, 1e6)?;
    let size = [first[0].rows, first[0].columns];
    let mut all = first.iter().chain(second);
    if first.len() != second.len() || all.any(|image| [image.rows, image.columns] != size) {
        return Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "images".to_owned(),
            value: format!("{} and {}", first.len(), second.len()),
            expected: format!(
                "the same number of both kinds, all of {} x {} pixels",
                size[0], size[1]
            ),
        }));
    }
    check_range("steps", options.steps as f64, 1.0, 1e6)?;
    check_range("batch", options.batch as f64, 1.0, MOST as f64)?;
    let largest = size[0].min(size[1]);
    check_range("patch", options.patch as f64, 16.0, largest as f64)?;
    if !options.patch.is_multiple_of(8) {
        return Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "patch".to_owned(),
            value: options.patch.to_string(),
            expected: "a multiple of 8".to_owned(),
        }));
    }
    Ok(())
}

/// Random places of patches in draw number `draw`: one of the first `images` images, row and column of the first pixel.
fn places(
    options: &TwoSampleOptions,
    draw: u64,
    count: usize,
    images: usize,
    all: &[Field],
) -> Vec<[usize; 3]> {
    let room = [
        images,
        all[0].rows - options.patch + 1,
        all[0].columns - options.patch + 1,
    ];
    let source = NoiseSource::new(options.seed);
    let place = |k: usize| {
        std::array::from_fn(|n| {
            let position = 3 * (MOST * draw + k as u64) + n as u64;
            (source.uniform(PLACES, position) * room[n] as f64) as usize
        })
    };
    (0..count).map(place).collect()
}

/// Patches of the first kind, then of the second at the same places of images 2k + `odd`.
///
/// # Shapes
///
/// `[2 places, 1, patch, patch]`
fn patches(
    kinds: [&[Field]; 2],
    places: &[[usize; 3]],
    odd: usize,
    options: &TwoSampleOptions,
    device: &Device,
) -> Tensor<4> {
    let side = options.patch;
    let mut values = Vec::with_capacity(2 * places.len() * side * side);
    for images in kinds {
        for &[image, top, left] in places {
            let image = &images[2 * image + odd];
            let begin = values.len();
            for row in top..top + side {
                values.extend_from_slice(&image.values[row * image.columns + left..][..side]);
            }
            standardize(&mut values[begin..]);
        }
    }
    let shape = [2 * places.len(), 1, side, side];
    Tensor::from_data(TensorData::new(values, shape), device)
}

/// Scales values to mean 0 and variance 1, or to 0 where there is no variance.
fn standardize(values: &mut [f32]) {
    let count = values.len() as f64;
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
    let squares: f64 = values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum();
    let deviation = (squares / count).sqrt();
    let factor = if deviation > 0.0 {
        1.0 / deviation
    } else {
        0.0
    };
    for value in values {
        *value = ((f64::from(*value) - mean) * factor) as f32;
    }
}

/// 1 for the first kind, −1 for the second, `[2 count]`.
fn signs(count: usize, device: &Device) -> Tensor<1> {
    let signs: Vec<f32> = [1.0f32, -1.0]
        .iter()
        .flat_map(|&s| vec![s; count])
        .collect();
    Tensor::from_data(TensorData::new(signs, [2 * count]), device)
}

/// Maps a patch to one number, above 0 for the first kind.
#[derive(Module, Debug)]
struct Network {
    first: Conv2d,
    second: Conv2d,
    norm: GroupNorm,
    halvings: Vec<Halving>,
    last: Conv2d,
}

#[derive(Module, Debug)]
struct Halving {
    down: Downsample,
    widen: Conv2d,
    norm: GroupNorm,
}

impl Network {
    fn new(device: &Device) -> Self {
        let norm = |width| GroupNorm::new(GROUPS, width, EPSILON, device);
        let halving = |n: usize| {
            let width = WIDTHS[n];
            let next = WIDTHS[(n + 1).min(WIDTHS.len() - 1)];
            Halving {
                down: Downsample::padded(width, device),
                widen: conv3x3(width, next, device),
                norm: norm(next),
            }
        };
        Self {
            first: conv3x3(1, WIDTHS[0], device),
            second: conv3x3(WIDTHS[0], WIDTHS[0], device),
            norm: norm(WIDTHS[0]),
            halvings: (0..WIDTHS.len()).map(halving).collect(),
            last: conv1x1(WIDTHS[WIDTHS.len() - 1], 1, device),
        }
    }

    /// # Shapes
    ///
    /// `[batch, 1, rows, columns]` to `[batch]`
    fn forward(&self, x: Tensor<4>) -> Tensor<1> {
        let x = wake_nn::activation::silu(convolve(&self.first, x));
        let mut x = self.norm.forward_silu(convolve(&self.second, x));
        for halving in &self.halvings {
            x = halving
                .norm
                .forward_silu(convolve(&halving.widen, halving.down.forward(x)));
        }
        let x = x.mean_dim(2).mean_dim(3);
        convolve(&self.last, x).reshape([-1])
    }
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "a test that cannot go on has failed, and small whole numbers are exact"
)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    /// White noise of mean 3, smoothed along its rows if `smoothed`.
    fn images(count: usize, first_seed: u64, smoothed: bool) -> Vec<Field> {
        let one = |seed: u64| {
            let white = NoiseSource::new(seed).normal(0, SIDE * SIDE + 1);
            let value = |n: usize| match smoothed {
                true => 3.0 + (white[n] + white[n + 1]) / f32::sqrt(2.0),
                false => 3.0 + white[n],
            };
            Field {
                rows: SIDE,
                columns: SIDE,
                values: (0..SIDE * SIDE).map(value).collect(),
            }
        };
        (first_seed..first_seed + count as u64).map(one).collect()
    }

    const OPTIONS: TwoSampleOptions = TwoSampleOptions {
        patch: 32,
        steps: 40,
        batch: 8,
        seed: 5,
    };

    /// Two sets of one kind cannot be separated: the accuracy is ½ within four standard errors. Smoothed noise is separated from
    /// white noise in nearly every patch.
    #[test]
    fn what_differs_is_told_apart_and_what_does_not_is_not() {
        let device = Device::flex();
        let white = images(16, 100, false);
        let same =
            classifier_two_sample_test(&white, &images(16, 300, false), &OPTIONS, &device).unwrap();
        assert_eq!(same.images, 16);
        let tolerance = 2.0 * same.half_width.max(0.05);
        assert!((same.accuracy - 0.5).abs() < tolerance, "{same:?}");
        // 64 patches of each kind: the standard error of a mean is 1/8 of a deviation, of the difference √2/8; four of these.
        assert!(same.distance.abs() < 4.0 * 2f64.sqrt() / 8.0, "{same:?}");
        let other =
            classifier_two_sample_test(&white, &images(16, 300, true), &OPTIONS, &device).unwrap();
        assert!(other.accuracy > 0.95, "{other:?}");
        // Two normal distributions with 95 % on their side of the middle are 2 · 1.645 deviations apart.
        assert!(other.distance > 3.29, "{other:?}");
        let again =
            classifier_two_sample_test(&white, &images(16, 300, true), &OPTIONS, &device).unwrap();
        assert_eq!(other, again);
    }

    #[test]
    fn the_distance_is_that_of_the_means_in_deviations() {
        let numbers = [vec![1.0, 3.0, 2.0], vec![-4.0, -2.0, -3.0]];
        assert_eq!(apart(&numbers), 5.0);
        assert_eq!(apart(&[vec![1.0; 3], vec![1.0; 3]]), 0.0);
    }

    #[test]
    fn a_patch_has_mean_0_and_variance_1_or_is_empty() {
        let mut values = [3.0, 5.0, 3.0, 5.0];
        standardize(&mut values);
        assert_eq!(values, [-1.0, 1.0, -1.0, 1.0]);
        let mut flat = [7.0; 4];
        standardize(&mut flat);
        assert_eq!(flat, [0.0; 4]);
    }

    #[test]
    fn images_that_no_test_can_be_made_of_are_refused() {
        let device = Device::flex();
        let white = images(4, 1, false);
        let refused = |options: &TwoSampleOptions, second: &[Field]| {
            classifier_two_sample_test(&white, second, options, &device)
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&OPTIONS, &white[..3]).contains("images of each kind is 3"));
        let mut wide = white.clone();
        wide[1].values.extend(vec![0.0; SIDE]);
        wide[1].rows += 1;
        assert!(refused(&OPTIONS, &wide).contains("the same number of both kinds"));
        let odd = TwoSampleOptions {
            patch: 20,
            ..OPTIONS
        };
        assert!(refused(&odd, &white).contains("multiple of 8"));
        let large = TwoSampleOptions {
            patch: 72,
            ..OPTIONS
        };
        assert!(refused(&large, &white).contains("patch is 72"));
    }
}
