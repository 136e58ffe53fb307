//! A run of any stage: steps, checkpoints, log.

use std::error::Error;
use std::path::Path;

use burn::module::Module;
use serde_json::{Map, Value, json};
use wake_ldm::train::{Metrics, Run, RunFolder, Task};

use super::{exit, progress};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// One run with its checkpoints and its log.
pub(crate) struct Stage<'a> {
    pub(crate) name: &'static str,
    /// Folder of the results.
    pub(crate) out: &'a Path,
    /// Whether it goes on from the newest checkpoint.
    pub(crate) resume: bool,
    /// Steps between checkpoints.
    pub(crate) every: u32,
    /// Steps in all.
    pub(crate) steps: usize,
    /// Files that are written after every checkpoint.
    pub(crate) results: &'a [&'a str],
}

impl Stage<'_> {
    /// Makes all steps; `show` writes the results.
    pub(crate) fn train<M: Module>(
        self,
        folder: &mut RunFolder,
        mut run: Run<M>,
        task: &impl Task<M>,
        show: impl Fn(&Run<M>) -> Outcome<()>,
    ) -> Outcome<()> {
        let Self {
            name,
            out,
            resume,
            every,
            steps,
            results,
        } = self;
        if let Some(checkpoint) = folder.begin(name, resume)? {
            run.resume(checkpoint)?;
            // A kill after the checkpoint leaves results of the one before.
            if !folder.is_current(name, run.steps(), results) {
                show(&run)?;
            }
            folder.note(name, run.steps(), steps)?;
        }
        let log = out.join(format!("{name}.jsonl"));
        let mut metrics = Metrics::open(&log, run.steps())?;
        let bar = progress::bar(steps as u64, name);
        while run.steps() < steps {
            let (report, terms) = run.step(task)?;
            let terms: Map<String, Value> = terms
                .into_iter()
                .map(|(term, value)| (term.to_owned(), json!(value)))
                .collect();
            metrics.write(run.steps(), steps, report, &Value::Object(terms))?;
            bar.set_message(format!("{name}, loss {:.4}", report.loss));
            bar.set_position(run.steps() as u64);
            if run.steps().is_multiple_of(every as usize) || run.steps() == steps {
                run.checkpoint(&folder.checkpoints(name))?;
                show(&run)?;
                folder.note(name, run.steps(), steps)?;
            }
        }
        bar.finish_and_clear();
        let (made, out) = (run.steps(), out.display());
        Ok(exit::say(&format!(
            "{name}: {made} steps, results in {out}"
        ))?)
    }
}
