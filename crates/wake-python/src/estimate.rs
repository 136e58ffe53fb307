//! Estimates of ship and wind from images.

use crate::convert::{array_of, array2, json};
use crate::error::Fault;
use crate::scene::PyScene;
use crate::work::run;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use wake_physics::Field;
use wake_physics::estimate::{Parameter, Priors, Sighting};

/// Estimates ship and wind from an image around a sighting, as a dictionary.
#[pyfunction]
#[pyo3(signature = (image, known, place, heading, deviations, calibrated, threads))]
#[expect(clippy::too_many_arguments, reason = "all are named in Python")]
fn estimate<'py>(
    py: Python<'py>,
    image: PyReadonlyArray2<'py, f32>,
    known: &PyScene,
    place: Option<[f64; 2]>,
    heading: Option<f64>,
    deviations: [f64; 2],
    calibrated: bool,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let [rows, columns] = [image.shape()[0], image.shape()[1]];
    let image = Field {
        rows,
        columns,
        values: image.as_array().iter().copied().collect(),
    };
    let of_ship = Sighting::of_ship(&known.0);
    let (Some(place), Some(heading)) = (
        place.or(of_ship.map(|s| s.place)),
        heading.or(of_ship.map(|s| s.heading)),
    ) else {
        return Err(Fault::option(
            "known has no ship; add a ship with the assumed hull".to_owned(),
        )
        .into());
    };
    let sighting = Sighting {
        place,
        heading,
        place_sd: deviations[0],
        heading_sd: deviations[1],
    };
    let priors = priors(calibrated);
    let found = run(py, threads, || {
        Ok(wake_physics::estimate::estimate(
            &image, &known.0, &sighting, &priors,
        )?)
    })?;
    let [values, sds] = [PyDict::new(py), PyDict::new(py)];
    for one in &found.values {
        values.set_item(one.parameter.name(), one.value)?;
        sds.set_item(one.parameter.name(), one.deviation)?;
    }
    let about = PyDict::new(py);
    about.set_item("misfit", found.misfit())?;
    about.set_item(
        "by_echo",
        found
            .by_echo
            .map(|[velocity, deviation]| (velocity, deviation)),
    )?;
    let others = PyList::empty(py);
    for other in found.alternatives {
        others.append((PyScene(other.scene), other.weight))?;
    }
    about.set_item("scene", Py::new(py, PyScene(found.scene))?)?;
    about.set_item("values", values)?;
    about.set_item("deviations", sds)?;
    let count = Parameter::OF_WAKE.len();
    let covariance = (found.covariance.len() == count * count)
        .then(|| array2(py, found.covariance, [count, count]));
    about.set_item("covariance", covariance.transpose()?)?;
    about.set_item("identifiable", found.identifiable)?;
    about.set_item("weight", found.weight)?;
    about.set_item("alternatives", others)?;
    about.set_item("log_likelihood", found.log_likelihood)?;
    about.set_item("over_open_sea", found.over_open_sea)?;
    about.set_item("power", json(py, &found.power)?)?;
    about.set_item("mean", array_of(py, found.mean)?)?;
    Ok(about)
}

/// Returns the smallest standard deviations of unbiased estimates, by name.
#[pyfunction]
#[pyo3(signature = (scene, calibrated, threads))]
fn bound<'py>(
    py: Python<'py>,
    scene: &PyScene,
    calibrated: bool,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let parameters: Vec<Parameter> = Parameter::OF_WAKE
        .into_iter()
        .filter(|p| !scene.0.ships.is_empty() || !p.is_of_ship())
        .collect();
    let priors = priors(calibrated);
    let found = run(py, threads, || {
        Ok(wake_physics::estimate::bound(
            &scene.0,
            &parameters,
            &priors,
        )?)
    })?;
    let out = PyDict::new(py);
    for (parameter, deviation) in found.deviations {
        out.set_item(parameter.name(), deviation)?;
    }
    Ok(out)
}

fn priors(calibrated: bool) -> Priors {
    let mut priors = Priors::default();
    if !calibrated {
        priors.gain = f64::INFINITY;
    }
    priors
}

/// Adds the functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(estimate, module)?)?;
    module.add_function(wrap_pyfunction!(bound, module)?)
}
