//! Rules that match detections with labels, and the resulting recall, precision and average precision.
//!
//! *Ray rule*: the axes differ by at most 10°, and the tips lie within 60 pixels of each other, or the detected axis passes
//! within 25 pixels of the labelled tip and of the middle of the labelled ray. *Box rule*: the boxes, cut to the image, have
//! an intersection over union of at least 0.5. Detections are matched in descending order of score, one per label; a second
//! detection of a label is a false alarm. A detection that fits an ignored label best is neither right nor wrong.

use crate::wake::{Detection, Wake};

/// Bounds of the rules: angle \[deg\], distance of tips and of lines \[pixels\], intersection over union.
const TURN: f64 = 10.0;
const TIP: f64 = 60.0;
const LINE: f64 = 25.0;
const SHARE: f64 = 0.5;

/// A position in an image: (column, row), with whole numbers at the centres of pixels.
pub type Point = [f64; 2];

/// A ray and a box, as the rules use them.
#[derive(Debug, Clone, PartialEq)]
pub struct Ray {
    /// Where the wake begins.
    pub tip: Point,
    /// Direction from the tip along the wake [deg clockwise from the image's up].
    pub axis_deg: f64,
    /// Corners in order around the box; a ray without one never matches by the box rule.
    pub oriented_box: Option<[Point; 4]>,
}

/// A known wake.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Where it is.
    pub ray: Ray,
    /// Visible length \[pixels\].
    pub length: f64,
    /// Whether it counts; other labels are ignored.
    pub counts: bool,
    /// Whether either end may be its tip.
    pub ambiguous: bool,
}

/// A detection, as the rules use it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Score; higher is more certain.
    pub score: f64,
    /// Where it is.
    pub ray: Ray,
}

impl From<&Wake> for Ray {
    fn from(wake: &Wake) -> Self {
        let corners = wake.oriented_box();
        Self {
            tip: wake.tip.map(f64::from),
            axis_deg: f64::from(wake.axis_deg),
            oriented_box: Some(corners.map(|corner| corner.map(f64::from))),
        }
    }
}

impl From<&Detection> for Found {
    fn from(one: &Detection) -> Self {
        Self {
            score: f64::from(one.score),
            ray: Ray::from(&one.wake),
        }
    }
}

/// Labels and detections of one image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judged {
    /// Number of columns.
    pub columns: f64,
    /// Number of rows.
    pub rows: f64,
    /// Known wakes.
    pub labels: Vec<Label>,
    /// Detections.
    pub found: Vec<Found>,
}

impl Judged {
    /// The same image with new detections.
    #[must_use]
    pub fn with_found(&self, found: &[Detection]) -> Self {
        Self {
            found: found.iter().map(Found::from).collect(),
            ..self.clone()
        }
    }
}

/// Rule by which a detection matches a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Axes and tips.
    Ray,
    /// Intersection over union of boxes.
    Box,
}

/// Outcome for one detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Index of the image.
    pub image: usize,
    /// Index of the detection in it.
    pub detection: usize,
    /// Score of the detection.
    pub score: f64,
    /// Index of the matched label; `None` for a false alarm.
    pub label: Option<usize>,
}

