//! Echo of a ship on pixels with independent speckle, used if no impulse response images it.

use crate::raster::{Field, Raster};
use crate::sar::dense::weight_sum;
use crate::sar::impulse::PointTarget;
use std::f64::consts::PI;

/// Adds points to an image before speckle: Gaussian in azimuth, shared linearly between two columns in range.
///
/// - `intensity`: the image, `[rows, columns]` of `raster`, linear in units of σ⁰
/// - `resolution` \[m\]: azimuth resolution of the radar for points at rest; in range it is the pixel
///
/// The added sum is the points' cross section over the pixel area, minus the part outside the image.
///
/// # Panics
///
/// If the intensity does not match the raster in size.
pub(crate) fn add_points(
    intensity: &mut Field,
    raster: &Raster,
    points: &[PointTarget],
    resolution: f64,
) {
    assert_eq!(
        (intensity.rows, intensity.columns),
        (raster.rows, raster.columns),
        "an image of another size than its raster"
    );
    let area = raster.spacing * raster.spacing;
    let variance = (resolution / raster.spacing).powi(2) / (2.0 * PI * PI);
    let variance = variance.max(super::imaging::SMALLEST_VARIANCE);
    for point in points {
        let [column, row] = raster.pixel(point.position[0], point.position[1]);
        add_point(
            intensity,
            [row, column],
            point.cross_section / area,
            variance,
        );
    }
}

/// Adds one point at a fractional (row, column): Gaussian in azimuth, linear weights in range.
fn add_point(image: &mut Field, [row, column]: [f64; 2], power: f64, variance: f64) {
    let sum = weight_sum(row, variance);
    // exp(−18) of the peak is below the rounding of f32.
    let reach = 6.0 * variance.sqrt();
    let first = (row - reach).ceil().max(0.0) as usize;
    let last = (row + reach).floor().min(image.rows as f64 - 1.0);
    let left = column.floor();
    for (at, share) in [(left, left + 1.0 - column), (left + 1.0, column - left)] {
        if at < 0.0 || at >= image.columns as f64 || last < 0.0 {
            continue;
        }
        for i in first..=last as usize {
            let weight = (-(i as f64 - row).powi(2) / (2.0 * variance)).exp() / sum;
            image.values[i * image.columns + at as usize] += (power * share * weight) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sar::geometry::{azimuth_displacement, ship_radial_velocity};

    /// Sum, centre (x, y) and standard deviations \[m\] of the intensity added by points.
    fn moments(points: &[PointTarget], raster: &Raster) -> (f64, [f64; 2], [f64; 2]) {
        let mut image = Field::constant(raster, 0.0);
        add_points(&mut image, raster, points, 3.0);
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        for i in 0..raster.rows {
            for j in 0..raster.columns {
                let v = f64::from(image.at(i, j));
                sum += v;
                for (axis, at) in [raster.x(j), raster.y(i)].into_iter().enumerate() {
                    first[axis] += v * at;
                    second[axis] += v * at * at;
                }
            }
        }
        let mean = first.map(|v| v / sum);
        let deviation = [0, 1].map(|a| (second[a] / sum - mean[a] * mean[a]).sqrt());
        (sum, mean, deviation)
    }

    fn points(y: f64) -> [PointTarget; 2] {
        [([17.3, y - 40.0], 1e5), ([31.1, y + 10.0], 4e5)].map(|(position, cross_section)| {
            PointTarget {
                position,
                cross_section,
            }
        })
    }

    #[test]
    fn the_cross_section_arrives_at_its_place() {
        let raster = Raster::image(400, 300, 2.5);
        for heading in [0.0, 45.0, 90.0, 225.0, 270.0] {
            let velocity = ship_radial_velocity(5.0, heading, 32f64.to_radians());
            let shift = azimuth_displacement(78.0, velocity);
            let (sum, [x, y], _) = moments(&points(shift), &raster);
            // Rounding of f32 sums; the centre of a sampled Gaussian half a pixel wide lies within 0.03 pixel.
            assert!((sum * 6.25 / 5e5 - 1.0).abs() < 1e-5);
            assert!((x - (0.2 * 17.3 + 0.8 * 31.1)).abs() < 1e-2 && (y - shift).abs() < 0.1);
        }
        // Heading 90 is away from the radar: smaller y. Heading 270: larger.
        let away = ship_radial_velocity(5.0, 90.0, 0.5);
        assert!(azimuth_displacement(78.0, away) < -100.0);
    }

    /// A point is as wide as the radar's azimuth resolution, ρ/(√2 π), and at least half a pixel.
    #[test]
    fn a_point_is_as_sharp_as_the_radar() {
        let raster = Raster::image(100, 90, 0.5);
        let one = PointTarget {
            position: [0.0, 1.2],
            cross_section: 1.0,
        };
        let (_, _, [x, y]) = moments(&[one], &raster);
        let width = 3.0 / (2f64.sqrt() * PI);
        assert!(x < 1e-3 && (y / width - 1.0).abs() < 1e-4, "{x} {y}");
    }

    #[test]
    fn far_outside_there_is_nothing() {
        let raster = Raster::image(40, 30, 2.5);
        for y in [-1e7, 1e7] {
            let mut image = Field::constant(&raster, 0.0);
            add_points(&mut image, &raster, &points(y), 3.0);
            assert!(image.values.iter().all(|v| v.abs() < f32::MIN_POSITIVE));
        }
    }
}
