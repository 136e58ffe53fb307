//! Report of `wake evaluate calibration`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use wake_detector::calibration::Probabilities;
use wake_detector::score::{Curve, Judged, Rule};
use wake_detector::{Calibration, Detection};
use wake_physics::Scene;
use wake_train::detector::judging::{
    DetectionOutcome, EmptySea, KnownImages, Reliability, Tile, bootstrap, outcomes,
};
use whole_files::{write_atomically, write_json};

use crate::exit::Outcome;

/// Contents of the report.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// Images per recipe for the fit, and of sea without ships.
    pub(super) images: u64,
    /// Images per recipe for the check.
    pub(super) checked: u64,
    /// Requested rate of false alarms per 1,000 km².
    pub(super) false_alarms: f64,
    /// CRC-32 of the weights.
    pub(super) weights: String,
    pub(super) modes: Vec<Mode>,
    pub(super) tiles: Option<Tiles>,
}

/// Figures with known or with unknown pixel spacing.
#[derive(Debug, Serialize)]
pub(super) struct Mode {
    name: &'static str,
    pub(super) probabilities: Probabilities,
    checks: Vec<Check>,
    /// Sure detections on sea without ships: all, and by wind, sensor and slicks.
    empty: EmptySea,
    by_wind: Vec<(String, EmptySea)>,
    by_sensor: Vec<(String, EmptySea)>,
    by_slicks: Vec<(String, EmptySea)>,
    /// Recall and precision of sure detections on the simulated images, by recipe.
    operating: Vec<Operating>,
}

/// Reliability of both probabilities on a set of images.
#[derive(Debug, Serialize)]
pub(super) struct Check {
    name: String,
    wake: Option<Reliability>,
    direction: Option<Reliability>,
}

/// Performance of sure detections on a set of images.
#[derive(Debug, Serialize)]
struct Operating {
    average_precision: Option<f64>,
    recall: f64,
    precision: f64,
}

/// Figures on real tiles.
#[derive(Debug, Serialize)]
pub(super) struct Tiles {
    count: usize,
    megapixels: f64,
    check: Check,
    /// 95 % intervals over the tiles of the calibration error, and of the Brier score minus a constant's Brier score.
    calibration_error: Option<[f64; 2]>,
    brier_less_constant: Option<[f64; 2]>,
    /// Sure detections that are not wakes.
    false_alarms: usize,
    /// Sure detections that are wakes, and labelled wakes.
    found: [usize; 2],
}

/// Limits of the wind classes \[m/s\].
const WINDS: [f64; 6] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0];

/// Score of a detection, and whether it is a wake.
pub(super) fn by_score(one: &DetectionOutcome) -> (f64, bool) {
    (f64::from(one.detection.score), one.wake)
}

/// Evidence for the direction of a wake, and whether the direction is correct.
pub(super) fn by_direction(one: &DetectionOutcome) -> Option<(f64, bool)> {
    let forward = 0.5 * (1.0 + f64::from(one.detection.forward?));
    Some((forward, one.direction?))
}

impl Check {
    pub(super) fn of(
        name: &str,
        probabilities: &Probabilities,
        outcomes: &[DetectionOutcome],
    ) -> Self {
        let wakes: Vec<_> = outcomes
            .iter()
            .map(|one| wake(probabilities, one))
            .collect();
        let directions = outcomes.iter().filter_map(by_direction);
        let directions: Vec<_> = directions
            .map(|(forward, right)| (probabilities.direction.of(forward), right))
            .collect();
        Self {
            name: name.to_owned(),
            wake: Reliability::of(&wakes),
            direction: Reliability::of(&directions),
        }
    }
}

fn wake(probabilities: &Probabilities, one: &DetectionOutcome) -> (f64, bool) {
    let (score, right) = by_score(one);
    (probabilities.wake.of(score), right)
}

