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
