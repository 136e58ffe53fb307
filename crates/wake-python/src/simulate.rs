//! Simulation of images from scenes.

use crate::convert::{array_of, check_memory, json};
use crate::error::{Fault, Outcome};
use crate::scene::{PyScene, labels, plan};
use crate::work::{caught, run};
use numpy::ndarray::ArrayView2;
use numpy::{PyArray1, PyArray4, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use wake_dataset::streams;
use wake_nn::noise::NoiseSource;
use wake_physics::grey::{GreyScale, Mapping};
use wake_physics::output::encode_png;
use wake_physics::{Method, Scene, Simulator};

/// Images per thread between two checks for an interrupt by the user.
const BETWEEN_LOOKS: usize = 8;

/// Simulates a scene; returns a dictionary of the fields, and one of labels, plan and other results.
#[pyfunction]
#[pyo3(signature = (scene, threads, direct))]
fn simulate<'py>(
    py: Python<'py>,
    scene: &PyScene,
    threads: Option<usize>,
    direct: bool,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let method = if direct { Method::Direct } else { Method::Fast };
    let made = run(py, threads, || {
        Ok(wake_physics::simulate_with(&scene.0, method)?)
    })?;
    let quick_look = made.quick_look();
    let about = PyDict::new(py);
    about.set_item("labels", labels(py, &made.labels)?)?;
    about.set_item("plan", plan(py, &made.plan)?)?;
    about.set_item("seconds", json(py, &made.seconds)?)?;
    about.set_item("accuracy", json(py, &made.accuracy)?)?;
    about.set_item("quick_look", json(py, &quick_look)?)?;
    let size = [made.raster.rows, made.raster.columns];
    let slc = made.slc.map(|slc| {
        let slc = slc.into_iter();
        crate::convert::array2(py, slc.collect::<Vec<_>>(), size)
    });
    about.set_item("slc", slc.transpose()?)?;
    let fields = PyDict::new(py);
    for (name, field) in [
        ("elevation", made.elevation),
        ("slope_x", made.slope_x),
        ("slope_y", made.slope_y),
        ("velocity_x", made.velocity_x),
        ("velocity_y", made.velocity_y),
        ("velocity_z", made.velocity_z),
        ("radial_velocity", made.radial_velocity),
        ("sigma0", made.sigma0),
        ("intensity", made.intensity),
        ("speckled", made.speckled),
    ] {
        fields.set_item(name, array_of(py, field)?)?;
    }
    Ok((fields, about))
}

/// Returns the mean over all seas of the intensity of a scene.
#[pyfunction]
#[pyo3(signature = (scene, threads))]
fn expected_intensity<'py>(
    py: Python<'py>,
    scene: &PyScene,
    threads: Option<usize>,
) -> PyResult<Bound<'py, numpy::PyArray2<f32>>> {
    let field = run(py, threads, || {
        Ok(wake_physics::expected_intensity(&scene.0)?)
    })?;
    array_of(py, field)
}

/// Simulates a base scene with other values: row i of `theta` holds the values of `keys` for image number `first + i`.
#[pyfunction]
#[pyo3(signature = (base, keys, theta, seed, first, speckle, threads))]
#[expect(clippy::too_many_arguments, reason = "all are named in Python")]
fn simulate_batch<'py>(
    py: Python<'py>,
    base: &PyScene,
    keys: Vec<String>,
    theta: PyReadonlyArray2<'py, f64>,
    seed: u64,
    first: u64,
    speckle: bool,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyArray4<f32>>> {
    let [count, columns] = [theta.shape()[0], theta.shape()[1]];
    if columns != keys.len() {
        let text = format!(
            "theta has {columns} columns, but there are {} keys; give one key per column",
            keys.len()
        );
        return Err(Fault::array(text).into());
    }
    let size = [base.0.grid.rows, base.0.grid.columns];
    check_memory("theta", count, size, 4)?;
    let scenes = caught(|| scenes(&base.0, &keys, theta.as_array(), seed, first))?;
    let mut values = vec![0f32; count * size[0] * size[1]];
    let idle = Idle::default();
    let at_once = BETWEEN_LOOKS * threads.unwrap_or_else(rayon_threads);
    let pixels = size[0] * size[1];
    for (out, scenes) in values
        .chunks_mut(at_once * pixels)
        .zip(scenes.chunks(at_once))
    {
        run(py, threads, || images(scenes, out, speckle, &idle))?;
        py.check_signals()?;
    }
    PyArray1::from_vec(py, values).reshape([count, 1, size[0], size[1]])
}

