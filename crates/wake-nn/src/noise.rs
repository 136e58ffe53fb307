//! Standard normal noise from a counter: the same numbers on every backend, in any order.
//!
//! A [`NoiseSource`] is a seed. A number is addressed by a stream (one for each use of noise in a run) and
//! its position in the stream, so image k of a batch gets the same noise alone or in a batch, and no number
//! depends on how many were drawn before.
//!
//! ```text
//! words  = Philox4x32-10(counter = [position / 4, 0, stream, 0], key = [seed mod 2³², seed div 2³²])
//! u      = (word + ½) / 2³²
//! normal = √(−2 ln u₀) · (cos 2πu₁, sin 2πu₁),  √(−2 ln u₂) · (cos 2πu₃, sin 2πu₃)
//! ```
//!
//! Everything is computed in f64 and rounded to f32 at the end.
//!
//! # References
//!
//! Salmon et al. (2011), "Parallel Random Numbers: As Easy as 1, 2, 3", section 3.3 (Philox). Box &
//! Muller (1958), "A Note on the Generation of Random Normal Deviates".

#[cfg(feature = "burn")]
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;

/// Source of noise that depends only on a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoiseSource {
    seed: u64,
}

impl NoiseSource {
    /// Makes the source of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// First `length` numbers of a stream of standard normal noise.
    pub fn normal(self, stream: u32, length: usize) -> Vec<f32> {
        let mut numbers = vec![0.0; length];
        self.fill(stream, &mut numbers);
        numbers
    }

    /// Writes the first numbers of a stream, on all cores.
    fn fill(self, stream: u32, numbers: &mut [f32]) {
        let key = [self.seed as u32, (self.seed >> 32) as u32];
        let parts = numbers.par_chunks_mut(PART).enumerate();
        parts.for_each(|(part, numbers)| {
            let normals = Normals {
                key,
                stream,
                first: (part * PART / 4) as u64,
                numbers,
            };
            #[cfg(feature = "flex")]
            pulp::Arch::new().dispatch(normals);
            #[cfg(not(feature = "flex"))]
            normals.write();
        });
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
#[cfg(feature = "burn")]
pub fn normal_batch(
    sources: &[NoiseSource],
    stream: u32,
    [channels, rows, columns]: [usize; 3],
    device: &Device,
) -> Tensor<4> {
    let length = channels * rows * columns;
    let mut numbers = vec![0.0; sources.len() * length];
    let images = numbers.par_chunks_mut(length.max(1)).zip(sources);
    images.for_each(|(numbers, source)| source.fill(stream, numbers));
    let data = TensorData::new(numbers, [sources.len(), channels, rows, columns]);
    Tensor::from_data(data, device)
}

/// Numbers that one core generates at a time.
const PART: usize = 1 << 14;
/// Blocks of four numbers that are generated side by side, for vector instructions.
const LANES: usize = 16;

/// Piece of a stream to be written.
struct Normals<'a> {
    key: [u32; 2],
    stream: u32,
    /// First block of the piece.
    first: u64,
    numbers: &'a mut [f32],
}

impl Normals<'_> {
    #[inline(always)]
    fn write(self) {
        for (n, numbers) in self.numbers.chunks_mut(4 * LANES).enumerate() {
            let first = self.first + (n * LANES) as u64;
            let mut four = [[0.0; LANES]; 4];
            let mut words = [[0; LANES]; 4];
            for lane in 0..LANES {
                let block = first + lane as u64;
                let counter = [block as u32, (block >> 32) as u32, self.stream, 0];
                for (words, word) in words.iter_mut().zip(philox(counter, self.key)) {
                    words[lane] = word;
                }
            }
            for lane in 0..LANES {
                let words = [0, 1, 2, 3].map(|k| words[k][lane]);
                for (numbers, number) in four.iter_mut().zip(normal4(words)) {
                    numbers[lane] = number;
                }
            }
            for (lane, numbers) in numbers.chunks_mut(4).enumerate() {
                for (number, four) in numbers.iter_mut().zip(&four) {
                    *number = four[lane];
                }
            }
        }
    }
}

#[cfg(feature = "flex")]
impl pulp::WithSimd for Normals<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.write();
    }
}

/// Four independent normal numbers from four words.
#[inline(always)]
fn normal4(words: [u32; 4]) -> [f32; 4] {
    let [u0, u1, u2, u3] = words.map(|word| (f64::from(word) + 0.5) / 4294967296.0);
    let pair = |u: f64, v: f64| {
        let [cos, sin] = cos_sin_turns(v);
        let radius = (-2.0 * ln(u)).sqrt();
        [(radius * cos) as f32, (radius * sin) as f32]
    };
    let ([a, b], [c, d]) = (pair(u0, u1), pair(u2, u3));
    [a, b, c, d]
}

