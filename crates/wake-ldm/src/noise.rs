//! Standard normal noise from a counter: the same numbers on every backend, in any order.
//!
//! A [`NoiseSource`] is a seed. A draw is named by a stream (which noise of the run it is) and the
//! position in it, so image k of a batch gets the same noise alone or among others, and no draw
//! depends on how many came before.
//!
//! ```text
//! words  = Philox4x32-10(counter = [position / 4, 0, stream, 0], key = [seed mod 2³², seed div 2³²])
//! u      = (word + ½) / 2³²
//! normal = √(−2 ln u₀) · (cos 2πu₁, sin 2πu₁),  √(−2 ln u₂) · (cos 2πu₃, sin 2πu₃)
//! ```
//!
//! All in f64, rounded to f32 at the end.
//!
//! # References
//!
//! Salmon et al. (2011), "Parallel Random Numbers: As Easy as 1, 2, 3", section 3.3 (Philox). Box &
//! Muller (1958), "A Note on the Generation of Random Normal Deviates".

use burn::tensor::{Device, Tensor, TensorData};

/// The noise that the first sample is made of.
pub const INITIAL_STREAM: u32 = 0;
/// The noise that an encoded image is drawn with.
pub(crate) const POSTERIOR_STREAM: u32 = 1;
/// The white share of the noise that a flow starts from.
pub(crate) const WHITE_STREAM: u32 = 2;
/// The noise of fine-tuning.
#[cfg(feature = "train")]
pub(crate) const FINE_TUNE_STREAM: u32 = 3;
/// The noise that a learnt sea starts from.
pub(crate) const SEA_TEXTURE_STREAM: u32 = 4;
/// The noise of the first step; that of step i is `STEP_STREAM + i`.
pub const STEP_STREAM: u32 = 16;

/// Streams of uniform numbers; they never meet the normal ones, which have another counter.
pub(crate) mod uniform {
    /// The values of a data set's scene: each key has one of the streams from here on.
    #[cfg(feature = "dataset")]
    pub(crate) const VALUES: u32 = 1 << 31;
    /// Seeds of scenes.
    #[cfg(feature = "dataset")]
    pub(crate) const SEEDS: u32 = 1000;
    /// Wordings of scenes.
    #[cfg(feature = "dataset")]
    pub(crate) const WORDINGS: u32 = 1001;
    /// Prompts without images.
    #[cfg(feature = "dataset")]
    pub(crate) const PROMPTS: u32 = 1002;
    /// Styles of learnt seas.
    pub(crate) const STYLES: u32 = 1100;
    /// Noise levels of examples.
    #[cfg(feature = "train")]
    pub(crate) const LEVELS: u32 = 2000;
    /// Places of patches in a two-sample test.
    #[cfg(feature = "train")]
    pub(crate) const PLACES: u32 = 2002;
    /// Latent pixels of examples.
    #[cfg(feature = "train")]
    pub(crate) const CELLS: u32 = 2001;
    /// Places of patches that a sea is learnt from.
    #[cfg(feature = "train")]
    pub(crate) const SEA_PLACES: u32 = 2003;
    /// Places of the squares that an autoencoder learns from.
    #[cfg(feature = "train")]
    pub(crate) const CROPS: u32 = 2004;
    /// Prompts that are left out.
    #[cfg(feature = "train")]
    pub(crate) const LEFT_OUT: u32 = 2101;
    /// Training steps of fine-tuning.
    #[cfg(feature = "train")]
    pub(crate) const STEPS: u32 = 2100;
    /// The order of examples; round i of the shuffle has `ORDER + i`.
    #[cfg(feature = "dataset")]
    pub(crate) const ORDER: u32 = 1 << 20;
}

/// Noise that follows from a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseSource {
    seed: u64,
}

