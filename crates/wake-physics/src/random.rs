//! Random numbers independent of the number of threads: one generator per line of a grid, and one stream per use.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

/// Odd constant that spreads line numbers over 64 bits; different from the one that spreads the seed afterwards.
const LINE_STEP: u64 = 0xD134_2543_DE82_EF95;

/// Uses of the random numbers of one seed. Every use has its own stream, defined only here: the lines of the seed from the
/// stream's first line up to the first line of the next stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Amplitudes of the sea, by lines of its lattice.
    Sea,
    /// Phases of points, by looks.
    Points,
    /// Positions and strengths of the scatterers of ships, by ships.
    Scatterers,
    /// Paired echoes of the scatterers, by ships.
    PairedEchoes,
    /// Gusts, by lines of their lattice.
    Gusts,
    /// Mottle, by lines of its lattice.
    Mottle,
    /// Directions and phases of slicks.
    Slicks,
    /// Phases of the swell.
    Swell,
    /// Reflectivity of the sea, by looks and rows.
    Reflectivity,
    /// Speckle, by rows of the image; its lines are offset by the seed's first random number.
    Speckle,
}

impl Stream {
    fn first_line(self) -> u64 {
        match self {
            Self::Sea | Self::Speckle => 0,
            Self::Points => 1 << 40,
            Self::Scatterers => 1 << 41,
            Self::Gusts => 1 << 42,
            Self::Slicks => 1 << 43,
            Self::Swell => 1 << 44,
            Self::Reflectivity => 1 << 45,
            Self::Mottle => 1 << 46,
            Self::PairedEchoes => 1 << 47,
        }
    }
}

/// The generator of one line of a stream.
///
/// The numbers depend only on `seed`, `stream` and `line`, on every platform, so lines can be drawn in any order.
#[must_use]
pub(crate) fn generator(seed: u64, stream: Stream, line: u64) -> Xoshiro256PlusPlus {
    let line = stream.first_line() + line;
    Xoshiro256PlusPlus::seed_from_u64(match stream {
        Stream::Speckle => {
            let first = Xoshiro256PlusPlus::seed_from_u64(seed).next_u64();
            first.wrapping_add(line)
        }
        _ => seed ^ line.wrapping_add(1).wrapping_mul(LINE_STEP),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    const ALL: [Stream; 10] = [
        Stream::Sea,
        Stream::Points,
        Stream::Scatterers,
        Stream::Gusts,
        Stream::Mottle,
        Stream::Slicks,
        Stream::Swell,
        Stream::Reflectivity,
        Stream::PairedEchoes,
        Stream::Speckle,
    ];

    /// All lines of all streams and seeds begin differently, and each is reproducible.
    #[test]
    fn streams_lines_and_seeds_differ_and_repeat() {
        let mut seen = HashSet::new();
        for seed in [0, 1, 2, 7, 1 << 40, u64::MAX] {
            for stream in ALL {
                for line in (0..3000).chain([1 << 20, 1 << 30]) {
                    let first = generator(seed, stream, line).next_u64();
                    assert!(seen.insert(first), "{seed} {stream:?} {line}");
                    assert_eq!(generator(seed, stream, line).next_u64(), first);
                }
            }
        }
    }

    /// The streams do not overlap: the longest, a thousand looks of 2²⁰ rows, ends before another begins.
    #[test]
    fn streams_of_lines_do_not_meet() {
        let longest = 1000u64 << 20;
        let mut firsts: Vec<u64> = ALL[..9].iter().map(|s| s.first_line()).collect();
        firsts.sort_unstable();
        assert!(firsts.windows(2).all(|pair| pair[1] - pair[0] > longest));
    }

    /// Neighbouring lines are uncorrelated: the mean product of their signs is within 5 standard errors of 0.
    #[test]
    fn neighbouring_lines_are_uncorrelated() {
        let count = 20_000;
        let (mut one, mut two) = (generator(3, Stream::Sea, 10), generator(3, Stream::Sea, 11));
        let same = (0..count)
            .filter(|_| (one.next_u64() ^ two.next_u64()) >> 63 == 0)
            .count();
        let excess = 2.0 * same as f64 / f64::from(count) - 1.0;
        assert!(excess.abs() < 5.0 / f64::from(count).sqrt());
    }
}
