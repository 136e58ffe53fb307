//! Labels of an image: ships, their echoes and wakes, in metres and pixels, and whether they are visible.
//!
//! Pixels are (column, row), with whole numbers at the centres. Everything is cut to the rectangle of the centres, columns 0 to
//! `columns − 1` and rows 0 to `rows − 1`. What is outside the image or not visible is an empty list. `visibility` computes how
//! far a wake is visible, `clip` cuts.

mod clip;
mod curve;
mod dark_line;
mod empty_list;
mod independent_pixel;
mod rows;
mod short_waves;
mod visibility;

use crate::kelvin::half_angle;
use crate::prepared::Prepared;
use crate::raster::Raster;
use crate::sar::geometry::{azimuth_displacement, direction, ship_radial_velocity};
use crate::scene::{Scene, Ship};
use clip::{Polygon, Rectangle};
use serde::{Deserialize, Serialize};
use visibility::{Background, Extent};

pub use independent_pixel::independent_pixel;
pub use visibility::Visibility;

/// A place in the image, (column, row), with fractions.
pub type Pixel = [f64; 2];

/// A line between two places in the image, with further places where it bends.
pub type Line = Vec<Pixel>;

/// Detector class of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// A wake, number 0.
    Wake,
    /// A ship, number 1.
    Ship,
}

impl Class {
    /// Class number in data sets.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::Wake => 0,
            Self::Ship => 1,
        }
    }

    /// Class name in data sets.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wake => "wake",
            Self::Ship => "ship",
        }
    }
}

/// An object that a detector should find.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object {
    /// Class of the object.
    pub class: Class,
    /// Box (x, y, width, height), cut to the image.
    pub box_px: [f64; 4],
    /// Corners of the box along the track: port ahead, starboard ahead, starboard astern, port astern; they may lie
    /// outside the image.
    pub oriented_box_px: [Pixel; 4],
    /// The bow, if in the image; for a ship, the bow of its echo.
    pub tip: Option<Pixel>,
    /// Direction from the tip along the object [deg clockwise from the image's up], 0 up to 360.
    pub axis_deg: f64,
    /// Angle between axis and arms \[deg\]; 0 for a ship.
    pub half_angle_deg: f64,
    /// Visible length along the axis from the tip \[pixels\]; for a ship, the whole length.
    pub length_px: f64,
    /// Visibility of a wake; `None` for a ship.
    pub visibility: Option<Visibility>,
}

/// The labels of one image: the content of `labels.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Labels {
    /// Ships of the scene, each with its wake, including ships outside the image.
    pub ships: Vec<LabelledShip>,
    /// Azimuth displacement of the whole sea, wakes included, by the sea's mean Doppler shift \[m\]: (R/V) times its mean
    /// velocity toward the radar; 0 for a sea that returns nothing. The simulated image leaves it out. In a real image, the
    /// offset of a ship from its wake is `azimuth_displacement_m` minus this value.
    #[serde(default)]
    pub sea_displacement_m: f64,
}

/// A ship and its wake.
///
/// All keys are always present; an absent value is an empty list, a missing number is null.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelledShip {
    /// The ship, class 1.
    pub ship: ShipLabel,
    /// Its wake, class 0.
    pub wake: WakeLabel,
}

/// Place of a ship and of its echo.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShipLabel {
    /// Midship (x, y) \[m\], also outside the image.
    pub position_m: [f64; 2],
    /// Midship, if in the image.
    #[serde(with = "empty_list")]
    pub position_px: Option<Pixel>,
    /// Midship displaced in azimuth, where the radar images the ship; if in the image.
    #[serde(with = "empty_list")]
    pub echo_px: Option<Pixel>,
    /// Box (x, y, width, height) of the hull where the radar images it, cut to the image; if the echo is drawn.
    #[serde(with = "empty_list")]
    pub echo_box_px: Option<[f64; 4]>,
    /// Corners of the hull itself at that place, port ahead first and clockwise seen from above; they may lie outside
    /// the image.
    #[serde(with = "empty_list")]
    pub echo_oriented_box_px: Option<[Pixel; 4]>,
    /// Direction of motion at the time of the image [deg clockwise from azimuth].
    pub heading: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Length \[m\].
    pub length: f64,
    /// Azimuth of the echo minus azimuth of the ship \[m\].
    pub azimuth_displacement_m: f64,
}

