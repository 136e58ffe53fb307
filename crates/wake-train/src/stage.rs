//! A stage of training: a run in its folder, with checkpoints, results and a log.

use burn::module::Module;
use serde_json::{Map, Value, json};

use super::folder::RunFolder;
use super::log::TrainLog;
use super::progress::Progress;
use super::run::{Run, Task, Terms};
use super::trainer::StepReport;
use crate::error::Error;

/// How a [`Run`] is carried out and stored in a folder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage<'a> {
    /// Name of the stage, its checkpoints and its log.
    pub name: &'static str,
    /// Whether to resume from the newest checkpoint.
    pub resume: bool,
    /// Steps between checkpoints, at least 1.
    pub every: usize,
    /// Number of checkpoints to keep, at least 1.
    pub keep: usize,
    /// Total number of steps.
    pub steps: usize,
    /// Result files, written after every checkpoint.
    pub results: &'a [&'a str],
}

impl Stage<'_> {
    /// Runs the stage to its last step.
    ///
    /// - `progress`: called after every step
    /// - `show`: writes the results after every checkpoint, and at the start if a killed run left outdated ones
    ///
    /// # Errors
    ///
    /// Errors of `show`, of the run's steps, and of files that cannot be written.
    pub(crate) fn train<M: Module, T: Task<M>, E: From<Error>>(
        self,
        folder: &mut RunFolder,
        mut run: Run<M>,
        task: &T,
        progress: &dyn Fn(Progress),
        show: impl Fn(&Run<M>) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { name, steps, .. } = self;
        progress(Progress::Begin {
            what: name,
            of: steps as u64,
        });
        if let Some(checkpoint) = folder.begin(name, self.resume)? {
            run.resume(checkpoint)?;
            if !folder.is_current(name, run.steps(), self.results) {
                show(&run)?;
            }
            folder.note(name, run.steps(), steps)?;
        }
        let log = folder.path().join(format!("{name}.jsonl"));
        let mut metrics = TrainLog::open(&log, run.steps())?;
        let mut ready = Vec::new();
        while run.steps() < steps {
            let (report, terms) = step_ahead(&mut run, task, &mut ready, steps)?;
            let terms: Map<String, Value> = terms
                .into_iter()
                .map(|(term, value)| (term.to_owned(), json!(value)))
                .collect();
            metrics.write(run.steps(), steps, report, &Value::Object(terms))?;
            progress(Progress::Step {
                step: run.steps(),
                loss: report.loss,
            });
            if run.steps().is_multiple_of(self.every.max(1)) || run.steps() == steps {
                run.checkpoint(&folder.checkpoints(name), self.keep)?;
                show(&run)?;
                folder.note(name, run.steps(), steps)?;
            }
        }
        progress(Progress::Made { stage: name, steps });
        Ok(())
    }
}

/// Makes one step while another thread makes the next batch.
///
/// - `ready`: parts of the batch of this step, empty at first; on return of the next step, if the run of `steps` has one
fn step_ahead<M: Module, T: Task<M>>(
    run: &mut Run<M>,
    task: &T,
    ready: &mut Vec<T::Batch>,
    steps: usize,
) -> Result<(StepReport, Terms), Error> {
    let (parts, step) = (run.parts(), run.steps());
    let batches = match std::mem::take(ready) {
        none if none.is_empty() => parts.of_step(task, step)?,
        made => made,
    };
    let (report, next) = std::thread::scope(|scope| {
        let maker = scope.spawn(|| match step + 1 < steps {
            true => parts.of_step(task, step + 1),
            false => Ok(Vec::new()),
        });
        let report = run.step_on(task, &batches);
        let next = maker.join();
        (
            report,
            next.unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        )
    });
    *ready = next?;
    report
}
