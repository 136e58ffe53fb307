//! Annotation of a product: acquisition, geometry and geolocation.

use super::orbit::Orbit;
use crate::error::Result;
use crate::geolocation::{Grid, GridPoint};
use crate::limits::{GRID_POINTS, IMAGE_SIDE};
use crate::place::Place;
use crate::time::UtcTime;
use crate::xml::{Document, Node};

/// Direction of the platform along its orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Pass {
    /// Toward north.
    Ascending,
    /// Toward south.
    Descending,
}

/// Transmitted and received polarization of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Polarization {
    /// Vertical, vertical.
    VV,
    /// Horizontal, horizontal.
    HH,
    /// Vertical, horizontal.
    VH,
    /// Horizontal, vertical.
    HV,
}

impl Polarization {
    /// All polarizations, co-polarized first, in the order of preference if none is requested.
    pub const ALL: [Self; 4] = [Self::VV, Self::HH, Self::VH, Self::HV];

    /// Name in capitals, such as `"VV"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::VV => "VV",
            Self::HH => "HH",
            Self::VH => "VH",
            Self::HV => "HV",
        }
    }

    /// Polarization with a name, in upper or lower case.
    pub fn from_name(name: &str) -> Option<Self> {
        let is = |known: &Self| known.name().eq_ignore_ascii_case(name);
        Self::ALL.into_iter().find(is)
    }
}

/// Processing of one swath: looks and bandwidths.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SwathLooks {
    /// Name of the swath, such as `IW1`.
    pub swath: String,
    /// Number of looks in range.
    pub range_looks: u32,
    /// Number of looks in azimuth.
    pub azimuth_looks: u32,
    /// Bandwidth of one look in range \[Hz\].
    pub range_look_bandwidth: f64,
    /// Bandwidth of one look in azimuth \[Hz\].
    pub azimuth_look_bandwidth: f64,
}

/// Annotation of one polarization. Line 0 is the first acquired; pixel 0 is in near range.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Annotation {
    /// Satellite, such as `S1A`.
    pub mission: String,
    /// Acquisition mode: `IW`, `EW` or `S1` to `S6` (stripmap).
    pub mode: String,
    /// Polarization of the image.
    pub polarization: Polarization,
    /// Direction of the platform along its orbit.
    pub pass: Pass,
    /// Heading of the platform, clockwise from true north \[degrees\], as the product gives it (−180 to 180).
    pub platform_heading: f64,
    /// Number of the orbit since launch.
    pub absolute_orbit: u32,
    /// Zero-Doppler time of line 0.
    #[serde(serialize_with = "as_text")]
    pub first_line_time: UtcTime,
    /// Zero-Doppler time of the last line.
    #[serde(serialize_with = "as_text")]
    pub last_line_time: UtcTime,
    /// Number of lines.
    pub lines: usize,
    /// Number of pixels of a line.
    pub pixels: usize,
    /// Ground distance between pixels \[m\].
    pub range_spacing: f64,
    /// Distance between lines \[m\].
    pub azimuth_spacing: f64,
    /// Time between lines \[s\].
    pub line_interval: f64,
    /// Two-way slant range time of pixel 0 of the first line \[s\].
    pub slant_range_time: f64,
    /// Radar frequency \[Hz\].
    pub radar_frequency: f64,
    /// Incidence angle in the middle of the swath \[degrees\].
    pub incidence_mid_swath: f64,
    /// Whether the processor has already subtracted the thermal noise.
    pub noise_removed: bool,
    /// Looks and bandwidths of each swath.
    pub looks: Vec<SwathLooks>,
    #[serde(skip)]
    pub(crate) grid: Grid,
    #[serde(skip)]
    pub(crate) orbit: Orbit,
}

fn as_text<S: serde::Serializer>(time: &UtcTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(time)
}

impl Annotation {
    /// Reads an annotation file; `file` names it in errors. The caller must have checked the product type.
    pub(crate) fn read(file: &str, document: &Document) -> Result<Self> {
        let root = document.root();
        let image = root.get("imageAnnotation/imageInformation")?;
        let general = root.get("generalAnnotation/productInformation")?;
        let header = root.get("adsHeader")?;
        let side = IMAGE_SIDE as i64;
        let lines = image.integer_in("numberOfLines", 2, side)? as usize;
        let pixels = image.integer_in("numberOfSamples", 2, side)? as usize;
        let processing = root.get("imageAnnotation/processingInformation")?;
        let removed = processing.find("thermalNoiseCorrectionPerformed");
        Ok(Self {
            mission: header.get("missionId")?.text().to_owned(),
            mode: header.get("mode")?.text().to_owned(),
            polarization: named(header, "polarisation", Polarization::from_name)?,
            pass: named(general, "pass", pass)?,
            platform_heading: general.number_in("platformHeading", -360.0, 360.0)?,
            absolute_orbit: header.integer_in("absoluteOrbitNumber", 0, 1_000_000)? as u32,
            first_line_time: named(image, "productFirstLineUtcTime", UtcTime::parse)?,
            last_line_time: named(image, "productLastLineUtcTime", UtcTime::parse)?,
            lines,
            pixels,
            range_spacing: image.number_in("rangePixelSpacing", 0.1, 1000.0)?,
            azimuth_spacing: image.number_in("azimuthPixelSpacing", 0.1, 1000.0)?,
            line_interval: image.number_in("azimuthTimeInterval", 1e-6, 1.0)?,
            slant_range_time: image.number_in("slantRangeTime", 1e-4, 1.0)?,
            radar_frequency: general.number_in("radarFrequency", 1e8, 1e11)?,
            incidence_mid_swath: image.number_in("incidenceAngleMidSwath", 0.0, 90.0)?,
            noise_removed: removed.is_some_and(|node| node.text() == "true"),
            looks: read_looks(processing)?,
            grid: read_grid(file, root, (lines, pixels))?,
            orbit: Orbit::read(root.get("generalAnnotation/orbitList")?)?,
        })
    }

