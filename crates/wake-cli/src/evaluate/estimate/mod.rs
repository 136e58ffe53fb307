//! `wake evaluate estimate`: evaluates errors and error bars of ship and wind estimates.

mod lines;
mod options;
mod report;
mod sets;

use std::fs::OpenOptions;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

use rayon::ThreadPoolBuilder;

use crate::exit::{self, Outcome};
use crate::progress;
use lines::{Line, read};
pub(crate) use options::Options;
use report::Report;
use sets::Set;

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let sets = Set::all(options)?;
    whole_files::make_folder(&options.out)?;
    let path = options.out.join("estimates.jsonl");
    let mut lines = read(&path)?;
    let file = OpenOptions::new().create(true).append(true).open(&path)?;
    let images = sets
        .iter()
        .flat_map(|set| (0..set.count).map(move |index| (set, index)));
    let is_new = |(set, index): &(&Set, u64)| {
        let known = |line: &Line| line.set == set.name && line.estimate.index == *index;
        !lines.iter().any(known)
    };
    let bar = progress::bar(images.clone().count() as u64, "images");
    let images: Vec<(&Set, u64)> = images.filter(is_new).collect();
    bar.inc(bar.length().unwrap_or(0) - images.len() as u64);
    let (next, file) = (Mutex::new(images.into_iter()), Mutex::new(file));
    let threads = rayon::current_num_threads() / options.jobs as usize;
    let job = || -> Outcome<Vec<Line>> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.max(1));
        let pool = pool.build().map_err(std::io::Error::other)?;
        let mut lines = Vec::new();
        loop {
            let Some((set, index)) = next.lock().unwrap_or_else(PoisonError::into_inner).next()
            else {
                return Ok(lines);
            };
            if let Some(line) = pool.install(|| estimated(set, index))? {
                let text = serde_json::to_string(&line)?;
                writeln!(
                    file.lock().unwrap_or_else(PoisonError::into_inner),
                    "{text}"
                )?;
                lines.push(line);
            }
            bar.inc(1);
        }
    };
    let each = std::thread::scope(|scope| {
        let jobs: Vec<_> = (0..options.jobs).map(|_| scope.spawn(job)).collect();
        let ended = jobs.into_iter().map(|job| match job.join() {
            Ok(lines) => lines,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        ended.collect::<Vec<_>>()
    });
    for of_job in each {
        lines.extend(of_job?);
    }
    bar.finish_and_clear();
    let report = Report::of(&sets, &lines);
    let text = report.markdown();
    whole_files::write_json(&options.out.join("report.json"), &report)?;
    whole_files::write_atomically(&options.out.join("report.md"), text.as_bytes())?;
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}

/// Estimates an image; `None` if the set has none at this index.
fn estimated(set: &Set, index: u64) -> Outcome<Option<Line>> {
    let Some(image) = set.image(index)? else {
        return Ok(None);
    };
    Ok(Some(Line {
        set: set.name.to_owned(),
        estimate: image.estimated()?,
    }))
}
