//! Progress of a training on the screen: a bar for each task, and a line when a stage is done.

use std::io;
use std::path::{Display, Path};
use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;
use wake_train::Progress;

use crate::exit::{self, Outcome};
use crate::progress;

/// Shows the progress of a training.
pub(crate) struct Screen<'a> {
    /// Folder of the results.
    out: &'a Path,
    /// Text for a stage, its steps, and the folder.
    line: Line,
    shown: Mutex<Shown>,
}

type Line = fn(&str, usize, Display<'_>) -> String;

struct Shown {
    what: &'static str,
    bar: ProgressBar,
    /// Whether all output succeeded.
    said: io::Result<()>,
}

impl<'a> Screen<'a> {
    pub(crate) fn new(out: &'a Path) -> Self {
        Self::saying(out, |stage, steps, out| {
            format!("{stage}: {steps} steps, results in {out}")
        })
    }

    pub(crate) fn saying(out: &'a Path, line: Line) -> Self {
        let shown = Shown {
            what: "",
            bar: ProgressBar::hidden(),
            said: Ok(()),
        };
        Self {
            out,
            line,
            shown: Mutex::new(shown),
        }
    }

    /// Callback for a training.
    pub(crate) fn watch(&self) -> impl Fn(Progress) + Sync {
        |told| {
            let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
            match told {
                Progress::Begin { what, of } => {
                    shown.what = what;
                    shown.bar = progress::bar(of, what);
                }
                Progress::More(count) => shown.bar.inc(count),
                Progress::Step { step, loss } => {
                    let message = format!("{}, loss {loss:.4}", shown.what);
                    shown.bar.set_message(message);
                    shown.bar.set_position(step as u64);
                }
                Progress::Made { stage, steps } => {
                    shown.bar.finish_and_clear();
                    let said = exit::say(&(self.line)(stage, steps, self.out.display()));
                    shown.said = std::mem::replace(&mut shown.said, Ok(())).and(said);
                }
                _ => shown.bar.finish_and_clear(),
            }
        }
    }

    /// Returns the first output error, if there was one.
    pub(crate) fn end(&self) -> Outcome<()> {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(std::mem::replace(&mut shown.said, Ok(()))?)
    }
}
