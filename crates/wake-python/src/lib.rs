//! The compiled module `shipwake._core` of the Python package `shipwake`. It is private, and changes with the package.
//!
//! Functions return arrays and dictionaries, with keys as in the files of the libraries. Long calls release the interpreter's
//! lock, run on a thread pool of the module, and turn panics into exceptions.

mod convert;
mod dataset;
#[cfg(feature = "models")]
mod detector;
mod error;
mod estimate;
mod product;
#[cfg(feature = "models")]
mod sampler;
mod scene;
mod simulate;
mod work;

use pyo3::prelude::*;

/// Private compiled module of the package.
#[pymodule(name = "_core")]
fn core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    // The shortest decimal number that is this f32: 0.03, not 0.029999999.
    let least_score: f64 = wake_detector::LEAST_SCORE.to_string().parse()?;
    module.add("LEAST_SCORE", least_score)?;
    simulate::register(module)?;
    estimate::register(module)?;
    dataset::register(module)?;
    product::register(module)?;
    #[cfg(feature = "models")]
    {
        sampler::register(module)?;
        detector::register(module)?;
    }
    Ok(())
}