impl Mode {
    /// - `checked`: the images of each recipe, simulated ones first
    pub(super) fn of(
        name: &'static str,
        probabilities: Probabilities,
        checks: Vec<Check>,
        empty: &KnownImages,
        checked: &[&KnownImages],
    ) -> Self {
        let sea = |counts: &dyn Fn(&Scene) -> bool| {
            EmptySea::count(&empty.scenes, &empty.found, probabilities.sure_from, counts)
        };
        let winds = WINDS.windows(2).map(|bounds| {
            let inside = |scene: &Scene| (bounds[0]..bounds[1]).contains(&scene.sea.wind_speed);
            (format!("{} to {} m/s", bounds[0], bounds[1]), sea(&inside))
        });
        let mut sensors = BTreeMap::new();
        for scene in &empty.scenes {
            sensors.insert(sensor(scene), ());
        }
        let sensors = sensors.into_keys().map(|name| {
            let found = sea(&|scene: &Scene| sensor(scene) == name);
            (name, found)
        });
        let slicks = [("without slicks", false), ("with slicks", true)].map(|(name, has)| {
            let found = sea(&|scene: &Scene| (scene.sea.slick_damping > 0.0) == has);
            (name.to_owned(), found)
        });
        Self {
            name,
            checks,
            empty: sea(&|_| true),
            by_wind: winds.collect(),
            by_sensor: sensors.collect(),
            by_slicks: slicks.into(),
            operating: checked
                .iter()
                .map(|images| Operating::of(images, probabilities.sure_from))
                .collect(),
            probabilities,
        }
    }
}

fn sensor(scene: &Scene) -> String {
    let name = serde_json::to_value(scene.radar.sensor).ok();
    name.and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_else(|| "none".to_owned())
}

impl Operating {
    fn of(images: &KnownImages, sure_from: f32) -> Self {
        let judged = images.with_found();
        let all = Curve::new(&judged, Rule::Ray);
        let sure: Vec<Judged> = judged
            .into_iter()
            .map(|mut image| {
                image.found.retain(|one| one.score >= f64::from(sure_from));
                image
            })
            .collect();
        let (right, wrong) = Curve::new(&sure, Rule::Ray).totals();
        Self {
            average_precision: all.average_precision(),
            recall: right as f64 / all.labels.max(1) as f64,
            precision: right as f64 / (right + wrong).max(1) as f64,
        }
    }
}

impl Report {
    /// Checks the probabilities for unknown spacing on real tiles; clear and probable wakes count, doubtful ones are
    /// ignored.
    pub(super) fn check_tiles(&mut self, tiles: &[Tile], found: &[Vec<Detection>]) {
        let probabilities = self.modes[1].probabilities;
        let judged: Vec<Judged> = tiles.iter().map(|tile| tile.probable.clone()).collect();
        let outcomes = outcomes(&judged, found);
        let mut groups = vec![Vec::new(); tiles.len()];
        for one in &outcomes {
            groups[one.image].push(wake(&probabilities, one));
        }
        let sure = |one: &&DetectionOutcome| one.detection.score >= probabilities.sure_from;
        let labels = judged.iter().flat_map(|image| &image.labels);
        let pixels = tiles
            .iter()
            .map(|tile| tile.image.rows() * tile.image.columns());
        self.tiles = Some(Tiles {
            count: tiles.len(),
            megapixels: pixels.sum::<usize>() as f64 * 1e-6,
            check: Check::of("real tiles", &probabilities, &outcomes),
            calibration_error: bootstrap(&groups, |drawn| {
                Some(Reliability::of(&drawn.concat())?.calibration_error)
            }),
            brier_less_constant: bootstrap(&groups, |drawn| {
                let found = Reliability::of(&drawn.concat())?;
                Some(found.brier - found.brier_of_constant)
            }),
            false_alarms: outcomes.iter().filter(sure).filter(|one| !one.wake).count(),
            found: [
                outcomes.iter().filter(sure).filter(|one| one.wake).count(),
                labels.filter(|label| label.counts).count(),
            ],
        });
    }

