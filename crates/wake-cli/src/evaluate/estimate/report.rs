//! Report of `wake evaluate estimate`.

use std::fmt::Write;

use serde::Serialize;
use wake_train::evaluation::{AbsoluteErrors, EstimateRow, EstimatedImage};

use super::lines::Line;
use super::sets::Set;

/// Constant guess of the speed, the middle of the paper's range \[m/s\]: the baseline.
const MIDDLE: f64 = 9.0;

/// Figures of all sets.
#[derive(Serialize)]
pub(super) struct Report {
    sets: Vec<Figures>,
}

/// Figures of one set.
#[derive(Serialize)]
struct Figures {
    set: &'static str,
    about: &'static str,
    images: usize,
    identifiable: usize,
    /// Identifiable images whose speed is wrong by more than 10 %, or whose heading by more than 5 degrees.
    wrong: usize,
    /// Images whose bound of the speed is below a tenth of the paper's range, and identifiable ones among them.
    tellable: [usize; 2],
    /// Median of the largest misfit of the residual spectrum, as a factor.
    misfit: f64,
    /// Median seconds of an estimate, times its threads.
    seconds: f64,
    /// Errors by value; real tiles have a true value of the heading only.
    rows: Vec<EstimateRow>,
    /// Errors of heading and speed from `measure` on the same images.
    measured: [AbsoluteErrors; 2],
    /// Errors of the sighting's heading, and of the constant guess of the speed.
    guessed: [AbsoluteErrors; 2],
    /// Images and identifiable ones by range of incidence \[deg\] and of speed \[m/s\].
    by_incidence: Vec<Part>,
    by_speed: Vec<Part>,
}

/// Images within a range.
#[derive(Serialize)]
struct Part {
    from: f64,
    to: f64,
    images: usize,
    identifiable: usize,
}

/// Largest bound of the speed that counts as informative: a tenth of the paper's range of 6 to 12 m/s \[m/s\].
const TELLING: f64 = 0.6;

/// Fewest identifiable images for which a set has a table of errors.
const FEWEST: usize = 5;

/// Limits of the ranges.
const INCIDENCES: [f64; 5] = [0.0, 20.0, 22.0, 28.0, 90.0];
const SPEEDS: [f64; 5] = [0.0, 6.6, 8.0, 10.0, 30.0];

/// Largest relative error of a correct speed, and largest error of a correct heading \[deg\].
const RIGHT: (f64, f64) = (0.1, 5.0);

impl Report {
    pub(super) fn of(sets: &[Set], lines: &[Line]) -> Self {
        let figures = |set: &Set| {
            let of_set = lines.iter().filter(|line| line.set == set.name);
            let mut images: Vec<EstimatedImage> = of_set.map(|l| l.estimate.clone()).collect();
            images.retain(|image| image.index < set.count);
            Figures::of(set, &images)
        };
        Self {
            sets: sets.iter().map(figures).collect(),
        }
    }