/// Returns the verdicts on all detections that are right or wrong, in descending order of score.
#[must_use]
pub fn verdicts(images: &[Judged], rule: Rule) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    for (image, judged) in images.iter().enumerate() {
        let mut order: Vec<usize> = (0..judged.found.len()).collect();
        order.sort_by(|&a, &b| judged.found[b].score.total_cmp(&judged.found[a].score));
        let mut taken = vec![false; judged.labels.len()];
        for detection in order {
            let found = &judged.found[detection];
            let mut fits = Vec::new();
            let mut ignored = f64::INFINITY;
            for (i, label) in judged.labels.iter().enumerate() {
                if label.counts {
                    fits.extend(cost(rule, judged, &found.ray, label).map(|cost| (cost, i)));
                } else {
                    // A match by the other rule alone counts as a worse fit.
                    let other = match rule {
                        Rule::Ray => Rule::Box,
                        Rule::Box => Rule::Ray,
                    };
                    let far = || cost(other, judged, &found.ray, label).map(|cost| cost + 10.0);
                    ignored = cost(rule, judged, &found.ray, label)
                        .or_else(far)
                        .unwrap_or(f64::INFINITY)
                        .min(ignored);
                }
            }
            fits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if ignored < fits.first().map_or(f64::INFINITY, |fit| fit.0) {
                continue;
            }
            let label = fits.into_iter().map(|(_, i)| i).find(|&i| !taken[i]);
            if let Some(i) = label {
                taken[i] = true;
            }
            verdicts.push(Verdict {
                image,
                detection,
                score: found.score,
                label,
            });
        }
    }
    verdicts.sort_by(|a, b| b.score.total_cmp(&a.score));
    verdicts
}

/// Precision and recall at each score threshold.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Number of labels that count.
    pub labels: usize,
    /// Number of images.
    pub images: usize,
    /// Score, and right detections and false alarms at or above it, in descending order of score.
    steps: Vec<(f64, usize, usize)>,
}

impl Curve {
    /// Computes the curve of a set of images.
    #[must_use]
    pub fn new(images: &[Judged], rule: Rule) -> Self {
        let mut steps: Vec<(f64, usize, usize)> = Vec::new();
        let (mut right, mut wrong) = (0, 0);
        for verdict in verdicts(images, rule) {
            if verdict.label.is_some() {
                right += 1;
            } else {
                wrong += 1;
            }
            match steps.last_mut() {
                // Detections of equal score form one step.
                Some(last) if last.0.total_cmp(&verdict.score).is_eq() => {
                    (last.1, last.2) = (right, wrong);
                }
                _ => steps.push((verdict.score, right, wrong)),
            }
        }
        let counted = |image: &Judged| image.labels.iter().filter(|label| label.counts).count();
        Self {
            labels: images.iter().map(counted).sum(),
            images: images.len(),
            steps,
        }
    }

    /// Average precision: area under the largest precision at each recall or above; `None` without labels.
    ///
    /// # References
    ///
    /// Everingham et al. (2010), "The Pascal Visual Object Classes (VOC) Challenge", in its later form over
    /// all steps of recall.
    #[must_use]
    pub fn average_precision(&self) -> Option<f64> {
        let labels = self.labels as f64;
        let mut best = 0.0f64;
        let mut area = 0.0;
        for (k, &(_, right, wrong)) in self.steps.iter().enumerate().rev() {
            best = best.max(right as f64 / (right + wrong) as f64);
            let before = if k == 0 { 0 } else { self.steps[k - 1].1 };
            area += (right - before) as f64 / labels * best;
        }
        (self.labels > 0).then_some(area)
    }

    /// Largest recall with at most this many false alarms per image, and its score threshold; `None` without labels.
    #[must_use]
    pub fn recall_at(&self, false_alarms: f64) -> Option<(f64, f64)> {
        let allowed = |&&(_, _, wrong): &&(f64, usize, usize)| {
            wrong as f64 <= false_alarms * self.images as f64
        };
        let step = self.steps.iter().rfind(allowed);
        (self.labels > 0).then(|| {
            step.map_or((0.0, f64::INFINITY), |s| {
                (s.1 as f64 / self.labels as f64, s.0)
            })
        })
    }

    /// Total numbers of right detections and false alarms.
    #[must_use]
    pub fn totals(&self) -> (usize, usize) {
        self.steps.last().map_or((0, 0), |step| (step.1, step.2))
    }
}

