//! In which order examples are taken, and what noise they are mixed with.

use crate::noise::NoiseSource;

/// Stream that the order of the examples is drawn from.
const ORDER_STREAM: u32 = 2003;

/// The examples at some positions of a run: each round through a set is another stride through it.
pub(super) fn examples(
    seed: u64,
    positions: impl Iterator<Item = u64>,
    count: usize,
) -> Vec<usize> {
    let random = NoiseSource::new(seed);
    positions
        .map(|position| shuffled(random, position, count))
        .collect()
}

/// The noise of one image of a run.
pub(super) fn noise_of(seed: u64, position: u64) -> NoiseSource {
    NoiseSource::new(seed ^ position.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

fn shuffled(random: NoiseSource, position: u64, count: usize) -> usize {
    let count = count as u64;
    let (round, at) = (position / count, position % count);
    let draw = random.uniform(ORDER_STREAM, round);
    let start = (draw * count as f64) as u64;
    let mut stride = ((0.3 + 0.4 * draw) * count as f64) as u64 | 1;
    while gcd(stride, count) != 1 {
        stride += 1;
    }
    ((start + at * stride) % count) as usize
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_round_takes_every_example_once_in_another_order() {
        let rounds: Vec<Vec<usize>> = (0..3)
            .map(|round| examples(5, round * 24..(round + 1) * 24, 24))
            .collect();
        for round in &rounds {
            let mut sorted = round.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..24).collect::<Vec<_>>());
        }
        assert_ne!(rounds[0], rounds[1]);
    }
}