/// Place of a wake and its visible extent.
///
/// Arms, centreline and boxes end with the visible wake, at the last window that shows waves or the dark line clearly enough, not
/// at the edge of the image.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WakeLabel {
    /// The bow, from which the arms start; if in the image.
    #[serde(with = "empty_list")]
    pub tip_px: Option<Pixel>,
    /// Direction from the tip along the wake [deg clockwise from the image's up], 0 up to 360, along the tangent for a turning
    /// ship; null for a ship at rest.
    pub axis_deg: Option<f64>,
    /// Angle between axis and arms \[deg\], see [`half_angle`]; null for a ship at rest.
    pub half_angle_deg: Option<f64>,
    /// Kelvin arms as far as waves are visible, port before starboard, each from the ship outward: two places, or more behind a
    /// turning ship.
    pub arms_px: Vec<Line>,
    /// Track line as far as the wake is visible, from the stern backward: two places, or more behind a turning ship; empty where
    /// nothing is visible.
    pub centreline_px: Line,
    /// Distance along the axis from the tip to the end of the visible wake in the image \[pixels\]; 0 if nothing is visible.
    pub length_px: f64,
    /// Visibility of the wake; null where it does not meet the image.
    pub visibility: Option<Visibility>,
    /// Box (x, y, width, height) of the visible wake: the wedge between the arms, the dark line, or both.
    #[serde(with = "empty_list")]
    pub box_px: Option<[f64; 4]>,
    /// Smallest box around the visible wake with a side along the track; its corners may lie outside the image. Port ahead first,
    /// then starboard ahead, starboard astern, port astern.
    #[serde(with = "empty_list")]
    pub oriented_box_px: Option<[Pixel; 4]>,
}

/// Labels of a valid scene, without simulating it.
///
/// An echo is displaced by the ship's own motion. A wake is not: its water only oscillates, so the mean displacement over a wave
/// is zero in linear theory.
#[must_use]
pub fn labels_of(scene: &Scene) -> Labels {
    labels(&Prepared::new(scene))
}

/// Labels of a prepared scene; see [`labels_of`].
pub(crate) fn labels(prepared: &Prepared<'_>) -> Labels {
    let (scene, models) = (prepared.scene, &prepared.models);
    let sea = Background::new(prepared);
    let ships = scene.ships.iter().enumerate().map(|(n, ship)| {
        let wake = &models.wakes[n];
        let heading = ship.heading_at(scene.sea.time);
        let frame = Frame::new(wake.track.position, heading, &models.pixels.image);
        let opening = half_angle(ship.speed, scene.sea.depth);
        let extent = match &sea {
            Some(sea) if ship.speed > 0.0 => sea.extent(n, opening),
            _ => Extent::NOTHING,
        };
        LabelledShip {
            ship: frame.ship(ship, echo_displacement(scene, ship)),
            wake: match wake.track.turn() {
                None => frame.wake(ship, opening, &extent),
                Some(_) => frame.curved_wake(wake, opening, &extent),
            },
        }
    });
    let velocity = sea.as_ref().map_or(0.0, |sea| sea.velocity);
    Labels {
        ships: ships.collect(),
        sea_displacement_m: azimuth_displacement(scene.radar.range_to_velocity, velocity),
    }
}

/// Azimuth displacement of a ship's echo \[m\].
pub(crate) fn echo_displacement(scene: &Scene, ship: &Ship) -> f64 {
    let incidence = scene.radar.incidence.to_radians();
    let heading = ship.heading_at(scene.sea.time);
    let velocity = ship_radial_velocity(ship.speed, heading, incidence);
    azimuth_displacement(scene.radar.range_to_velocity, velocity)
}

impl Labels {
    /// Objects to detect: visible wakes, and ships whose echo is drawn.
    #[must_use]
    pub fn objects(&self) -> Vec<Object> {
        let of = |one: &LabelledShip| [one.wake.object(), one.ship.object()];
        self.ships.iter().flat_map(of).flatten().collect()
    }
}

