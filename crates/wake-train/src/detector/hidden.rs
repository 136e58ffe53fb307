//! Parts of wakes under painted clutter.

/// Brightness above which clutter hides a wake, in medians of the image.
pub(super) const HIDES: f32 = 0.5;
/// Number of samples along a line.
const SAMPLES: usize = 64;

/// Share of the samples of a line inside an image that nothing hides; 1 for a line outside the image.
///
/// - `from`, `to`: ends (column, row) of the line
/// - `size`: rows and columns of the image
/// - `hidden`: whether the pixel of an index, row by row, is hidden
pub(super) fn free_share(
    [from, to]: [[f64; 2]; 2],
    size: usize,
    hidden: impl Fn(usize) -> bool,
) -> f64 {
    let inside = |x: f64| (x >= 0.0 && x < size as f64 - 0.5).then(|| x.round() as usize);
    let pixel = |k: usize| {
        let t = (k as f64 + 0.5) / SAMPLES as f64;
        let [x, y] = [0, 1].map(|axis| inside(from[axis] + t * (to[axis] - from[axis])));
        Some(y? * size + x?)
    };
    let (mut samples, mut free) = (0, 0);
    for i in (0..SAMPLES).filter_map(pixel) {
        samples += 1;
        free += usize::from(!hidden(i));
    }
    match samples {
        0 => 1.0,
        samples => free as f64 / f64::from(samples),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right of a column everything is hidden; parts of the line outside of the image do not count.
    #[test]
    fn a_line_is_free_up_to_a_coast() {
        for (line, coast, expected) in [
            ([[0.0, 15.0], [80.0, 15.0]], 20, 0.25),
            ([[0.0, 15.0], [80.0, 15.0]], 96, 1.0),
            ([[0.0, 15.0], [80.0, 15.0]], 0, 0.0),
            ([[-80.0, 15.0], [80.0, 15.0]], 20, 0.25),
            ([[5.0, -20.0], [5.0, -80.0]], 0, 1.0),
        ] {
            let share = free_share(line, 96, |i| i % 96 >= coast);
            // One of the 32 or 64 samples in the image more or less.
            assert!((share - expected).abs() < 0.04, "{share} {expected}");
        }
    }
}