    pub(super) fn markdown(&self) -> String {
        let mut text =
            "<!-- Written by: wake evaluate estimate -->\n\n# Estimates of ship and wind, evaluated\n\n".to_owned();
        if let Some(paper) = self.sets.first() {
            paper.lead(&mut text);
        }
        text.push_str(
            "| set | images | identifiable | of these wrong | speed: median error | heading: median error | misfit | thread seconds |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        );
        for figures in &self.sets {
            figures.summarise(&mut text);
        }
        self.parts_of_error(&mut text);
        text.push_str(
            "\n- Wrong: speed off by more than 10 %, heading off by more than 5 degrees, or no ship in the image.\n\
             - Misfit: largest factor between the spectra of residual and model (median); a wrong assumption should raise it.\n\
             - Thread seconds: elapsed seconds times threads; other work on the machine adds to them.\n\
             - Sighting: place and heading have errors of 60 m along each axis and 3 degrees (standard deviations, clipped at two).\n\
             - Tuning: constants of the search on the first twelve of the paper's scenes, factors on the deviations on others.\n\
             - Tables of errors: identifiable images of sets with at least five. A Gaussian has 68 %, 95 % and 100 % within 1, 2 and 3 deviations.\n\
             - Ranks: images by tenths of Φ(error/deviation), equally many for exact error bars.\n",
        );
        for figures in &self.sets {
            figures.write(&mut text);
        }
        text
    }

    /// Writes how much search, mean image and noise model contribute to the errors.
    fn parts_of_error(&self, text: &mut String) {
        let parts = [
            ("paper", "nothing"),
            ("from the truth", "search"),
            ("right mean", "search and mean image"),
            ("right model", "search, mean image and noise"),
        ];
        let figures =
            parts.map(|(set, known)| (self.sets.iter().find(|one| one.set == set), known));
        if figures.iter().any(|(set, _)| set.is_none()) {
            return;
        }
        text.push_str(
            "\nSources of error, removed one by one: start at the true scene (no search); the model's own mean image under a simulated sea; \
             images drawn from the model.\n\n\
             | removed | identifiable | speed: within 1, 2 deviations | speed: squared error over bound | heading: within 1, 2 deviations | heading: squared error over bound |\n\
             | --- | --- | --- | --- | --- | --- |\n",
        );
        for (set, known) in figures {
            let Some(set) = set else { continue };
            let of = |quantity| {
                let row = set.row(quantity);
                let within = row.and_then(|row| row.within);
                let within = within.map_or("–".to_owned(), |[one, two, _]| {
                    format!("{:.0} %, {:.0} %", 100.0 * one, 100.0 * two)
                });
                format!("{within} | {}", shown(row.and_then(|row| row.over_bound)))
            };
            let (speed, heading) = (of("speed"), of("heading"));
            let (count, images) = (set.identifiable, set.images);
            // Writing into a string cannot fail.
            let _ = writeln!(
                text,
                "| {known} | {count} of {images} | {speed} | {heading} |"
            );
        }
    }
}

impl Figures {
    fn of(set: &Set, images: &[EstimatedImage]) -> Self {
        let identifiable: Vec<&EstimatedImage> = images.iter().filter(|i| i.identifiable).collect();
        let is_wrong = |image: &&&EstimatedImage| {
            let off = |n: usize| {
                image
                    .values
                    .get(n)
                    .and_then(|v| v[0])
                    .unwrap_or(f64::INFINITY)
            };
            let wrong_speed = off(0).abs() > RIGHT.0 * image.speed && !set.is_real();
            set.is_empty() || wrong_speed || off(1).abs() > RIGHT.1
        };
        let median = |of: fn(&EstimatedImage) -> f64| {
            let mut values: Vec<f64> = images.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        let tellable = |image: &&EstimatedImage| {
            let bound = image.values.first().and_then(|speed| speed[2]);
            bound.is_some_and(|bound| bound < TELLING)
        };
        let mut rows = EstimateRow::of_all(images);
        rows.retain(|row| !set.is_real() || row.quantity == "heading");
        let of = |error: &dyn Fn(&EstimatedImage) -> Option<f64>| {
            AbsoluteErrors::of(&images.iter().map(error).collect::<Vec<_>>())
        };
        Self {
            set: set.name,
            about: set.about,
            images: images.len(),
            identifiable: identifiable.len(),
            wrong: identifiable.iter().filter(is_wrong).count(),
            tellable: [
                images.iter().filter(tellable).count(),
                identifiable.iter().copied().filter(tellable).count(),
            ],
            misfit: median(|image| image.misfit),
            seconds: median(|image| image.seconds),
            rows: match set.is_empty() {
                true => Vec::new(),
                false => rows,
            },
            measured: [0, 1].map(|n| of(&|image| image.measured[n])),
            guessed: [
                of(&|image| Some(image.sighted.abs())),
                of(&|image| Some((image.speed - MIDDLE).abs())),
            ],
            by_incidence: parts(images, &INCIDENCES, |image| image.incidence),
            by_speed: parts(images, &SPEEDS, |image| image.speed),
        }
    }

    /// Writes the result of the set in three sentences.
    fn lead(&self, text: &mut String) {
        let [speed, heading] = [self.row("speed"), self.row("heading")];
        let (Some(speed), Some(heading)) = (speed, heading) else {
            return;
        };
        let within = |row: &EstimateRow| {
            row.within.map_or("–".to_owned(), |[one, two, _]| {
                format!("{:.0} and {:.0} %", 100.0 * one, 100.0 * two)
            })
        };
        let [tellable, told] = self.tellable;
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "Of {} simulated images of the paper's scenes, {} are [identifiable](../estimate.md), and {} of these estimates are wrong. Median errors are \
             {} m/s in speed and {} degrees in heading; {} of the speeds and {} of the headings lie within one and two reported standard deviations. \
             The Cramér–Rao bound of the speed is below {TELLING} m/s in {tellable} images, of which {told} are identifiable.\n",
            self.images,
            self.identifiable,
            self.wrong,
            shown(speed.median),
            shown(heading.median),
            within(speed),
            within(heading),
        );
    }

