//! Sentinel-1 Level-1 GRD products.

mod annotation;
mod archive;
mod calibration;
mod lut;
mod noise;
mod orbit;
mod sigma;
mod tree;

mod cut;
mod write;

use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

pub use annotation::{Annotation, Pass, Polarization, SwathLooks};

use archive::Archive;
use calibration::Calibration;
use noise::Noise;
use sigma::{Calibrator, sigma_nought};

use crate::error::{Error, Result};
use crate::geotiff::{GeoTiff, SampleType};
use crate::limits::MEASUREMENT_EXTRA_BYTES;
use crate::window::{Window, check_window};
use crate::xml::Document;
use whole_files::sentence;

/// One polarization of a Sentinel-1 Level-1 GRD product.
///
/// σ⁰ = (DN² − noise) / A². A is bilinear between the vectors of `sigmaNought`; the noise is bilinear between its
/// range vectors, times the factor of its azimuth block, which is linear along azimuth. Tables are constant beyond
/// their first and last line or pixel. A pixel with DN² below the noise has σ⁰ = 0 and is counted; DN = 0 is no data.
/// If the processor has already removed the noise, the noise is 0.
#[derive(Debug)]
pub struct Sentinel1 {
    archive: Archive,
    /// File name of annotation and measurement, without ending.
    stem: String,
    polarizations: Vec<Polarization>,
    annotation: Annotation,
    calibration: Calibration,
    noise: Option<Noise>,
    measurement: Mutex<Option<Arc<GeoTiff>>>,
}

/// Calibration of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelCalibration {
    /// A, the value of the σ⁰ table.
    pub sigma_nought_lut: f64,
    /// Thermal noise power \[DN²\].
    pub noise: f64,
}

impl PixelCalibration {
    /// σ⁰ (linear) of a digital number: (DN² − noise) / A², and 0 if DN² is below the noise.
    pub fn sigma_nought(self, digital_number: f64) -> f64 {
        sigma_nought(digital_number, self.noise, self.sigma_nought_lut)
    }
}

impl Sentinel1 {
    /// Opens a product: a `.SAFE` folder, or a `.zip` of one. Without a polarization, opens the first that the
    /// product has of VV, HH, VH and HV. The measurement is opened when it is first read.
    ///
    /// # Errors
    /// Files that are missing, damaged or beyond the limits; a product of another type; a polarization that the
    /// product lacks.
    pub fn open(path: &Path, polarization: Option<Polarization>) -> Result<Self> {
        let archive = Archive::open(path)?;
        let stems = stems(&archive)?;
        let polarizations: Vec<Polarization> = stems.iter().map(|(p, _)| *p).collect();
        let chosen = match polarization {
            None => stems.first(),
            Some(wanted) => stems.iter().find(|(p, _)| *p == wanted),
        };
        let Some((polarization, stem)) = chosen else {
            let names: Vec<&str> = polarizations.iter().map(|p| p.name()).collect();
            return Err(Error::Polarization {
                path: path.to_owned(),
                wanted: polarization.map_or("", Polarization::name),
                there: names.join(", "),
            });
        };
        let (annotation, calibration, noise) = read_files(&archive, stem, *polarization)?;
        Ok(Self {
            stem: stem.clone(),
            polarizations,
            annotation,
            calibration,
            noise,
            measurement: Mutex::new(None),
            archive,
        })
    }

    /// Annotation of the product.
    pub fn annotation(&self) -> &Annotation {
        &self.annotation
    }

    /// Polarizations of the product.
    pub fn polarizations(&self) -> &[Polarization] {
        &self.polarizations
    }

    /// Name shared by annotation and measurement files, such as `s1a-iw-grd-vv-20210119t031653-…-001`.
    pub fn stem(&self) -> &str {
        &self.stem
    }

    /// Whether the product has pixels of this polarization; some products have only annotation.
    pub fn has_measurement(&self) -> bool {
        self.archive.has(&self.measurement_name())
    }

    /// Calibration of a pixel.
    pub fn calibration(&self, line: f64, pixel: f64) -> PixelCalibration {
        PixelCalibration {
            sigma_nought_lut: self.calibration.sigma_nought.at(line, pixel),
            noise: self
                .noise
                .as_ref()
                .map_or(0.0, |noise| noise.at(line, pixel)),
        }
    }

    /// Noise-equivalent σ⁰ of a pixel: thermal noise / A².
    pub fn noise_equivalent_sigma_nought(&self, line: f64, pixel: f64) -> f64 {
        let PixelCalibration {
            sigma_nought_lut,
            noise,
        } = self.calibration(line, pixel);
        noise / (sigma_nought_lut * sigma_nought_lut)
    }

    /// Reads the digital numbers of a window inside the image, line by line; `out` has the size of the window.
    pub(crate) fn digital_numbers(
        &self,
        lines: Range<usize>,
        pixels: Range<usize>,
        out: &mut [f32],
    ) -> Result<()> {
        let measurement = {
            let mut known = self
                .measurement
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            let opened = match known.take() {
                Some(opened) => opened,
                None => Arc::new(self.open_measurement()?),
            };
            known.insert(opened).clone()
        };
        measurement.read(lines, pixels, out)
    }

