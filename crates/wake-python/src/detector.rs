//! The detector: finds wakes in images and products.

use crate::convert::json;
use crate::error::{Fault, Outcome};
use crate::product::PyProduct;
use crate::work::run;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::convert::Infallible;
use std::path::PathBuf;
use wake_detector::{Detection, Detector, Raster, Tile};
use wake_geo::{Land, Product};
use wake_map::{Search, mapped, search};
use wake_nn::burn::tensor::Device;

/// Largest number of pixels along a side of an image.
const LONGEST_SIDE: usize = 20_000;

/// Trained detector.
#[pyclass(frozen, name = "Detector", module = "shipwake._core")]
pub(crate) struct PyDetector(Detector);

#[pymethods]
impl PyDetector {
    /// Loads the detector of this package, or of a file.
    #[staticmethod]
    fn load(py: Python<'_>, file: Option<PathBuf>, threads: Option<usize>) -> PyResult<Self> {
        let detector = run(py, threads, || {
            let device = Device::flex();
            Ok(match &file {
                None => Detector::pretrained(&device)?,
                Some(file) => Detector::load(file, &device)?,
            })
        })?;
        Ok(Self(detector))
    }

    /// Returns the wakes of an image of amplitudes or grey in descending order of score.
    fn find<'py>(
        &self,
        py: Python<'py>,
        image: PyReadonlyArray2<'py, f32>,
        spacing: Option<f32>,
        least_score: f32,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let [rows, columns] = [image.shape()[0], image.shape()[1]];
        if ![rows, columns]
            .iter()
            .all(|n| (1..=LONGEST_SIDE).contains(n))
        {
            let text = format!(
                "the image has {rows} x {columns} pixels, outside 1 to {LONGEST_SIDE} per side; cut it into pieces"
            );
            return Err(Fault::array(text).into());
        }
        let view = image.as_array();
        let amplitudes = Amplitudes {
            columns,
            values: view.iter().copied().collect(),
            rows,
        };
        let found = run(py, threads, || {
            let detector = self.with(spacing, least_score)?;
            let mut found = Vec::new();
            for tile in Tile::all(rows, columns) {
                let Ok(wakes) = detector.find_in(&amplitudes, &tile);
                found.extend(wakes);
            }
            let merged = detector.merged(found).into_iter();
            Ok(merged.map(Detection::measured).collect::<Vec<_>>())
        })?;
        json(py, &found.iter().map(detection).collect::<Vec<_>>())
    }

    /// Returns the wakes of a product with their places in descending order of score. Land and `buffer` metres of sea along it
    /// are left out; `None` searches land, too. By default, the spacing is the product's.
    fn find_in<'py>(
        &self,
        py: Python<'py>,
        product: &PyProduct,
        spacing: Option<f32>,
        least_score: f32,
        buffer: Option<f64>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let product = &product.0;
        let wakes = run(py, threads, || {
            let detector = self.with(spacing_of(product, spacing)?, least_score)?;
            let buffer = buffer.filter(|_| product.has_places());
            let land = buffer.map(|buffer| Land::natural_earth().mask(product, buffer));
            let land = land.transpose()?.filter(|land| !land.is_empty());
            let options = Search {
                land: land.as_ref(),
                ..Search::default()
            };
            let found = search(product, &detector, options, &|_, _| {})?;
            Ok(mapped(product, &found)?)
        })?;
        json(py, &wakes)
    }
}

impl PyDetector {
    /// Returns the detector for a pixel spacing \[m\] and a least score.
    fn with(&self, spacing: Option<f32>, least_score: f32) -> Outcome<Detector> {
        let detector = self.0.clone().with_least_score(least_score)?;
        Ok(match spacing {
            None => detector,
            Some(spacing) => detector.with_spacing(spacing)?,
        })
    }
}

/// Returns the given spacing or, without one, the pixel spacing in the middle of the product \[m\].
fn spacing_of(product: &Product, given: Option<f32>) -> Outcome<Option<f32>> {
    if given.is_some() || !product.has_places() {
        return Ok(given);
    }
    let (lines, pixels) = product.size();
    let axes = product.axes(0.5 * lines as f64, 0.5 * pixels as f64)?;
    Ok(Some(
        (0.5 * (axes.line_spacing + axes.pixel_spacing)) as f32,
    ))
}

/// An image in memory.
struct Amplitudes {
    rows: usize,
    columns: usize,
    values: Vec<f32>,
}

impl Raster for Amplitudes {
    type Error = Infallible;

    fn rows(&self) -> usize {
        self.rows
    }

    fn columns(&self) -> usize {
        self.columns
    }

    fn window(
        &self,
        top: usize,
        left: usize,
        rows: usize,
        columns: usize,
    ) -> Result<Vec<f32>, Infallible> {
        let line = |row: usize| &self.values[row * self.columns + left..][..columns];
        Ok((top..top + rows).flat_map(line).copied().collect())
    }
}

fn detection(found: &Detection) -> Value {
    let wake = &found.wake;
    json!({
        "score": found.score,
        "probability": found.probability,
        "direction_probability": found.direction_probability,
        "sure": found.sure,
        "tip": wake.tip,
        "axis_deg": wake.axis_deg,
        "half_angle_deg": wake.half_angle_deg,
        "length": wake.length,
        "length_sd": found.extent.map(|extent| extent.deviation),
        "corners": wake.oriented_box(),
    })
}

/// Adds the class to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyDetector>()
}