// The functions below are written without calls, branches and fused products, so that compilers turn them into vector
// instructions and every machine gives the same bits.

/// Cosine and sine of `turns` turns, 0 to 1, to within 2 units in the last place of 1.
///
/// Quarter turns are taken out exactly; the series of the remainder, at most π/4, end below 5e-17.
#[inline(always)]
fn cos_sin_turns(turns: f64) -> [f64; 2] {
    // Adding 1.5 · 2⁵² leaves the nearest whole number in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let shifted = 4.0 * turns + ROUND;
    let quarters = shifted.to_bits();
    let x = (4.0 * turns - (shifted - ROUND)) * std::f64::consts::FRAC_PI_2;
    let square = x * x;
    // Σ (−x²)ⁿ/(2n + 1)! and Σ (−x²)ⁿ/(2n)! by nested factors.
    let nested = |first: f64, count: usize| {
        (0..count).rev().fold(1.0, |sum, n| {
            let k = first + 2.0 * n as f64;
            1.0 - sum * square / (k * (k + 1.0))
        })
    };
    let (sin, cos) = (x * nested(2.0, 7), nested(1.0, 8));
    let [a, b] = if quarters & 1 == 0 {
        [cos, sin]
    } else {
        [sin, cos]
    };
    // Quarters 1 and 2 have negative cosines, 2 and 3 negative sines.
    let cos = if (quarters + 1) & 2 == 0 { a } else { -a };
    let sin = if quarters & 2 == 0 { b } else { -b };
    [cos, sin]
}

/// Natural logarithm of a positive normal floating-point number, to within 3 units in the last place.
///
/// ```text
/// ln u = e ln 2 + 2 artanh f,   u = 2^e m,   f = (m − 1)/(m + 1),   √½ ≤ m < √2
/// ```
///
/// The series of artanh ends below 2e-17.
#[inline(always)]
fn ln(u: f64) -> f64 {
    const FRACTION: u64 = (1 << 52) - 1;
    // The exponent of u/√½ is the power of two to be taken out.
    let bits = u.to_bits();
    let above = bits.wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits());
    let e = (above as i64) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(above & !FRACTION));
    let f = (m - 1.0) / (m + 1.0);
    let square = f * f;
    let series = (0..10)
        .rev()
        .fold(1.0 / 21.0, |sum, n| 1.0 / (2 * n + 1) as f64 + sum * square);
    e as f64 * std::f64::consts::LN_2 + 2.0 * f * series
}

/// Philox4x32 with ten rounds.
#[inline(always)]
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
#[inline(always)]
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

    /// The series against the functions of the standard library, over their whole ranges.
    #[test]
    fn logarithm_cosine_and_sine_are_right_to_few_units_in_the_last_place() {
        for k in 0..200_000u32 {
            // Words from the smallest to the largest, dense at both ends.
            let word = match k % 4 {
                0 => k,
                1 => u32::MAX - k,
                _ => k.wrapping_mul(2_654_435_769),
            };
            let u = (f64::from(word) + 0.5) / 4294967296.0;
            let error = (ln(u) / u.ln() - 1.0).abs();
            assert!(error < 3.0 * f64::EPSILON, "ln {u}: {error:e}");
            let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
            let [c, s] = cos_sin_turns(u);
            // The reference's angle is rounded by up to half a unit in the last place of 2π, 4.4e-16.
            for error in [(c - cos).abs(), (s - sin).abs()] {
                assert!(error < 4.0 * f64::EPSILON, "{u}: {error:e}");
            }
        }
    }

    /// Numbers of a stream follow the formula, to a unit in the last place of f32.
    #[test]
    fn numbers_are_those_of_the_formula() {
        let seed = 0x1234_5678_9ABC_DEF0_u64;
        let length = PART + 4 * LANES + 3;
        let numbers = NoiseSource::new(seed).normal(9, length);
        for (position, number) in numbers.into_iter().enumerate() {
            let words = philox(
                [(position / 4) as u32, 0, 9, 0],
                [seed as u32, (seed >> 32) as u32],
            );
            let u = words.map(|word| (f64::from(word) + 0.5) / 4294967296.0);
            let pair = position % 4 / 2 * 2;
            let (sin, cos) = (std::f64::consts::TAU * u[pair + 1]).sin_cos();
            let exact = (-2.0 * u[pair].ln()).sqrt() * if position % 2 == 0 { cos } else { sin };
            let error = (f64::from(number) - exact).abs();
            assert!(
                error <= f64::from(f32::EPSILON) * exact.abs() + 1e-15,
                "{position}"
            );
        }
    }

    #[test]
    fn noise_has_the_moments_of_the_normal_distribution() {
        let n = 400_000;
        let numbers = NoiseSource::new(7).normal(0, n);
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
