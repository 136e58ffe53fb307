//! A stage on the screen: its bar, and what is said at its end.

use std::error::Error;

use burn::module::Module;
use wake_ldm::train::{Run, RunFolder, Stage, Task};

use super::{exit, progress};

/// Makes all steps of a stage; `show` writes the results.
pub(crate) fn train<M: Module>(
    stage: Stage<'_>,
    folder: &mut RunFolder,
    run: Run<M>,
    task: &impl Task<M>,
    show: impl Fn(&Run<M>) -> Result<(), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let (name, steps, out) = (stage.name, stage.steps, stage.out.display());
    let bar = progress::bar(steps as u64, name);
    let done = |step: usize, loss: f64| {
        bar.set_message(format!("{name}, loss {loss:.4}"));
        bar.set_position(step as u64);
    };
    stage.train(folder, run, task, done, show)?;
    bar.finish_and_clear();
    Ok(exit::say(&format!(
        "{name}: {steps} steps, results in {out}"
    ))?)
}
