//! A finite data set, gone through again and again in another order each time.

use super::folder::Folder;
use super::pair::Pair;
use crate::error::Result;
use crate::noise::NoiseSource;

/// Rounds of the network that shuffles.
const ROUNDS: u32 = 6;

/// Stream of the first round of the first epoch.
const SHUFFLE_STREAM: u32 = 2000;

/// Every pair of a folder once in each epoch, shuffled anew, without end.
///
/// Position p is pair p mod n of epoch p div n: a function of (seed, p) alone.
#[derive(Debug, Clone)]
pub struct Epochs {
    folder: Folder,
    seed: u64,
}

impl Epochs {
    /// The endless walk through a folder.
    pub fn new(folder: Folder, seed: u64) -> Self {
        Self { folder, seed }
    }

    /// The pair at a position.
    ///
    /// # Errors
    ///
    /// As [`Folder::pair`].
    pub fn pair(&self, position: u64) -> Result<Pair> {
        let count = self.folder.len().max(1);
        let source = NoiseSource::new(self.seed.wrapping_add(position / count));
        self.folder.pair(shuffled(position % count, count, source))
    }
}

/// Place of `position` in a permutation of 0 up to `count`.
///
/// A Feistel network permutes the numbers of an even number of bits; those that fall beyond `count` are permuted again
/// until they do not ("cycle walking").
///
/// # References
///
/// Black and Rogaway (2002), "Ciphers with Arbitrary Finite Domains".
fn shuffled(position: u64, count: u64, source: NoiseSource) -> u64 {
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mut place = feistel(position, half, source);
    while place >= count {
        place = feistel(place, half, source);
    }
    place
}

/// A permutation of the numbers of 2·`half` bits.
fn feistel(number: u64, half: u32, source: NoiseSource) -> u64 {
    let size = 1u64 << half;
    let (mut left, mut right) = (number / size, number % size);
    for round in 0..ROUNDS {
        let mixed = (source.uniform(SHUFFLE_STREAM + round, right) * size as f64) as u64;
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
            let order = |seed| -> Vec<u64> {
                let source = NoiseSource::new(seed);
                (0..count).map(|p| shuffled(p, count, source)).collect()
            };
            let places: BTreeSet<u64> = order(3).into_iter().collect();
            assert_eq!(places, (0..count).collect());
            assert!(count < 10 || order(3) != order(4));
        }
    }

    /// Each place is equally likely for a position: χ² of 8 places over 4,000 orders below its 1e-5 quantile for 7
    /// degrees of freedom, 35.
    #[test]
    fn orders_are_even() {
        let mut counts = [0u32; 8];
        for seed in 0..4000 {
            counts[shuffled(3, 8, NoiseSource::new(seed)) as usize] += 1;
        }
        let chi2: f64 = counts
            .iter()
            .map(|&c| (f64::from(c) - 500.0).powi(2) / 500.0)
            .sum();
        assert!(chi2 < 35.0, "{counts:?}");
    }
}
