//! What is where in an image: ship, echo and wake, in metres and pixels.
//!
//! Pixels are (column, row), whole numbers at the centres; everything is cut to the rectangle of the centres,
//! columns 0 to `columns − 1` and rows 0 to `rows − 1`. What is not in the image is an empty list.

mod clip;

use crate::kelvin::KELVIN_ANGLE;
use crate::raster::Raster;
use crate::sar::geometry::direction;
use clip::{Polygon, Rectangle};
use serde::{Deserialize, Serialize};

/// A place in the image, (column, row), with fractions.
pub type Pixel = [f64; 2];

/// A line from one place in the image to another.
pub type Segment = [Pixel; 2];

/// Which class of a detector an object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// A wake, number 0.
    Wake,
    /// A ship, number 1.
    Ship,
}

impl Class {
    /// Its number in data sets.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::Wake => 0,
            Self::Ship => 1,
        }
    }

    /// Its name in data sets.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wake => "wake",
            Self::Ship => "ship",
        }
    }
}

/// A ship under way, as labels see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Midship (x, y) at the time of the image \[m\].
    pub position: [f64; 2],
    /// Where it moves to [deg clockwise from azimuth].
    pub heading: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Length \[m\].
    pub length: f64,
    /// Beam \[m\].
    pub beam: f64,
    /// Azimuth displacement of its echo \[m\], see [`crate::sar::geometry::azimuth_displacement`].
    pub azimuth_displacement: f64,
}

/// The labels of one image: the content of `labels.json`.
///
/// The keys are always the same; what is not there is an empty list, a missing number is null.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Labels {
    /// The ship, class 1.
    pub ship: ShipLabel,
    /// Its wake, class 0.
    pub wake: WakeLabel,
}

/// Where the ship is, and where its echo appears.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShipLabel {
    /// Midship (x, y) \[m\], also outside the image.
    #[serde(with = "empty_list")]
    pub position_m: Option<[f64; 2]>,
    /// Midship, if in the image.
    #[serde(with = "empty_list")]
    pub position_px: Option<Pixel>,
    /// Midship displaced in azimuth, where the radar sees the ship; if in the image.
    #[serde(with = "empty_list")]
    pub echo_px: Option<Pixel>,
    /// Box (x, y, width, height) of the hull where the radar sees it, cut to the image.
    #[serde(with = "empty_list")]
    pub echo_box_px: Option<[f64; 4]>,
    /// Where it moves to [deg clockwise from azimuth].
    pub heading: Option<f64>,
    /// Speed [m/s].
    pub speed: Option<f64>,
    /// Azimuth of the echo less that of the ship \[m\].
    pub azimuth_displacement_m: Option<f64>,
}

/// Where the wake is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WakeLabel {
    /// The bow, from which the arms start; if in the image.
    #[serde(with = "empty_list")]
    pub apex_px: Option<Pixel>,
    /// The Kelvin arms in the image, port before starboard, each from the ship outward.
    pub arms_px: Vec<Segment>,
    /// The track line in the image, from the stern backward.
    #[serde(with = "empty_list")]
    pub centreline_px: Option<Segment>,
    /// Box (x, y, width, height) of the wedge between the arms, cut to the image.
    #[serde(with = "empty_list")]
    pub box_px: Option<[f64; 4]>,
    /// Smallest box with a side along the track around the same wedge; its corners may lie outside the image.
    /// Port ahead first, then starboard ahead, starboard astern, port astern.
    #[serde(with = "empty_list")]
    pub oriented_box_px: Option<[Pixel; 4]>,
}

impl Labels {
    /// The labels of an image on `raster`; without a ship all are empty, without speed those of the wake.
    ///
    /// The echo is displaced by the ship's own motion, the wake is not: its water only oscillates, so that the
    /// mean displacement over a wave is zero in linear theory.
    #[must_use]
    pub fn new(track: Option<&Track>, raster: &Raster) -> Self {
        let Some(track) = track else {
            return Self::default();
        };
        let frame = Frame::new(track, raster);
        Self {
            ship: frame.ship(track),
            wake: if track.speed > 0.0 {
                frame.wake(track)
            } else {
                WakeLabel::default()
            },
        }
    }
}

/// The image in metres, and the directions of the ship.
struct Frame<'a> {
    raster: &'a Raster,
    image: Rectangle,
    ahead: [f64; 2],
    starboard: [f64; 2],
}

