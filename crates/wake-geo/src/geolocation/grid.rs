//! Grids of points with known places, interpolated bilinearly.

use crate::error::{Error, Result};
use crate::limits::GRID_POINTS;
use crate::place::{Place, wrapped};

/// Point of a geolocation grid, or ground control point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPoint {
    /// Line; line 0 is the centre of the first line.
    pub line: f64,
    /// Pixel; pixel 0 is the centre of the first pixel.
    pub pixel: f64,
    /// Place of the point.
    pub place: Place,
}

/// Rectangular grid of points. Places are bilinear in line and pixel; beyond the border of the grid the outermost
/// cell is extrapolated.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    lines: Vec<f64>,
    pixels: Vec<f64>,
    /// Row by row; longitudes are continuous across ±180°.
    places: Vec<Place>,
}

impl Grid {
    /// Builds a grid from points in any order.
    ///
    /// # Errors
    /// Fewer than 2 × 2 points, missing or duplicate points, numbers that are not a valid place, a grid that ends
    /// more than a cell before the border of the image. `file` names the file in errors.
    pub(crate) fn new(
        file: &str,
        mut points: Vec<GridPoint>,
        size: (usize, usize),
    ) -> Result<Self> {
        let damaged = |why: String| Error::damaged(file, why);
        if points.len() > GRID_POINTS {
            return Err(damaged(format!(
                "it has {} grid points, above the limit {GRID_POINTS}",
                points.len()
            )));
        }
        for point in &points {
            check_point(point).map_err(|why| damaged(format!("a grid point has {why}")))?;
        }
        points.sort_by(|a, b| a.line.total_cmp(&b.line).then(a.pixel.total_cmp(&b.pixel)));
        let lines = distinct(points.iter().map(|point| point.line));
        let pixels = distinct(
            points
                .iter()
                .take_while(|p| p.line <= lines[0])
                .map(|p| p.pixel),
        );
        if lines.len() < 2 || pixels.len() < 2 || lines.len() * pixels.len() != points.len() {
            return Err(damaged(format!(
                "its {} grid points on {} lines do not form a rectangular grid",
                points.len(),
                lines.len()
            )));
        }
        let expected = lines
            .iter()
            .flat_map(|line| pixels.iter().map(move |pixel| (*line, *pixel)));
        if let Some((point, _)) = points.iter().zip(expected).find(|(point, at)| {
            point.line.total_cmp(&at.0).is_ne() || point.pixel.total_cmp(&at.1).is_ne()
        }) {
            return Err(damaged(format!(
                "the grid point at line {}, pixel {} does not match the pixels of the first grid line",
                point.line, point.pixel
            )));
        }
        for (name, axis, size) in [("line", &lines, size.0), ("pixel", &pixels, size.1)] {
            let cell = axis
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .fold(0.0, f64::max);
            let (first, last) = (axis[0], axis[axis.len() - 1]);
            if first > cell || size as f64 - 1.0 - last > cell {
                return Err(damaged(format!(
                    "the geolocation grid reaches from {name} {first} to {last}, but the image has {size} {name}s"
                )));
            }
        }
        let mut places: Vec<Place> = points.into_iter().map(|point| point.place).collect();
        let first = places[0].longitude;
        for place in &mut places {
            place.longitude = near(place.longitude, first);
        }
        Ok(Self {
            lines,
            pixels,
            places,
        })
    }

    /// Place of a pixel.
    pub(crate) fn place(&self, line: f64, pixel: f64) -> Place {
        let cell = self.cell(line, pixel);
        let optional = |of: fn(&Place) -> Option<f64>| {
            let [a, b, c, d] = cell.corners.map(|place| of(&place));
            Some(cell.mix([a?, b?, c?, d?]))
        };
        Place {
            latitude: cell.mix(cell.corners.map(|p| p.latitude)),
            longitude: wrapped(cell.mix(cell.corners.map(|p| p.longitude))),
            height: optional(|p| p.height),
            incidence: optional(|p| p.incidence),
            slant_range_time: optional(|p| p.slant_range_time),
        }
    }

