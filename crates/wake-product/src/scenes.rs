//! The scene of each block: the radar of the product there, and ships and wind in its directions.

use std::ops::Range;

use wake_geo::{Polarization, Product, Sentinel1};
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

/// Ships farther than this from a block leave no wake in it that could be seen \[m\].
const REACH: f64 = 12_000.0;

/// Accuracy of the scenes, as in data sets for detectors: speckle of a few looks hides what is finer.
const TOLERANCE: f64 = 0.02;

/// Everything that the scenes of the blocks are made from.
#[derive(Debug)]
pub(crate) struct Scenes<'a> {
    product: &'a Product,
    base: Scene,
    wind: Wind,
    /// Ships with their line and pixel in the product.
    ships: Vec<(ShipAt, [f64; 2])>,
}

impl<'a> Scenes<'a> {
    /// - `changes`: keys of a scene and their values, such as `sea.fetch=50e3`
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
        // A change comes last, so that it may ask for more.
        let accuracy = format!("model.tolerance={TOLERANCE}");
        let mut assignments = vec![format!("radar.sensor={sensor}"), polarization, accuracy];
        assignments.extend_from_slice(changes);
        let mut base = Scene::default().with_assignments(&assignments)?;
        base.ships.clear();
        // Noise is that of the product; ambiguities may lie in other blocks.
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

    /// Incidence of a pixel \[degrees\], if the product says it.
    pub(crate) fn incidence(&self, line: f64, pixel: f64) -> Result<Option<f64>> {
        Ok(self.product.place(line, pixel)?.incidence)
    }

    /// Ships in the product, with their lines and pixels.
    pub(crate) fn ships(&self) -> &[(ShipAt, [f64; 2])] {
        &self.ships
    }

    /// The scene of a block.
    ///
    /// Row 0 of a scene is the farthest along azimuth, line 0 of a product the first that was acquired: line l of a block of n
    /// lines is row n − 1 − l.
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
        scene.grid.spacing = 0.5 * (axes.line_spacing + axes.pixel_spacing);
        if let Some(incidence) = place.incidence {
            scene.radar.incidence = incidence;
        }
        if let Some(ratio) = self.product.range_to_velocity(line, pixel)? {
            scene.radar.range_to_velocity = ratio;
        }
        let turned = |degrees: f64| (degrees - axes.line_azimuth).rem_euclid(360.0);
        scene.sea.wind_toward = turned(self.wind.toward);
        let spacing = scene.grid.spacing;
        let first_row = (lines.len() / 2) as f64 - (lines.len() - 1) as f64;
        let first_column = -((pixels.len() / 2) as f64);
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
                position: [
                    (pixel - pixels.start as f64 + first_column) * spacing,
                    (line - lines.start as f64 + first_row) * spacing,
                ],
                heading: turned(ship.heading),
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

/// The Sentinel-1 product.
pub(crate) fn sentinel(product: &Product) -> Result<&Sentinel1> {
    product.sentinel1().ok_or_else(|| Error::Template {
        path: product.path().to_owned(),
        why: "it is no Sentinel-1 product; give a .SAFE folder or its .zip".to_owned(),
    })
}

/// The preset of the product's mode.
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
            "its polarization is {}; VV and HH can be",
            annotation.polarization.name()
        )));
    }
    match annotation.mode.as_str() {
        "IW" if near(10.0) => Ok("sentinel-1-iw"),
        "EW" if near(40.0) => Ok("sentinel-1-ew"),
        mode => Err(refused(format!(
            "it is of mode {mode} with pixels of {} m; IW of 10 m and EW of 40 m can be",
            annotation.range_spacing
        ))),
    }
}
