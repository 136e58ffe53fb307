//! Plot of average precision by training data.

use std::path::Path;

use plotters::prelude::*;

use crate::exit::Outcome;

/// Colours of simulated and real images.
const COLOURS: [RGBColor; 2] = [RGBColor(31, 119, 180), RGBColor(214, 39, 40)];
const NAMES: [&str; 2] = ["simulated wakes above 1 dB", "real tiles, clear wakes"];

/// Plots one line per training with its average precision on simulated and on real images.
pub(crate) fn transfer(path: &Path, trainings: &[(String, [f64; 2])]) -> Outcome<()> {
    // The legend takes the first two lines.
    let height = 120 + 28 * (trainings.len() as u32 + 2);
    let area = SVGBackend::new(path, (760, height)).into_drawing_area();
    area.fill(&WHITE)?;
    let lines = (0..trainings.len() as i32 + 2).into_segmented();
    let longest = trainings.iter().map(|(name, _)| name.chars().count()).max();
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(24 + 6 * longest.unwrap_or(0) as u32)
        .build_cartesian_2d(0.0..1.0, lines)?;
    let name = |line: &SegmentValue<i32>| match line {
        SegmentValue::CenterOf(n) => trainings
            .get(usize::try_from(*n).unwrap_or(usize::MAX))
            .map_or_else(String::new, |(name, _)| name.clone()),
        _ => String::new(),
    };
    chart
        .configure_mesh()
        .max_light_lines(1)
        .y_labels(trainings.len() + 2)
        .y_label_formatter(&name)
        .x_desc("average precision")
        .draw()?;
    for (kind, colour) in COLOURS.into_iter().enumerate() {
        let dots = trainings.iter().zip(0..).map(|((_, precision), n)| {
            let place = (precision[kind], SegmentValue::CenterOf(n));
            Circle::new(place, 5, colour.filled())
        });
        chart
            .draw_series(dots)?
            .label(NAMES[kind])
            .legend(move |(x, y)| Circle::new((x + 9, y), 5, colour.filled()));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    area.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_training_has_its_line_and_two_dots() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("transfer.svg");
        let trainings = [
            ("first", [0.2, 0.9]),
            ("second", [0.5, 0.4]),
            ("third", [1.0, 0.0]),
        ];
        let trainings = trainings.map(|(name, dots)| (name.to_owned(), dots));
        transfer(&path, &trainings).unwrap();
        let drawn = std::fs::read_to_string(&path).unwrap();
        for (name, _) in &trainings {
            assert!(drawn.contains(name.as_str()), "{name}");
        }
        // Two for each training, and two in the legend.
        assert_eq!(drawn.matches("<circle").count(), 2 * 3 + 2);
    }
}
