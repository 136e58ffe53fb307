//! The radar echo of the ship itself: bright points on its hull, imaged where its motion puts them.

use crate::raster::{Field, Raster};
use crate::sar::direct::weight_sum;
use crate::sar::geometry::direction;
use std::f64::consts::PI;

/// Radar cross section of a ship.
///
/// ```text
/// RCS = 52 √f D^{3/2}
/// ```
///
/// - `frequency` f \[Hz\] (1 MHz is the unit of the formula); `displacement` D \[kg\] (1000 t is its unit)
/// - returns the cross section \[m²\], about the median over aspects
///
/// # Validity
///
/// Measured from 1 to 10 GHz at grazing incidence on naval ships of 2 to 17 thousand tonnes. Its use at the
/// incidence angles of a satellite is chosen: real echoes scatter around it by 10 dB.
///
/// # References
///
/// Skolnik, *Introduction to Radar Systems* (1980), Section 2.8.
#[must_use]
pub(crate) fn ship_cross_section(frequency: f64, displacement: f64) -> f64 {
    52.0 * (frequency / 1e6).sqrt() * (displacement / 1e6).powf(1.5)
}

/// The echo of a ship: equal points that fill its waterplane.
///
/// The waterplane is that of a parabolic hull, half breadth B/2·(1 − (2s/L)²) at s from midship; points lie half a
/// pixel apart (chosen). The ship is rigid: its points are displaced together and are as sharp as the radar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Echo {
    /// Midship (x, y) \[m\], where the ship truly is.
    pub position: [f64; 2],
    /// Where it moves to [deg clockwise from azimuth].
    pub heading: f64,
    /// Length L \[m\].
    pub length: f64,
    /// Beam B \[m\].
    pub beam: f64,
    /// Radar cross section \[m²\].
    pub cross_section: f64,
    /// Azimuth displacement (R/V)·`u_r` \[m\], see [`crate::sar::geometry::azimuth_displacement`].
    pub displacement: f64,
}

impl Echo {
    /// Adds the echo to an image before speckle.
    ///
    /// - `resolution` \[m\]: of the radar in azimuth, for points at rest; in range it is the pixel
    ///
    /// The sum added is cross section / pixel area, less what falls outside the image.
    ///
    /// # Panics
    ///
    /// If the intensity is not of the raster's size.
    pub(crate) fn add_to(&self, intensity: &mut Field, raster: &Raster, resolution: f64) {
        assert_eq!(
            (intensity.rows, intensity.columns),
            (raster.rows, raster.columns),
            "an image of another size than its raster"
        );
        let points = self.points(raster.spacing);
        let area = raster.spacing * raster.spacing;
        let power = self.cross_section / (area * points.len() as f64);
        let variance = (resolution / raster.spacing).powi(2) / (2.0 * PI * PI);
        let variance = variance.max(super::imaging::SMALLEST_VARIANCE);
        for [x, y] in points {
            let [column, row] = raster.pixel(x, y + self.displacement);
            add_point(intensity, [row, column], power, variance);
        }
    }

    /// The bright points (x, y) \[m\] at the ship's true place.
    fn points(&self, spacing: f64) -> Vec<[f64; 2]> {
        let [ahead_x, ahead_y] = direction(self.heading);
        let along = (2.0 * self.length / spacing).ceil().max(1.0) as usize;
        let mut points = Vec::new();
        for i in 0..along {
            // −1 at the stern, 1 at the bow.
            let place = (2.0 * i as f64 + 1.0) / along as f64 - 1.0;
            let breadth = self.beam * (1.0 - place * place);
            let across = (2.0 * breadth / spacing).ceil().max(1.0) as usize;
            for j in 0..across {
                let side = breadth * ((j as f64 + 0.5) / across as f64 - 0.5);
                let ahead = 0.5 * self.length * place;
                points.push([
                    self.position[0] + ahead * ahead_x + side * ahead_y,
                    self.position[1] + ahead * ahead_y - side * ahead_x,
                ]);
            }
        }
        points
    }
}

/// Adds one point at (row, column), with fractions: Gaussian in azimuth, linear weights in range.
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

    fn ship(heading: f64, displacement: f64) -> Echo {
        Echo {
            position: [20.0, -30.0],
            heading,
            length: 195.0,
            beam: 26.0,
            cross_section: 5e5,
            displacement,
        }
    }

    /// Sum, centre (x, y) and standard deviations of an echo.
    fn moments(echo: &Echo, raster: &Raster, resolution: f64) -> (f64, [f64; 2], [f64; 2]) {
        let mut image = Field::constant(raster, 0.0);
        echo.add_to(&mut image, raster, resolution);
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

    #[test]
    fn the_cross_section_arrives_at_the_displaced_place() {
        let raster = Raster::image(400, 300, 2.5);
        for heading in [0.0, 45.0, 90.0, 225.0, 270.0] {
            let speed = 5.0;
            let velocity = ship_radial_velocity(speed, heading, 32f64.to_radians());
            let echo = ship(heading, azimuth_displacement(78.0, velocity));
            let (sum, [x, y], _) = moments(&echo, &raster, 3.0);
            // Rounding of f32 sums; the centre of a sampled Gaussian of half a pixel lies within 0.03 pixel.
            assert!((sum * 6.25 / 5e5 - 1.0).abs() < 1e-5);
            assert!((x - 20.0).abs() < 1e-2 && (y + 30.0 - echo.displacement).abs() < 0.1);
        }
        // Toward 90 is away from the radar: smaller y. Toward 270: larger.
        let away = ship_radial_velocity(5.0, 90.0, 0.5);
        assert!(azimuth_displacement(78.0, away) < -100.0);
    }

    #[test]
    fn the_echo_lies_along_the_heading() {
        let raster = Raster::image(400, 400, 2.5);
        // Standard deviation of s weighted with the breadth 1 − s²: 1/√5 of the half length.
        let along = 195.0 / 2.0 / 5f64.sqrt();
        let (_, _, north) = moments(&ship(0.0, 0.0), &raster, 3.0);
        let (_, _, east) = moments(&ship(90.0, 0.0), &raster, 3.0);
        // Points per breadth are whole numbers: 2 %.
        assert!((north[1] / along - 1.0).abs() < 0.02 && (east[0] / along - 1.0).abs() < 0.02);
        assert!(north[0] < 10.0 && east[1] < 10.0);
    }

    #[test]
    fn far_outside_there_is_nothing() {
        let raster = Raster::image(40, 30, 2.5);
        for displacement in [-1e7, 1e7] {
            let mut image = Field::constant(&raster, 0.0);
            ship(45.0, displacement).add_to(&mut image, &raster, 3.0);
            assert!(image.values.iter().all(|v| v.abs() < f32::MIN_POSITIVE));
        }
    }

    #[test]
    fn skolnik_by_hand() {
        // 52·√9600·10^1.5 = 161,118 m² for 10,000 t at 9.6 GHz.
        assert!((ship_cross_section(9.6e9, 1e7) / 161_118.0 - 1.0).abs() < 1e-4);
    }
}
