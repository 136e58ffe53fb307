//! Bootstrap intervals over images.

use wake_nn::noise::NoiseSource;

/// Draws of a bootstrap and their seed.
const DRAWS: u32 = 1000;
const SEED: u64 = 5;

/// The 95 % bootstrap interval of a figure, drawing images with replacement; `None` if no draw has the figure.
///
/// - `images`: what is known of each image
/// - `figure`: the figure of some images
///
/// # References
///
/// Efron & Tibshirani (1993), "An Introduction to the Bootstrap", chapter 13 (percentile interval).
#[must_use]
pub fn bootstrap<T: Clone>(images: &[T], figure: impl Fn(&[T]) -> Option<f64>) -> Option<[f64; 2]> {
    let draws = NoiseSource::new(SEED);
    let draw = |n: u32| -> Option<f64> {
        let one = |k: u64| {
            let at = draws.uniform(n, k) * images.len() as f64;
            images[at as usize].clone()
        };
        figure(&(0..images.len() as u64).map(one).collect::<Vec<T>>())
    };
    let mut figures: Vec<f64> = (0..DRAWS).filter_map(draw).collect();
    figures.sort_by(f64::total_cmp);
    let at = |share: f64| {
        figures
            .get((share * figures.len() as f64) as usize)
            .copied()
    };
    Some([at(0.025)?, at(0.975)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of 400 independent outcomes of 0.3: ± 1.96 · √(0.21/400) = 0.045, to a tenth of that for 1,000 draws.
    #[test]
    fn the_interval_of_a_share_is_that_of_the_binomial() {
        let outcomes: Vec<f64> = (0..400).map(|k| f64::from(u8::from(k % 10 < 3))).collect();
        let mean = |drawn: &[f64]| match drawn {
            [] => None,
            _ => Some(drawn.iter().sum::<f64>() / drawn.len() as f64),
        };
        let [low, high] = bootstrap(&outcomes, mean).unwrap();
        assert!(
            (low - 0.255).abs() < 0.006 && (high - 0.345).abs() < 0.006,
            "{low} {high}"
        );
        assert!(bootstrap(&[], mean).is_none());
    }
}
