//! One type for every raster image.

use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result, check_range};
use crate::geodesic::track;
use crate::geolocation::Geolocation;
use crate::geotiff::GeoTiff;
use crate::picture::Picture;
use crate::place::{PixelAxes, Place};
use crate::safe::{Polarization, Sentinel1};
use crate::window::{Window, check_window};
use whole_files::sentence;

/// Raster image and its location on Earth: a Sentinel-1 GRD product, a GeoTIFF, or an image without places.
///
/// Lines and pixels count from 0, and whole numbers are pixel centres. The image reaches from −0.5 to the number of
/// lines (or pixels) minus 0.5.
#[derive(Debug)]
pub struct Product {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Sentinel1(Box<Sentinel1>, Box<Geolocation>),
    GeoTiff(Box<GeoTiff>),
    Picture(Picture, Geolocation),
}

/// Meaning of the values of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// Normalized radar cross-section σ⁰, linear.
    SigmaNought,
    /// Samples of the file, of unknown calibration.
    Samples,
}

impl Product {
    /// Opens a `.SAFE` folder, a `.zip` of one, or a TIFF, PNG or JPEG file; the content decides, not the name. Of a
    /// Sentinel-1 product, opens the first polarization that it has of VV, HH, VH and HV.
    ///
    /// # Errors
    /// Paths that cannot be read, unsupported formats and product types, files that are damaged, truncated or beyond
    /// the [limits](crate::limits).
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::open_any(path.as_ref(), None)
    }

    /// Opens one polarization of a Sentinel-1 product; other images are refused.
    ///
    /// # Errors
    /// As [`Product::open`]; a polarization that the product lacks.
    pub fn open_polarization(path: impl AsRef<Path>, polarization: Polarization) -> Result<Self> {
        Self::open_any(path.as_ref(), Some(polarization))
    }

    fn open_any(path: &Path, polarization: Option<Polarization>) -> Result<Self> {
        let is_manifest = path.file_name().is_some_and(|name| name == "manifest.safe");
        let path = match path.parent() {
            Some(parent) if is_manifest => parent,
            _ => path,
        };
        if path.is_dir() {
            return Self::open_sentinel1(path, polarization);
        }
        let mut file = whole_files::open_regular(path).map_err(|e| Error::io(path, e))?;
        let mut magic = Vec::new();
        let start = (&mut file).take(4).read_to_end(&mut magic);
        start.map_err(|e| Error::io(path, e))?;
        let kind = match magic.as_slice() {
            [b'P', b'K', ..] => return Self::open_sentinel1(path, polarization),
            _ if polarization.is_some() => {
                return Err(Error::unreadable(
                    path,
                    "only Sentinel-1 products have a choice of polarization",
                ));
            }
            b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+" => {
                let name = sentence(&path.to_string_lossy());
                Kind::GeoTiff(Box::new(GeoTiff::from_source(&name, Arc::new(file))?))
            }
            b"\x89PNG" | [0xff, 0xd8, 0xff, _] => {
                let why = "PNG and JPEG files have no geolocation".to_owned();
                Kind::Picture(Picture::open(path, file)?, Geolocation::Unknown(why))
            }
            _ => {
                return Err(Error::unreadable(
                    path,
                    "its first bytes match no known format",
                ));
            }
        };
        Ok(Self {
            path: path.to_owned(),
            kind,
        })
    }

    fn open_sentinel1(path: &Path, polarization: Option<Polarization>) -> Result<Self> {
        let product = Sentinel1::open(path, polarization)?;
        let grid = Geolocation::Grid(product.annotation().grid.clone());
        Ok(Self {
            path: path.to_owned(),
            kind: Kind::Sentinel1(Box::new(product), Box::new(grid)),
        })
    }

    /// Path of the product.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of lines and of pixels of a line.
    pub fn size(&self) -> (usize, usize) {
        match &self.kind {
            Kind::Sentinel1(product, _) => {
                (product.annotation().lines, product.annotation().pixels)
            }
            Kind::GeoTiff(tiff) => (tiff.lines(), tiff.pixels()),
            Kind::Picture(picture, _) => (picture.lines, picture.pixels),
        }
    }

    /// Meaning of the values that [`Product::read_window`] returns.
    pub fn values(&self) -> Values {
        match self.kind {
            Kind::Sentinel1(..) => Values::SigmaNought,
            _ => Values::Samples,
        }
    }

    /// The Sentinel-1 product with annotation, calibration and times, if it is one.
    pub fn sentinel1(&self) -> Option<&Sentinel1> {
        match &self.kind {
            Kind::Sentinel1(product, _) => Some(product),
            _ => None,
        }
    }

    /// Whether pixels can be read; a Sentinel-1 product may have only annotation.
    pub fn has_pixels(&self) -> bool {
        self.sentinel1().is_none_or(Sentinel1::has_measurement)
    }

    /// Whether places are known.
    pub fn has_places(&self) -> bool {
        !matches!(self.geolocation(), Geolocation::Unknown(_))
    }

    fn geolocation(&self) -> &Geolocation {
        match &self.kind {
            Kind::Sentinel1(_, geolocation) => geolocation,
            Kind::GeoTiff(tiff) => tiff.geolocation(),
            Kind::Picture(_, geolocation) => geolocation,
        }
    }

    /// Reads a window: σ⁰ of a Sentinel-1 product, samples of other images. Only the strips or tiles that it covers
    /// are read. Several threads may read at once.
    ///
    /// # Errors
    /// A window that is empty, leaves the image or exceeds the limit; a product without measurement; damaged pixels.
    pub fn read_window(&self, lines: Range<usize>, pixels: Range<usize>) -> Result<Window> {
        let mut window = Window::default();
        self.read_window_into(lines, pixels, &mut window)?;
        Ok(window)
    }

    /// As [`Product::read_window`], into an existing window whose memory is reused; after an error its content is
    /// undefined.
    ///
    /// # Errors
    /// As [`Product::read_window`].
    pub fn read_window_into(
        &self,
        lines: Range<usize>,
        pixels: Range<usize>,
        window: &mut Window,
    ) -> Result<()> {
        check_window(&lines, &pixels, self.size())?;
        window.start(lines.len(), pixels.len());
        match &self.kind {
            Kind::Sentinel1(product, _) => product.read_window(lines, pixels, window)?,
            Kind::Picture(picture, _) => picture.read(lines, pixels, &mut window.values),
            Kind::GeoTiff(tiff) => {
                tiff.read(lines, pixels, &mut window.values)?;
                let values = &mut window.values;
                if let Some(missing) = tiff.no_data() {
                    let equal = |value: &&mut f32| value.total_cmp(&missing).is_eq();
                    values
                        .iter_mut()
                        .filter(equal)
                        .for_each(|value| *value = f32::NAN);
                }
                window.no_data = values.iter().filter(|value| value.is_nan()).count();
            }
        }
        Ok(())
    }

    /// Place of a pixel; for a Sentinel-1 product with height, incidence and slant range time.
    ///
    /// # Errors
    /// A pixel outside the image, an image without places, a pixel beyond its map projection.
    pub fn place(&self, line: f64, pixel: f64) -> Result<Place> {
        let (lines, pixels) = self.size();
        check_range("line", line, -0.5, lines as f64 - 0.5)?;
        check_range("pixel", pixel, -0.5, pixels as f64 - 0.5)?;
        let place = self.geolocation().place(line, pixel);
        place.ok_or_else(|| {
            let why = match self.geolocation() {
                Geolocation::Unknown(why) => why.clone(),
                _ => format!("line {line}, pixel {pixel} lies outside its map projection"),
            };
            Error::NoPlaces {
                file: sentence(&self.path.to_string_lossy()),
                why,
            }
        })
    }

    /// The (line, pixel) of a latitude and longitude \[degrees\], the inverse of [`Product::place`]. `None` if the
    /// place lies outside the image, or the image has no places.
    pub fn pixel_of(&self, latitude: f64, longitude: f64) -> Option<(f64, f64)> {
        if !(-90.0..=90.0).contains(&latitude) || !(-720.0..=720.0).contains(&longitude) {
            return None;
        }
        let (lines, pixels) = self.size();
        let found = self
            .geolocation()
            .pixel_of(latitude, longitude, 0.5 * pixels as f64);
        // Rounding may move a pixel on the border out of the image.
        let inside = |at: f64, size: usize| (-0.5 - 1e-6..=size as f64 - 0.5 + 1e-6).contains(&at);
        let clamped = |at: f64, size: usize| at.clamp(-0.5, size as f64 - 0.5);
        found
            .filter(|&(line, pixel)| inside(line, lines) && inside(pixel, pixels))
            .map(|(line, pixel)| (clamped(line, lines), clamped(pixel, pixels)))
    }

    /// Directions of increasing line and pixel from true north, and the distances between pixels, by geodesics on WGS84.
    ///
    /// # Errors
    /// As [`Product::place`].
    pub fn axes(&self, line: f64, pixel: f64) -> Result<PixelAxes> {
        self.place(line, pixel)?;
        let (lines, pixels) = self.size();
        // One pixel around the position, cut at the borders of the image.
        let around = |at: f64, size: usize| {
            let last = size as f64 - 0.5;
            ((at - 0.5).max(-0.5), (at + 0.5).min(last))
        };
        let (above, below) = around(line, lines);
        let (left, right) = around(pixel, pixels);
        let degrees = |line, pixel| self.place(line, pixel).map(|p| (p.latitude, p.longitude));
        let down = track(degrees(above, pixel)?, degrees(below, pixel)?);
        let across = track(degrees(line, left)?, degrees(line, right)?);
        Ok(PixelAxes {
            line_azimuth: down.azimuth,
            pixel_azimuth: across.azimuth,
            line_spacing: down.distance / (below - above),
            pixel_spacing: across.distance / (right - left),
        })
    }

    /// Geodesic from one (line, pixel) to another: length, and direction at the start from true north.
    ///
    /// # Errors
    /// As [`Product::place`].
    pub fn track(&self, from: (f64, f64), to: (f64, f64)) -> Result<crate::geodesic::Track> {
        let (from, to) = (self.place(from.0, from.1)?, self.place(to.0, to.1)?);
        Ok(track(
            (from.latitude, from.longitude),
            (to.latitude, to.longitude),
        ))
    }

    /// R/V at a pixel \[s\]: slant range divided by platform speed. A target that moves toward the radar at u is
    /// imaged R/V · u away along azimuth. `None` for images other than Sentinel-1 products.
    ///
    /// # Errors
    /// As [`Product::place`].
    pub fn range_to_velocity(&self, line: f64, pixel: f64) -> Result<Option<f64>> {
        let place = self.place(line, pixel)?;
        let product = self.sentinel1().zip(place.slant_range_time);
        Ok(product.map(|(product, time)| product.annotation().range_to_velocity(line, time)))
    }
}
