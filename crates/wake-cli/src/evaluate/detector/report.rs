//! Report of `wake evaluate detector`.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};

use wake_detector::score::{Curve, Judged, Rule};
use wake_train::detector::judging::bootstrap;
use whole_files::write_atomically;

use super::recall::{FALSE_ALARMS, Recall};
use super::{plot, real_sea};
use crate::exit::Outcome;

/// Figures, one row per detector and set of images.
#[derive(Default)]
pub(crate) struct Report {
    pub(crate) rows: Vec<Value>,
    /// Names of other trainings.
    pub(crate) rungs: Vec<String>,
    /// Names of trainings of which each tile was left out in turn.
    pub(crate) left_out: Vec<String>,
    /// Accuracies of the two-sample test.
    pub(crate) sea: Vec<Value>,
    /// Recall by visibility.
    pub(crate) visibility: Recall,
    /// Recall by sensor, wind and heading.
    pub(crate) scenes: Recall,
    /// Recall by kind of painted wakes.
    pub(crate) kinds: Recall,
}

/// An interval as text.
fn range(interval: &Value) -> String {
    match (interval[0].as_f64(), interval[1].as_f64()) {
        (Some(low), Some(high)) => format!("{low:.2} to {high:.2}"),
        _ => "–".to_owned(),
    }
}

impl Report {
    /// Adds a row.
    pub(crate) fn add(&mut self, set: &str, finder: &str, images: &[Judged]) {
        let (rays, boxes) = (Curve::new(images, Rule::Ray), Curve::new(images, Rule::Box));
        let (right, wrong) = rays.totals();
        let (recall, score) = rays.recall_at(FALSE_ALARMS).unwrap_or_default();
        let interval = bootstrap(images, |drawn| {
            Curve::new(drawn, Rule::Ray).average_precision()
        });
        self.rows.push(json!({
            "images": set, "finder": finder, "count": images.len(), "wakes": rays.labels,
            "average_precision": rays.average_precision(), "interval": interval, "average_precision_boxes": boxes.average_precision(),
            "recall_at_half_false_alarm": recall, "at_score": Some(score).filter(|s| s.is_finite()),
            "right": right, "false_alarms": wrong,
        }));
    }

    /// Writes `report.json`, `report.md`, `recall.csv` and, with other trainings, `transfer.svg` into a folder.
    pub(crate) fn write(&self, folder: &Path) -> Outcome<()> {
        let rows = format!("{:#}\n", json!({"rows": self.rows, "sea": self.sea}));
        let recall = format!(
            "images,by,range,found by,recall,wakes\n{}{}{}",
            self.visibility.csv, self.scenes.csv, self.kinds.csv
        );
        let files = [
            ("report.json", rows),
            ("report.md", self.text()),
            ("recall.csv", recall),
        ];
        for (name, text) in files {
            write_atomically(&folder.join(name), text.as_bytes())?;
        }
        let dots = self.dots();
        if !dots.is_empty() {
            plot::transfer(&folder.join("transfer.svg"), &dots)?;
        }
        Ok(())
    }

    /// The row of a set of images and a detector.
    fn row(&self, images: &str, finder: &str) -> Option<&Value> {
        let found = |row: &&Value| row["images"] == images && row["finder"] == finder;
        self.rows.iter().find(found)
    }

    /// Average precision on simulated and on real images, of other trainings and of the network.
    fn dots(&self) -> Vec<(String, [f64; 2])> {
        let finders = self.rungs.iter().map(String::as_str).chain(["network"]);
        let dot = |finder: &str| {
            let of = |images| self.row(images, finder)?["average_precision"].as_f64();
            let simulated = of("satellites, above 1 dB")?;
            Some((finder.to_owned(), [simulated, of("real, clear wakes")?]))
        };
        match self.rungs.is_empty() {
            true => Vec::new(),
            false => finders.filter_map(dot).collect(),
        }
    }

    /// The first paragraph: the results.
    fn lead(&self) -> String {
        // Images without any wake have no average precision.
        let judged = |row: &&Value| row["average_precision"].is_number();
        let row = |images, finder| self.row(images, finder).filter(judged);
        let pair = |images| Some([row(images, "network")?, row(images, "Radon")?]);
        let number = |row: &Value, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        let precisions = |rows: [&Value; 2]| rows.map(|row| number(row, "average_precision"));
        let mut text = String::new();
        if let Some(rows) = pair("real, clear wakes") {
            let [network, radon] = precisions(rows);
            let [found, classical] = rows.map(|row| number(row, "recall_at_half_false_alarm"));
            // Writing into a string cannot fail.
            let _ = write!(
                text,
                "On {} real tiles with {} clear wakes the network has an average precision of {network:.2} (95 %: {}) and, at half \
                 a false alarm per image, a recall of {found:.2}; a classical Radon transform has {radon:.2} and {classical:.2}. ",
                rows[0]["count"],
                rows[0]["wakes"],
                range(&rows[0]["interval"]),
            );
        }
        if let Some(rows) = pair("satellites") {
            let [network, radon] = precisions(rows);
            let _ = write!(
                text,
                "On {} simulated images with {} visible wakes, average precision is {network:.2} (Radon transform: {radon:.2}). ",
                rows[0]["count"], rows[0]["wakes"],
            );
        }
        text.trim_end().to_owned()
    }

