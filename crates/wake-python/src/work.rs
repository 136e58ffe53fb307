//! Long calls: run without the interpreter's lock on a thread pool of this process, with panics as exceptions.

use crate::error::{Fault, Outcome};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

/// Largest number of threads in a pool.
const MOST_THREADS: usize = 1024;

/// Thread pools of one process.
struct Pools {
    process: u32,
    pools: Vec<Arc<ThreadPool>>,
}

static POOLS: Mutex<Pools> = Mutex::new(Pools {
    process: 0,
    pools: Vec::new(),
});

/// Returns a pool of `threads` threads, by default one per core; each process makes it once.
///
/// The caller holds the interpreter's lock, as does a fork, so no child inherits a locked mutex. The threads of inherited pools
/// do not exist in the child; such pools are forgotten, since dropping them would signal their threads.
fn pool(_: Python<'_>, threads: Option<usize>) -> Outcome<Arc<ThreadPool>> {
    let threads = match threads {
        None => std::thread::available_parallelism().map_or(1, usize::from),
        Some(threads) => threads,
    };
    if !(1..=MOST_THREADS).contains(&threads) {
        return Err(Fault::option(format!(
            "threads is {threads}, outside [1, {MOST_THREADS}]"
        )));
    }
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if pools.process != process {
        std::mem::forget(std::mem::take(&mut pools.pools));
        pools.process = process;
    }
    let fits = |pool: &&Arc<ThreadPool>| pool.current_num_threads() == threads;
    if let Some(pool) = pools.pools.iter().find(fits) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.thread_name(|n| format!("shipwake-{n}")).build();
    let pool = Arc::new(pool.map_err(|error| {
        Fault::option(format!(
            "cannot start {threads} threads: {error}; use fewer threads"
        ))
    })?);
    pools.pools.push(Arc::clone(&pool));
    Ok(pool)
}

/// Runs work on a pool of `threads` threads, while other Python threads continue.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> Outcome<T> + Send,
) -> PyResult<T> {
    let pool = pool(py, threads)?;
    Ok(py.detach(|| caught(|| pool.install(work)))?)
}

/// Runs short work and turns its panics into exceptions.
pub(crate) fn caught<T>(work: impl FnOnce() -> Outcome<T>) -> Outcome<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(Fault::of_panic(&*panic)))
}
