//! Projected coordinates by EPSG code.

use proj4rs::Proj;
use proj4rs::transform::transform;

/// Coordinate reference system with an EPSG code: degrees on the ellipsoid, or a map projection.
///
/// Supported codes: 4326 (WGS84), 4258, 4269 and 4979, taken as WGS84; 3857 (web mercator); 32601–32660 and
/// 32701–32760 (UTM north and south); 25828–25838 (ETRS89 UTM); 26901–26923 (NAD83 UTM); 32661, 32761 (UPS);
/// 3413, 3995, 3996, 3031, 3976 (polar stereographic); 3035 (Lambert azimuthal, Europe); 3571–3576 and 6931, 6932
/// (polar Lambert azimuthal); 3395 (world mercator); 6933 (equal-area cylindrical); 3034, 2154 (Lambert conic).
/// ETRS89, NAD83 and RGF93 are taken as WGS84, from which they differ by at most 2 m.
#[derive(Clone, Debug)]
pub struct Projection {
    epsg: u32,
    /// `None` for degrees.
    map: Option<Box<(Proj, Proj)>>,
}

impl Projection {
    /// Reference system of an EPSG code; `None` if the code is not supported.
    pub fn epsg(code: u32) -> Option<Self> {
        if is_geographic(code) {
            return Some(Self {
                epsg: code,
                map: None,
            });
        }
        let ellipsoid = ellipsoid(code);
        let map = format!("{} {ellipsoid} +units=m +no_defs", definition(code)?);
        let degrees = format!("+proj=longlat {ellipsoid} +no_defs");
        let map = Proj::from_proj_string(&map).ok()?;
        let degrees = Proj::from_proj_string(&degrees).ok()?;
        Some(Self {
            epsg: code,
            map: Some(Box::new((map, degrees))),
        })
    }

    /// The EPSG code.
    pub fn code(&self) -> u32 {
        self.epsg
    }

    /// Whether coordinates are (longitude, latitude) in degrees.
    pub fn is_geographic(&self) -> bool {
        self.map.is_none()
    }

    /// Converts coordinates x, y \[m, or degrees of longitude and latitude\] to (latitude, longitude) \[degrees\];
    /// `None` beyond the projection.
    pub fn to_degrees(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (longitude, latitude) = match &self.map {
            None => (x, y),
            Some(map) => {
                let mut point = (x, y, 0.0);
                transform(&map.0, &map.1, &mut point).ok()?;
                (point.0.to_degrees(), point.1.to_degrees())
            }
        };
        let valid = (-90.0..=90.0).contains(&latitude) && (-360.0..=360.0).contains(&longitude);
        valid.then(|| (latitude, crate::place::wrapped(longitude)))
    }

    /// Converts a latitude and longitude \[degrees\] to coordinates (x, y); `None` beyond the projection.
    pub fn from_degrees(&self, latitude: f64, longitude: f64) -> Option<(f64, f64)> {
        let (x, y) = match &self.map {
            None => (longitude, latitude),
            Some(map) => {
                let mut point = (longitude.to_radians(), latitude.to_radians(), 0.0);
                transform(&map.1, &map.0, &mut point).ok()?;
                (point.0, point.1)
            }
        };
        (x.is_finite() && y.is_finite()).then_some((x, y))
    }
}

pub(crate) fn is_geographic(code: u32) -> bool {
    matches!(code, 4326 | 4979 | 4258 | 4269)
}

/// Ellipsoid of a map; degrees on it are taken as WGS84 degrees.
fn ellipsoid(code: u32) -> &'static str {
    match code {
        25828..=25838 | 26901..=26923 | 3034 | 3035 | 2154 => "+ellps=GRS80",
        _ => "+ellps=WGS84",
    }
}

/// PROJ definition of a projection, from the EPSG registry.
fn definition(code: u32) -> Option<String> {
    let utm = |zone: u32| format!("+proj=utm +zone={zone}");
    let laea = |lat: i32, lon: i32| format!("+proj=laea +lat_0={lat} +lon_0={lon}");
    let polar =
        |lat: i32, ts: i32, lon: i32| format!("+proj=stere +lat_0={lat} +lat_ts={ts} +lon_0={lon}");
    Some(match code {
        32601..=32660 => utm(code - 32600),
        32701..=32760 => utm(code - 32700) + " +south",
        25828..=25838 => utm(code - 25800),
        26901..=26923 => utm(code - 26900),
        3857 => "+proj=webmerc +lon_0=0".to_owned(),
        3395 => "+proj=merc +lon_0=0".to_owned(),
        6933 => "+proj=cea +lat_ts=30 +lon_0=0".to_owned(),
        32661 => "+proj=stere +lat_0=90 +lon_0=0 +k=0.994 +x_0=2000000 +y_0=2000000".to_owned(),
        32761 => "+proj=stere +lat_0=-90 +lon_0=0 +k=0.994 +x_0=2000000 +y_0=2000000".to_owned(),
        3413 => polar(90, 70, -45),
        3995 => polar(90, 71, 0),
        3996 => polar(90, 75, 0),
        3031 => polar(-90, -71, 0),
        3976 => polar(-90, -70, 0),
        3035 => laea(52, 10) + " +x_0=4321000 +y_0=3210000",
        3571 => laea(90, 180),
        3572 => laea(90, -150),
        3573 => laea(90, -100),
        3574 => laea(90, -40),
        3575 => laea(90, 10),
        3576 => laea(90, 90),
        6931 => laea(90, 0),
        6932 => laea(-90, 0),
        3034 => {
            "+proj=lcc +lat_1=35 +lat_2=65 +lat_0=52 +lon_0=10 +x_0=4000000 +y_0=2800000".to_owned()
        }
        2154 => {
            "+proj=lcc +lat_1=49 +lat_2=44 +lat_0=46.5 +lon_0=3 +x_0=700000 +y_0=6600000".to_owned()
        }
        _ => return None,
    })
}