    /// The errors of a value, if there are any.
    fn row(&self, quantity: &str) -> Option<&EstimateRow> {
        let mut rows = self.rows.iter();
        rows.find(|row| row.quantity == quantity)
            .filter(|row| row.median.is_some())
    }

    /// Writes the row of the set in the summary table.
    fn summarise(&self, text: &mut String) {
        let of = |quantity, unit| match self.row(quantity).and_then(|row| row.median) {
            Some(median) => format!("{} {unit}", shown(Some(median))),
            None => "–".to_owned(),
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {:.2} | {:.0} |",
            self.set,
            self.images,
            self.identifiable,
            self.wrong,
            of("speed", "m/s"),
            of("heading", "degrees"),
            self.misfit,
            self.seconds
        );
    }

    /// Writes the tables of the set.
    fn write(&self, text: &mut String) {
        let _ = writeln!(text, "\n## {}\n\n{}.", self.set, sentence(self.about));
        let has_table = self.identifiable >= FEWEST && !self.rows.is_empty();
        if has_table {
            let _ = writeln!(
                text,
                "\n| {} | median error | 90th percentile | within 1, 2, 3 deviations | squared error over bound | deviation over bound | ranks |\n\
                 | --- | --- | --- | --- | --- | --- | --- |",
                self.set
            );
        }
        for row in self.rows.iter().filter(|_| has_table) {
            let within = row.within.map_or("–".to_owned(), |within| {
                within
                    .map(|share| format!("{:.0} %", 100.0 * share))
                    .join(", ")
            });
            let ranks: Vec<String> = row.ranks.iter().map(usize::to_string).collect();
            let _ = writeln!(
                text,
                "| {} | {} {} | {} | {within} | {} | {} | {} |",
                row.quantity.replace('_', " "),
                shown(row.median),
                row.unit,
                shown(row.percentile_90),
                shown(row.over_bound),
                shown(row.deviation_over_bound),
                ranks.join(" ")
            );
        }
        if self.rows.len() > 1 && has_table {
            let _ = writeln!(
                text,
                "\n| {}, without the estimate | given | median error | 90th percentile |\n| --- | --- | --- | --- |",
                self.set
            );
            let beside = [
                ("measured heading", &self.measured[0], "deg"),
                ("measured speed", &self.measured[1], "m/s"),
                ("heading of the sighting", &self.guessed[0], "deg"),
                ("speed always 9 m/s", &self.guessed[1], "m/s"),
            ];
            for (name, errors, unit) in beside {
                let _ = writeln!(
                    text,
                    "| {name} | {:.0} % | {} {unit} | {} |",
                    100.0 * errors.measurable,
                    shown(errors.median),
                    shown(errors.percentile_90)
                );
            }
            let list = |parts: &[Part], unit: &str| {
                let each = parts.iter().filter(|part| part.images > 0).map(|part| {
                    let Part {
                        from,
                        to,
                        images,
                        identifiable,
                    } = part;
                    format!("{from} to {to} {unit} {identifiable} of {images}")
                });
                each.collect::<Vec<_>>().join(", ")
            };
            let _ = writeln!(
                text,
                "\nIdentifiable by incidence: {}; by speed: {}.",
                list(&self.by_incidence, "deg"),
                list(&self.by_speed, "m/s")
            );
        }
    }
}

fn parts(
    images: &[EstimatedImage],
    limits: &[f64],
    of: impl Fn(&EstimatedImage) -> f64,
) -> Vec<Part> {
    let part = |pair: &[f64]| {
        let [from, to] = [pair[0], pair[1]];
        let inside = || {
            images
                .iter()
                .filter(|image| (from..to).contains(&of(image)))
        };
        Part {
            from,
            to,
            images: inside().count(),
            identifiable: inside().filter(|image| image.identifiable).count(),
        }
    };
    limits.windows(2).map(part).collect()
}

/// Capitalises the first letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// Formats three significant digits, or a dash.
fn shown(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| {
        let digits = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 5.0);
        format!("{value:.*}", digits as usize)
    })
}