    /// Zero-Doppler time of a line.
    pub fn line_time(&self, line: f64) -> UtcTime {
        self.first_line_time.plus_seconds(line * self.line_interval)
    }

    /// Speed of the platform in the Earth-fixed frame at a line \[m/s\].
    pub fn platform_speed(&self, line: f64) -> f64 {
        self.orbit.speed(self.line_time(line))
    }

    /// R/V \[s\]: slant range divided by platform speed. A target that moves toward the radar at u is imaged R/V · u
    /// away along azimuth.
    pub fn range_to_velocity(&self, line: f64, slant_range_time: f64) -> f64 {
        self.orbit
            .range_to_velocity(self.line_time(line), slant_range_time)
    }

    /// Equivalent number of looks of the product's class, identified by its pixel spacing; `None` for other spacings.
    ///
    /// Source: Sentinel-1 Product Definition (S1-RS-MDA-52-7440), tables of GRD products.
    pub fn equivalent_looks(&self) -> Option<f64> {
        let near = |spacing: f64| (self.range_spacing / spacing - 1.0).abs() < 0.1;
        match self.mode.as_str() {
            "IW" if near(10.0) => Some(4.4),
            "IW" if near(40.0) => Some(81.8),
            "EW" if near(25.0) => Some(2.7),
            "EW" if near(40.0) => Some(10.7),
            mode if mode.starts_with('S') && self.range_spacing < 5.0 => Some(3.7),
            mode if mode.starts_with('S') && near(10.0) => Some(29.7),
            mode if mode.starts_with('S') && near(40.0) => Some(398.4),
            _ => None,
        }
    }
}

fn pass(text: &str) -> Option<Pass> {
    match text.to_ascii_lowercase().as_str() {
        "ascending" => Some(Pass::Ascending),
        "descending" => Some(Pass::Descending),
        _ => None,
    }
}

/// Value of a child element, converted from its text by `read`.
fn named<T>(node: Node<'_>, name: &str, read: impl Fn(&str) -> Option<T>) -> Result<T> {
    let text = node.get(name)?.text();
    read(text).ok_or_else(|| node.error(format!("{name} is {text:?}, which is not a valid value")))
}

fn read_looks(processing: Node<'_>) -> Result<Vec<SwathLooks>> {
    const MOST_SWATHS: usize = 16;
    let Some(list) = processing.find("swathProcParamsList") else {
        return Ok(Vec::new());
    };
    let swaths = list.children("swathProcParams").take(MOST_SWATHS);
    swaths
        .map(|node| {
            Ok(SwathLooks {
                swath: node.get("swath")?.text().to_owned(),
                range_looks: node.integer_in("rangeProcessing/numberOfLooks", 1, 10_000)? as u32,
                azimuth_looks: node.integer_in("azimuthProcessing/numberOfLooks", 1, 10_000)?
                    as u32,
                range_look_bandwidth: node.number_in("rangeProcessing/lookBandwidth", 0.0, 1e10)?,
                azimuth_look_bandwidth: node.number_in(
                    "azimuthProcessing/lookBandwidth",
                    0.0,
                    1e7,
                )?,
            })
        })
        .collect()
}

fn read_grid(file: &str, root: Node<'_>, size: (usize, usize)) -> Result<Grid> {
    let list = root.get("geolocationGrid/geolocationGridPointList")?;
    let mut points = Vec::new();
    for node in list.children("geolocationGridPoint") {
        if points.len() == GRID_POINTS {
            return Err(list.error(format!(
                "it has more than {GRID_POINTS} geolocation grid points"
            )));
        }
        points.push(GridPoint {
            line: node.number("line")?,
            pixel: node.number("pixel")?,
            place: Place {
                latitude: node.number("latitude")?,
                longitude: node.number("longitude")?,
                height: Some(node.number("height")?),
                incidence: Some(node.number("incidenceAngle")?),
                slant_range_time: Some(node.number("slantRangeTime")?),
            },
        });
    }
    Grid::new(file, points, size)
}
