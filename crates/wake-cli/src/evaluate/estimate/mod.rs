//! `wake evaluate estimate`: errors and error bars of estimates of ship and wind.

mod lines;
mod options;
mod report;
mod sets;

use std::fs::OpenOptions;
use std::io::Write;

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
    let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
    let total: u64 = sets.iter().map(|set| set.count).sum();
    let bar = progress::bar(total, "images");
    for set in &sets {
        for index in 0..set.count {
            let known = |line: &Line| line.set == set.name && line.estimate.index == index;
            if !lines.iter().any(known)
                && let Some(image) = set.image(index)?
            {
                let line = Line {
                    set: set.name.to_owned(),
                    estimate: image.estimated()?,
                };
                writeln!(file, "{}", serde_json::to_string(&line)?)?;
                lines.push(line);
            }
            bar.inc(1);
        }
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
