//! Estimation of ship and wind from a wake in a product.

use std::ops::Range;

use wake_geo::{Product, Sentinel1};
use wake_physics::estimate::{Estimate, Parameter, Priors, Sighting, Value, estimate};
use wake_physics::scene::Ship;
use wake_physics::{Field, Scene};

use crate::error::{Error, Result};
use crate::scenes::{Scenes, Wind, in_part, in_scene, on_map, sentinel};

/// Largest rows and columns of the estimated part.
const SIDE: usize = 128;

/// Distance astern from the wake's tip to the middle of the estimated part, as a share of the part's side.
const ASTERN: f64 = 0.25;

/// Estimate of ship and wind, with directions on the map.
#[derive(Clone, Debug, PartialEq)]
pub struct MappedEstimate {
    /// The estimate, with directions in the image.
    pub estimate: Estimate,
    /// Heading of the ship, clockwise from true north \[degrees\].
    pub heading: f64,
    /// Direction that the wind blows toward, clockwise from true north \[degrees\].
    pub wind_toward: f64,
}

/// Estimates ship and wind around a wake of a Sentinel-1 product.
///
/// Uses σ⁰ of at most 128 × 128 pixels around the wake, with thermal noise added back; pixels darker than the noise count as
/// noise. Radar and pixel spacing are taken from the annotation, the water is deep, and the hull form is the default scene's.
///
/// - `tip`: line and pixel of the wake's tip
/// - `heading`: heading of the ship, clockwise from true north \[degrees\], accurate to some 7 degrees
///
/// # Errors
///
/// [`Error::Template`] for a product of an unsupported radar or a part without data (land, border), [`Error::Product`] for pixels
/// that cannot be read, [`Error::Scene`] as [`estimate`].
pub fn estimate_wake(product: &Product, tip: [f64; 2], heading: f64) -> Result<MappedEstimate> {
    let sentinel = sentinel(product)?;
    // The wind is estimated, so this direction has no effect.
    let wind = Wind {
        speed: Scene::default().sea.wind_speed,
        toward: 0.0,
    };
    let scenes = Scenes::new(product, &[], wind, &[])?;
    let axes = product.axes(tip[0], tip[1])?;
    let turned = in_scene(&axes, heading);
    let (sin, cos) = turned.to_radians().sin_cos();
    let (lines, pixels) = product.size();
    let part = |tip: f64, forward: f64, count: usize| -> Range<usize> {
        let side = SIDE.min(count);
        let first = tip - ASTERN * side as f64 * forward - 0.5 * side as f64;
        let first = (first.round().max(0.0) as usize).min(count - side);
        first..first + side
    };
    let (lines, pixels) = (part(tip[0], cos, lines), part(tip[1], sin, pixels));
    let mut known = scenes.scene(&lines, &pixels, 0)?;
    let (image, noise) = with_noise(product, sentinel, &lines, &pixels)?;
    // Without noise where the processor has removed it.
    known.radar.nesz = (noise > 0.0).then(|| 10.0 * noise.log10());
    known.ships = vec![Ship::default()];
    let place = in_part(known.grid.spacing, (&lines, &pixels), tip);
    let sighting = Sighting::new(place, turned);
    let found = estimate(&image, &known, &sighting, &Priors::default())?;
    let of = |value: Value| found.of(Parameter::Value(value))[0];
    Ok(MappedEstimate {
        heading: on_map(&axes, of(Value::Heading)),
        wind_toward: on_map(&axes, of(Value::WindToward)),
        estimate: found,
    })
}

/// Intensity of a part with thermal noise, its rows in reverse order of lines, and the mean noise, both as σ⁰.
fn with_noise(
    product: &Product,
    sentinel: &Sentinel1,
    lines: &Range<usize>,
    pixels: &Range<usize>,
) -> Result<(Field, f64)> {
    let window = sentinel.read_intensity(lines.clone(), pixels.clone())?;
    if window.no_data > 0 {
        return Err(Error::Template {
            path: product.path().to_owned(),
            why: format!(
                "lines {lines:?} and pixels {pixels:?} include pixels without data; choose a ship farther from them"
            ),
        });
    }
    let mut values = Vec::with_capacity(window.values.len());
    let mut noise = 0.0;
    for (n, line) in lines.clone().enumerate().rev() {
        values.extend_from_slice(window.line(n));
        let of = |pixel| sentinel.noise_equivalent_sigma_nought(line as f64, pixel as f64);
        noise += pixels.clone().map(of).sum::<f64>();
    }
    noise /= values.len() as f64;
    let field = Field {
        rows: lines.len(),
        columns: pixels.len(),
        values,
    };
    Ok((field, noise))
}