    /// Reads the intensity DN² / A² of a window: σ⁰ plus thermal noise. Unlike σ⁰ plus
    /// [`Sentinel1::noise_equivalent_sigma_nought`], it keeps pixels below the noise as they are, and the statistics of speckle.
    ///
    /// # Errors
    /// As [`Product::read_window`](crate::Product::read_window).
    pub fn read_intensity(&self, lines: Range<usize>, pixels: Range<usize>) -> Result<Window> {
        check_window(
            &lines,
            &pixels,
            (self.annotation.lines, self.annotation.pixels),
        )?;
        let mut window = Window::default();
        window.start(lines.len(), pixels.len());
        self.read_calibrated(None, lines, pixels, &mut window)?;
        Ok(window)
    }

    /// Reads σ⁰ of a window inside the image; `window` has the right size.
    pub(crate) fn read_window(
        &self,
        lines: Range<usize>,
        pixels: Range<usize>,
        window: &mut Window,
    ) -> Result<()> {
        self.read_calibrated(self.noise.as_ref(), lines, pixels, window)
    }

    fn read_calibrated(
        &self,
        noise: Option<&Noise>,
        lines: Range<usize>,
        pixels: Range<usize>,
        window: &mut Window,
    ) -> Result<()> {
        self.digital_numbers(lines.clone(), pixels.clone(), &mut window.values)?;
        let rows = window.values.chunks_exact_mut(pixels.len());
        let mut calibrator = Calibrator::new(&self.calibration, noise, pixels);
        for (line, row) in lines.zip(rows) {
            let counts = calibrator.apply(line, row);
            window.no_data += counts.no_data;
            window.below_noise += counts.below_noise;
        }
        Ok(())
    }

    fn measurement_name(&self) -> String {
        format!("measurement/{}.tiff", self.stem)
    }

    fn open_measurement(&self) -> Result<GeoTiff> {
        let name = self.measurement_name();
        if !self.archive.has(&name) {
            return Err(Error::NoMeasurement {
                path: self.archive.path().to_owned(),
            });
        }
        let (lines, pixels) = (self.annotation.lines, self.annotation.pixels);
        let most = 2 * lines as u64 * pixels as u64 + MEASUREMENT_EXTRA_BYTES;
        let tiff = GeoTiff::from_source(&name, self.archive.pixels(&name, most)?)?;
        if (tiff.lines(), tiff.pixels()) != (lines, pixels) || tiff.sample_type() != SampleType::U16
        {
            return Err(Error::damaged(
                &name,
                format!(
                    "it has {} lines of {} pixels with {} samples, but the annotation says {lines} lines of {pixels} pixels, and samples \
                     must be 16-bit unsigned",
                    tiff.lines(),
                    tiff.pixels(),
                    tiff.sample_type().name()
                ),
            ));
        }
        Ok(tiff)
    }
}

/// Polarizations and file names of a GRD product's annotations, co-polarized first.
fn stems(archive: &Archive) -> Result<Vec<(Polarization, String)>> {
    let mut found = Vec::new();
    let mut other = None;
    for name in archive.names_in("annotation") {
        let Some(stem) = name.strip_suffix(".xml") else {
            continue;
        };
        let mut parts = stem.split('-').skip(2);
        match (parts.next(), parts.next().and_then(Polarization::from_name)) {
            (Some("grd"), Some(polarization)) => found.push((polarization, stem.to_owned())),
            (Some(kind), _) if other.is_none() => other = Some(sentence(kind).to_uppercase()),
            _ => {}
        }
    }
    let order = |p: Polarization| Polarization::ALL.iter().position(|known| *known == p);
    found.sort_by_key(|(polarization, _)| order(*polarization));
    if !found.is_empty() {
        return Ok(found);
    }
    let path = archive.path();
    let from_name = archive
        .folder_name()
        .split('_')
        .nth(2)
        .filter(|kind| kind.len() >= 3);
    let by_name = from_name
        .filter(|_| archive.folder_name().starts_with("S1"))
        .map(sentence);
    let no_xml = archive
        .names_in("measurement")
        .any(|name| name.ends_with(".nc"));
    match other.or(no_xml.then(|| "OCN".to_owned())).or(by_name) {
        Some(found) if !found.starts_with("GRD") => Err(Error::ProductType {
            path: path.to_owned(),
            found,
        }),
        Some(_) => Err(Error::Missing {
            path: path.to_owned(),
            name: "annotation/s1*-*-grd-*.xml".to_owned(),
        }),
        None => Err(Error::unreadable(
            path,
            "it has no file annotation/s1*-*-grd-*.xml",
        )),
    }
}

fn read_files(
    archive: &Archive,
    stem: &str,
    polarization: Polarization,
) -> Result<(Annotation, Calibration, Option<Noise>)> {
    let read = |name: &str| Document::parse(name, &archive.text(name)?);
    let name = format!("annotation/{stem}.xml");
    let document = read(&name)?;
    let header = document.root().get("adsHeader")?;
    let kind = header.get("productType")?.text();
    if kind != "GRD" {
        return Err(Error::ProductType {
            path: archive.path().to_owned(),
            found: sentence(kind),
        });
    }
    let annotation = Annotation::read(&name, &document)?;
    if annotation.polarization != polarization {
        return Err(header.error(format!(
            "polarisation is {}, but the file name says {}",
            annotation.polarization.name(),
            polarization.name()
        )));
    }
    let (lines, pixels) = (annotation.lines, annotation.pixels);
    let document = read(&format!("annotation/calibration/calibration-{stem}.xml"))?;
    let calibration = Calibration::read(&document, lines, pixels)?;
    let noise = match annotation.noise_removed {
        true => None,
        false => {
            let document = read(&format!("annotation/calibration/noise-{stem}.xml"))?;
            Some(Noise::read(&document, lines, pixels)?)
        }
    };
    Ok((annotation, calibration, noise))
}
