//! The report as a page.

use super::figures::{Figures, Report, Row};

pub(crate) fn page(report: &Report) -> String {
    let mut lines = vec![
        "# Ship and sea from images, with error bars".to_owned(),
        String::new(),
        "Simulated images with speckle that were held out. The ship lies within 40 m of where a detection says; wind, speed and heading are unknown; fetch, incidence, length and proportions of the hull are known, and the length is estimated again. `identifiable` is what the estimator says; `telling` counts scenes whose bound is below a tenth of the range.".to_owned(),
        String::new(),
    ];
    section(
        &mut lines,
        "The paper's ranges: 256 x 256 pixels of 4 m, 4 looks",
        &report.ranges,
    );
    lines.push(format!(
        "Of {} images without a ship, {} gave a wake (largest ln likelihood ratio {:.1}). An estimate takes {:.1} s in the median.",
        report.empty[0], report.empty[1], report.largest_of_empty, report.seconds
    ));
    lines.join("\n") + "\n"
}

fn section(lines: &mut Vec<String>, title: &str, figures: &Figures) {
    if figures.rows.iter().all(|row| row.scenes[0] == 0) {
        return;
    }
    lines.push(format!("## {title}"));
    lines.push(String::new());
    lines.push(format!(
        "{} of {} images gave a wake, {} of them with a consistent fit.",
        figures.wakes, figures.rows[0].scenes[0], figures.consistent
    ));
    lines.push(String::new());
    lines.push("| value | telling | of them identifiable | identifiable | median error | 90th percentile | within 1, 2, 3 sd | pulls: scale, largest | squared error over bound: median, mean | `measure`: given, median, 90th | middle of the range: median, 90th |".to_owned());
    lines.push("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |".to_owned());
    lines.extend(figures.rows.iter().map(line));
    lines.push(String::new());
    lines.push("Ranks of the truth in the stated distribution, by tenths:".to_owned());
    lines.push(String::new());
    for row in &figures.rows {
        lines.push(format!("- {}: {:?}", row.name, row.ranks));
    }
    lines.push(String::new());
}

fn line(row: &Row) -> String {
    let measured = row
        .measured
        .map_or_else(String::new, |(count, [median, high])| {
            format!("{count}, {median:.2}, {high:.2}")
        });
    format!(
        "| {} \\[{}\\] | {} | {} | {} | {:.3} | {:.3} | {:.2} {:.2} {:.2} | {:.2}, {:.1} | {:.2}, {:.2} | {measured} | {:.2}, {:.2} |",
        row.name,
        row.unit,
        row.scenes[1],
        row.given,
        row.scenes[2],
        row.errors[0],
        row.errors[1],
        row.within[0],
        row.within[1],
        row.within[2],
        row.pulls[0],
        row.pulls[1],
        row.over_bound[0],
        row.over_bound[1],
        row.middle[0],
        row.middle[1]
    )
}
