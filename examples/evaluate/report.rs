//! The report as text.

use crate::judge::Report;
use crate::measurements::MeasurementRow;
use crate::statistics::Errors;

/// The report in Markdown.
pub(crate) fn markdown(report: &Report) -> String {
    let parts = [
        format!(
            "Judged: {}. {} held-out scenes of 256 x 256 pixels of 4 m, before speckle.\n",
            report.judged, report.scenes
        ),
        rungs(report),
        pixels(report),
        wake(report),
        measurements("Values read from the images", &report.measurements),
        conditions(report),
        swaps(report),
        seconds(report),
    ];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

/// A number, or a dash.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.digits$}"))
}

/// Model over simulator.
fn ratio(model: Option<f64>, simulator: Option<f64>) -> String {
    number(model.zip(simulator).map(|(m, s)| m / s), 3)
}

fn rungs(report: &Report) -> String {
    let mut text = "## Rungs\n\nWhat each kind of image has of a sea, means over the scenes: the shape of the grey that is left \
        when the expected image is subtracted; variance on crests of the wake over that in its troughs; squared differences of neighbours across the borders of squares of \
        8 pixels over those elsewhere; share of patches of \
        unseen scenes that the best of up to three small networks tells from simulated ones, 0.5 where it cannot, and the distance of both kinds in the \
        feature that it tells them by, in standard deviations.\n\n\
        | image | two-sample | distance | skewness | kurtosis | steepness range, azimuth, wind | grouping | crests | seams |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.rungs {
        let told = r.two_sample.map_or("–".to_owned(), |t| {
            format!("{:.3} ± {:.3}", t.accuracy, t.half_width)
        });
        let [range, azimuth, wind] = r.steepness.map(|s| number(s, 3));
        text += &format!(
            "| {} | {told} | {} | {} | {} | {range}, {azimuth}, {wind} | {} | {} | {} |\n",
            r.image,
            number(r.two_sample.map(|t| t.distance), 2),
            number(r.skewness, 3),
            number(r.kurtosis, 3),
            number(r.grouping, 3),
            number(r.crest_variance, 2),
            number(r.seams, 2)
        );
    }
    text
}

fn pixels(report: &Report) -> String {
    let mut text = "## Pixels, against a simulated image of the same scene\n\n\
        | image | SSIM | PSNR dB | LPIPS | brightness | contrast ratio | spectrum dB |\n\
        | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.pixels {
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {} |\n",
            r.image,
            number(r.ssim, 4),
            number(r.psnr_db, 2),
            number(r.lpips, 4),
            number(r.brightness_difference, 4),
            number(r.contrast_ratio, 3),
            number(r.spectrum_db, 2)
        );
    }
    let paper = &report.paper;
    text += &format!(
        "| the paper's model | {} | {} | {} | – | – | – |\n",
        paper.ssim, paper.psnr_db, paper.lpips
    );
    let (model, simulator) = (&report.pixels[0], &report.pixels[1]);
    text += &format!(
        "\nModel over simulator: SSIM {}, PSNR {}, LPIPS {}. Good is 0.9 to 1.1: as close as another simulated image.\n",
        ratio(model.ssim, simulator.ssim),
        ratio(model.psnr_db, simulator.psnr_db),
        ratio(model.lpips, simulator.lpips)
    );
    text + &format!(
        "Equivalent looks of the open sea after {} looks of speckle: simulator {}, model {}.\n",
        report.speckle.looks,
        number(report.speckle.simulator, 2),
        number(report.speckle.model, 2)
    )
}

fn wake(report: &Report) -> String {
    let wake = &report.wake_correlation;
    format!(
        "## Wake correlation\n\nInside the Kelvin wedge, over {} scenes, medians: simulator (4 against 4 images) {}, \
         model (8 against 8) {}, ratio {}.\n",
        wake.simulator.len(),
        number(wake.simulator_median, 3),
        number(wake.model_median, 3),
        number(wake.ratio_median, 3)
    )
}

fn errors(errors: &Errors) -> String {
    format!(
        "{} | {} | {:.2}",
        number(errors.median, 3),
        number(errors.percentile_90, 3),
        errors.measurable
    )
}

fn measurements(title: &str, rows: &[MeasurementRow]) -> String {
    let mut text = format!(
        "## {title}\n\nAbsolute error: median, 90th percentile, share measurable. The shares of the others are of the \
         scenes in which the simulated image is measurable; the rest of these are misses.\n\n\
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

fn conditions(report: &Report) -> String {
    if report.conditions.len() < 2 {
        return String::new();
    }
    let mut text =
        "## What the model is told\n\nMedian absolute error (share measurable).\n\n| value |"
            .to_owned();
    for condition in &report.conditions {
        text += &format!(" {} |", condition.told);
    }
    text += &format!("\n| --- |{}\n", " --- |".repeat(report.conditions.len()));
    for (n, row) in report.measurements.iter().enumerate() {
        text += &format!("| {} ({}) |", row.quantity, row.unit);
        for condition in &report.conditions {
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

fn swaps(report: &Report) -> String {
    let mut text = "## One value changed\n\nShare of pairs in which the measured value follows, of those in which it \
        follows on simulated images.\n\n| value | told | pairs | counted | right |\n| --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.swaps {
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
