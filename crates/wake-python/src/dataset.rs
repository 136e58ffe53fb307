//! Data sets: pairs by index, in batches, and as folders.

use crate::convert::{array_of, check_memory, toml_of};
use crate::error::exceptions::RecipeError;
use crate::error::{Fault, Outcome};
use crate::scene::{PyScene, labels};
use crate::work::{caught, run};
use numpy::{PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use std::path::PathBuf;
use wake_dataset::{Manifest, Pair, Recipe, Shard, Simulated, Source};
use wake_physics::Field;

/// Endless data set of a recipe and a seed.
#[pyclass(frozen, name = "Simulated", module = "shipwake._core")]
pub(crate) struct PySimulated(Simulated);

#[pymethods]
impl PySimulated {
    /// Returns the data set of a named recipe, with the given changes.
    #[staticmethod]
    fn named(name: &str, changes: &Bound<'_, PyDict>, seed: u64) -> PyResult<Self> {
        let changes = assignments(changes)?;
        Ok(caught(|| Self::of(&Recipe::named(name)?, &changes, seed))?)
    }

    /// Returns the data set of a recipe file, given as text, with the given changes.
    #[staticmethod]
    fn from_toml(text: &str, changes: &Bound<'_, PyDict>, seed: u64) -> PyResult<Self> {
        let changes = assignments(changes)?;
        Ok(caught(|| {
            Self::of(&Recipe::from_toml(text)?, &changes, seed)
        })?)
    }

    /// Returns the data set of the tables of a recipe, with the given changes.
    #[staticmethod]
    fn from_tables(
        tables: &Bound<'_, PyDict>,
        changes: &Bound<'_, PyDict>,
        seed: u64,
    ) -> PyResult<Self> {
        let text = toml::to_string(&toml_of("recipe", tables)?);
        let text = text.map_err(|error| RecipeError::new_err(error.to_string()))?;
        Self::from_toml(&text, changes, seed)
    }

    /// Returns the whole recipe as the text of a recipe file.
    fn to_toml(&self) -> PyResult<String> {
        let text = toml::to_string(self.0.recipe());
        text.map_err(|error| RecipeError::new_err(error.to_string()))
    }

    /// Seed of the data set.
    fn seed(&self) -> u64 {
        self.0.seed()
    }

    /// Rows and columns of every image.
    fn size(&self) -> (usize, usize) {
        let [rows, columns] = self.0.size();
        (rows, columns)
    }

    /// Scene of pair number `index`.
    fn scene(&self, index: u64) -> PyResult<PyScene> {
        Ok(caught(|| Ok(self.0.scene(index)?)).map(PyScene)?)
    }

    /// Returns pair number `index`.
    fn pair<'py>(
        &self,
        py: Python<'py>,
        index: u64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        item(py, run(py, threads, || Ok(self.0.pair(index)?))?)
    }

    /// Returns pair number `index` with everything but its image.
    fn without_image<'py>(&self, py: Python<'py>, index: u64) -> PyResult<Bound<'py, PyDict>> {
        item(py, caught(|| Ok(self.0.pair_without_image(index)?))?)
    }

    /// Returns the files of pair number `index` by extension: `json`, `png` and `txt`.
    fn files<'py>(
        &self,
        py: Python<'py>,
        index: u64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let files = run(py, threads, || {
            Ok(wake_dataset::sample_files(&self.0.pair(index)?)?)
        })?;
        let named = PyDict::new(py);
        for (ending, content) in files {
            named.set_item(ending, PyBytes::new(py, &content))?;
        }
        Ok(named)
    }

    /// Returns the pairs from `first` up to `end`: images `[pairs, 1, rows, columns]`, and a list of all else by pair.
    fn pairs<'py>(
        &self,
        py: Python<'py>,
        first: u64,
        end: u64,
        threads: Option<usize>,
    ) -> PyResult<(Bound<'py, PyArray4<f32>>, Bound<'py, PyList>)> {
        let count = usize::try_from(end.saturating_sub(first)).unwrap_or(usize::MAX);
        check_memory("pairs", count, self.0.size(), 8)?;
        batch(
            py,
            run(py, threads, || Ok(self.0.items(first..end)?))?,
            self.0.size(),
        )
    }

    /// Writes the first `count` pairs, or a shard's share of these pairs, into a folder; calls `watch(done, total)` to report progress.
    #[expect(clippy::too_many_arguments, reason = "all are named in Python")]
    fn write(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        count: u64,
        val_share: f64,
        shard: Option<(u64, u64)>,
        threads: Option<usize>,
        watch: Option<Py<PyAny>>,
    ) -> PyResult<u64> {
        let manifest = || -> Outcome<Manifest> {
            let recipe = self.0.recipe().clone();
            let manifest =
                Manifest::new(recipe, self.0.seed(), count)?.with_val_share(val_share)?;
            Ok(Manifest {
                shard: shard.map(|(number, of)| Shard { number, of }),
                ..manifest
            })
        };
        let manifest = caught(manifest)?;
        let jobs =
            threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
        run(py, threads, || {
            let (mut made, mut failed) = (0, None);
            wake_dataset::write(&folder, &manifest, &self.0, jobs, |progress| {
                made = progress.made;
                if failed.is_none() {
                    failed = told(watch.as_ref(), progress.done, progress.total).err();
                }
            })?;
            match failed {
                Some(error) => Err(Fault(error)),
                None => Ok(made),
            }
        })
    }
}

