//! Progress messages of a training.

/// Progress message of a training.
///
/// Every piece of work begins with [`Begin`](Self::Begin) and ends with [`End`](Self::End) or [`Made`](Self::Made); they do
/// not overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// Work begins.
    Begin {
        /// Name of what is counted, such as `pairs`, or of the stage.
        what: &'static str,
        /// Total count.
        of: u64,
    },
    /// This many more are done; may come from several threads.
    More(u64),
    /// A step of a stage was made.
    Step {
        /// Steps made so far, including steps of earlier runs.
        step: usize,
        /// Loss of this step.
        loss: f64,
    },
    /// Work other than a stage has ended.
    End,
    /// A stage has made all its steps, and its results are written.
    Made {
        /// Name of the stage.
        stage: &'static str,
        /// Total number of steps.
        steps: usize,
    },
}

/// Runs a piece of work and reports its progress.
///
/// - `of`: total count
/// - `work`: receives a function to call with the number of items just done
pub(super) fn counted<T>(
    what: &'static str,
    of: u64,
    progress: &(dyn Fn(Progress) + Sync),
    work: impl FnOnce(&(dyn Fn(u64) + Sync)) -> T,
) -> T {
    progress(Progress::Begin { what, of });
    let made = work(&|count| progress(Progress::More(count)));
    progress(Progress::End);
    made
}