    /// Writes the calibration and the report into a folder, and the calibration beside the weights if they are given.
    pub(super) fn write(
        &self,
        folder: &Path,
        calibration: &Calibration,
        weights: Option<&Path>,
    ) -> Outcome<()> {
        write_json(&folder.join("detector.calibration.json"), calibration)?;
        if let Some(weights) = weights {
            write_json(&Calibration::path_beside(weights), calibration)?;
        }
        write_json(&folder.join("report.json"), self)?;
        write_atomically(&folder.join("report.md"), self.text().as_bytes())?;
        Ok(())
    }

    pub(super) fn text(&self) -> String {
        let real = if self.tiles.is_some() {
            " --real DIR"
        } else {
            ""
        };
        let mut text = format!(
            "<!-- Written by: wake evaluate calibration --images {0} --checked {1}{real} -->\n\n\
             # Probabilities of detections\n\n\
             {7}The score threshold of *sure* detections keeps false alarms on simulated sea without ships ({5} images) to at most {4} per \
             1,000 km². `probability` is the chance of a wake in either direction, `direction_probability` the chance that tip and end \
             are not confused. Where wakes are rarer than in the images of the fit, `probability` is too high.\n\n\
             Fit: beta calibration on {2} simulated and as many painted images; check: {3} others of each kind. Weights: CRC-32 {6}. \
             Cells of the reliability tables: mean probability, observed frequency, number of detections.\n",
            self.images,
            self.checked,
            self.images,
            self.checked,
            self.false_alarms,
            self.images,
            self.weights,
            self.result(),
        );
        for mode in &self.modes {
            // Writing into a string cannot fail.
            let _ = write!(text, "\n## Images of {} pixel spacing\n\n", mode.name);
            mode.write(&mut text);
        }
        if let Some(tiles) = &self.tiles {
            tiles.write(&mut text);
        }
        text
    }

    /// Ranges of calibration error and Brier scores of `probability` over all simulated and painted images, and the error on
    /// real tiles; empty without any detections.
    fn result(&self) -> String {
        let checks = self.modes.iter().flat_map(|mode| &mode.checks);
        let wakes: Vec<&Reliability> = checks.filter_map(|check| check.wake.as_ref()).collect();
        if wakes.is_empty() {
            return String::new();
        }
        let range = |figure: fn(&Reliability) -> f64| {
            let figures = wakes.iter().map(|found| figure(found));
            let [least, most] = figures.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
                [a.min(x), b.max(x)]
            });
            format!("{least:.2} to {most:.2}")
        };
        let tiles = self.tiles.as_ref();
        let real = tiles.and_then(|tiles| Some((tiles.count, tiles.check.wake.as_ref()?)));
        let real = real.map_or(String::new(), |(count, found)| {
            format!(", {:.2} on {count} real tiles", found.calibration_error)
        });
        format!(
            "On simulated and painted images, `probability` is off by {} in the mean{real} (Brier score: {}; a constant: {}). ",
            range(|found| found.calibration_error),
            range(|found| found.brier),
            range(|found| found.brier_of_constant),
        )
    }
}

impl Mode {
    fn write(&self, text: &mut String) {
        let found = &self.probabilities;
        let _ = writeln!(text, "Sure from score {:.3}.\n", found.sure_from);
        text.push_str(
            "| images | AP | recall of sure detections | precision |\n| --- | --- | --- | --- |\n",
        );
        for (check, one) in self.checks.iter().zip(&self.operating) {
            let precision = one.average_precision.unwrap_or(0.0);
            let _ = writeln!(
                text,
                "| {} | {precision:.3} | {:.3} | {:.3} |",
                check.name, one.recall, one.precision
            );
        }
        text.push('\n');
        summary(text, &self.checks);
        let bins = |kind: fn(&Check) -> Option<&Reliability>| {
            self.checks.iter().map(kind).collect::<Vec<_>>()
        };
        text.push_str("\nReliability of `probability`:\n\n");
        reliability(text, &self.checks, &bins(|check| check.wake.as_ref()));
        text.push_str("\nReliability of `direction_probability`:\n\n");
        reliability(text, &self.checks, &bins(|check| check.direction.as_ref()));
        text.push_str("\nFalse alarms on simulated sea without ships:\n\n");
        text.push_str("| sea | images | km² | sure detections | per 1,000 km² | at most (95 %) |\n| --- | --- | --- | --- | --- | --- |\n");
        let all = [("all".to_owned(), self.empty)];
        for (name, sea) in all
            .iter()
            .chain(&self.by_wind)
            .chain(&self.by_sensor)
            .chain(&self.by_slicks)
        {
            let _ = writeln!(
                text,
                "| {name} | {} | {:.0} | {} | {:.2} | {:.2} |",
                sea.images,
                sea.area,
                sea.false_alarms,
                sea.rate(),
                sea.most()
            );
        }
    }
}