    pub(crate) fn text(&self) -> String {
        let count = self.rows.first().and_then(|row| row["count"].as_u64());
        let count = count.unwrap_or(0);
        let rungs = match self.rungs.is_empty() {
            true => "",
            false => " --rung NAME=FILE …",
        };
        let (left_out, meaning) = match self.left_out.is_empty() {
            true => ("", String::new()),
            false => (
                " --left-out NAME=DIR …",
                format!(
                    "- {}: each tile searched by a network that was not trained on it ([few labels](../detector.md#a-few-labels))\n",
                    self.left_out.join(", ")
                ),
            ),
        };
        let mut text = format!(
            "<!-- Written by: wake evaluate detector --images {count} --real DIR{rungs}{left_out} -->\n\n# Finding wakes\n\n{}\n\n\
             - AP: average precision by the ray rule: axis within 10°; tip within 60 pixels, or axis line within 25 pixels of the \
             label's tip and middle\n\
             - 95 %: interval of AP by bootstrap over the images\n\
             - AP boxes: average precision of oriented boxes from the tip to the visible end, IoU 0.5\n\
             - Recall: at half a false alarm per image, which the last column's score allows\n{meaning}\n\
             | images | number | wakes | found by | AP | 95 % | AP boxes | recall | at score |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
            self.lead()
        );
        let number = |value: &Value| value.as_f64().map_or("–".to_owned(), |x| format!("{x:.3}"));
        let told = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let of_rung = |row: &&Value| self.rungs.iter().any(|rung| row["finder"] == **rung);
        for row in self.rows.iter().filter(|row| !of_rung(row)) {
            // Writing into a string cannot fail.
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                told(&row["images"]),
                row["count"],
                row["wakes"],
                told(&row["finder"]),
                number(&row["average_precision"]),
                range(&row["interval"]),
                number(&row["average_precision_boxes"]),
                number(&row["recall_at_half_false_alarm"]),
                number(&row["at_score"]),
            );
        }
        text.push_str(
            "\n## Recall by visibility\n\nBy [contrast](../labels.md#visibility) of simulated wakes and matched-filter signal-to-noise ratio \
             of painted ones. All detectors: [`detector_recall.csv`](detector_recall.csv).\n",
        );
        text.push_str(&self.visibility.text);
        text.push_str(
            "\n## Recall by scene\n\nBy sensor, wind, and angle between wake and flight (0°: the ship sails along the flight).\n",
        );
        text.push_str(&self.scenes.text);
        text.push_str(
            "\n## Recall by kind\n\nBy the line painted along the axis of a wake. All but the last kind may also have arms at 10 to 20°, fainter ones beside a bright line.\n",
        );
        text.push_str(&self.kinds.text);
        if !self.rungs.is_empty() {
            text.push_str(&self.transfer());
        }
        if !self.sea.is_empty() {
            text.push_str(&real_sea::table(&self.sea));
        }
        text
    }

    /// Table of average precision by training images, one column per set of images.
    fn transfer(&self) -> String {
        let mut sets: Vec<&Value> = Vec::new();
        for row in &self.rows {
            if !sets.contains(&&row["images"]) {
                sets.push(&row["images"]);
            }
        }
        let name = |set: &&&Value| set.as_str().unwrap_or_default().to_owned();
        let titles: Vec<String> = sets.iter().map(|set| name(&set)).collect();
        let mut text = format!(
            "\n## What transfer needs\n\nThe same network trained on other images: AP (and recall).\n\n\
             ![Average precision on real tiles and on simulated images, by training images](detector_transfer.svg)\n\n\
             | trained on | {} |\n| --- |{}\n",
            titles.join(" | "),
            " --- |".repeat(titles.len()),
        );
        for rung in &self.rungs {
            let cell = |set: &&Value| {
                let found = |row: &&Value| row["finder"] == **rung && row["images"] == **set;
                self.rows.iter().find(found).map_or("–".to_owned(), |row| {
                    let number = |key: &str| row[key].as_f64().unwrap_or(0.0);
                    let (precision, recall) = (
                        number("average_precision"),
                        number("recall_at_half_false_alarm"),
                    );
                    format!("{precision:.3} ({recall:.2})")
                })
            };
            let cells: Vec<String> = sets.iter().map(cell).collect();
            // Writing into a string cannot fail.
            let _ = writeln!(text, "| {rung} | {} |", cells.join(" | "));
        }
        text
    }
}
