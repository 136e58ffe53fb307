//! Images to learn from, and where the wakes are in them.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

/// A wake in an image: a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wake {
    /// Where its line begins, (column, row); whole numbers at the centres of pixels.
    pub(crate) tip: [f32; 2],
    /// From the tip along the wake [deg clockwise from the image's up].
    pub(crate) axis_deg: f32,
    /// Half the angle between the outer edges [deg].
    pub(crate) half_angle_deg: f32,
    /// How far it can be seen \[pixels\].
    pub(crate) length: f32,
    /// Signal over noise of a filter that knows the wake, or infinity where a label states none.
    pub(crate) snr: f32,
}

impl Wake {
    /// The unit vector from the tip along the wake, (right, down).
    pub(crate) fn direction(&self) -> [f32; 2] {
        direction(self.axis_deg)
    }

    /// The place `along` the wake.
    pub(crate) fn at(&self, along: f32) -> [f32; 2] {
        let [right, down] = self.direction();
        [self.tip[0] + along * right, self.tip[1] + along * down]
    }
}

/// The unit vector (right, down) of an angle clockwise from the image's up.
pub(crate) fn direction(degrees: f32) -> [f32; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sin, -cos]
}

/// The angle of a vector (right, down), clockwise from the image's up, 0 to 360.
pub(crate) fn angle_of([right, down]: [f32; 2]) -> f32 {
    right.atan2(-down).to_degrees().rem_euclid(360.0)
}

/// An image with its wakes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sample {
    /// Rows and columns of a square image.
    pub(crate) size: usize,
    /// Grey levels from 0 to 255, row by row.
    pub(crate) pixels: Vec<f32>,
    /// All wakes, the weak ones too.
    pub(crate) wakes: Vec<Wake>,
}

/// Images as a pure function of their number.
pub(crate) trait Source: Sync {
    /// Image number `index`, always the same one.
    fn sample(&self, index: u64) -> Sample;
}

/// Random numbers of one image.
pub(crate) struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Those of a seed and a position.
    pub(crate) fn new(seed: u64, index: u64) -> Self {
        let mixed =
            seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index.wrapping_mul(0xD1B5_4A32_D192_ED03);
        Self(Xoshiro256PlusPlus::seed_from_u64(mixed))
    }

    /// Uniform between two numbers.
    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.0.random::<f32>()
    }

    /// Uniform in the logarithm; both numbers are positive.
    pub(crate) fn scale(&mut self, low: f32, high: f32) -> f32 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// True with a probability.
    pub(crate) fn chance(&mut self, probability: f32) -> bool {
        self.0.random::<f32>() < probability
    }

    /// −1 or 1.
    pub(crate) fn sign(&mut self) -> f32 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Normal, mean 0, variance 1.
    pub(crate) fn normal(&mut self) -> f32 {
        self.0.sample(StandardNormal)
    }

    /// An index drawn with the given weights.
    pub(crate) fn one_of(&mut self, weights: &[f32]) -> usize {
        let mut left = self.between(0.0, weights.iter().sum());
        for (i, weight) in weights.iter().enumerate() {
            left -= weight;
            if left < 0.0 {
                return i;
            }
        }
        weights.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_vectors_are_inverse() {
        for degrees in [0.0, 37.0, 90.0, 181.0, 270.0, 359.0] {
            assert!((angle_of(direction(degrees)) - degrees).abs() < 1e-3);
        }
        // Up is a smaller row, right a larger column.
        assert!(direction(0.0)[1] < -0.999 && direction(90.0)[0] > 0.999);
    }
}