/// Counts detected wakes by a property of each label, at the score threshold for a number of false alarms per image.
///
/// - `value`: property of a label that counts, by the index of its image and its index in the image
/// - `bounds`: ascending; bin k holds the values from bound k to below bound k + 1
///
/// # Shapes
///
/// For each bin, the number of wakes found and the number of wakes that count.
#[must_use]
pub fn found_by(
    images: &[Judged],
    rule: Rule,
    false_alarms: f64,
    bounds: &[f64],
    value: impl Fn(usize, usize) -> f64,
) -> Vec<[usize; 2]> {
    let bin = |image: usize, label: usize| {
        let value = value(image, label);
        bounds
            .windows(2)
            .position(|b| (b[0]..b[1]).contains(&value))
    };
    let mut counts = vec![[0; 2]; bounds.len().saturating_sub(1)];
    for (image, judged) in images.iter().enumerate() {
        for label in (0..judged.labels.len()).filter(|&label| judged.labels[label].counts) {
            if let Some(bin) = bin(image, label) {
                counts[bin][1] += 1;
            }
        }
    }
    let least = Curve::new(images, rule)
        .recall_at(false_alarms)
        .map_or(f64::INFINITY, |(_, least)| least);
    for verdict in verdicts(images, rule).iter().filter(|v| v.score >= least) {
        if let Some(bin) = verdict.label.and_then(|label| bin(verdict.image, label)) {
            counts[bin][0] += 1;
        }
    }
    counts
}

/// Misfit of a detection to a label; `None` if they do not match.
fn cost(rule: Rule, image: &Judged, ray: &Ray, label: &Label) -> Option<f64> {
    match rule {
        Rule::Ray => ray_cost(ray, label),
        Rule::Box => {
            let (a, b) = (ray.oriented_box.as_ref()?, label.ray.oriented_box.as_ref()?);
            let share = shared(a, b, [image.columns, image.rows]);
            (share >= SHARE).then_some(1.0 - share)
        }
    }
}

fn ray_cost(ray: &Ray, label: &Label) -> Option<f64> {
    let forward = fit(ray, label.ray.tip, label.ray.axis_deg, label.length);
    if !label.ambiguous {
        return forward;
    }
    let [dx, dy] = unit(label.ray.axis_deg);
    let end = [
        label.ray.tip[0] + dx * label.length,
        label.ray.tip[1] + dy * label.length,
    ];
    let backward = fit(ray, end, label.ray.axis_deg + 180.0, label.length);
    [forward, backward]
        .into_iter()
        .flatten()
        .min_by(f64::total_cmp)
}

/// Misfit of a ray to another; `None` if they do not match.
fn fit(ray: &Ray, tip: Point, axis_deg: f64, length: f64) -> Option<f64> {
    let turn = ((ray.axis_deg - axis_deg + 180.0).rem_euclid(360.0) - 180.0).abs();
    if turn > TURN {
        return None;
    }
    let apart = (ray.tip[0] - tip[0]).hypot(ray.tip[1] - tip[1]);
    let [dx, dy] = unit(axis_deg);
    let middle = [tip[0] + dx * length / 2.0, tip[1] + dy * length / 2.0];
    let beside = |p: Point| {
        let [dx, dy] = unit(ray.axis_deg);
        ((p[0] - ray.tip[0]) * -dy + (p[1] - ray.tip[1]) * dx).abs()
    };
    let off = beside(tip).max(beside(middle));
    (apart <= TIP || off <= LINE).then(|| (apart / TIP).min(1.0 + off / LINE) + turn / TURN)
}

fn unit(degrees: f64) -> Point {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sin, -cos]
}

/// Intersection over union of two boxes, both cut to an image.
fn shared(a: &[Point; 4], b: &[Point; 4], [columns, rows]: Point) -> f64 {
    let frame = [[0.0, 0.0], [columns, 0.0], [columns, rows], [0.0, rows]];
    let (a, b) = (clipped(a, &frame), clipped(b, &frame));
    if a.len() < 3 || b.len() < 3 {
        return 0.0;
    }
    let common = area(&clipped(&a, &b)).abs();
    let union = area(&a).abs() + area(&b).abs() - common;
    if union > 0.0 { common / union } else { 0.0 }
}

/// Signed area of a polygon, by the shoelace formula.
fn area(polygon: &[Point]) -> f64 {
    let corners = polygon.iter().zip(polygon.iter().cycle().skip(1));
    corners.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>() / 2.0
}