/// Writes the figures of both probabilities, one row per set of images.
fn summary(text: &mut String, checks: &[Check]) {
    text.push_str("| images | probability of | detections | calibration error | Brier | Brier of a constant |\n| --- | --- | --- | --- | --- | --- |\n");
    for check in checks {
        for (kind, found) in [("a wake", &check.wake), ("its direction", &check.direction)] {
            let Some(found) = found else { continue };
            let _ = writeln!(
                text,
                "| {} | {kind} | {} | {:.3} | {:.4} | {:.4} |",
                check.name,
                found.count,
                found.calibration_error,
                found.brier,
                found.brier_of_constant
            );
        }
    }
}

/// Writes a table with a column per set of images: mean probability, observed share, and count.
fn reliability(text: &mut String, checks: &[Check], found: &[Option<&Reliability>]) {
    let names: Vec<&str> = checks.iter().map(|check| check.name.as_str()).collect();
    let _ = writeln!(
        text,
        "| probability | {} |\n| --- |{}",
        names.join(" | "),
        " --- |".repeat(names.len())
    );
    for bin in 0..10 {
        let cell = |found: &Option<&Reliability>| match found.map(|found| found.bins[bin]) {
            Some(bin) if bin.count > 0 => {
                format!("{:.2}: {:.2} of {}", bin.predicted, bin.observed, bin.count)
            }
            _ => "–".to_owned(),
        };
        let cells: Vec<String> = found.iter().map(cell).collect();
        let _ = writeln!(
            text,
            "| {:.1} to {:.1} | {} |",
            bin as f64 / 10.0,
            (bin + 1) as f64 / 10.0,
            cells.join(" | ")
        );
    }
}

impl Tiles {
    fn write(&self, text: &mut String) {
        let range = |range: Option<[f64; 2]>| {
            range.map_or("–".to_owned(), |[a, b]| format!("{a:.3} to {b:.3}"))
        };
        let _ = write!(
            text,
            "\n## Real tiles\n\nSure detections find {4} of {5} clear and probable wakes on {0} real tiles ({1:.1} megapixels of unknown \
             spacing), with {6} false alarms ({7:.2} a megapixel; {8:.1} per 1,000 km² if pixels are 10 m). Doubtful wakes are ignored; \
             nothing was fitted on the tiles. 95 % bootstrap intervals over them: calibration error {2}, Brier score minus that of a \
             constant {3}.\n\n",
            self.count,
            self.megapixels,
            range(self.calibration_error),
            range(self.brier_less_constant),
            self.found[0],
            self.found[1],
            self.false_alarms,
            self.false_alarms as f64 / self.megapixels,
            self.false_alarms as f64 / (self.megapixels * 100.0) * 1e3,
        );
        let checks = std::slice::from_ref(&self.check);
        summary(text, checks);
        text.push_str("\nReliability of `probability`:\n\n");
        reliability(text, checks, &[self.check.wake.as_ref()]);
        text.push_str("\nReliability of `direction_probability`:\n\n");
        reliability(text, checks, &[self.check.direction.as_ref()]);
    }
}
