//! The report as text.

mod contents;
mod images;
mod values;

use contents::number;
pub(crate) use contents::{PAPER, Report};

/// The report in Markdown.
pub(crate) fn markdown(report: &Report) -> String {
    let parts = [
        format!(
            "Judged: {}. {} held-out scenes of 256 x 256 pixels of 4 m, before speckle.\n",
            report.figures.judged, report.figures.scenes
        ),
        images::ablation(report),
        images::pixels(report),
        images::wake(report),
        values::measurements("Values read from the images", &report.figures.measurements),
        values::conditions(report),
        values::controllability(report),
        seconds(report),
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
    text + &format!(
        "\nThe paper's model is up to {} times faster than its simulator, a harmonic sum.\n",
        report.paper.speed_up
    )
}
