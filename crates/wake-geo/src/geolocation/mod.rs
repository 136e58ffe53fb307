//! From pixels to places and back.

mod affine;
mod grid;

pub use affine::Affine;
pub use grid::GridPoint;

pub(crate) use grid::Grid;

use crate::place::Place;
use crate::projection::Projection;

/// Source of the places of an image.
#[derive(Clone, Debug)]
pub(crate) enum Geolocation {
    /// A grid of points.
    Grid(Grid),
    /// An affine map to projected coordinates.
    Affine(Affine, Projection),
    /// No places, with the reason.
    Unknown(String),
}

impl Geolocation {
    /// Place of a pixel; `None` beyond the projection, or if places are unknown.
    pub(crate) fn place(&self, line: f64, pixel: f64) -> Option<Place> {
        match self {
            Self::Grid(grid) => Some(grid.place(line, pixel)),
            Self::Affine(affine, projection) => {
                let (x, y) = affine.coordinates(line, pixel);
                let (latitude, longitude) = projection.to_degrees(x, y)?;
                Some(Place {
                    latitude,
                    longitude,
                    height: None,
                    incidence: None,
                    slant_range_time: None,
                })
            }
            Self::Unknown(_) => None,
        }
    }

    /// The (line, pixel) of a place, possibly outside the image; `None` where there is none. Of the longitudes that
    /// differ by whole turns, the one whose pixel is nearest to `middle`, the middle pixel of a line, is used.
    pub(crate) fn pixel_of(
        &self,
        latitude: f64,
        longitude: f64,
        middle: f64,
    ) -> Option<(f64, f64)> {
        match self {
            Self::Grid(grid) => grid.pixel_of(latitude, longitude),
            Self::Affine(affine, projection) => {
                let turns: &[f64] = match projection.is_geographic() {
                    true => &[0.0, 360.0, -360.0],
                    false => &[0.0],
                };
                let (x, y) = projection.from_degrees(latitude, longitude)?;
                let pixels = turns.iter().map(|turn| affine.pixel_of(x + turn, y));
                pixels.min_by(|a, b| (a.1 - middle).abs().total_cmp(&(b.1 - middle).abs()))
            }
            Self::Unknown(_) => None,
        }
    }
}