impl WakeLabel {
    fn object(&self) -> Option<Object> {
        Some(Object {
            class: Class::Wake,
            box_px: self.box_px?,
            oriented_box_px: self.oriented_box_px?,
            tip: self.tip_px,
            axis_deg: self.axis_deg?,
            half_angle_deg: self.half_angle_deg?,
            length_px: self.length_px,
            visibility: self.visibility,
        })
    }
}

impl ShipLabel {
    fn object(&self) -> Option<Object> {
        let box_px = self.echo_box_px?;
        let corners = self.echo_oriented_box_px?;
        let tip = [0, 1].map(|a| 0.5 * (corners[0][a] + corners[1][a]));
        let [dx, dy] = [0, 1].map(|a| corners[1][a] - corners[2][a]);
        let [x, y, width, height] = box_px;
        let inside = (x..=x + width).contains(&tip[0]) && (y..=y + height).contains(&tip[1]);
        Some(Object {
            class: Class::Ship,
            box_px,
            oriented_box_px: corners,
            tip: inside.then_some(tip),
            axis_deg: (self.heading + 180.0).rem_euclid(360.0),
            half_angle_deg: 0.0,
            length_px: dx.hypot(dy),
            visibility: None,
        })
    }
}

/// The image in metres, and the directions of the ship.
struct Frame<'a> {
    raster: &'a Raster,
    image: Rectangle,
    position: [f64; 2],
    /// Heading [deg clockwise from azimuth].
    heading: f64,
    ahead: [f64; 2],
    starboard: [f64; 2],
}

impl<'a> Frame<'a> {
    /// - `position`: midship (x, y) \[m\]
    /// - `heading`: [deg clockwise from azimuth]
    fn new(position: [f64; 2], heading: f64, raster: &'a Raster) -> Self {
        let [x, y] = direction(heading);
        Self {
            raster,
            image: Rectangle::of(raster),
            position,
            heading,
            ahead: [x, y],
            starboard: [y, -x],
        }
    }