impl NoiseSource {
    /// The noise of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The first `length` numbers of a stream.
    pub fn normal(self, stream: u32, length: usize) -> Vec<f32> {
        let key = [self.seed as u32, (self.seed >> 32) as u32];
        let blocks = (0..length.div_ceil(4)).flat_map(|block| {
            let block = block as u64;
            normal4(philox([block as u32, (block >> 32) as u32, stream, 0], key))
        });
        blocks.take(length).collect()
    }

    /// Number `position` of a stream of independent numbers, uniform on the open interval (0, 1).
    ///
    /// ```text
    /// words = Philox4x32-10(counter = [position mod 2³², position div 2³², stream, 1], key as above)
    /// u     = (2²⁰ word₀ + ⌊word₁/2¹²⌋ + ½) / 2⁵²
    /// ```
    pub fn uniform(self, stream: u32, position: u64) -> f64 {
        let key = [self.seed as u32, (self.seed >> 32) as u32];
        let counter = [position as u32, (position >> 32) as u32, stream, 1];
        let [high, low, ..] = philox(counter, key);
        let bits = (u64::from(high) << 20) | u64::from(low >> 12);
        (bits as f64 + 0.5) / (1u64 << 52) as f64
    }
}

/// Noise for a batch of images, each from its own source.
///
/// # Shapes
///
/// `[sources, channels, rows, columns]`
pub(crate) fn normal_batch(
    sources: &[NoiseSource],
    stream: u32,
    [channels, rows, columns]: [usize; 3],
    device: &Device,
) -> Tensor<4> {
    let length = channels * rows * columns;
    let numbers: Vec<f32> = sources
        .iter()
        .flat_map(|source| source.normal(stream, length))
        .collect();
    let data = TensorData::new(numbers, [sources.len(), channels, rows, columns]);
    Tensor::from_data(data, device)
}

/// Four independent normal numbers from four words.
fn normal4(words: [u32; 4]) -> [f32; 4] {
    let [u0, u1, u2, u3] = words.map(|word| (f64::from(word) + 0.5) / 4294967296.0);
    let pair = |u: f64, v: f64| {
        let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
        let radius = (-2.0 * u.ln()).sqrt();
        [(radius * cos) as f32, (radius * sin) as f32]
    };
    let ([a, b], [c, d]) = (pair(u0, u1), pair(u2, u3));
    [a, b, c, d]
}

/// Philox4x32 with ten rounds.
fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let [high0, low0] = product(0xD2511F53, counter[0]);
        let [high1, low1] = product(0xCD9E8D57, counter[2]);
        counter = [
            high1 ^ counter[1] ^ key[0],
            low1,
            high0 ^ counter[3] ^ key[1],
            low0,
        ];
        key = [
            key[0].wrapping_add(0x9E3779B9),
            key[1].wrapping_add(0xBB67AE85),
        ];
    }
    counter
}

