//! Grey images.

use wake_physics::Field;
use wake_physics::grey::GreyScale;
use wake_physics::measure::median;

/// An image with grey levels 0…1.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Pixels `[rows, columns]`, row by row.
    pub pixels: Vec<f32>,
}

impl Grey {
    /// Converts a field of σ⁰ or intensity to grey.
    pub(super) fn of_power(power: &Field, scale: &GreyScale) -> Self {
        let grey = |&p: &f32| scale.grey(f64::from(p)) as f32;
        Self {
            rows: power.rows,
            columns: power.columns,
            pixels: power.values.iter().map(grey).collect(),
        }
    }

    /// Converts intensities to a quick-look: amplitude stretched by an unknown factor, in 8 bits.
    ///
    /// ```text
    /// grey = offset + gain · a / median(a),   a = √intensity,   in steps of 1/255 from 0 to 1
    /// ```
    ///
    /// Also returns the amplitudes of grey 0 and 1, a = median(a) (grey − offset)/gain; `None` if the median or the gain is zero.
    /// An image with zero median has the grey level `offset` everywhere.
    pub fn quick_look(power: &Field, gain: f64, offset: f64) -> (Self, Option<[f64; 2]>) {
        let mut pixels: Vec<f32> = power.values.iter().map(|&p| p.max(0.0).sqrt()).collect();
        let median = median(&pixels);
        let factor = if median > 0.0 {
            gain as f32 / median
        } else {
            0.0
        };
        for a in &mut pixels {
            let grey = (offset as f32 + factor * *a).clamp(0.0, 1.0);
            *a = (255.0 * grey).round() / 255.0;
        }
        let ends = [0.0, 1.0].map(|grey| f64::from(median) * (grey - offset) / gain);
        let image = Self {
            rows: power.rows,
            columns: power.columns,
            pixels,
        };
        (image, (median > 0.0 && gain > 0.0).then_some(ends))
    }

    /// Pixels rounded to 8-bit levels.
    pub fn levels(&self) -> Vec<u8> {
        let level = |&grey: &f32| (255.0 * grey).round() as u8;
        self.pixels.iter().map(level).collect()
    }

    /// Makes an image from 8-bit levels.
    pub fn of_levels(levels: &[u8], rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            pixels: levels.iter().map(|&l| f32::from(l) / 255.0).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(values: &[f32]) -> Field {
        Field {
            rows: 1,
            columns: values.len(),
            values: values.to_vec(),
        }
    }

    /// Whatever the unit of the intensity, the median amplitude has the grey level gain + offset, and grey is linear in
    /// amplitude, in steps of 8 bits.
    #[test]
    fn a_quick_look_is_amplitude_of_an_unknown_factor() {
        let power = [0.0, 1.0, 4.0, 9.0, 1e6];
        let expected = [0.1, 0.2, 0.3, 0.4, 1.0];
        for factor in [1e-6, 1.0, 1e3] {
            let power = power.map(|p| factor * p);
            let (grey, amplitudes) = Grey::quick_look(&field(&power), 0.2, 0.1);
            let [dark, bright] = amplitudes.unwrap();
            for (level, power) in grey.pixels.iter().zip(power).take(4) {
                // Half a level of the 255 between the ends; the last pixel is saturated.
                let found = dark + f64::from(*level) * (bright - dark);
                assert!((found - f64::from(power).sqrt()).abs() <= (bright - dark) / 509.0);
            }
            assert_eq!((grey.rows, grey.columns), (1, 5));
            for (found, expected) in grey.pixels.iter().zip(expected) {
                // Half a level, and the rounding of both numbers.
                assert!((found - expected).abs() <= 0.5 / 255.0 + 1e-6, "{found}");
                assert!((255.0 * found - (255.0 * found).round()).abs() < 1e-4);
            }
        }
        let (dark, none) = Grey::quick_look(&field(&[0.0; 3]), 0.2, -0.1);
        assert_eq!(none, None);
        assert_eq!(dark.pixels, [0.0; 3]);
        assert!(Grey::quick_look(&field(&[]), 0.2, 0.1).0.pixels.is_empty());
    }
}
