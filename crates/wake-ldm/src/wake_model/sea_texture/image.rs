//! An image of the sea, and the open sea in it.

use wake_physics::Field;

use super::style::SeaStyle;
use crate::error::{Error, Result};

/// Rows and columns of the patches from which a sea is learnt.
pub const WINDOW: usize = 128;

/// Amplitudes of any scale, with an optional mask of pixels that are ignored.
#[derive(Debug, Clone)]
pub struct SeaImage {
    amplitude: Field,
    hidden: Option<Field>,
}

impl SeaImage {
    /// Makes an image; pixels with `mask` above 0 are ignored.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for a mask of another size.
    pub fn new(amplitude: Field, mask: Option<Field>) -> Result<Self> {
        if let Some(mask) = &mask
            && [mask.rows, mask.columns] != [amplitude.rows, amplitude.columns]
        {
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "mask".to_owned(),
                value: format!("{} x {} pixels", mask.rows, mask.columns),
                expected: format!(
                    "{} x {}, the size of the image",
                    amplitude.rows, amplitude.columns
                ),
            }));
        }
        Ok(Self {
            amplitude,
            hidden: mask,
        })
    }

    /// Rows and columns of the image.
    pub fn size(&self) -> [usize; 2] {
        [self.amplitude.rows, self.amplitude.columns]
    }

    /// Positions of the first pixels of adjacent patches that fit into the image.
    pub fn places(&self) -> impl Iterator<Item = [usize; 2]> {
        let [rows, columns] = self.size().map(|n| n / WINDOW);
        (0..rows * columns).map(move |n| [n / columns * WINDOW, n % columns * WINDOW])
    }

    /// Returns the patch of [`WINDOW`] rows and columns at a position, and its style; `None` if any pixel is masked, or if the
    /// patch is not open sea or extends beyond the image.
    pub fn patch(&self, place: [usize; 2]) -> Option<(Field, SeaStyle)> {
        if let Some(hidden) = &self.hidden
            && cut(hidden, place)?.values.iter().any(|&m| m > 0.0)
        {
            return None;
        }
        let patch = cut(&self.amplitude, place)?;
        let style = SeaStyle::of(&patch)?;
        Some((patch, style))
    }
}

/// Cuts a patch out of a field; `None` if the patch is not inside.
fn cut(field: &Field, [top, left]: [usize; 2]) -> Option<Field> {
    if top + WINDOW > field.rows || left + WINDOW > field.columns {
        return None;
    }
    let rows = field.values.chunks_exact(field.columns).skip(top);
    let rows = rows.take(WINDOW).flat_map(|row| &row[left..left + WINDOW]);
    Some(Field {
        rows: WINDOW,
        columns: WINDOW,
        values: rows.copied().collect(),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// White noise of mean 100 and standard deviation 10.
    fn rough(rows: usize, columns: usize) -> Field {
        let white = NoiseSource::new(3).normal(0, rows * columns);
        Field {
            rows,
            columns,
            values: white.into_iter().map(|n| 100.0 + 10.0 * n).collect(),
        }
    }

    #[test]
    fn patches_hold_neither_targets_nor_what_a_mask_marks() {
        let mut image = rough(2 * WINDOW + 40, 2 * WINDOW);
        image.values[(WINDOW + 5) * 2 * WINDOW + WINDOW - 1] = 900.0;
        let mut mask = Field {
            values: vec![0.0; image.values.len()],
            ..image
        };
        mask.values[WINDOW] = 255.0;
        let open = SeaImage::new(image.clone(), Some(mask.clone())).unwrap();
        let found: Vec<[usize; 2]> = open
            .places()
            .filter(|&place| open.patch(place).is_some())
            .collect();
        assert_eq!(open.places().count(), 4);
        assert_eq!(found, [[0, 0], [WINDOW, WINDOW]]);
        // Patches one pixel away from the target, and just below the marked pixel.
        assert!(open.patch([1, WINDOW]).is_some() && open.patch([0, WINDOW]).is_none());
        assert!(open.patch([WINDOW + 5, WINDOW]).is_some());
        assert!(open.patch([WINDOW + 5, WINDOW - 1]).is_none());
        assert!(open.patch([WINDOW + 41, 0]).is_none() && open.patch([0, WINDOW + 1]).is_none());
        mask.rows -= 1;
        let refused = SeaImage::new(image, Some(mask)).unwrap_err().to_string();
        assert!(refused.contains("mask is 295 x 256"), "{refused}");
    }

    /// For 16,384 white pixels: mean 1, spread 0.1 and correlation 0 within five standard errors, at any scale.
    #[test]
    fn the_style_is_that_of_the_pixels() {
        let image = rough(WINDOW, WINDOW);
        let (patch, style) = SeaImage::new(image.clone(), None)
            .unwrap()
            .patch([0, 0])
            .unwrap();
        assert_eq!(patch, image);
        let error = 5.0 / WINDOW as f32;
        // The standard error of a median is √(π/2) times that of a mean.
        assert!((style.mean() - 1.0).abs() < 0.1 * error * 1.6);
        assert!((style.spread() - 0.1).abs() < 0.1 * error);
        let features = style.features();
        assert!(features[1].abs() < 2.5 * error && features[2].abs() < 2.0 * error);
        let darker = Field {
            values: image.values.iter().map(|v| 0.25 * v).collect(),
            ..image
        };
        assert_eq!(SeaStyle::of(&darker), Some(style));
        let flat = Field {
            values: vec![3.0; image.values.len()],
            ..image
        };
        assert_eq!(SeaStyle::of(&flat), None);
    }

    /// A coast through the middle has block means of 80 ± 20, a variation of a quarter; a weaker one has 90 ± 10.
    /// Values of 200 on
    /// one pixel in ten have a skewness of 0.1 · 0.9 · 0.8 · 100³/(1,030)^{3/2}, 2.2, and are not targets: eight deviations of 32
    /// above the mean of 110 is 367.
    #[test]
    fn land_and_coasts_are_no_sea() {
        let image = rough(WINDOW, WINDOW);
        let with = |change: fn(usize, f32) -> f32| {
            let values = image.values.iter().enumerate();
            SeaStyle::of(&Field {
                values: values.map(|(n, &v)| change(n, v)).collect(),
                ..image
            })
        };
        assert!(with(|_, v| v).is_some());
        assert!(with(|n, v| if n % WINDOW < 64 { 0.6 * v } else { v }).is_none());
        assert!(with(|n, v| if n % WINDOW < 64 { 0.8 * v } else { v }).is_some());
        assert!(with(|n, v| if n.is_multiple_of(10) { 2.0 * v } else { v }).is_none());
    }
}
