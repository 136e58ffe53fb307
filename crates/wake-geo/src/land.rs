//! Land: a coarse coastline of the whole Earth, or one from a file.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use serde_json::Value;
use whole_files::sentence;

use crate::error::{Error, Result};
use crate::product::Product;

/// Polygons of land.
///
/// The built-in polygons are Natural Earth's at 1:10 million: coasts are off by some hundred metres, and the smallest
/// islands are missing.
#[derive(Clone, Debug, Default)]
pub struct Land {
    /// Closed lines of (longitude, latitude) \[degrees\]; points inside an odd number of them are land.
    rings: Vec<Vec<[f64; 2]>>,
}

/// Land around a product, on a grid of latitude and longitude.
#[derive(Clone, Debug)]
pub struct LandMask {
    /// Longitude and latitude of the first cell \[degrees\].
    first: [f64; 2],
    /// Number of cells along longitude and latitude.
    size: [usize; 2],
    cells: Vec<bool>,
}

/// Side of a cell of a mask \[degrees\].
const CELL: f64 = 0.0025;
/// Step of the coordinates of the built-in coast \[degrees\].
const STEP: f64 = 0.005;
/// Most points of a file.
const MOST_POINTS: usize = 5_000_000;
/// Largest buffer around land \[m\].
const LARGEST_BUFFER: f64 = 50_000.0;
/// Length of a degree of latitude \[m\].
const DEGREE: f64 = 111_195.0;

impl Land {
    /// Returns the built-in coast: Natural Earth, public domain.
    ///
    /// # Panics
    ///
    /// Never: the data are part of the crate.
    pub fn natural_earth() -> Self {
        let packed = include_bytes!("../assets/land.bin");
        let mut bytes = Vec::new();
        ZlibDecoder::new(&packed[..])
            .read_to_end(&mut bytes)
            .expect("data of this crate");
        let mut bytes = bytes.into_iter();
        let mut number = || {
            let (mut value, mut shift) = (0u64, 0);
            for byte in bytes.by_ref() {
                value |= u64::from(byte & 127) << shift;
                shift += 7;
                if byte < 128 {
                    break;
                }
            }
            // The sign is the lowest bit.
            let half = (value >> 1) as i64;
            if value & 1 == 0 { half } else { -half - 1 }
        };
        let rings = number();
        let ring = |count: i64, number: &mut dyn FnMut() -> i64| {
            let mut at = [0, 0];
            let mut point = || {
                at = at.map(|x| x + number());
                at.map(|x| x as f64 * STEP)
            };
            (0..count).map(|_| point()).collect()
        };
        let mut all = Vec::new();
        for _ in 0..rings {
            let count = number();
            all.push(ring(count, &mut number));
        }
        Self { rings: all }
    }