    /// Point `ahead` and `starboard` of another point \[m\].
    fn offset(&self, from: [f64; 2], ahead: f64, starboard: f64) -> [f64; 2] {
        [0, 1].map(|a| from[a] + ahead * self.ahead[a] + starboard * self.starboard[a])
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> Pixel {
        self.raster.pixel(x, y)
    }

    fn pixel_inside(&self, point: [f64; 2]) -> Option<Pixel> {
        self.image.contains(point).then(|| self.pixel(point))
    }

    fn ship(&self, ship: &Ship, displacement: f64) -> ShipLabel {
        let [x, y] = self.position;
        let echo = [x, y + displacement];
        let (half_length, half_beam) = (0.5 * ship.length, 0.5 * ship.beam);
        let signs = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let hull = signs.map(|(a, s)| self.offset(echo, a * half_length, s * half_beam));
        let seen = Polygon::new(hull.to_vec()).cut_to(&self.image);
        let echo_box_px = seen
            .filter(|_| ship.echo)
            .and_then(|polygon| self.upright_box(&[polygon]));
        ShipLabel {
            position_m: self.position,
            position_px: self.pixel_inside(self.position),
            echo_px: self.pixel_inside(echo),
            echo_box_px,
            echo_oriented_box_px: echo_box_px.map(|_| hull.map(|corner| self.pixel(corner))),
            heading: self.heading,
            speed: ship.speed,
            length: ship.length,
            azimuth_displacement_m: displacement,
        }
    }

    /// - `opening`: half-angle of the wedge \[rad\]
    fn wake(&self, ship: &Ship, opening: f64, extent: &Extent) -> WakeLabel {
        if ship.speed <= 0.0 {
            return WakeLabel::default();
        }
        let bow = self.offset(self.position, 0.5 * ship.length, 0.0);
        let stern = self.offset(self.position, -0.5 * ship.length, 0.0);
        let arms = [-1.0, 1.0].map(|side| {
            let (sin, cos) = opening.sin_cos();
            self.offset([0.0; 2], -cos, side * sin)
        });
        let wedge = self.astern_of(bow, extent.waves).and_then(|polygon| {
            polygon
                .right_of(bow, arms[1])?
                .right_of(bow, arms[0].map(|v| -v))
        });
        let line = self.astern_of(bow, extent.dark_line).and_then(|polygon| {
            let port = self.offset(bow, 0.0, -extent.half_width);
            let starboard = self.offset(bow, 0.0, extent.half_width);
            polygon
                .right_of(port, self.ahead)?
                .right_of(starboard, self.ahead.map(|v| -v))
        });
        let seen: Vec<Polygon> = [wedge, line].into_iter().flatten().collect();
        let along = |at: [f64; 2]| at[0] * self.ahead[0] + at[1] * self.ahead[1];
        let arms = arms.into_iter();
        let arms = arms.filter_map(|arm| self.ray(bow, arm, extent.waves / opening.cos()));
        let astern = self.ahead.map(|v| -v);
        let centreline = self.ray(stern, astern, extent.longest() - ship.length);
        WakeLabel {
            arms_px: arms.collect(),
            centreline_px: centreline.unwrap_or_default(),
            visibility: extent.visibility,
            ..self.outlined(
                bow,
                opening,
                &seen,
                along(bow) - extent_of(&seen, self.ahead)[0],
            )
        }
    }

    /// Label of a wake without its lines and its visibility.
    ///
    /// - `bow`: (x, y) \[m\]
    /// - `opening`: half-angle of the wedge \[rad\]
    /// - `seen`: visible parts of the wake
    /// - `length`: visible length along the axis \[m\], used where the visible wake has an area
    fn outlined(&self, bow: [f64; 2], opening: f64, seen: &[Polygon], length: f64) -> WakeLabel {
        let box_px = self.upright_box(seen);
        WakeLabel {
            tip_px: self.pixel_inside(bow),
            axis_deg: Some((self.heading + 180.0).rem_euclid(360.0)),
            half_angle_deg: Some(opening.to_degrees()),
            length_px: box_px.map_or(0.0, |_| length / self.raster.spacing),
            box_px,
            oriented_box_px: box_px.map(|_| self.track_box(seen)),
            ..WakeLabel::default()
        }
    }

    /// The part of the image astern of a point, up to a distance from it.
    fn astern_of(&self, bow: [f64; 2], distance: f64) -> Option<Polygon> {
        let port = self.starboard.map(|v| -v);
        let end = self.offset(bow, -distance, 0.0);
        let image = Polygon::from(&self.image).right_of(bow, self.starboard)?;
        image.right_of(end, port)
    }

    fn ray(&self, from: [f64; 2], along: [f64; 2], longest: f64) -> Option<Line> {
        let ends = self.image.clip_ray(from, along, longest)?;
        Some(ends.map(|end| self.pixel(end)).to_vec())
    }

    /// (x, y, width, height) of the upright box around polygons; `None` if it has no area.
    fn upright_box(&self, polygons: &[Polygon]) -> Option<[f64; 4]> {
        // Range increases with the column, azimuth decreases with the row.
        let [left, right] = extent_of(polygons, [1.0, 0.0]);
        let [bottom, top] = extent_of(polygons, [0.0, 1.0]);
        let [x0, y0] = self.pixel([left, top]);
        let [x1, y1] = self.pixel([right, bottom]);
        (x1 > x0 && y1 > y0).then_some([x0, y0, x1 - x0, y1 - y0])
    }

    /// Corners of the box along the track around polygons.
    fn track_box(&self, polygons: &[Polygon]) -> [Pixel; 4] {
        let [astern, ahead] = extent_of(polygons, self.ahead);
        let [port, starboard] = extent_of(polygons, self.starboard);
        let corners = [
            (ahead, port),
            (ahead, starboard),
            (astern, starboard),
            (astern, port),
        ];
        corners.map(|(a, s)| self.pixel(self.offset([0.0; 2], a, s)))
    }
}

/// Smallest and largest coordinate along a unit vector; ∞ and −∞ without polygons.
fn extent_of(polygons: &[Polygon], axis: [f64; 2]) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    polygons.iter().fold(start, |[low, high], polygon| {
        let [a, b] = polygon.extent(axis);
        [low.min(a), high.max(b)]
    })
}

#[cfg(test)]
mod tests;
