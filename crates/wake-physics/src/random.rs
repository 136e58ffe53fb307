//! Random numbers that do not depend on the number of threads: one generator per line of a grid, and one stream per use.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

/// An odd constant that spreads line numbers over 64 bits, unlike the one that spreads the seed afterwards.
const LINE_STEP: u64 = 0xD134_2543_DE82_EF95;

/// The generator of one line.
///
/// Its numbers are fixed by `seed` and `line` alone, on every platform: lines can be drawn in any order.
#[must_use]
pub(crate) fn line_generator(seed: u64, line: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed ^ line.wrapping_add(1).wrapping_mul(LINE_STEP))
}

/// What random numbers of one seed are drawn for. Every use has a stream of its own, here and nowhere else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Amplitudes of the sea, by lines of its lattice.
    Sea,
    /// Speckle, by rows of the image.
    Speckle,
}

/// The generator of one line of a stream.
pub(crate) fn generator(seed: u64, stream: Stream, line: u64) -> Xoshiro256PlusPlus {
    match stream {
        Stream::Sea => line_generator(seed, line),
        Stream::Speckle => {
            let key = Xoshiro256PlusPlus::seed_from_u64(seed).next_u64();
            Xoshiro256PlusPlus::seed_from_u64(key.wrapping_add(line))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn lines_and_seeds_differ_and_repeat() {
        let mut seen = HashSet::new();
        for seed in [0, 1, 7, u64::MAX] {
            for line in 0..1000 {
                let mut generator = line_generator(seed, line);
                assert!(seen.insert(generator.next_u64()), "{seed} {line}");
                assert_eq!(
                    line_generator(seed, line).next_u64(),
                    line_generator(seed, line).next_u64()
                );
            }
        }
    }

    /// No line of any stream and seed begins as another does.
    #[test]
    fn streams_do_not_overlap() {
        let mut seen = HashSet::new();
        for seed in [0, 1, 2, 7, 1 << 40, u64::MAX] {
            for stream in [Stream::Sea, Stream::Speckle] {
                for line in 0..20_000 {
                    let first = generator(seed, stream, line).next_u64();
                    assert!(seen.insert(first), "{seed} {stream:?} {line}");
                }
            }
        }
    }

    /// Neighbouring lines are uncorrelated: the mean product of their signs is within 5 standard errors of 0.
    #[test]
    fn neighbouring_lines_are_uncorrelated() {
        let count = 20_000;
        let (mut one, mut two) = (line_generator(3, 10), line_generator(3, 11));
        let same = (0..count)
            .filter(|_| (one.next_u64() ^ two.next_u64()) >> 63 == 0)
            .count();
        let excess = 2.0 * same as f64 / f64::from(count) - 1.0;
        assert!(excess.abs() < 5.0 / f64::from(count).sqrt());
    }
}