impl PySimulated {
    fn of(recipe: &Recipe, changes: &[String], seed: u64) -> Outcome<Self> {
        let recipe = recipe.with_assignments(changes)?;
        Ok(Self(Simulated::new(recipe, seed)?))
    }
}

/// Converts values by key to assignments of a recipe.
fn assignments(values: &Bound<'_, PyDict>) -> PyResult<Vec<String>> {
    let one = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key.extract()?;
        let value = toml_of(&key, &value)?
            .ok_or_else(|| RecipeError::new_err(format!("{key} is None; give a value")))?;
        Ok(format!("{key} = {value}"))
    };
    values.iter().map(one).collect()
}

/// Calls the progress function, if there is one.
fn told(watch: Option<&Py<PyAny>>, done: u64, total: u64) -> PyResult<()> {
    let Some(watch) = watch else { return Ok(()) };
    Python::attach(|py| watch.call1(py, (done, total)).map(drop))
}

/// Returns the images of pairs as one array, and all else as a list.
fn batch<'py>(
    py: Python<'py>,
    pairs: Vec<Pair>,
    [rows, columns]: [usize; 2],
) -> PyResult<(Bound<'py, PyArray4<f32>>, Bound<'py, PyList>)> {
    let mut values = Vec::with_capacity(pairs.len() * rows * columns);
    let (items, count) = (PyList::empty(py), pairs.len());
    for mut pair in pairs {
        values.append(&mut pair.image.pixels);
        items.append(about(py, &pair)?)?;
    }
    let images = PyArray1::from_vec(py, values).reshape([count, 1, rows, columns])?;
    Ok((images, items))
}

/// Converts a pair to a dictionary.
fn item<'py>(py: Python<'py>, mut pair: Pair) -> PyResult<Bound<'py, PyDict>> {
    let image = Field {
        rows: pair.image.rows,
        columns: pair.image.columns,
        values: std::mem::take(&mut pair.image.pixels),
    };
    let item = about(py, &pair)?;
    item.set_item("image", array_of(py, image)?)?;
    Ok(item)
}

/// Returns all of a pair but its image. Boxes count from the corner of the first pixel, in steps of 0.01 pixels, as in written
/// data sets.
fn about<'py>(py: Python<'py>, pair: &Pair) -> PyResult<Bound<'py, PyDict>> {
    let item = PyDict::new(py);
    item.set_item("index", pair.index)?;
    item.set_item("prompt", &pair.prompt)?;
    item.set_item("scene", PyScene(pair.scene.clone()))?;
    let hundredths = |value: f64| ((100.0 * (value + 0.5)).round() / 100.0) as f32;
    let (mut boxes, mut corners, mut classes) = (Vec::new(), Vec::new(), Vec::new());
    for object in pair.labels.objects() {
        let [x, y, width, height] = object.box_px;
        let [width, height] = [width, height].map(|v| ((100.0 * v).round() / 100.0) as f32);
        // As in written data sets, boxes without width or height are dropped.
        if width > 0.0 && height > 0.0 {
            let [x, y] = [x, y].map(hundredths);
            boxes.extend([x, y, x + width, y + height]);
            corners.extend(
                object
                    .oriented_box_px
                    .as_flattened()
                    .iter()
                    .map(|&v| hundredths(v)),
            );
            classes.push(i64::from(object.class.number()));
        }
    }
    let count = classes.len();
    let boxes: Bound<'py, PyArray2<f32>> = PyArray1::from_vec(py, boxes).reshape([count, 4])?;
    let corners: Bound<'py, PyArray3<f32>> =
        PyArray1::from_vec(py, corners).reshape([count, 4, 2])?;
    item.set_item("boxes", boxes)?;
    item.set_item("corners", corners)?;
    item.set_item("classes", PyArray1::from_vec(py, classes))?;
    item.set_item("labels", labels(py, &pair.labels)?)?;
    item.set_item(
        "amplitudes",
        pair.amplitudes.map(|[dark, bright]| (dark, bright)),
    )?;
    Ok(item)
}

/// Joins the shards of a folder; returns the number of pairs.
#[pyfunction]
fn merge_shards(py: Python<'_>, folder: PathBuf) -> PyResult<u64> {
    run(py, Some(1), || {
        let manifest = wake_dataset::merge(&folder)?;
        Ok(manifest.count)
    })
}

/// Adds the classes to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySimulated>()?;
    module.add_function(wrap_pyfunction!(merge_shards, module)?)
}
