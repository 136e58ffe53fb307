//! Windows of open sea from both halves of an image.

use wake_physics::Field;

use wake_ldm::sea_texture::{SeaImage, SeaStyle, WINDOW};

/// A real window of a left half, and one of the right half of the same image, both of [`WINDOW`] rows and columns.
#[derive(Debug, Clone)]
pub struct SeaPair {
    /// Amplitudes of the left window, in the image's scale.
    pub left: Field,
    /// Amplitudes of the right window.
    pub right: Field,
    /// Style of the left window.
    pub style: SeaStyle,
    /// Median of the left window.
    pub median: f64,
}

impl SeaPair {
    /// Pairs of windows of open sea, spread over both halves of an image.
    ///
    /// - `most`: largest number of pairs
    #[must_use]
    pub fn of_image(left: &SeaImage, right: &SeaImage, most: usize) -> Vec<Self> {
        let [left, right] = [left, right].map(|half| -> Vec<(Field, SeaStyle)> {
            half.places()
                .filter_map(|place| half.patch(place))
                .collect()
        });
        let count = left.len().min(right.len()).min(most);
        let at = |half: &[(Field, SeaStyle)], n: usize| half[n * half.len() / count].clone();
        let pair = |n: usize| {
            let ((left, style), (right, _)) = (at(&left, n), at(&right, n));
            let median = left.mean() / f64::from(style.mean());
            Self {
                left,
                right,
                style,
                median,
            }
        };
        (0..count).map(pair).collect()
    }
}

/// Window of the given amplitudes.
pub(super) fn window(values: Vec<f32>) -> Field {
    Field {
        rows: WINDOW,
        columns: WINDOW,
        values,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use wake_physics::Raster;
    use wake_physics::sar::speckle::speckle;

    /// Speckle of four looks; an image of three windows beside one of two.
    #[test]
    fn a_pair_has_a_window_of_each_half() {
        let image = |windows: usize, seed: u64| {
            let raster = Raster::image(WINDOW, windows * WINDOW, 1.0);
            let mut field = Field::constant(&raster, 100.0);
            speckle(&mut field, 4, seed);
            field.values.iter_mut().for_each(|v| *v = v.sqrt());
            SeaImage::new(field, None).unwrap()
        };
        let (left, right) = (image(3, 1), image(2, 2));
        let pairs = SeaPair::of_image(&left, &right, 8);
        assert_eq!(pairs.len(), 2);
        assert_eq!(pairs[1].left, left.patch([0, WINDOW]).unwrap().0);
        assert_eq!(pairs[1].right, right.patch([0, WINDOW]).unwrap().0);
        for pair in &pairs {
            let mut sorted = pair.left.values.clone();
            sorted.sort_by(f32::total_cmp);
            let median = f64::from(sorted[sorted.len() / 2]);
            assert!((pair.median / median - 1.0).abs() < 1e-6);
        }
        assert_eq!(SeaPair::of_image(&left, &right, 1).len(), 1);
    }
}
