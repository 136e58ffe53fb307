//! Tables of image figures: ablation, pixels, wake correlation, schedulers.

use super::contents::{Report, number};

/// Ratio of model to simulator.
fn ratio(model: Option<f64>, simulator: Option<f64>) -> String {
    number(model.zip(simulator).map(|(m, s)| m / s), 3)
}

pub(super) fn ablation(report: &Report) -> String {
    let mut text = "## Ablation\n\nMeans over the scenes; 0.5 in the two-sample test: indistinguishable from simulated images.\n\n\
        | image | two-sample | distance | skewness | kurtosis | steepness range, azimuth, wind | grouping | crests | seams | wake |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.figures.ablation {
        let told = r.two_sample.map_or("–".to_owned(), |t| {
            format!("{:.3} ± {:.3}", t.accuracy, t.half_width)
        });
        let [range, azimuth, wind] = r.steepness.map(|s| number(s, 3));
        text += &format!(
            "| {} | {told} | {} | {} | {} | {range}, {azimuth}, {wind} | {} | {} | {} | {} |\n",
            r.image,
            number(r.two_sample.map(|t| t.distance), 2),
            number(r.skewness, 3),
            number(r.kurtosis, 3),
            number(r.grouping, 3),
            number(r.crest_variance, 2),
            number(r.seams, 2),
            number(r.wake_contrast, 2)
        );
    }
    text
}

pub(super) fn pixels(report: &Report) -> String {
    let mut text = "## Pixels, against a simulated image of the same scene\n\n\
        | image | SSIM | PSNR dB | features | LPIPS | brightness | contrast ratio | spectrum dB | in thirds |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.figures.pixels {
        let [low, middle, high] = r.bands_db;
        text += &format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {low:.1}, {middle:.1}, {high:.1} |\n",
            r.image,
            number(r.ssim, 4),
            number(r.psnr_db, 2),
            number(r.features, 4),
            number(r.lpips, 4),
            number(r.brightness_difference, 4),
            number(r.contrast_ratio, 3),
            number(r.spectrum_db, 2)
        );
    }
    let (model, simulator) = (&report.figures.pixels[0], &report.figures.pixels[1]);
    text += &format!(
        "\nModel over simulator: SSIM {}, PSNR {}, features {}, LPIPS {}. Good is 0.9 to 1.1: as close as another simulated image.\n",
        ratio(model.ssim, simulator.ssim),
        ratio(model.psnr_db, simulator.psnr_db),
        ratio(model.features, simulator.features),
        ratio(model.lpips, simulator.lpips)
    );
    text + &format!(
        "Equivalent looks of the open sea after {} looks of speckle: simulator {}, model {}.\n",
        report.figures.speckle.looks,
        number(report.figures.speckle.simulator, 2),
        number(report.figures.speckle.model, 2)
    )
}

pub(super) fn wake(report: &Report) -> String {
    let wake = &report.figures.wake_correlation;
    format!(
        "## Wake correlation\n\nInside the Kelvin wedge, over {} scenes, medians: simulator (4 against 4 images) {}, \
         model (8 against 8) {}, ratio {}.\n",
        wake.simulator.len(),
        number(wake.simulator_median, 3),
        number(wake.model_median, 3),
        number(wake.ratio_median, 3)
    )
}

pub(super) fn schedulers(report: &Report) -> String {
    if report.schedulers.is_empty() {
        return String::new();
    }
    let mut text = "## Schedulers\n\nError: difference of grey from the reference of many DDIM steps and the same noise, root mean square \
        over the reference's standard deviation.\n\n| scheduler | steps | error | seconds | SSIM | PSNR dB | spectrum dB |\n\
        | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in &report.schedulers {
        text += &format!(
            "| {} | {} | {} | {:.3} | {} | {} | {} |\n",
            r.scheduler,
            r.steps,
            number(r.error, 4),
            r.seconds,
            number(r.pixels.ssim, 4),
            number(r.pixels.psnr_db, 2),
            number(r.pixels.spectrum_db, 2)
        );
    }
    text
}
