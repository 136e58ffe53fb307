//! Geolocation of a GeoTIFF: keys, affine map and control points (OGC GeoTIFF 1.1).

use tiff::decoder::ifd::Value;

use super::chunks::Chunks;
use crate::geolocation::{Affine, Geolocation, Grid, GridPoint};
use crate::place::Place;
use crate::projection::Projection;
use whole_files::sentence;

pub(crate) const PIXEL_SCALE: u16 = 33550;
pub(crate) const TIEPOINTS: u16 = 33922;
pub(crate) const TRANSFORMATION: u16 = 34264;
pub(crate) const KEY_DIRECTORY: u16 = 34735;
pub(crate) const NO_DATA: u16 = 42113;

pub(crate) const MODEL_TYPE: u16 = 1024;
pub(crate) const RASTER_TYPE: u16 = 1025;
pub(crate) const GEOGRAPHIC: u16 = 2048;
pub(crate) const PROJECTED: u16 = 3072;
pub(crate) const MODEL_PROJECTED: u16 = 1;
pub(crate) const MODEL_GEOGRAPHIC: u16 = 2;
pub(crate) const PIXEL_IS_AREA: u16 = 1;
pub(crate) const PIXEL_IS_POINT: u16 = 2;

/// Geolocation of an image; unknown, with the reason, if the file has none that is supported.
pub(crate) fn geolocation(file: &str, chunks: &Chunks) -> Geolocation {
    match read(file, chunks) {
        Ok(geolocation) => geolocation,
        Err(why) => Geolocation::Unknown(sentence(&why)),
    }
}

fn read(file: &str, chunks: &Chunks) -> Result<Geolocation, String> {
    let Some(keys) = chunks.tag(KEY_DIRECTORY) else {
        return Err("it has no GeoTIFF keys".to_owned());
    };
    let keys = Keys(keys.into_u16_vec().map_err(|e| e.to_string())?);
    let code = match keys.get(MODEL_TYPE) {
        Some(MODEL_PROJECTED) => keys.get(PROJECTED),
        Some(MODEL_GEOGRAPHIC) => keys.get(GEOGRAPHIC),
        _ => keys.get(PROJECTED).or(keys.get(GEOGRAPHIC)),
    };
    let code = code.ok_or("it has no EPSG code")?;
    let projection = Projection::epsg(code.into());
    let projection = projection.ok_or_else(|| format!("EPSG code {code} is not supported"))?;
    // Raster coordinates count from the corner of the first pixel or from its centre.
    let half = match keys.get(RASTER_TYPE) {
        Some(PIXEL_IS_POINT) => 0.0,
        _ => 0.5,
    };
    if let Some(affine) = affine(chunks)? {
        let affine = affine.shifted(half, half);
        return match affine.determinant().is_normal() {
            true => Ok(Geolocation::Affine(affine, projection)),
            false => Err("its affine map has no inverse".to_owned()),
        };
    }
    let points = doubles(chunks, TIEPOINTS)?.unwrap_or_default();
    let (points, _) = points.as_chunks::<6>();
    let points = points.iter().map(|&[pixel, line, _, x, y, height]| {
        let (latitude, longitude) = projection.to_degrees(x, y).ok_or_else(|| {
            format!("a control point at {x}, {y} lies outside the projection EPSG:{code}")
        })?;
        Ok(GridPoint {
            line: line - half,
            pixel: pixel - half,
            place: Place {
                latitude,
                longitude,
                height: Some(height),
                incidence: None,
                slant_range_time: None,
            },
        })
    });
    let points: Vec<GridPoint> = points.collect::<Result<_, String>>()?;
    let grid = Grid::new(file, points, (chunks.lines, chunks.pixels));
    let grid =
        grid.map_err(|_| "its control points do not form a rectangular grid over the image")?;
    Ok(Geolocation::Grid(grid))
}

/// The affine map from raster coordinates, which count from 0.
fn affine(chunks: &Chunks) -> Result<Option<Affine>, String> {
    if let Some(m) = doubles(chunks, TRANSFORMATION)? {
        let &[a, b, _, d, e, f, _, h, ..] = m.as_slice() else {
            return Err(format!(
                "its transformation has {} numbers instead of 16",
                m.len()
            ));
        };
        return Ok(Some(Affine {
            x: [d, a, b],
            y: [h, e, f],
        }));
    }
    let Some(scale) = doubles(chunks, PIXEL_SCALE)? else {
        return Ok(None);
    };
    let tie = doubles(chunks, TIEPOINTS)?.unwrap_or_default();
    let (&[sx, sy, ..], &[pixel, line, _, x, y, ..]) = (scale.as_slice(), tie.as_slice()) else {
        return Err("it has a pixel scale, but no tie point".to_owned());
    };
    Ok(Some(Affine {
        x: [x - sx * pixel, sx, 0.0],
        y: [y + sy * line, 0.0, -sy],
    }))
}

fn doubles(chunks: &Chunks, tag: u16) -> Result<Option<Vec<f64>>, String> {
    let Some(value) = chunks.tag(tag) else {
        return Ok(None);
    };
    let values = value.into_f64_vec().map_err(|e| e.to_string())?;
    match values.iter().all(|v| v.is_finite()) {
        true => Ok(Some(values)),
        false => Err(format!("tag {tag} has a number that is not finite")),
    }
}

/// Value that marks missing pixels, as GDAL writes it.
pub(crate) fn no_data(chunks: &Chunks) -> Option<f32> {
    match chunks.tag(NO_DATA)? {
        Value::Ascii(text) => text
            .trim_matches(|c: char| c.is_whitespace() || c == '\0')
            .parse()
            .ok(),
        _ => None,
    }
}

/// Key directory: a header of four numbers, then four numbers a key.
struct Keys(Vec<u16>);

impl Keys {
    /// Value of a key, if it is stored in the directory itself.
    fn get(&self, key: u16) -> Option<u16> {
        let (entries, _) = self.0.get(4..)?.as_chunks::<4>();
        entries
            .iter()
            .find_map(|&[id, place, _, value]| (id == key && place == 0).then_some(value))
    }
}
