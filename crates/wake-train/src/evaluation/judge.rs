//! Classifier two-sample test of two kinds of images, the best of a few.

use burn::tensor::Device;
use wake_physics::Field;

use crate::error::Result;
use crate::{TwoSample, TwoSampleOptions, classifier_two_sample_test};

/// Largest number of classifiers; another is trained while none has an accuracy above [`FOUND`], since a single failed
/// training proves little.
const NETWORKS: u64 = 3;
const FOUND: f64 = 0.9;
/// Side of the smallest patches of a test [pixels].
const SMALLEST: usize = 16;

/// Result of the most accurate of up to three [`classifier_two_sample_test`] tests, of default options and different seeds;
/// `None` for fewer than four images, and for images below 16 pixels.
///
/// - `first`, `second`: images of one size, equally many of both kinds; image k of both may show the same scene
/// - `device`: device without autodiff
///
/// # Errors
///
/// As [`classifier_two_sample_test`].
pub(super) fn told_apart(
    first: &[Field],
    second: &[Field],
    device: &Device,
) -> Result<Option<TwoSample>> {
    let mut best: Option<TwoSample> = None;
    let patch = TwoSampleOptions::default().patch;
    let side = first
        .iter()
        .map(|image| image.rows.min(image.columns))
        .min();
    let patch = patch.min(side.unwrap_or(0) / 8 * 8);
    if first.len() < 4 || patch < SMALLEST {
        return Ok(best);
    }
    for seed in 1..=NETWORKS {
        let options = TwoSampleOptions {
            seed,
            patch,
            ..TwoSampleOptions::default()
        };
        let told = classifier_two_sample_test(first, second, &options, device)?;
        best = best
            .filter(|best| best.accuracy >= told.accuracy)
            .or(Some(told));
        if told.accuracy > FOUND {
            break;
        }
    }
    Ok(best)
}
