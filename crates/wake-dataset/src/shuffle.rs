//! Random permutations without a list.

use crate::streams;
use wake_nn::noise::NoiseSource;

/// Rounds of the Feistel network.
const ROUNDS: u32 = 6;

/// Index, from 0 to below `count`, at a position of an endless shuffled sequence: each index once in every epoch of `count`
/// positions, in another order each epoch. A function of (seed, position) alone.
///
/// - `count`: at least 1
///
/// A Feistel network permutes numbers of an even number of bits; results of `count` or more are permuted again until they are
/// below it ("cycle walking").
///
/// # References
///
/// Black and Rogaway (2002), "Ciphers with Arbitrary Finite Domains".
pub fn shuffled(position: u64, count: u64, seed: u64) -> u64 {
    let source = NoiseSource::new(seed.wrapping_add(position / count));
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mut place = feistel(position % count, half, source);
    while place >= count {
        place = feistel(place, half, source);
    }
    place
}

/// Permutation of the numbers of 2·`half` bits.
fn feistel(number: u64, half: u32, source: NoiseSource) -> u64 {
    let size = 1u64 << half;
    let (mut left, mut right) = (number / size, number % size);
    for round in 0..ROUNDS {
        let mixed = (source.uniform(streams::ORDER + round, right) * size as f64) as u64;
        (left, right) = (right, left ^ mixed);
    }
    left * size + right
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_place_comes_once_an_epoch() {
        for count in (1..70).chain([1000]) {
            let order =
                |seed| -> Vec<u64> { (0..count).map(|p| shuffled(p, count, seed)).collect() };
            let places: BTreeSet<u64> = order(3).into_iter().collect();
            assert_eq!(places, (0..count).collect());
            assert!(count < 10 || order(3) != order(4));
        }
    }

    /// Each index is equally likely at a position: χ² of 8 indices over 4,000 orders is below 35, its upper 1e-5 quantile for 7
    /// degrees of freedom.
    #[test]
    fn orders_are_even() {
        let mut counts = [0u32; 8];
        for seed in 0..4000 {
            counts[shuffled(3, 8, seed) as usize] += 1;
        }
        let chi2: f64 = counts
            .iter()
            .map(|&c| (f64::from(c) - 500.0).powi(2) / 500.0)
            .sum();
        assert!(chi2 < 35.0, "{counts:?}");
    }
}
