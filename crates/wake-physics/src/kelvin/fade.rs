//! Fade of the free waves: all of them astern, none ahead, and a smooth transition along the hull.

use crate::raster::{Field, Raster};
use crate::track::Track;

/// Factor on the free waves at ξ forward of midship.
///
/// ```text
/// s = (L/2 − ξ)/L brought into [0, 1],     fade = s³ (10 − 15 s + 6 s²)
/// ```
///
/// 0 ahead of the bow, 1 astern of the stern, twice differentiable between. The free waves alone are right only astern; near the
/// hull there is a local disturbance as well, which is left out. The transition is a choice: it hides the wrong waves ahead
/// without a step.
///
/// - `forward` ξ \[m\]
/// - `length` L \[m\], above 0
#[must_use]
pub fn fade(forward: f64, length: f64) -> f64 {
    let s = (0.5 - forward / length).clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// [`fade`], and its derivatives by ξ and by L [1/m].
#[inline(always)]
pub(crate) fn fade_with_slope(forward: f64, length: f64) -> [f64; 3] {
    let s = (0.5 - forward / length).clamp(0.0, 1.0);
    let slope = 30.0 * (s * (1.0 - s)).powi(2);
    [
        fade(forward, length),
        -slope / length,
        slope * forward / (length * length),
    ]
}

/// [`fade`] at every pixel of a raster.
#[must_use]
pub fn fade_field(track: &Track, length: f64, raster: &Raster) -> Field {
    let mut field = Field::constant(raster, 0.0);
    fill_fade(&mut field, track, length, raster);
    field
}

/// [`fade`] at a place (x, y) \[m\]; 1 for a turning ship, whose waves begin where they are sent.
pub(crate) fn fade_at(track: &Track, length: f64, place: [f64; 2]) -> f64 {
    match track.turn() {
        None => fade(track.seen_from_ship(place)[0], length),
        Some(_) => 1.0,
    }
}

/// Fills a field of the raster's size with [`fade_field`].
pub(crate) fn fill_fade(field: &mut Field, track: &Track, length: f64, raster: &Raster) {
    if track.turn().is_some() {
        field.values.fill(1.0);
        return;
    }
    let [fx, fy] = track.forward;
    let corner = track.seen_from_ship([raster.x(0), raster.y(0)])[0];
    let (down, right) = (-fy * raster.spacing, fx * raster.spacing);
    field.fill_from_fn(|i, j| fade(corner + i as f64 * down + j as f64 * right, length) as f32);
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact outside the passage")]
mod tests {
    use super::*;

    #[test]
    fn nothing_ahead_everything_astern() {
        assert_eq!(fade(50.1, 100.0), 0.0);
        assert_eq!(fade(50.0, 100.0), 0.0);
        assert_eq!(fade(-50.0, 100.0), 1.0);
        assert_eq!(fade(-1e9, 100.0), 1.0);
        assert_eq!(fade(0.0, 100.0), 0.5);
    }

    /// The fade falls toward the bow without a step in its slope: its second difference is at most of second order.
    #[test]
    fn passage_is_smooth() {
        let d = 0.01;
        let mut last = 1.0;
        for i in -6000..6000 {
            let x = f64::from(i) * d;
            let bend = fade(x + d, 100.0) - 2.0 * fade(x, 100.0) + fade(x - d, 100.0);
            // |fade''| ≤ 10/√3/L².
            assert!(bend.abs() <= 5.8e-4 * d * d + 1e-15);
            assert!(fade(x, 100.0) <= last);
            last = fade(x, 100.0);
        }
    }

    #[test]
    fn slopes_are_derivatives() {
        for forward in [-60.0, -49.0, -20.0, 0.0, 31.0, 49.9, 80.0] {
            let [value, by_forward, by_length] = fade_with_slope(forward, 100.0);
            assert_eq!(value, fade(forward, 100.0));
            let d = 1e-4;
            let central = |at: &dyn Fn(f64) -> f64| (at(d) - at(-d)) / (2.0 * d);
            let expected = central(&|d| fade(forward + d, 100.0));
            // d² times third derivatives of 60/L³, and rounding.
            assert!((by_forward - expected).abs() < 1e-10, "{forward}");
            let expected = central(&|d| fade(forward, 100.0 + d));
            assert!((by_length - expected).abs() < 1e-10, "{forward}");
        }
    }

    #[test]
    fn field_is_the_function() {
        let raster = Raster::image(9, 12, 20.0);
        let track = Track::new([10.0, -30.0], 210.0, 0.0);
        let field = fade_field(&track, 100.0, &raster);
        for (i, j) in [(0, 0), (3, 5), (8, 11), (4, 6)] {
            let seen = track.seen_from_ship([raster.x(j), raster.y(i)]);
            assert!((f64::from(field.at(i, j)) - fade(seen[0], 100.0)).abs() < 1e-6);
        }
    }
}