    /// The (line, pixel) of a place, if it lies in the grid or at most one cell beyond.
    pub(crate) fn pixel_of(&self, latitude: f64, longitude: f64) -> Option<(f64, f64)> {
        let longitude = near(longitude, self.places[0].longitude);
        let target = (latitude, longitude);
        if !self.may_hold(target) {
            return None;
        }
        let middle = |axis: &[f64]| 0.5 * (axis[0] + axis[axis.len() - 1]);
        let start = (middle(&self.lines), middle(&self.pixels));
        self.search(start, target).or_else(|| {
            let centre = |axis: &[f64], i: usize| 0.5 * (axis[i] + axis[i + 1]);
            let rows = 0..self.lines.len() - 1;
            let starts = rows.flat_map(|i| (0..self.pixels.len() - 1).map(move |j| (i, j)));
            starts
                .filter(|&(i, j)| self.cell_may_hold(i, j, target))
                .find_map(|(i, j)| {
                    self.search((centre(&self.lines, i), centre(&self.pixels, j)), target)
                })
        })
    }

    /// Newton's method from a start, with the derivatives of the current cell.
    fn search(&self, start: (f64, f64), target: (f64, f64)) -> Option<(f64, f64)> {
        const STEPS: usize = 40;
        let (mut line, mut pixel) = start;
        for _ in 0..STEPS {
            let cell = self.cell(line, pixel);
            let latitudes = cell.corners.map(|p| p.latitude);
            let longitudes = cell.corners.map(|p| p.longitude);
            let (north, east) = (
                target.0 - cell.mix(latitudes),
                target.1 - cell.mix(longitudes),
            );
            let (north_t, north_u) = cell.slopes(latitudes);
            let (east_t, east_u) = cell.slopes(longitudes);
            let determinant = north_t * east_u - north_u * east_t;
            let dt = (north * east_u - north_u * east) / determinant;
            let du = (north_t * east - north * east_t) / determinant;
            if !(dt.is_finite() && du.is_finite()) {
                return None;
            }
            line = clamped(line + dt * cell.height, &self.lines);
            pixel = clamped(pixel + du * cell.width, &self.pixels);
            if dt.abs().max(du.abs()) < 1e-12 {
                let cell = self.cell(line, pixel);
                let miss = (cell.mix(cell.corners.map(|p| p.latitude)) - target.0)
                    .abs()
                    .max((cell.mix(cell.corners.map(|p| p.longitude)) - target.1).abs());
                return (miss < 1e-9).then_some((line, pixel));
            }
        }
        None
    }

    /// Whether a place is inside the bounding box of the grid, widened by half its size on each side.
    fn may_hold(&self, target: (f64, f64)) -> bool {
        let inside = |of: fn(&Place) -> f64, value: f64| {
            let values = self.places.iter().map(of);
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
            let margin = 0.5 * (high - low) + 1e-6;
            (low - margin..=high + margin).contains(&value)
        };
        inside(|p| p.latitude, target.0) && inside(|p| p.longitude, target.1)
    }

    /// Whether a place is inside the bounding box of a cell, widened by its size on each side.
    fn cell_may_hold(&self, i: usize, j: usize, target: (f64, f64)) -> bool {
        let cell = self.cell_at(i, j, self.lines[i], self.pixels[j]);
        let inside = |values: [f64; 4], value: f64| {
            let (low, high) = values
                .iter()
                .fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
            (low - (high - low)..=high + (high - low)).contains(&value)
        };
        inside(cell.corners.map(|p| p.latitude), target.0)
            && inside(cell.corners.map(|p| p.longitude), target.1)
    }

    /// The cell that contains a pixel, or the nearest cell at the border.
    fn cell(&self, line: f64, pixel: f64) -> Cell {
        let index = |axis: &[f64], x: f64| {
            let after = axis.partition_point(|&at| at <= x);
            after.clamp(1, axis.len() - 1) - 1
        };
        let (i, j) = (index(&self.lines, line), index(&self.pixels, pixel));
        self.cell_at(i, j, line, pixel)
    }

    fn cell_at(&self, i: usize, j: usize, line: f64, pixel: f64) -> Cell {
        let (height, width) = (
            self.lines[i + 1] - self.lines[i],
            self.pixels[j + 1] - self.pixels[j],
        );
        let at = |i: usize, j: usize| self.places[i * self.pixels.len() + j];
        Cell {
            t: (line - self.lines[i]) / height,
            u: (pixel - self.pixels[j]) / width,
            height,
            width,
            corners: [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)],
        }
    }
}

/// Position in a cell: t along lines, u along pixels, both 0 to 1 inside.
struct Cell {
    t: f64,
    u: f64,
    height: f64,
    width: f64,
    corners: [Place; 4],
}

impl Cell {
    fn mix(&self, [a, b, c, d]: [f64; 4]) -> f64 {
        let (t, u) = (self.t, self.u);
        (a * (1.0 - u) + b * u) * (1.0 - t) + (c * (1.0 - u) + d * u) * t
    }

