//! Tables of values measured in the images.

use super::contents::{Report, number};
use wake_train::evaluation::{AbsoluteErrors, MeasurementRow};

fn errors(errors: &AbsoluteErrors) -> String {
    format!(
        "{} | {} | {:.2}",
        number(errors.median, 3),
        number(errors.percentile_90, 3),
        errors.measurable
    )
}

pub(super) fn measurements(title: &str, rows: &[MeasurementRow]) -> String {
    let mut text = format!(
        "## {title}\n\nAbsolute error: median, 90th percentile, share of scenes in which the value is measurable (for model and \
         Gaussian sea, of those measurable in the simulated image).\n\n\
         | value | unit | simulator median | p90 | share | model median | p90 | share | Gaussian sea median | p90 | share |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for row in rows {
        let [model, gaussian] = [&row.model, &row.gaussian]
            .map(|row| row.as_ref().map_or("– | – | –".to_owned(), errors));
        text += &format!(
            "| {} | {} | {} | {model} | {gaussian} |\n",
            row.quantity,
            row.unit,
            errors(&row.simulator)
        );
    }
    text
}

pub(super) fn conditions(report: &Report) -> String {
    if report.figures.conditions.len() < 2 {
        return String::new();
    }
    let mut text =
        "## Conditions\n\nMedian absolute error (share measurable).\n\n| value |".to_owned();
    for condition in &report.figures.conditions {
        text += &format!(" {} |", condition.told);
    }
    text += &format!(
        "\n| --- |{}\n",
        " --- |".repeat(report.figures.conditions.len())
    );
    for (n, row) in report.figures.measurements.iter().enumerate() {
        text += &format!("| {} ({}) |", row.quantity, row.unit);
        for condition in &report.figures.conditions {
            let model = condition.measurements[n].model.as_ref();
            let cell = model.map_or("–".to_owned(), |e| {
                format!("{} ({:.2})", number(e.median, 3), e.measurable)
            });
            text += &format!(" {cell} |");
        }
        text.push('\n');
    }
    text
}

pub(super) fn controllability(report: &Report) -> String {
    let mut text = "## One value changed\n\nOf the pairs counted, in which the measured value changes in the right direction on simulated \
        images, the share in which it also does on generated ones.\n\n| value | condition | pairs | counted | right |\n| --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.figures.controllability {
        text += &format!(
            "| {} | {} | {} | {} | {} |\n",
            r.quantity,
            r.told,
            r.pairs,
            r.counted,
            number(r.right, 2)
        );
    }
    text
}
