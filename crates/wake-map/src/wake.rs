//! Wakes on the map.

use rayon::prelude::*;
use serde::Serialize;
use wake_detector::{Detection, Extent};
use wake_geo::Product;

use crate::echo::Echo;
use crate::error::Result;
use crate::profile::{Contrast, Kind};
use crate::seen::{Seen, one_a_ship};
use crate::ship::EstimatedShip;

/// A wake with its position on the map and its measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MappedWake {
    /// Score for ranking detections, 0 to 1; not a probability.
    pub score: f64,
    /// Probability of a wake, in either direction; `None` for a detector without calibration.
    pub probability: Option<f64>,
    /// Probability that the heading is not wrong by 180°, if it is a wake.
    pub direction_probability: Option<f64>,
    /// Whether the detection counts as found ([`Detection::sure`]).
    pub sure: bool,
    /// Line of the tip, where the wake begins.
    pub line: f64,
    /// Pixel of the tip.
    pub pixel: f64,
    /// (Longitude, latitude) of the tip \[degrees\]; `None` for an image without geolocation.
    pub tip: Option<[f64; 2]>,
    /// (Longitude, latitude) of the visible end \[degrees\].
    pub end: Option<[f64; 2]>,
    /// Direction of the ship, from the end of the wake to its tip, clockwise from true north \[degrees\]; see
    /// `direction_probability`.
    pub heading: Option<f64>,
    /// Visible length \[m\].
    pub length: Option<f64>,
    /// Standard deviation of the visible length \[m\].
    pub length_deviation: Option<f64>,
    /// (Pixel, line) of the visible end.
    pub end_px: [f64; 2],
    /// Visible length \[pixels\].
    pub length_px: f64,
    /// Half the angle between the outer edges \[degrees\].
    pub half_angle: f64,
    /// Contrast of the line against the sea on both sides \[dB\].
    pub contrast_db: Option<f64>,
    /// Appearance of the wake.
    pub kind: Option<Kind>,
    /// Incidence angle at the tip \[degrees\].
    pub incidence: Option<f64>,
    /// Time at which the tip was imaged, UTC.
    pub time: Option<String>,
    /// The ship's echo.
    pub echo: Option<Echo>,
    /// Ship and wind, if estimated by the caller.
    pub ship: Option<EstimatedShip>,
}

/// Measures and maps detections of a product, given in descending order of score, without duplicates of one ship's wake.
///
/// # Errors
///
/// [`Error::Product`](crate::Error::Product) for positions that cannot be computed.
pub fn mapped(product: &Product, found: &[Detection]) -> Result<Vec<MappedWake>> {
    let seen: Vec<Seen> = found.par_iter().map(|one| Seen::of(product, one)).collect();
    let ships = one_a_ship(seen);
    ships
        .par_iter()
        .map(|one| one_mapped(product, one))
        .collect()
}

fn one_mapped(product: &Product, one: &Seen) -> Result<MappedWake> {
    let Seen {
        detection,
        measured,
        echo,
        ..
    } = *one;
    let wake = one.visible();
    let (lines, pixels) = product.size();
    let inside = |[x, y]: [f32; 2]| {
        let clamped = |value: f32, size: usize| f64::from(value).clamp(-0.5, size as f64 - 0.5);
        (clamped(y, lines), clamped(x, pixels))
    };
    let (tip, end) = (inside(wake.tip), inside(wake.at(wake.length)));
    let mut mapped = MappedWake {
        score: f64::from(detection.score),
        probability: detection.probability.map(f64::from),
        direction_probability: detection.direction_probability.map(f64::from),
        sure: detection.sure,
        line: f64::from(wake.tip[1]),
        pixel: f64::from(wake.tip[0]),
        tip: None,
        end: None,
        heading: None,
        length: None,
        length_deviation: None,
        end_px: wake.at(wake.length).map(f64::from),
        length_px: f64::from(wake.length),
        half_angle: f64::from(wake.half_angle_deg),
        contrast_db: measured.map(Contrast::decibel),
        kind: measured.map(Contrast::kind),
        incidence: None,
        time: None,
        echo,
        ship: None,
    };
    if product.has_places() {
        let [from, to] = [product.place(tip.0, tip.1)?, product.place(end.0, end.1)?];
        let track = product.track(end, tip)?;
        mapped.tip = Some([from.longitude, from.latitude]);
        mapped.end = Some([to.longitude, to.latitude]);
        mapped.heading = Some(track.azimuth);
        mapped.length = Some(track.distance);
        let relative = |extent: Extent| f64::from(extent.deviation / wake.length.max(1.0));
        mapped.length_deviation = detection
            .extent
            .map(|extent| relative(extent) * track.distance);
        mapped.incidence = from.incidence;
    }
    let sentinel = product.sentinel1();
    mapped.time = sentinel.map(|s| s.annotation().line_time(tip.0).to_string());
    Ok(mapped)
}
