//! Speckle: intensity fluctuation of N independent looks.

use crate::random::{Stream, generator};
use crate::raster::Field;
use rand::Rng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, Gamma};
use rayon::prelude::*;

/// Largest number of looks for which a product of uniform numbers is faster than the rejection method.
const PRODUCT_LOOKS: u32 = 8;

/// Multiplies every pixel by an independent Gamma-distributed random number with mean 1.
///
/// ```text
/// I → I·g,     p(g) = N^N g^{N−1} e^{−N g}/Γ(N),     std(g) = 1/√N
/// ```
///
/// - `intensity` I, changed in place
/// - `looks` N, at least 1; one look is exponential
/// - `seed`: the same seed gives the same speckle for any number of threads
///
/// # Validity
///
/// Fully developed speckle, independent between pixels. Where the resolution is wider than a pixel, real speckle is
/// correlated.
///
/// # References
///
/// Goodman (1976), J. Opt. Soc. Am. 66.
pub fn speckle(intensity: &mut Field, looks: u32, seed: u64) {
    intensity
        .values
        .par_chunks_mut(intensity.columns.max(1))
        .enumerate()
        .for_each(|(i, row)| {
            speckle_row(
                row,
                looks.max(1),
                generator(seed, Stream::Speckle, i as u64),
            );
        });
}

fn speckle_row(row: &mut [f32], looks: u32, mut random: Xoshiro256PlusPlus) {
    let shape = f64::from(looks);
    match Gamma::new(shape, 1.0 / shape) {
        Ok(gamma) if looks > PRODUCT_LOOKS => {
            for v in row {
                *v *= gamma.sample(&mut random) as f32;
            }
        }
        _ => {
            for v in row {
                *v *= (-product(looks, &mut random).ln() / shape) as f32;
            }
        }
    }
}

/// Product of `count` uniform 32-bit random numbers from the open interval (0, 1).
fn product(count: u32, random: &mut Xoshiro256PlusPlus) -> f64 {
    let uniform = |bits: u64| (bits as u32 as f64 + 0.5) * 2f64.powi(-32);
    let mut product = 1.0;
    for _ in 0..count / 2 {
        let bits = random.next_u64();
        product *= uniform(bits) * uniform(bits >> 32);
    }
    if count % 2 == 1 {
        product *= uniform(random.next_u64() >> 32);
    }
    product
}

/// Equivalent number of looks of an image of a uniform scene.
///
/// ```text
/// ENL = mean² / variance
/// ```
///
/// - returns infinity for a constant image
#[must_use]
pub fn equivalent_looks(image: &Field) -> f64 {
    let mean = image.mean();
    let sum: f64 = image
        .values
        .iter()
        .map(|&v| (f64::from(v) - mean).powi(2))
        .sum();
    mean * mean * image.values.len() as f64 / sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    fn flat(looks: u32, seed: u64) -> Field {
        let mut field = Field::constant(&Raster::image(256, 200, 1.0), 2.0);
        speckle(&mut field, looks, seed);
        field
    }

    /// P(g ≤ x) for an integer number of looks: 1 − e^{−Nx} Σ_{i<N} (Nx)^i/i!, in logarithms where N is large.
    fn erlang(looks: u32, x: f64) -> f64 {
        let mean = f64::from(looks) * x;
        let (mut log_term, mut sum) = (-mean, 0.0);
        for i in 0..looks {
            sum += log_term.exp();
            log_term += (mean / f64::from(i + 1)).ln();
        }
        1.0 - sum
    }

    #[test]
    fn distribution_is_gamma() {
        // Both sides of the switch between the two methods, and the ends of the range.
        for looks in [1, 2, 3, 4, 8, 9, 30, 1000] {
            let field = flat(looks, 3);
            let n = field.values.len() as f64;
            let mut values: Vec<f64> = field.values.iter().map(|&v| f64::from(v) / 2.0).collect();
            values.sort_by(f64::total_cmp);
            let distance = values
                .iter()
                .enumerate()
                .map(|(i, &v)| {
                    let p = erlang(looks, v);
                    (p - i as f64 / n).abs().max((p - (i + 1) as f64 / n).abs())
                })
                .fold(0.0, f64::max);
            // Kolmogorov–Smirnov: exceeded by chance once in a thousand cases, 1.95/√n.
            assert!(distance < 1.95 / n.sqrt(), "{looks} looks: {distance}");
        }
    }

    #[test]
    fn mean_stays_and_looks_are_found_again() {
        for looks in [1, 4, 16, 100] {
            let field = flat(looks, 11);
            let (shape, n) = (f64::from(looks), field.values.len() as f64);
            // Four standard errors of the mean, and of mean²/variance: √((2 + 6/N + 4/N)/n) at most √(12/n).
            assert!((field.mean() / 2.0 - 1.0).abs() < 4.0 / (shape * n).sqrt());
            assert!((equivalent_looks(&field) / shape - 1.0).abs() < 4.0 * (12.0 / n).sqrt());
        }
    }

    #[test]
    fn rows_and_columns_are_independent() {
        let field = flat(1, 5);
        let n = field.values.len() as f64;
        for shift in [1, 2, field.columns, field.columns + 1] {
            let pairs = field.values.iter().zip(&field.values[shift..]);
            let covariance: f64 = pairs.map(|(&a, &b)| f64::from((a - 2.0) * (b - 2.0))).sum();
            // The correlation of independent pixels has the standard deviation 1/√n.
            assert!((covariance / (4.0 * n)).abs() < 4.0 / n.sqrt());
        }
    }

    #[test]
    fn seed_decides_and_threads_do_not() {
        assert_eq!(flat(4, 1), flat(4, 1));
        assert_ne!(flat(4, 1), flat(4, 2));
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let three = rayon::ThreadPoolBuilder::new()
            .num_threads(3)
            .build()
            .unwrap();
        assert_eq!(one.install(|| flat(9, 1)), three.install(|| flat(9, 1)));
    }

    #[test]
    fn nothing_stays_nothing() {
        let mut field = Field::constant(&Raster::image(3, 3, 1.0), 0.0);
        speckle(&mut field, 1, 1);
        assert!(field.values.iter().all(|v| v.abs() < f32::MIN_POSITIVE));
    }
}
