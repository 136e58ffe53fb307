//! Scene of each block: the product's local radar geometry, and ships and wind in image directions.

use std::ops::Range;

use wake_geo::{PixelAxes, Polarization, Product, Sentinel1};
use wake_physics::Scene;
use wake_physics::scene::Ship;

use crate::error::{Error, Result};
use crate::ships::ShipAt;

/// The wind over the whole product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Speed at 10 m \[m/s\].
    pub speed: f64,
    /// Direction that it blows toward, clockwise from true north \[degrees\].
    pub toward: f64,
}

/// Ships farther than this from a block leave no visible wake in it \[m\].
const REACH: f64 = 12_000.0;

/// Tolerance of the scenes, as in data sets for detectors: speckle of a few looks hides smaller errors.
const TOLERANCE: f64 = 0.02;

/// Inputs of the scenes of all blocks.
#[derive(Debug)]
pub(crate) struct Scenes<'a> {
    product: &'a Product,
    base: Scene,
    wind: Wind,
    /// Ships with their line and pixel in the product.
    ships: Vec<(ShipAt, [f64; 2])>,
}

impl<'a> Scenes<'a> {
    /// - `changes`: assignments to keys of a scene, such as `sea.fetch=50e3`
    pub(crate) fn new(
        product: &'a Product,
        ships: &[ShipAt],
        wind: Wind,
        changes: &[String],
    ) -> Result<Self> {
        let sentinel = sentinel(product)?;
        let sensor = sensor(product, sentinel)?;
        let polarization = format!(
            "radar.polarization={}",
            sentinel.annotation().polarization.name()
        );
        // Changes come last, so that they can override the tolerance.
        let accuracy = format!("model.tolerance={TOLERANCE}");
        let mut assignments = vec![format!("radar.sensor={sensor}"), polarization, accuracy];
        assignments.extend_from_slice(changes);
        let mut base = Scene::default().with_assignments(&assignments)?;
        base.ships.clear();
        // Noise is added from the product's annotation; ambiguities may lie in other blocks, and are left out.
        base.radar.nesz = None;
        (base.radar.azimuth_ambiguity, base.radar.prf) = (None, None);
        base.radar.frequency = sentinel.annotation().radar_frequency;
        base.sea.wind_speed = wind.speed;
        base.validate()?;
        let placed = ships.iter().filter_map(|ship| {
            let (line, pixel) = product.pixel_of(ship.latitude, ship.longitude)?;
            Some((ship.clone(), [line, pixel]))
        });
        let scenes = Self {
            product,
            base,
            wind,
            ships: placed.collect(),
        };
        Ok(scenes)
    }

    /// Incidence angle of a pixel \[degrees\], if the product gives it.
    pub(crate) fn incidence(&self, line: f64, pixel: f64) -> Result<Option<f64>> {
        Ok(self.product.place(line, pixel)?.incidence)
    }

    /// Ships in the product, with their lines and pixels.
    pub(crate) fn ships(&self) -> &[(ShipAt, [f64; 2])] {
        &self.ships
    }

    /// Makes the scene of a block.
    ///
    /// Row 0 of a scene is the farthest along azimuth, line 0 of a product the first acquired: line l of a block of n lines is
    /// row n − 1 − l.
    pub(crate) fn scene(
        &self,
        lines: &Range<usize>,
        pixels: &Range<usize>,
        seed: u64,
    ) -> Result<Scene> {
        let middle = |range: &Range<usize>| 0.5 * (range.start + range.end - 1) as f64;
        let (line, pixel) = (middle(lines), middle(pixels));
        let (place, axes) = (
            self.product.place(line, pixel)?,
            self.product.axes(line, pixel)?,
        );
        let mut scene = self.base.clone();
        scene.seed = seed;
        (scene.grid.rows, scene.grid.columns) = (lines.len(), pixels.len());
        // Distances between places on the map would include the heights of the geolocation grid near coasts.
        let annotation = sentinel(self.product)?.annotation();
        let [down, across] = [annotation.azimuth_spacing, annotation.range_spacing];
        scene.grid.spacing = 0.5 * (down + across);
        if let Some(incidence) = place.incidence {
            scene.radar.incidence = incidence;
        }
        if let Some(ratio) = self.product.range_to_velocity(line, pixel)? {
            // Keep displacements in lines as in the product.
            scene.radar.range_to_velocity = ratio * scene.grid.spacing / down;
        }
        scene.sea.wind_toward = in_scene(&axes, self.wind.toward);
        let spacing = scene.grid.spacing;
        for (ship, [line, pixel]) in &self.ships {
            let away = |at: f64, range: &Range<usize>| {
                (range.start as f64 - at)
                    .max(at - (range.end - 1) as f64)
                    .max(0.0)
                    * spacing
            };
            if away(*line, lines).hypot(away(*pixel, pixels)) > REACH {
                continue;
            }
            scene.ships.push(Ship {
                position: in_part(spacing, (lines, pixels), [*line, *pixel]),
                heading: in_scene(&axes, ship.heading),
                speed: ship.speed,
                length: ship.length,
                beam: ship.beam,
                draft: ship.draft,
                echo: true,
                edge: true,
                ..Ship::default()
            });
        }
        scene.validate()?;
        Ok(scene)
    }
}