    /// Derivatives along t and u.
    fn slopes(&self, [a, b, c, d]: [f64; 4]) -> (f64, f64) {
        let (t, u) = (self.t, self.u);
        (
            (c - a) * (1.0 - u) + (d - b) * u,
            (b - a) * (1.0 - t) + (d - c) * t,
        )
    }
}

/// Clamps to at most one cell beyond the ends of an axis.
fn clamped(x: f64, axis: &[f64]) -> f64 {
    let last = axis.len() - 1;
    let (before, after) = (axis[1] - axis[0], axis[last] - axis[last - 1]);
    x.clamp(axis[0] - before, axis[last] + after)
}

/// The longitude nearest to another, up to whole turns.
fn near(longitude: f64, other: f64) -> f64 {
    longitude - ((longitude - other) / 360.0).round() * 360.0
}

fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.dedup_by(|a, b| a.total_cmp(b).is_eq());
    values
}

fn check_point(point: &GridPoint) -> std::result::Result<(), String> {
    let Place {
        latitude,
        longitude,
        height,
        incidence,
        slant_range_time,
    } = point.place;
    for (name, value, min, max) in [
        ("line", Some(point.line), -1e7, 1e7),
        ("pixel", Some(point.pixel), -1e7, 1e7),
        ("latitude", Some(latitude), -90.0, 90.0),
        ("longitude", Some(longitude), -360.0, 360.0),
        ("height", height, -1e5, 1e5),
        ("incidence angle", incidence, 0.0, 90.0),
        ("slant range time", slant_range_time, 0.0, 1.0),
    ] {
        if let Some(value) = value.filter(|value| !(min..=max).contains(value)) {
            return Err(format!("{name} {value}, outside [{min}, {max}]"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid across the antimeridian, rotated and slightly curved.
    fn points() -> Vec<GridPoint> {
        let mut points = Vec::new();
        for i in 0..5 {
            for j in 0..7 {
                let (i, j) = (f64::from(i), f64::from(j));
                points.push(GridPoint {
                    line: 100.0 * i,
                    pixel: 50.0 * j,
                    place: Place {
                        latitude: 60.0 - 0.1 * i + 0.02 * j + 0.001 * i * j,
                        longitude: wrapped(179.8 + 0.1 * j + 0.03 * i - 0.002 * j * j),
                        height: Some(i),
                        incidence: Some(30.0 + j),
                        slant_range_time: None,
                    },
                });
            }
        }
        points
    }

    #[test]
    fn a_place_leads_back_to_its_pixel_across_the_antimeridian() {
        let grid = Grid::new("grid", points(), (401, 301)).expect("a grid");
        for (line, pixel) in [
            (0.0, 0.0),
            (400.0, 300.0),
            (123.4, 56.7),
            (400.5, -0.5),
            (399.0, 1.0),
        ] {
            let place = grid.place(line, pixel);
            assert!((-180.0..180.0).contains(&place.longitude));
            let (l, p) = grid
                .pixel_of(place.latitude, place.longitude)
                .expect("inside");
            assert!(
                (l - line).abs() < 1e-6 && (p - pixel).abs() < 1e-6,
                "{line} {pixel}: {l} {p}"
            );
        }
        assert_eq!(grid.pixel_of(10.0, 179.9), None);
        assert_eq!(grid.pixel_of(60.0, 0.0), None);
        let place = grid.place(50.0, 25.0);
        assert!((place.incidence.expect("known") - 30.5).abs() < 1e-12);
        assert_eq!(place.slant_range_time, None);
    }

    #[test]
    fn grids_that_cannot_be_are_refused() {
        let refused = |change: &dyn Fn(&mut Vec<GridPoint>)| {
            let mut points = points();
            change(&mut points);
            Grid::new("grid", points, (401, 301))
                .expect_err("no grid")
                .to_string()
        };
        assert!(refused(&|p| p.clear()).contains("do not form a rectangular grid"));
        assert!(refused(&|p| p.truncate(34)).contains("do not form a rectangular grid"));
        assert!(refused(&|p| p[3] = p[4]).contains("grid"));
        assert!(refused(&|p| p[9].pixel = 7.0).contains("pixel 7"));
        assert!(
            refused(&|p| p[9].place.latitude = f64::NAN)
                .contains("latitude NaN, outside [-90, 90]")
        );
        assert!(refused(&|p| p.iter_mut().for_each(|p| p.line *= 0.5)).contains("401 lines"));
    }
}