/// Clips a convex polygon by another.
///
/// # References
///
/// Sutherland & Hodgman (1974), "Reentrant Polygon Clipping".
fn clipped(polygon: &[Point], cutter: &[Point]) -> Vec<Point> {
    let turn = area(cutter).signum();
    let mut left = polygon.to_vec();
    for (a, b) in cutter.iter().zip(cutter.iter().cycle().skip(1)) {
        let side =
            |p: &Point| turn * ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]));
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (i, q) in left.iter().enumerate() {
            let p = &left[(i + left.len() - 1) % left.len()];
            let (sp, sq) = (side(p), side(q));
            if (sp >= 0.0) != (sq >= 0.0) {
                let t = sp / (sp - sq);
                kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
            if sq >= 0.0 {
                kept.push(*q);
            }
        }
        left = kept;
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn boxes_share_what_geometry_says() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        let frame = [20.0, 20.0];
        let half = [[5.0, 0.0], [5.0, 10.0], [15.0, 10.0], [15.0, 0.0]];
        let r = 5.0 * 2f64.sqrt();
        let turned = [
            [5.0, 5.0 - r],
            [5.0 + r, 5.0],
            [5.0, 5.0 + r],
            [5.0 - r, 5.0],
        ];
        let far = half.map(|[x, y]| [x + 30.0, y]);
        // A square and the same square turned by 45° share an octagon of 2√2 − 2 of its area, if the image cuts nothing off.
        let inner = |p: [Point; 4]| p.map(|[x, y]| [x + 5.0, y + 5.0]);
        let octagon = 2.0 * 2f64.sqrt() - 2.0;
        assert!((shared(&square, &square, frame) - 1.0).abs() < 1e-12);
        assert!((shared(&square, &half, frame) - 1.0 / 3.0).abs() < 1e-12);
        assert!(
            (shared(&inner(square), &inner(turned), frame) - octagon / (2.0 - octagon)).abs()
                < 1e-12
        );
        assert!(shared(&square, &far, [100.0, 100.0]).abs() < 1e-12);
    }

    /// A ray far from the tip fits by its distance from the label's tip and middle, worked out by hand.
    #[test]
    fn a_ray_from_the_middle_of_a_line_fits() {
        let ray = Ray {
            tip: [0.0, 0.0],
            axis_deg: 90.0,
            oriented_box: None,
        };
        // The middle lies 50 sin 5° = 4.358 lower than the tip.
        let found = fit(&ray, [200.0, 10.0], 95.0, 100.0).expect("a fit");
        assert!(
            (found - (1.0 + 14.357787 / 25.0 + 0.5)).abs() < 1e-6,
            "{found}"
        );
        assert_eq!(fit(&ray, [200.0, 10.0], 95.0, 400.0), None);
        assert_eq!(fit(&ray, [200.0, 10.0], 101.0, 100.0), None);
        let near = fit(&ray, [30.0, 40.0], 90.0, 100.0).expect("tips are near");
        assert!((near - 50.0 / 60.0).abs() < 1e-12);
    }

    fn ray(value: &Value) -> Ray {
        let number = |v: &Value| v.as_f64().expect("a number");
        let point = |v: &Value| [number(&v[0]), number(&v[1])];
        let corners = value["oriented_box"].as_array();
        Ray {
            tip: point(&value["tip"]),
            axis_deg: number(&value["axis_deg"]),
            oriented_box: corners.map(|c| [0, 1, 2, 3].map(|k| point(&c[k]))),
        }
    }

    /// Compares with a scorer in Python on random labels and detections, including ties and ignored labels.
    #[test]
    fn scores_are_those_of_the_scorer_in_python() {
        let text = include_str!("../../../tests/fixtures/own/detector_scores.json");
        let cases: Value = serde_json::from_str(text).expect("JSON");
        let cases = cases["cases"].as_array().expect("cases");
        assert!(cases.len() >= 8);
        for (k, case) in cases.iter().enumerate() {
            for wanted in ["clear", "clear+probable"] {
                let images = case["images"]
                    .as_array()
                    .expect("images")
                    .iter()
                    .map(|image| Judged {
                        columns: image["width"].as_f64().expect("a width"),
                        rows: image["height"].as_f64().expect("a height"),
                        labels: image["wakes"]
                            .as_array()
                            .expect("wakes")
                            .iter()
                            .map(|wake| Label {
                                ray: ray(wake),
                                length: wake["length_px"].as_f64().expect("a length"),
                                counts: wanted.split('+').any(|c| wake["confidence"] == c),
                                ambiguous: wake["direction_ambiguous"].as_bool().unwrap_or(false),
                            })
                            .collect(),
                        found: image["detections"]
                            .as_array()
                            .expect("detections")
                            .iter()
                            .map(|found| Found {
                                score: found["score"].as_f64().expect("a score"),
                                ray: ray(found),
                            })
                            .collect(),
                    });
                let images: Vec<Judged> = images.collect();
                let expected = &case["expected"][wanted];
                let number = |key: &str| expected[key].as_f64().expect("a number");
                let rays = Curve::new(&images, Rule::Ray);
                let boxes = Curve::new(&images, Rule::Box);
                let found = rays.average_precision().expect("labels");
                // Sums of some hundred numbers below 1, in another order.
                assert!(
                    (found - number("ap")).abs() < 1e-12,
                    "case {k}, {wanted}: {found}"
                );
                assert!(
                    (boxes.average_precision().expect("labels") - number("ap50")).abs() < 1e-12,
                    "case {k}, {wanted}"
                );
                assert_eq!(
                    rays.totals(),
                    (number("right") as usize, number("false_alarms") as usize),
                    "case {k}"
                );
            }
        }
    }

    #[test]
    fn recall_at_a_rate_is_read_off_the_curve() {
        let curve = Curve {
            labels: 4,
            images: 2,
            steps: vec![(0.9, 1, 0), (0.8, 2, 1), (0.5, 2, 3), (0.4, 3, 3)],
        };
        assert_eq!(curve.recall_at(0.5), Some((0.5, 0.8)));
        assert_eq!(curve.recall_at(0.0), Some((0.25, 0.9)));
        assert_eq!(curve.recall_at(2.0), Some((0.75, 0.4)));
        // Envelope of precision: 1, 2/3, 1/2 over recall ¼, ½, ¾.
        let area = 0.25 * (1.0 + 2.0 / 3.0 + 0.5);
        assert!((curve.average_precision().expect("labels") - area).abs() < 1e-12);
    }

    /// Of three wakes with values 1, 2 and 5, the ones with 1 and 5 score above a false alarm, and the one with 2 below it.
    #[test]
    fn wakes_are_counted_by_what_they_are_like() {
        let ray = |x: f64| Ray {
            tip: [x, 100.0],
            axis_deg: 0.0,
            oriented_box: None,
        };
        let label = |x: f64| Label {
            ray: ray(x),
            length: 90.0,
            counts: true,
            ambiguous: false,
        };
        let found = |x: f64, score: f64| Found { score, ray: ray(x) };
        let image = Judged {
            columns: 2000.0,
            rows: 200.0,
            labels: vec![label(100.0), label(600.0), label(1100.0)],
            found: vec![
                found(1100.0, 0.9),
                found(100.0, 0.8),
                found(1700.0, 0.7),
                found(600.0, 0.6),
            ],
        };
        let value = |_, label: usize| [1.0, 2.0, 5.0][label];
        let images = [image];
        let count = |false_alarms| {
            found_by(
                &images,
                Rule::Ray,
                false_alarms,
                &[0.0, 2.0, 4.0, 8.0],
                value,
            )
        };
        assert_eq!(count(0.5), [[1, 1], [0, 1], [1, 1]]);
        assert_eq!(count(1.0), [[1, 1], [1, 1], [1, 1]]);
    }
}