/// Position (x, y) in the scene of a part \[m\].
///
/// - `at`: line and pixel of the product
pub(crate) fn in_part(
    spacing: f64,
    (lines, pixels): (&Range<usize>, &Range<usize>),
    at: [f64; 2],
) -> [f64; 2] {
    let first_row = (lines.len() / 2) as f64 - (lines.len() - 1) as f64;
    let first_column = -((pixels.len() / 2) as f64);
    [
        (at[1] - pixels.start as f64 + first_column) * spacing,
        (at[0] - lines.start as f64 + first_row) * spacing,
    ]
}

/// Converts a direction clockwise from true north to a scene's, clockwise from the direction of lines \[degrees\], so that a ship
/// crosses the same pixels, although the product's axes are not quite orthogonal and have unequal spacing.
pub(crate) fn in_scene(axes: &PixelAxes, toward: f64) -> f64 {
    let sine = |degrees: f64| degrees.to_radians().sin();
    let lines = sine(axes.pixel_azimuth - toward) / axes.line_spacing;
    let pixels = sine(toward - axes.line_azimuth) / axes.pixel_spacing;
    pixels.atan2(lines).to_degrees().rem_euclid(360.0) % 360.0
}

/// The inverse of [`in_scene`].
pub(crate) fn on_map(axes: &PixelAxes, in_scene: f64) -> f64 {
    let (sin, cos) = in_scene.to_radians().sin_cos();
    let [line, pixel] = [axes.line_azimuth, axes.pixel_azimuth].map(f64::to_radians);
    let (lines, pixels) = (cos * axes.line_spacing, sin * axes.pixel_spacing);
    let east = lines * line.sin() + pixels * pixel.sin();
    let north = lines * line.cos() + pixels * pixel.cos();
    east.atan2(north).to_degrees().rem_euclid(360.0) % 360.0
}

/// The Sentinel-1 product.
pub(crate) fn sentinel(product: &Product) -> Result<&Sentinel1> {
    product.sentinel1().ok_or_else(|| Error::Template {
        path: product.path().to_owned(),
        why: "it is not a Sentinel-1 product; give a .SAFE folder or its .zip".to_owned(),
    })
}

/// Sensor preset for the product's mode.
fn sensor(product: &Product, sentinel: &Sentinel1) -> Result<&'static str> {
    let annotation = sentinel.annotation();
    let near = |spacing: f64| {
        [annotation.range_spacing, annotation.azimuth_spacing]
            .iter()
            .all(|found| (found / spacing - 1.0).abs() < 0.05)
    };
    let refused = |why: String| Error::Template {
        path: product.path().to_owned(),
        why,
    };
    if !matches!(annotation.polarization, Polarization::VV | Polarization::HH) {
        return Err(refused(format!(
            "its polarization is {}, expected VV or HH",
            annotation.polarization.name()
        )));
    }
    match annotation.mode.as_str() {
        "IW" if near(10.0) => Ok("sentinel-1-iw"),
        "EW" if near(40.0) => Ok("sentinel-1-ew"),
        mode => Err(refused(format!(
            "its mode is {mode} with pixels of {} m, expected IW with 10 m or EW with 40 m",
            annotation.range_spacing
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step toward 30° on a grid with lines of 10.1 m toward 193° and pixels of 9.9 m toward 283.4° crosses lines and pixels in
    /// the ratio of the scene's direction. With square pixels, that direction is the angle from the direction of lines.
    #[test]
    fn directions_lead_over_the_same_pixels() {
        let axes = |line_spacing, pixel_spacing, pixel_azimuth| PixelAxes {
            line_azimuth: 193.0,
            pixel_azimuth,
            line_spacing,
            pixel_spacing,
        };
        let skew = axes(10.1, 9.9, 283.4);
        let unit = |degrees: f64| [degrees.to_radians().sin(), degrees.to_radians().cos()];
        let found = in_scene(&skew, 30.0).to_radians();
        let (line, pixel) = (unit(skew.line_azimuth), unit(skew.pixel_azimuth));
        let step = [0, 1].map(|k| {
            found.cos() * skew.line_spacing * line[k] + found.sin() * skew.pixel_spacing * pixel[k]
        });
        let length = step[0].hypot(step[1]);
        let expected = unit(30.0);
        assert!((0..2).all(|k| (step[k] / length - expected[k]).abs() < 1e-12));
        let square = axes(10.0, 10.0, 283.0);
        assert!((in_scene(&square, 30.0) - 197.0).abs() < 1e-9);
        for toward in [0.0, 30.0, 170.0, 305.0] {
            let back = on_map(&skew, in_scene(&skew, toward));
            let turn = (back - toward + 180.0).rem_euclid(360.0) - 180.0;
            assert!(turn.abs() < 1e-9, "{toward}: {back}");
            assert!((0.0..360.0).contains(&back), "{toward}: {back}");
        }
    }
}
