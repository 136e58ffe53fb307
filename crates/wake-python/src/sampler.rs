//! The small diffusion model: images from sentences and scenes.

use crate::convert::{array_of, check_memory, json};
use crate::error::Fault;
use crate::scene::{PyScene, labels};
use crate::work::run;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use wake_ldm::WakeSampler;
use wake_ldm::sampler::{PromptMode, WakeImage};
use wake_nn::burn::tensor::Device;

/// Model that generates images.
#[pyclass(frozen, name = "Sampler", module = "shipwake._core")]
pub(crate) struct PySampler(WakeSampler);

#[pymethods]
impl PySampler {
    /// Loads the model of this package, or of a folder.
    #[staticmethod]
    fn load(
        py: Python<'_>,
        folder: Option<PathBuf>,
        steps: usize,
        mode: &str,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let mode = match mode {
            "both" => PromptMode::Both,
            "words" => PromptMode::Words,
            "numbers" => PromptMode::Numbers,
            other => {
                let text = format!("mode is '{other}', expected both, words or numbers");
                return Err(Fault::option(text).into());
            }
        };
        let sampler = run(py, threads, || {
            let device = Device::flex();
            let sampler = match &folder {
                None => WakeSampler::pretrained(&device)?,
                Some(folder) => WakeSampler::from_folder(folder, &device)?,
            };
            Ok(sampler.with_prompt_mode(mode).with_steps(steps)?)
        })?;
        Ok(Self(sampler))
    }

    /// Scene whose values are used where a prompt states none.
    fn base_scene(&self) -> PyScene {
        PyScene(self.0.base_scene())
    }

    /// Generates an image of each prompt; image k has the seed `seed + k`.
    fn prompts<'py>(
        &self,
        py: Python<'py>,
        prompts: Vec<String>,
        seed: u64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyList>> {
        self.check(prompts.len())?;
        let images = run(py, threads, || {
            let prompts: Vec<&str> = prompts.iter().map(String::as_str).collect();
            Ok(self.0.sample_many(&prompts, seed)?)
        })?;
        all(py, images)
    }

    /// Generates an image of each scene, with the scene's seed.
    fn scenes<'py>(
        &self,
        py: Python<'py>,
        scenes: Vec<PyRef<'py, PyScene>>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyList>> {
        self.check(scenes.len())?;
        let scenes: Vec<_> = scenes.iter().map(|scene| scene.0.clone()).collect();
        all(py, run(py, threads, || Ok(self.0.sample_scenes(&scenes)?))?)
    }
}

impl PySampler {
    /// Checks that a batch fits in memory; the network holds some hundred numbers per pixel.
    fn check(&self, count: usize) -> PyResult<()> {
        let grid = self.0.base_scene().grid;
        Ok(check_memory(
            "a batch",
            count,
            [grid.rows, grid.columns],
            400,
        )?)
    }
}

fn all(py: Python<'_>, images: Vec<WakeImage>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for image in images {
        list.append(one(py, image)?)?;
    }
    Ok(list)
}

fn one(py: Python<'_>, image: WakeImage) -> PyResult<Bound<'_, PyDict>> {
    let sample = PyDict::new(py);
    sample.set_item("labels", labels(py, &image.labels)?)?;
    sample.set_item("scene", PyScene(image.scene))?;
    sample.set_item("scale", json(py, &image.scale)?)?;
    sample.set_item("seconds", image.seconds.total)?;
    sample.set_item("grey", array_of(py, image.grey)?)?;
    sample.set_item("intensity", array_of(py, image.intensity)?)?;
    sample.set_item("speckled", array_of(py, image.speckled)?)?;
    Ok(sample)
}

/// Adds the class to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySampler>()
}
