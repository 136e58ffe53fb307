//! Resampling of grey images.

/// Resamples an image with a triangular filter as wide as the coarser of the old and new pixels.
///
/// The centre of the first pixel moves to ½ · factor − ½. Returns rows, columns and pixels.
pub(crate) fn rescaled(
    pixels: &[f32],
    rows: usize,
    columns: usize,
    factor: f32,
) -> (usize, usize, Vec<f32>) {
    if (factor - 1.0).abs() < 1e-6 {
        return (rows, columns, pixels.to_vec());
    }
    let size = |n: usize| ((n as f32 * factor).round() as usize).max(1);
    let (new_rows, new_columns) = (size(rows), size(columns));
    let across = weights(columns, new_columns, factor);
    let mut narrow = vec![0.0; rows * new_columns];
    for (to, from) in narrow
        .chunks_exact_mut(new_columns)
        .zip(pixels.chunks_exact(columns))
    {
        for (x, (first, weights)) in to.iter_mut().zip(&across) {
            *x = weights
                .iter()
                .zip(&from[*first..])
                .map(|(w, x)| w * x)
                .sum();
        }
    }
    let mut scaled = vec![0.0; new_rows * new_columns];
    for (to, (first, weights)) in scaled
        .chunks_exact_mut(new_columns)
        .zip(weights(rows, new_rows, factor))
    {
        for (k, w) in weights.iter().enumerate() {
            let from = &narrow[(first + k) * new_columns..][..new_columns];
            to.iter_mut().zip(from).for_each(|(to, x)| *to += w * x);
        }
    }
    (new_rows, new_columns, scaled)
}

/// For every new pixel, the first old pixel under its triangle, and the weights, which sum to 1.
fn weights(old: usize, new: usize, factor: f32) -> Vec<(usize, Vec<f32>)> {
    let reach = (1.0 / factor).max(1.0);
    let one = |i: usize| {
        let centre = (i as f32 + 0.5) / factor - 0.5;
        let first = (centre - reach).ceil().clamp(0.0, (old - 1) as f32) as usize;
        let last = (centre + reach).floor().clamp(0.0, (old - 1) as f32) as usize;
        let weight = |k: usize| (1.0 - (k as f32 - centre).abs() / reach).max(0.0);
        let mut weights: Vec<f32> = (first..=last).map(weight).collect();
        let sum: f32 = weights.iter().sum();
        match sum > 0.0 {
            true => weights.iter_mut().for_each(|w| *w /= sum),
            false => weights[0] = 1.0,
        }
        (first, weights)
    };
    (0..new).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Constants and the slopes of ramps are kept: pixel i of the new image lies at (i + ½)/factor − ½ of the old.
    #[test]
    fn scaling_keeps_constants_and_ramps() {
        let (rows, columns) = (40, 60);
        let ramp: Vec<f32> = (0..rows * columns)
            .map(|i| (i % columns) as f32 + 2.0 * (i / columns) as f32)
            .collect();
        for factor in [0.35f32, 0.5, 0.7, 1.0, 1.4] {
            let (r, c, scaled) = rescaled(&ramp, rows, columns, factor);
            let at = |i: usize| (i as f32 + 0.5) / factor - 0.5;
            for row in r / 4..3 * r / 4 {
                for column in c / 4..3 * c / 4 {
                    let expected = at(column) + 2.0 * at(row);
                    // Sampled at whole pixels, the centre of mass of a triangle is off by less than a tenth of a pixel.
                    let error = (scaled[row * c + column] - expected).abs();
                    assert!(error < 0.3, "{factor} {row} {column}: {error}");
                }
            }
            let (.., flat) = rescaled(&vec![5.0; rows * columns], rows, columns, factor);
            assert!(flat.iter().all(|x| (x - 5.0).abs() < 1e-4));
        }
    }
}
