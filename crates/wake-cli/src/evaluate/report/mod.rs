//! Report of `wake evaluate` in Markdown.

mod contents;
mod images;
mod values;

use super::common::Common;
use crate::exit::{self, Outcome};
pub(crate) use contents::{PAPER, Report};
use contents::{Paper, number};

/// The report in Markdown.
fn markdown(report: &Report) -> String {
    let parts = [
        format!(
            "Evaluated: {}. {} held-out scenes of {2} x {2} pixels of {3} m, {4} speckle.\n",
            report.figures.judged,
            report.figures.scenes,
            report.pixels_along,
            report.spacing,
            if report.speckle { "with" } else { "before" }
        ),
        images::ablation(report),
        images::pixels(report),
        images::wake(report),
        values::measurements(
            "Values measured in the images",
            &report.figures.measurements,
        ),
        values::conditions(report),
        values::controllability(report),
        images::schedulers(report),
        seconds(report),
        papers(&report.paper),
    ];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

fn seconds(report: &Report) -> String {
    let beside = report.seconds.iter().any(|r| r.text_to_image.is_some());
    let cell = |text: &str| {
        if beside {
            format!(" {text} |")
        } else {
            String::new()
        }
    };
    let mut text = format!(
        "## Seconds per image\n\n| pixels | simulator | harmonic sum, 2 x 10⁴ waves | model |{}\n\
         | --- | --- | --- | --- |{}\n",
        cell("text to image"),
        cell("---")
    );
    for r in &report.seconds {
        text += &format!(
            "| {0} x {0} | {1:.3} | {2:.1} | {3} |{4}\n",
            r.size,
            r.simulator_fast,
            r.simulator_harmonic_sum,
            number(r.model, 3),
            cell(&number(r.text_to_image, 2))
        );
    }
    text
}

/// The paper's figures, apart from the others.
fn papers(paper: &Paper) -> String {
    format!(
        "## The paper's own figures\n\n\
         | SSIM | PSNR dB | LPIPS | seconds at 256 x 256 | over its simulator |\n| --- | --- | --- | --- | --- |\n\
         | {} | {} | {} | {} (RTX 3090) | up to {} times faster |\n\n\
         Not comparable with the figures above: another simulator, another mapping to grey, one sample per scene.\n",
        paper.ssim, paper.psnr_db, paper.lpips, paper.seconds_256, paper.speed_up
    )
}

impl Report {
    /// Writes `report.json` and `report.md`, and prints the report.
    pub(crate) fn write(&self, common: &Common) -> Outcome<()> {
        let (out, text) = (&common.out, markdown(self));
        whole_files::write_json(&out.join("report.json"), self)?;
        whole_files::write_atomically(&out.join("report.md"), text.as_bytes())?;
        match common.json {
            true => exit::say(&serde_json::to_string_pretty(self)?)?,
            false => exit::say(&format!("{text}\nwritten to {}", out.display()))?,
        }
        Ok(())
    }
}
