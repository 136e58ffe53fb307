//! Borders of the squares of which an image is composed.

use crate::raster::Field;

/// Mean squared difference of neighbours across the borders of squares, over the mean squared difference elsewhere \[1\], along
/// rows or columns, whichever is larger; `None` where nothing differs or there is no border.
///
/// 1 for an image without squares, larger for an image that is composed of them.
///
/// - `side`: side of a square \[pixels\], at least 2; the first square begins at the first pixel
#[must_use]
pub fn seams(field: &Field, side: usize) -> Option<f64> {
    let ratio = |down: bool| {
        let [mut across, mut inside] = [(0.0, 0usize); 2];
        for i in 0..field.rows - usize::from(down) {
            for j in 0..field.columns - usize::from(!down) {
                let next = match down {
                    true => field.at(i + 1, j),
                    false => field.at(i, j + 1),
                };
                let place = if down { i } else { j };
                let sum = match (place + 1).is_multiple_of(side) {
                    true => &mut across,
                    false => &mut inside,
                };
                sum.0 += (f64::from(next) - f64::from(field.at(i, j))).powi(2);
                sum.1 += 1;
            }
        }
        let mean = |(sum, count): (f64, usize)| sum / count as f64;
        (across.1 > 0 && inside.0 > 0.0).then(|| mean(across) / mean(inside))
    };
    if field.values.is_empty() {
        return None;
    }
    Some(ratio(true)?.max(ratio(false)?))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};
    use rand::RngExt;
    use rand_distr::StandardNormal;

    const SIDE: usize = 256;

    fn field(value: impl Fn(usize, usize) -> f64) -> Field {
        Field {
            rows: SIDE,
            columns: SIDE,
            values: (0..SIDE * SIDE)
                .map(|n| value(n / SIDE, n % SIDE) as f32)
                .collect(),
        }
    }

    fn white(seed: u64) -> Vec<f64> {
        let mut random = generator(seed, Stream::Sea, 0);
        (0..SIDE * SIDE)
            .map(|_| random.sample(StandardNormal))
            .collect()
    }

    /// Squares that differ by noise of variance b under noise of variance 1: the mean squared difference of neighbours is 2
    /// within the squares, 2 + 2b across their borders.
    #[test]
    fn borders_of_squares_are_seen() {
        let (noise, steps) = (white(5), white(6));
        let even = field(|i, j| noise[i * SIDE + j]);
        // Some 8,000 pairs across borders: four standard errors of their mean square.
        let error = 4.0 * (2.0 / 8000.0f64).sqrt();
        assert!((seams(&even, 8).unwrap() - 1.0).abs() < error);
        let step = |i: usize, j: usize| 3.0 * steps[(i / 8) * SIDE + j / 8];
        let squares = field(|i, j| noise[i * SIDE + j] + step(i, j));
        // 992 pairs of squares; consecutive borders share a square, which adds half as much again.
        let error = 4.0 * (3.0 / 992.0f64).sqrt();
        assert!((seams(&squares, 8).unwrap() / 10.0 - 1.0).abs() < error);
        // Borders of squares of another size: as many steps as elsewhere.
        assert!((seams(&squares, 7).unwrap() - 1.0).abs() < 0.5);
        assert_eq!(seams(&field(|_, _| 2.0), 8), None);
    }
}