    /// Reads the polygons of a GeoJSON file; other geometries are ignored.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, is not GeoJSON, or has no polygon or more than five million points.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = whole_files::read_regular(path).map_err(|e| Error::io(path, e))?;
        let wrong = |why: String| Error::Land {
            path: path.to_owned(),
            why: sentence(&why),
        };
        let file: Value = serde_json::from_slice(&bytes)
            .map_err(|e| wrong(format!("it is not valid JSON: {e}")))?;
        let mut land = Self::default();
        land.add(&file);
        let points: usize = land.rings.iter().map(Vec::len).sum();
        match points {
            0 => Err(wrong("it has no polygon".to_owned())),
            count if count > MOST_POINTS => Err(wrong(format!(
                "its {count} points exceed the limit of {MOST_POINTS}; use a coarser coastline"
            ))),
            _ => Ok(land),
        }
    }

    /// Adds the polygons of a GeoJSON value.
    fn add(&mut self, value: &Value) {
        let coordinates = value["coordinates"].as_array();
        let all = |key: &str| value[key].as_array().into_iter().flatten();
        match value["type"].as_str() {
            Some("FeatureCollection") => all("features").for_each(|f| self.add(f)),
            Some("GeometryCollection") => all("geometries").for_each(|g| self.add(g)),
            Some("Feature") => self.add(&value["geometry"]),
            Some("Polygon") => coordinates
                .into_iter()
                .flatten()
                .for_each(|r| self.add_ring(r)),
            Some("MultiPolygon") => {
                let polygons = coordinates.into_iter().flatten();
                let rings = polygons.filter_map(Value::as_array).flatten();
                rings.for_each(|ring| self.add_ring(ring));
            }
            _ => {}
        }
    }

    fn add_ring(&mut self, ring: &Value) {
        let points = ring.as_array().into_iter().flatten();
        let point = |point: &Value| Some([point[0].as_f64()?, point[1].as_f64()?]);
        self.rings.push(points.filter_map(point).collect());
    }

    /// Land around a product, including everything closer to it than `buffer` \[m\].
    ///
    /// # Errors
    ///
    /// A product without places, or a buffer outside 0 to 50 km.
    pub fn mask(&self, product: &Product, buffer: f64) -> Result<LandMask> {
        crate::error::check_range("buffer", buffer, 0.0, LARGEST_BUFFER)?;
        let (lines, pixels) = product.size();
        let mut places = Vec::new();
        const STEPS: usize = 8;
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let at = |size: usize, k: usize| (size - 1) as f64 * k as f64 / STEPS as f64;
                let place = product.place(at(lines, i), at(pixels, j))?;
                places.push([place.longitude, place.latitude]);
            }
        }
        // Longitudes are made continuous across ±180°.
        let reference = places[0][0];
        for place in &mut places {
            place[0] = near(place[0], reference);
        }
        let bound = |axis: usize, end: fn(f64, f64) -> f64| {
            places
                .iter()
                .map(|place| place[axis])
                .reduce(end)
                .unwrap_or(0.0)
        };
        let south = bound(1, f64::min);
        let north = bound(1, f64::max);
        let narrow = south.abs().max(north.abs()).min(89.0).to_radians().cos();
        let beyond = [
            (buffer + 2000.0) / DEGREE / narrow,
            (buffer + 2000.0) / DEGREE,
        ];
        let first = [bound(0, f64::min) - beyond[0], south - beyond[1]];
        let last = [bound(0, f64::max) + beyond[0], north + beyond[1]];
        let size = [0, 1].map(|a| ((last[a] - first[a]) / CELL).ceil() as usize + 1);
        let mut mask = LandMask {
            first,
            size,
            cells: vec![false; size[0] * size[1]],
        };
        self.fill(&mut mask);
        mask.grow(buffer);
        Ok(mask)
    }

    /// Fills the cells inside the rings, row by row with the even-odd rule.
    fn fill(&self, mask: &mut LandMask) {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); mask.size[1]];
        let [west, south] = mask.first;
        let east = west + mask.size[0] as f64 * CELL;
        for ring in &self.rings {
            for edge in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let (a, b) = edge;
                let row = |latitude: f64| ((latitude - south) / CELL).ceil().max(0.0) as usize;
                let [low, high] = [a[1].min(b[1]), a[1].max(b[1])];
                let (first, end) = (row(low), row(high).min(mask.size[1]));
                for (row, crossings) in crossings.iter_mut().enumerate().take(end).skip(first) {
                    let latitude = south + row as f64 * CELL;
                    let t = (latitude - a[1]) / (b[1] - a[1]);
                    crossings.push(a[0] + t * (b[0] - a[0]));
                }
            }
        }
        for (row, crossings) in crossings.iter_mut().enumerate() {
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                for turn in [-360.0, 0.0, 360.0] {
                    let [from, to] = [pair[0] + turn, pair[1] + turn];
                    if to < west || from > east {
                        continue;
                    }
                    let cell =
                        |longitude: f64| ((longitude - west) / CELL).ceil().max(0.0) as usize;
                    let line = &mut mask.cells[row * mask.size[0]..][..mask.size[0]];
                    let (from, to) = (cell(from), cell(to).min(mask.size[0]));
                    line[from.min(to)..to].fill(true);
                }
            }
        }
    }
}

impl LandMask {
    /// Whether a place is land or within the buffer of land; `false` beyond the surroundings of the product.
    pub fn is_land(&self, latitude: f64, longitude: f64) -> bool {
        let longitude = near(longitude, self.first[0] + 0.5 * self.size[0] as f64 * CELL);
        let cell = |value: f64, axis: usize| {
            let cell = ((value - self.first[axis]) / CELL).round();
            (cell >= 0.0 && cell < self.size[axis] as f64).then_some(cell as usize)
        };
        let found = cell(longitude, 0).zip(cell(latitude, 1));
        found.is_some_and(|(x, y)| self.cells[y * self.size[0] + x])
    }

    /// Whether there is no land at all.
    pub fn is_empty(&self) -> bool {
        !self.cells.contains(&true)
    }

