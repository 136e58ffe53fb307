//! Satellite products and other georeferenced rasters.

use crate::convert::{array2, json};
use crate::error::Fault;
use crate::work::{caught, run};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use wake_geo::{Polarization, Product, Values};

/// An open product.
#[pyclass(frozen, name = "Product", module = "shipwake._core")]
pub(crate) struct PyProduct(pub(crate) Arc<Product>);

#[pymethods]
impl PyProduct {
    /// Opens a Sentinel-1 GRD product, a GeoTIFF, a PNG or a JPEG file.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf, polarization: Option<&str>) -> PyResult<Self> {
        let polarization = polarization.map(|name| {
            Polarization::from_name(name).ok_or_else(|| {
                Fault::option(format!(
                    "polarization is '{name}', expected VV, HH, VH or HV"
                ))
            })
        });
        let polarization = polarization.transpose()?;
        let product = run(py, Some(1), || {
            Ok(match polarization {
                None => Product::open(&path)?,
                Some(polarization) => Product::open_polarization(&path, polarization)?,
            })
        })?;
        Ok(Self(Arc::new(product)))
    }

    /// Number of lines, and of pixels per line.
    fn shape(&self) -> (usize, usize) {
        self.0.size()
    }

    /// Whether the values are σ⁰.
    fn is_calibrated(&self) -> bool {
        self.0.values() == Values::SigmaNought
    }

    /// Whether pixels can be read.
    fn has_pixels(&self) -> bool {
        self.0.has_pixels()
    }

    /// Whether the product is georeferenced.
    fn has_places(&self) -> bool {
        self.0.has_places()
    }

    /// Reads the values of a window.
    fn read<'py>(
        &self,
        py: Python<'py>,
        lines: (usize, usize),
        pixels: (usize, usize),
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let window = run(py, Some(1), || {
            Ok(self.0.read_window(lines.0..lines.1, pixels.0..pixels.1)?)
        })?;
        array2(py, window.values, [window.lines, window.pixels])
    }

    /// Returns the place of a pixel.
    fn place<'py>(&self, py: Python<'py>, line: f64, pixel: f64) -> PyResult<Bound<'py, PyAny>> {
        json(py, &caught(|| Ok(self.0.place(line, pixel)?))?)
    }

    /// Returns line and pixel of a place.
    fn pixel_of(&self, latitude: f64, longitude: f64) -> PyResult<Option<(f64, f64)>> {
        Ok(caught(|| Ok(self.0.pixel_of(latitude, longitude)))?)
    }

    /// Returns directions and spacings of lines and pixels around a pixel.
    fn axes<'py>(&self, py: Python<'py>, line: f64, pixel: f64) -> PyResult<Bound<'py, PyAny>> {
        json(py, &caught(|| Ok(self.0.axes(line, pixel)?))?)
    }

    /// Ratio of slant range and platform speed at a pixel \[s\].
    fn range_to_velocity(&self, line: f64, pixel: f64) -> PyResult<Option<f64>> {
        Ok(caught(|| Ok(self.0.range_to_velocity(line, pixel)?))?)
    }

    /// Returns place, calibration and σ⁰ of a pixel.
    fn locate<'py>(
        &self,
        py: Python<'py>,
        line: usize,
        pixel: usize,
        digital_number: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let located = run(py, Some(1), || {
            Ok(wake_geo::locate(&self.0, line, pixel, digital_number)?)
        })?;
        json(py, &located)
    }
}

/// Adds the class to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyProduct>()
}
