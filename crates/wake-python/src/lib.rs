//! The module `shipwake._core`: what the Python package `shipwake` calls. It is private, and changes with the package.
//!
//! Arrays and dictionaries go out, with keys as in the files of the libraries. Long calls release the interpreter's lock, work in a pool
//! of their own, and turn panics into exceptions.

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

/// The private module of the package.
#[pymodule(name = "_core")]
fn core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
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
