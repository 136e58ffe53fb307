//! Scenes.

use crate::convert::{json, python_of_toml, toml_of};
use crate::error::exceptions::{OptionError, SceneError};
use crate::error::{Fault, Outcome};
use crate::work::caught;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;
use wake_physics::{Plan, labels_of};
use wake_text::{Reading, Wording};

/// A valid scene.
#[pyclass(frozen, name = "Scene", module = "shipwake._core")]
pub(crate) struct PyScene(pub(crate) wake_physics::Scene);

#[pymethods]
impl PyScene {
    /// Reads the text of a scene file.
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        Ok(caught(|| Ok(wake_physics::Scene::from_toml(text)?)).map(Self)?)
    }

    /// Reads a scene file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        Ok(caught(|| Ok(wake_physics::Scene::read(&path)?)).map(Self)?)
    }

    /// Returns the scene of tables with the keys of a scene file.
    #[staticmethod]
    fn from_tables(tables: &Bound<'_, PyDict>) -> PyResult<Self> {
        let tables = toml_of("scene", tables)?.unwrap_or_else(|| toml::Table::new().into());
        Self::from_toml(&text_of(&tables)?)
    }

    /// Returns the scene that a prompt states, completed by `base`, and the words that were not understood.
    #[staticmethod]
    fn from_prompt(prompt: &str, base: &Self) -> PyResult<(Self, Vec<String>)> {
        let read = || -> Outcome<_> {
            let reading = Reading::of(prompt)?;
            if reading.states_nothing() {
                let prompt = prompt.to_owned();
                return Err(nothing_stated(&prompt));
            }
            let scene = reading.scene.onto(&base.0)?;
            let unread = reading.unread.iter().map(ToString::to_string).collect();
            Ok((Self(scene), unread))
        };
        Ok(caught(read)?)
    }

    /// Returns the scene as the text of a scene file.
    fn to_toml(&self) -> PyResult<String> {
        Ok(caught(|| Ok(self.0.to_toml()?))?)
    }

    /// Returns the scene as the tables of a scene file.
    fn to_tables<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python_of_toml(py, &self.tables()?)
    }

    /// Returns the scene with other values, by keys such as `ship.speed`.
    fn with_values(&self, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut assignments = Vec::new();
        for (key, value) in values.iter() {
            let key = key.cast::<PyString>().map_err(|_| {
                OptionError::new_err(
                    "a key of values is not a string, expected a key such as 'ship.speed'",
                )
            })?;
            let key = key.to_str()?;
            let value = toml_of(key, &value)?;
            let value =
                value.ok_or_else(|| SceneError::new_err(format!("{key} is None; give a value")))?;
            assignments.push(format!("{key}={value}"));
        }
        Ok(caught(|| Ok(self.0.with_assignments(&assignments)?)).map(Self)?)
    }

    /// Returns the scene in words; wordings count from 0.
    fn prompt(&self, wording: usize) -> PyResult<String> {
        let wording = Wording::ALL.get(wording).copied().unwrap_or_default();
        Ok(caught(|| Ok(wording.prompt(&self.0)?))?)
    }

    /// Returns the labels of the image without simulating it.
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        labels(py, &caught(|| Ok(labels_of(&self.0)))?)
    }

    /// Returns the plan of the simulation without running it.
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plan(py, &caught(|| Ok(Plan::new(&self.0)?))?)
    }

    /// Rows, columns, and pixel spacing \[m\].
    fn grid(&self) -> (usize, usize, f64) {
        let grid = &self.0.grid;
        (grid.rows, grid.columns, grid.spacing)
    }

    /// Whether all values of two scenes are equal.
    fn equals(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl PyScene {
    fn tables(&self) -> Outcome<toml::Value> {
        let text = caught(|| Ok(self.0.to_toml()?))?;
        toml::from_str::<toml::Table>(&text)
            .map(Into::into)
            .map_err(|error| Fault(SceneError::new_err(error.to_string())))
    }
}

fn text_of(tables: &toml::Value) -> PyResult<String> {
    toml::to_string(tables).map_err(|error| SceneError::new_err(error.to_string()))
}

/// Error of a prompt that states nothing of a scene.
fn nothing_stated(prompt: &str) -> Fault {
    Fault(crate::error::exceptions::PromptError::new_err(format!(
        "the prompt '{}' states nothing about a scene; say, for example, whether there is a ship, its speed and heading, the \
         wind, or the incidence",
        whole_files::quoted(prompt)
    )))
}

/// Converts labels to a dictionary, with the objects that a detector should find.
pub(crate) fn labels<'py>(
    py: Python<'py>,
    labels: &wake_physics::Labels,
) -> PyResult<Bound<'py, PyAny>> {
    let all = json(py, labels)?;
    let objects = labels.objects().into_iter().map(|object| {
        serde_json::json!({
            "name": object.class.name(),
            "box": object.box_px,
            "corners": object.oriented_box_px,
            "tip": object.tip,
            "axis_deg": object.axis_deg,
            "half_angle_deg": object.half_angle_deg,
            "length": object.length_px,
            "contrast_db": object.visibility.map(|v| v.contrast_db),
            "snr": object.visibility.map(|v| v.snr),
        })
    });
    let objects: Vec<serde_json::Value> = objects.collect();
    all.set_item("objects", json(py, &objects)?)?;
    Ok(all)
}

/// Converts a plan to a dictionary of its terms, sizes, notes, cost and text.
pub(crate) fn plan<'py>(py: Python<'py>, plan: &Plan) -> PyResult<Bound<'py, PyAny>> {
    let cost = plan.cost();
    let value = serde_json::json!({
        "terms": plan.terms,
        "sizes": plan.sizes,
        "notes": plan.notes,
        "left_out": plan.left_out(),
        "core_seconds": cost.core_seconds,
        "bytes": cost.bytes,
        "text": plan.to_string(),
    });
    json(py, &value)
}
