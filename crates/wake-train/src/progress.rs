//! What a training tells while it works.

/// One message of a training to whoever watches it.
///
/// Every piece of work begins with [`Begin`](Self::Begin) and ends with [`End`](Self::End) or [`Made`](Self::Made); no two are
/// under way at the same time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// Work begins.
    Begin {
        /// What is counted, such as `pairs`; of a stage its name.
        what: &'static str,
        /// How much of it there is.
        of: u64,
    },
    /// So much more was done; may come from several threads.
    More(u64),
    /// A step of a stage was made.
    Step {
        /// Steps made so far, those of earlier runs included.
        step: usize,
        /// The loss of this one.
        loss: f64,
    },
    /// Work other than a stage has ended.
    End,
    /// A stage has made all its steps, and its results are written.
    Made {
        /// Its name.
        stage: &'static str,
        /// Steps in all.
        steps: usize,
    },
}

/// Runs work that counts what it does.
///
/// - `of`: how much there is to do
/// - `work`: is given what it calls with every number of things that were done
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