fn rayon_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Idle simulators, which keep their memory for the next image.
#[derive(Default)]
struct Idle(Mutex<Vec<Simulator>>);

impl Idle {
    fn with<T>(&self, work: impl FnOnce(&mut Simulator) -> T) -> T {
        let taken = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut simulator = taken.unwrap_or_default();
        let result = work(&mut simulator);
        let mut idle = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(simulator);
        result
    }
}

/// Simulates scenes of equal size into `out`, one after the other.
fn images(scenes: &[Scene], out: &mut [f32], speckle: bool, idle: &Idle) -> Outcome<()> {
    let pixels = out.len() / scenes.len().max(1);
    let places = out.par_chunks_mut(pixels.max(1)).zip(scenes);
    places.with_max_len(1).try_for_each(|(out, scene)| {
        let image = idle.with(|simulator| simulator.image(scene))?;
        let field = if speckle {
            image.speckled()
        } else {
            image.intensity
        };
        out.copy_from_slice(&field.values);
        Ok(())
    })
}

/// Returns the scenes of a batch: scene i has the values of row i, and the seed of scene `first + i` of a data set of `seed`.
fn scenes(
    base: &Scene,
    keys: &[String],
    theta: ArrayView2<'_, f64>,
    seed: u64,
    first: u64,
) -> Outcome<Vec<Scene>> {
    let random = NoiseSource::new(seed);
    let one = |(row, values): (u64, numpy::ndarray::ArrayView1<'_, f64>)| -> Outcome<Scene> {
        let assignment = |(key, value): (&String, &f64)| format!("{key}={}", literal(*value));
        let assignments = keys.iter().zip(&values).map(assignment);
        let mut scene = base.with_assignments(&assignments.collect::<Vec<_>>())?;
        let [was, is] = [base, &scene].map(|s| [s.grid.rows, s.grid.columns]);
        if was != is {
            let text = format!(
                "row {row} of theta changes the image from {} x {} to {} x {} pixels; all images of a batch must have the same size",
                was[0], was[1], is[0], is[1]
            );
            return Err(Fault::array(text));
        }
        if !keys.iter().any(|key| key == "seed") {
            let index = first.wrapping_add(row);
            scene.seed = (random.uniform(streams::SEEDS, index) * (1u64 << 52) as f64) as u64;
        }
        Ok(scene)
    };
    (0..).zip(theta.rows()).map(one).collect()
}

/// Formats a number as TOML; whole numbers are integers, which every key of a number accepts.
fn literal(value: f64) -> String {
    match value.fract() == 0.0 && value.abs() < (1u64 << 53) as f64 {
        true => format!("{value:.0}"),
        false => toml::Value::Float(value).to_string(),
    }
}

/// Converts σ⁰ or intensities to 8-bit grey levels.
#[pyfunction]
fn levels<'py>(
    py: Python<'py>,
    power: PyReadonlyArray2<'py, f32>,
    darkest_db: f64,
    brightest_db: f64,
    amplitude: bool,
) -> PyResult<Bound<'py, numpy::PyArray2<u8>>> {
    let scale = GreyScale {
        darkest_db,
        brightest_db,
        mapping: match amplitude {
            true => Mapping::Amplitude,
            false => Mapping::Decibel,
        },
    };
    let view = power.as_array();
    let levels = caught(|| {
        scale.validate()?;
        Ok(view.iter().map(|&p| scale.level(f64::from(p))).collect())
    })?;
    crate::convert::array2(py, levels, [view.nrows(), view.ncols()])
}

/// Encodes an 8-bit image as the bytes of a PNG file.
#[pyfunction]
fn png<'py>(py: Python<'py>, levels: PyReadonlyArray2<'py, u8>) -> PyResult<Bound<'py, PyBytes>> {
    let view = levels.as_array();
    if view.is_empty() {
        let text = "the image has no pixels, expected at least one".to_owned();
        return Err(Fault::array(text).into());
    }
    let pixels: Vec<u8> = view.iter().copied().collect();
    let bytes = caught(|| {
        Ok(encode_png(
            Path::new("image.png"),
            &pixels,
            view.nrows(),
            view.ncols(),
        )?)
    })?;
    Ok(PyBytes::new(py, &bytes))
}

/// Adds the functions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyScene>()?;
    module.add_function(wrap_pyfunction!(simulate, module)?)?;
    module.add_function(wrap_pyfunction!(expected_intensity, module)?)?;
    module.add_function(wrap_pyfunction!(simulate_batch, module)?)?;
    module.add_function(wrap_pyfunction!(levels, module)?)?;
    module.add_function(wrap_pyfunction!(png, module)?)
}