impl<'a> Frame<'a> {
    fn new(track: &Track, raster: &'a Raster) -> Self {
        let [x, y] = direction(track.heading);
        Self {
            raster,
            image: Rectangle::of(raster),
            ahead: [x, y],
            starboard: [y, -x],
        }
    }

    /// The point `ahead` and `starboard` of another \[m\].
    fn offset(&self, from: [f64; 2], ahead: f64, starboard: f64) -> [f64; 2] {
        [0, 1].map(|a| from[a] + ahead * self.ahead[a] + starboard * self.starboard[a])
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> Pixel {
        self.raster.pixel(x, y)
    }

    fn pixel_inside(&self, point: [f64; 2]) -> Option<Pixel> {
        self.image.contains(point).then(|| self.pixel(point))
    }

    fn ship(&self, track: &Track) -> ShipLabel {
        let [x, y] = track.position;
        let echo = [x, y + track.azimuth_displacement];
        let (half_length, half_beam) = (0.5 * track.length, 0.5 * track.beam);
        let signs = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let hull = signs.map(|(a, s)| self.offset(echo, a * half_length, s * half_beam));
        ShipLabel {
            position_m: Some(track.position),
            position_px: self.pixel_inside(track.position),
            echo_px: self.pixel_inside(echo),
            echo_box_px: Polygon::new(hull.to_vec())
                .cut_to(&self.image)
                .and_then(|polygon| self.upright_box(&polygon)),
            heading: Some(track.heading),
            speed: Some(track.speed),
            azimuth_displacement_m: Some(track.azimuth_displacement),
        }
    }

    fn wake(&self, track: &Track) -> WakeLabel {
        let apex = self.offset(track.position, 0.5 * track.length, 0.0);
        let stern = self.offset(track.position, -0.5 * track.length, 0.0);
        let (sin, cos) = KELVIN_ANGLE.sin_cos();
        let [port, starboard] = [-sin, sin].map(|side| self.offset([0.0; 2], -cos, side));
        let wedge = Polygon::from(&self.image)
            .right_of(apex, starboard)
            .and_then(|polygon| polygon.right_of(apex, port.map(|v| -v)));
        WakeLabel {
            apex_px: self.pixel_inside(apex),
            arms_px: [port, starboard]
                .into_iter()
                .filter_map(|arm| self.ray(apex, arm))
                .collect(),
            centreline_px: self.ray(stern, self.ahead.map(|v| -v)),
            box_px: wedge.as_ref().and_then(|w| self.upright_box(w)),
            oriented_box_px: wedge.as_ref().map(|w| self.track_box(w)),
        }
    }

    fn ray(&self, from: [f64; 2], along: [f64; 2]) -> Option<Segment> {
        let ends = self.image.clip_ray(from, along)?;
        Some(ends.map(|end| self.pixel(end)))
    }

    /// (x, y, width, height) of the upright box around a polygon.
    fn upright_box(&self, polygon: &Polygon) -> Option<[f64; 4]> {
        // Range grows with the column, azimuth falls with the row.
        let [left, right] = polygon.extent([1.0, 0.0]);
        let [bottom, top] = polygon.extent([0.0, 1.0]);
        let [x0, y0] = self.pixel([left, top]);
        let [x1, y1] = self.pixel([right, bottom]);
        (x1 > x0 && y1 > y0).then_some([x0, y0, x1 - x0, y1 - y0])
    }

    /// Corners of the box along the track around a polygon.
    fn track_box(&self, polygon: &Polygon) -> [Pixel; 4] {
        let [astern, ahead] = polygon.extent(self.ahead);
        let [port, starboard] = polygon.extent(self.starboard);
        let corners = [
            (ahead, port),
            (ahead, starboard),
            (astern, starboard),
            (astern, port),
        ];
        corners.map(|(a, s)| self.pixel(self.offset([0.0; 2], a, s)))
    }
}

/// `None` as an empty list.
mod empty_list {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum List<T> {
        Full(T),
        Empty([(); 0]),
    }

    pub(super) fn serialize<T: Serialize, S: Serializer>(
        value: &Option<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => value.serialize(serializer),
            None => [(); 0].serialize(serializer),
        }
    }

    pub(super) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<T>, D::Error> {
        Ok(match List::deserialize(deserializer)? {
            List::Full(value) => Some(value),
            List::Empty([]) => None,
        })
    }
}

#[cfg(test)]
#[path = "labels_tests.rs"]
mod tests;