    /// Adds all cells closer to land than a distance \[m\]: along latitude first, then along longitude.
    fn grow(&mut self, buffer: f64) {
        let [columns, rows] = self.size;
        let reach = (buffer / (CELL * DEGREE)).ceil() as usize;
        if reach == 0 {
            return;
        }
        // Number of cells to the nearest land in the same column.
        let mut away = vec![usize::MAX; self.cells.len()];
        for column in 0..columns {
            let mut sweep = |order: &mut dyn Iterator<Item = usize>| {
                let mut since = usize::MAX;
                for row in order {
                    let at = row * columns + column;
                    since = if self.cells[at] {
                        0
                    } else {
                        since.saturating_add(1)
                    };
                    away[at] = away[at].min(since);
                }
            };
            sweep(&mut (0..rows));
            sweep(&mut (0..rows).rev());
        }
        for row in 0..rows {
            let latitude = (self.first[1] + row as f64 * CELL).clamp(-89.0, 89.0);
            let step = CELL * DEGREE * latitude.to_radians().cos();
            let across = (buffer / step).ceil() as usize;
            let line: Vec<usize> = away[row * columns..][..columns].to_vec();
            for column in 0..columns {
                let near = column.saturating_sub(across)..(column + across + 1).min(columns);
                let is_near = |other: usize| {
                    let x = other.abs_diff(column) as f64 * step;
                    line[other] <= reach && x.hypot(line[other] as f64 * CELL * DEGREE) <= buffer
                };
                if near.into_iter().any(is_near) {
                    self.cells[row * columns + column] = true;
                }
            }
        }
    }
}

/// The longitude nearest to another, up to whole turns.
fn near(longitude: f64, reference: f64) -> f64 {
    longitude - 360.0 * ((longitude - reference) / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask_of(land: &Land, west: f64, south: f64, buffer: f64) -> LandMask {
        let size = [(4.0 / CELL) as usize, (4.0 / CELL) as usize];
        let mut mask = LandMask {
            first: [west, south],
            size,
            cells: vec![false; size[0] * size[1]],
        };
        land.fill(&mut mask);
        mask.grow(buffer);
        mask
    }

    /// Places far from any coast.
    #[test]
    fn cities_are_on_land_and_seas_are_not() {
        let land = Land::natural_earth();
        for (latitude, longitude, expected) in [
            (48.9, 2.4, true),     // Paris
            (52.0, 3.0, false),    // North Sea
            (-18.0, 36.3, true),   // Mozambique
            (-19.5, 37.0, false),  // Mozambique Channel
            (65.0, -18.5, true),   // Iceland
            (66.5, 179.0, true),   // Chukotka, west of the antimeridian
            (66.3, -179.0, true),  // and east of it
            (57.0, -178.0, false), // Bering Sea
            (42.0, 51.0, true),    // the Caspian is a lake of Natural Earth
            (-77.0, 105.0, true),  // Antarctica
        ] {
            let mask = mask_of(&land, longitude - 2.0, latitude - 2.0, 0.0);
            assert_eq!(
                mask.is_land(latitude, longitude),
                expected,
                "{latitude} {longitude}"
            );
        }
        // The same across the antimeridian.
        let mask = mask_of(&land, 177.0, 64.3, 0.0);
        assert!(mask.is_land(66.5, -179.5) && mask.is_land(66.5, 180.5));
    }

    /// An island of one kilometre with a buffer of two.
    #[test]
    fn a_buffer_surrounds_land() {
        let half = 0.5 / 111.195;
        let corner = |x: f64, y: f64| [5.0 + x * half * 2.0, 60.0 + y * half];
        let land = Land {
            rings: vec![vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ]],
        };
        let mask = mask_of(&land, 3.0, 58.0, 2000.0);
        let north = |metres: f64| mask.is_land(60.0 + metres / DEGREE, 5.0);
        let east = |metres: f64| mask.is_land(60.0, 5.0 + metres / DEGREE / 0.5);
        // Cells there are 280 m high and half as wide.
        assert!(north(2200.0) && !north(2850.0));
        assert!(east(2250.0) && !east(2750.0));
    }

    #[test]
    fn polygons_are_read_from_geojson() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let square =
            "[[[0,0],[1,0],[1,1],[0,1],[0,0]],[[0.4,0.4],[0.6,0.4],[0.6,0.6],[0.4,0.6],[0.4,0.4]]]";
        let text = format!(
            r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature", "geometry":
            {{"type": "MultiPolygon", "coordinates": [{square}]}}}}, {{"type": "Feature", "geometry": {{"type": "Point"}}}}]}}"#
        );
        std::fs::write(file.path(), text).unwrap();
        let land = Land::read(file.path()).unwrap();
        let mask = mask_of(&land, -1.0, -1.0, 0.0);
        assert!(mask.is_land(0.2, 0.2) && !mask.is_land(0.5, 0.5) && !mask.is_land(1.2, 0.5));
        std::fs::write(file.path(), "{}").unwrap();
        assert!(
            Land::read(file.path())
                .unwrap_err()
                .to_string()
                .contains("(it has no polygon); give a GeoJSON file")
        );
    }
}
