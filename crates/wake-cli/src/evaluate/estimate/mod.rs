//! `wake evaluate estimate`: errors and error bars of estimates of ship and wind.

mod report;
mod sets;

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Deserialize, Serialize};
use wake_train::evaluation::EstimatedImage;

use crate::exit::{self, Outcome};
use crate::progress;
use report::Report;
use sets::Set;

/// Estimate ship and wind on simulated images, and compare errors with error bars and bounds.
///
/// Writes `estimates.jsonl` (a line an image), `report.json` and `report.md` into the folder. An interrupted run continues where
/// it stopped: delete the folder after a change of the program.
#[derive(Args)]
pub(crate) struct Options {
    /// Scenes of the paper's ranges
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    count: u32,
    /// Scenes of the recipe detector
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(0..=65536))]
    satellites: u32,
    /// Images of each other set: detected wakes, images of the wake model, wrong assumptions, sea without ships
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=65536))]
    others: u32,
    /// Folder of real tiles with labels.json: headings alone are compared
    #[arg(long, value_name = "DIR")]
    real: Option<PathBuf>,
    /// flex, ndarray, wgpu or cuda, where compiled in: of the detector and the wake model
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_estimate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

/// Line of `estimates.jsonl`.
#[derive(Serialize, Deserialize)]
struct Line {
    set: String,
    estimate: EstimatedImage,
}

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

/// Lines of an earlier run; a last one that was cut short is left out.
fn read(path: &Path) -> Outcome<Vec<Line>> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let lines = BufReader::new(File::open(path)?).lines();
    let lines = lines.collect::<Result<Vec<String>, _>>()?;
    Ok(lines
        .iter()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect())
}