/// High and low half of a product.
fn product(a: u32, b: u32) -> [u32; 2] {
    let product = u64::from(a) * u64::from(b);
    [(product >> 32) as u32, product as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers of the Random123 library (Salmon et al.), file `kat_vectors`.
    #[test]
    fn philox_gives_the_known_answers() {
        let all = u32::MAX;
        for (counter, key, answer) in [
            (
                [0; 4],
                [0; 2],
                [0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8],
            ),
            (
                [all; 4],
                [all; 2],
                [0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd],
            ),
            (
                [0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344],
                [0xa4093822, 0x299f31d0],
                [0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1],
            ),
        ] {
            assert_eq!(philox(counter, key), answer);
        }
    }

    /// Each purpose has numbers of its own; the last one may count up without end.
    #[test]
    #[cfg(feature = "train")]
    fn streams_do_not_overlap() {
        let one = |stream| (stream, 1);
        let normal = [
            one(INITIAL_STREAM),
            one(POSTERIOR_STREAM),
            one(WHITE_STREAM),
            one(FINE_TUNE_STREAM),
            one(SEA_TEXTURE_STREAM),
            (STEP_STREAM, u32::MAX - STEP_STREAM),
        ];
        let uniform = [
            one(uniform::SEEDS),
            one(uniform::WORDINGS),
            one(uniform::PROMPTS),
            one(uniform::STYLES),
            one(uniform::LEVELS),
            one(uniform::CELLS),
            one(uniform::PLACES),
            one(uniform::SEA_PLACES),
            one(uniform::CROPS),
            one(uniform::STEPS),
            one(uniform::LEFT_OUT),
            (uniform::ORDER, uniform::VALUES - uniform::ORDER),
            (uniform::VALUES, u32::MAX - uniform::VALUES),
        ];
        for streams in [&normal[..], &uniform] {
            let ends = streams.windows(2).all(|w| w[0].0 + w[0].1 <= w[1].0);
            assert!(ends, "{streams:?}");
        }
    }

    #[test]
    fn noise_has_the_moments_of_the_normal_distribution() {
        let n = 400_000;
        let numbers = NoiseSource::new(7).normal(INITIAL_STREAM, n);
        let moment = |power: i32| {
            numbers
                .iter()
                .map(|&x| f64::from(x).powi(power))
                .sum::<f64>()
                / n as f64
        };
        // Five standard errors of each moment: √(E x^2p − (E x^p)²)/√n.
        let allowed = |deviation: f64| 5.0 * deviation / (n as f64).sqrt();
        assert!(moment(1).abs() < allowed(1.0));
        assert!((moment(2) - 1.0).abs() < allowed(2.0_f64.sqrt()));
        assert!(moment(3).abs() < allowed(15.0_f64.sqrt()));
        assert!((moment(4) - 3.0).abs() < allowed(96.0_f64.sqrt()));
        let neighbours = numbers
            .windows(2)
            .map(|pair| f64::from(pair[0] * pair[1]))
            .sum::<f64>()
            / n as f64;
        assert!(neighbours.abs() < allowed(1.0));
        assert!(numbers.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn uniform_numbers_fill_the_interval() {
        let source = NoiseSource::new(7);
        let n = 100_000;
        let numbers: Vec<f64> = (0..n).map(|i| source.uniform(3, i)).collect();
        assert!(numbers.iter().all(|u| (0.0..1.0).contains(u) && *u > 0.0));
        // Five standard errors: of the mean, √(1/12 n); of the mean product of neighbours, √(7/144 n).
        let mean = numbers.iter().sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 5.0 / (12.0 * n as f64).sqrt());
        let neighbours = numbers.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (n - 1) as f64;
        assert!((neighbours - 0.25).abs() < 5.0 * (7.0 / (144.0 * n as f64)).sqrt());
        let tenths = numbers.iter().fold([0u32; 10], |mut count, u| {
            count[(10.0 * u) as usize] += 1;
            count
        });
        // Five standard deviations of a binomial count.
        let allowed = 5.0 * (0.09 * n as f64).sqrt();
        assert!(
            tenths
                .iter()
                .all(|&c| (f64::from(c) - 0.1 * n as f64).abs() < allowed)
        );
        for other in [
            source.uniform(4, 0),
            source.uniform(3, 1 << 32),
            NoiseSource::new(8).uniform(3, 0),
        ] {
            assert!((other - numbers[0]).abs() > 1e-9);
        }
    }

    #[test]
    #[allow(
        clippy::float_cmp,
        reason = "the same or other bits are what is tested"
    )]
    fn seeds_and_streams_differ_and_lengths_do_not_matter() {
        let long = NoiseSource::new(3).normal(5, 1003);
        assert_eq!(NoiseSource::new(3).normal(5, 10), long[..10]);
        for other in [
            NoiseSource::new(3).normal(6, 10),
            NoiseSource::new(4).normal(5, 10),
        ] {
            assert!(other.iter().zip(&long).all(|(a, b)| a != b));
        }
        let high_bits = NoiseSource::new(3 + (1 << 32)).normal(5, 10);
        assert_ne!(high_bits, long[..10]);
    }
}
