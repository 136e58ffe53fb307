//! Decodes the network's maps into wakes.

use crate::network::{ANGLE_UNIT, LENGTH_UNIT, Map, OUTPUTS, STRIDE};
use crate::wake::{Detection, Wake, angle_of, direction, turn};

/// Network maps of one image, `[OUTPUTS, rows, columns]`; the first two are probabilities.
#[derive(Debug, Clone)]
pub(crate) struct Maps {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    values: Vec<f32>,
}

/// Tips below this probability are ignored.
const LEAST_TIP: f32 = 0.02;
/// A tip is the maximum within this distance \[cells\].
const APART: usize = 2;
/// Largest number of tips examined per image.
const MOST_TIPS: usize = 300;
/// Largest turn of the axis from the direction at the tip, and the step of the search \[deg\]: a line that is turned more is
/// often an arm of the wake.
const TURN: f32 = 12.0;
const TURN_STEP: f32 = 1.5;
/// First part of a ray that is skipped because a ship may lie on it \[cells\].
const SKIPPED: usize = 2;
/// Added to the length in the mean along a ray, so that short rays have less support \[cells\].
const SHORT: f32 = 5.0;
/// Longest ray that is followed \[cells\].
const LONGEST: usize = 90;

impl Maps {
    /// Makes maps from the network's output, converting logits to probabilities.
    ///
    /// # Panics
    ///
    /// If there are not `OUTPUTS · rows · columns` numbers.
    pub(crate) fn new(rows: usize, columns: usize, mut values: Vec<f32>) -> Self {
        assert_eq!(
            values.len(),
            OUTPUTS * rows * columns,
            "numbers of all maps"
        );
        for logit in &mut values[..2 * rows * columns] {
            *logit = 1.0 / (1.0 + (-*logit).exp());
        }
        Self {
            rows,
            columns,
            values,
        }
    }

    /// Crops the maps to their upper left part.
    pub(crate) fn cut_to(&self, rows: usize, columns: usize) -> Self {
        let lines = self.values.chunks_exact(self.columns).enumerate();
        let inside = lines.filter(|(i, _)| i % self.rows < rows);
        let values = inside
            .flat_map(|(_, line)| &line[..columns])
            .copied()
            .collect();
        Self {
            rows,
            columns,
            values,
        }
    }

    fn map(&self, map: Map) -> &[f32] {
        let area = self.rows * self.columns;
        &self.values[map as usize * area..][..area]
    }

    /// Wakes in descending order of score.
    pub(crate) fn detections(&self) -> Vec<Detection> {
        let mut found: Vec<Detection> = self.tips().into_iter().map(|at| self.wake(at)).collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        found
    }

    /// Cells that are the maximum of their neighbourhood; of equal cells, the first.
    fn tips(&self) -> Vec<usize> {
        let tip = self.map(Map::Tip);
        let highest = |i: usize| {
            let (row, column) = (i / self.columns, i % self.columns);
            let rows = row.saturating_sub(APART)..(row + APART + 1).min(self.rows);
            let columns = column.saturating_sub(APART)..(column + APART + 1).min(self.columns);
            rows.flat_map(|r| columns.clone().map(move |c| r * self.columns + c))
                .all(|j| j == i || tip[j] < tip[i] || (j > i && tip[j] <= tip[i]))
        };
        let mut tips: Vec<usize> = (0..tip.len())
            .filter(|&i| tip[i] > LEAST_TIP && highest(i))
            .collect();
        tips.sort_by(|&a, &b| tip[b].total_cmp(&tip[a]));
        tips.truncate(MOST_TIPS);
        tips
    }

    /// The wake whose tip is in a cell, with the axis that fits the lines best near the cell's direction.
    fn wake(&self, at: usize) -> Detection {
        let cell = [(at % self.columns) as f32, (at / self.columns) as f32];
        let first = angle_of([self.map(Map::TipRight)[at], self.map(Map::TipDown)[at]]);
        let steps = (TURN / TURN_STEP) as i32;
        let rays = (-steps..=steps).map(|k| first + TURN_STEP * k as f32);
        let supports: Vec<(f32, [f32; 2])> = rays
            .map(|angle| (angle, self.support(cell, angle)))
            .collect();
        let best = |k: usize| supports.iter().map(|s| s.1[k]).fold(0.0, f32::max);
        let [support, longest] = [best(0), best(1)];
        // The axis is the mean of the rays weighted by the line along their whole length, not only its beginning.
        let (mut pull, mut total) = (0.0, 1e-6);
        for (angle, [_, whole]) in &supports {
            let weight = (whole / longest.max(1e-6)).max(0.0).powi(8);
            pull += weight * (angle - first);
            total += weight;
        }
        let centre = 0.5 * (STRIDE as f32 - 1.0);
        let length = LENGTH_UNIT * self.map(Map::Length)[at].clamp(-3.0, 2.5).exp();
        let axis_deg = (first + pull / total).rem_euclid(360.0) % 360.0;
        let wake = Wake {
            tip: cell.map(|x| STRIDE as f32 * x + centre),
            axis_deg,
            half_angle_deg: (ANGLE_UNIT * self.map(Map::HalfAngle)[at]).clamp(0.0, 30.0),
            length,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        let score = self.map(Map::Tip)[at] * support;
        Detection {
            forward: Some(self.forward(cell, axis_deg)),
            ..Detection::new(score, wake)
        }
    }

    /// Mean agreement of line directions along a ray with the ray, weighted by the probability of a line.
    fn forward(&self, cell: [f32; 2], angle: f32) -> f32 {
        let [right, down] = direction(angle);
        let (mut sum, mut total) = (0.0, 1e-6);
        for i in self.cells(cell, angle) {
            let (dx, dy) = (self.map(Map::LineRight)[i], self.map(Map::LineDown)[i]);
            sum += self.map(Map::Line)[i] * (dx * right + dy * down).clamp(-1.0, 1.0);
            total += self.map(Map::Line)[i];
        }
        sum / total
    }

    /// Cells of a ray from behind the ship to the border.
    fn cells(&self, [x, y]: [f32; 2], angle: f32) -> impl Iterator<Item = usize> + use<> {
        let [right, down] = direction(angle);
        let (rows, columns) = (self.rows, self.columns);
        let cell = move |k: usize| {
            let column = (x + k as f32 * right).round();
            let row = (y + k as f32 * down).round();
            let inside =
                column >= 0.0 && row >= 0.0 && column < columns as f32 && row < rows as f32;
            inside.then(|| row as usize * columns + column as usize)
        };
        (SKIPPED..LONGEST).map_while(cell)
    }

    /// Support of a ray by lines in its direction: the highest mean over a first part, lower for short parts, and the sum
    /// over the whole ray.
    fn support(&self, cell: [f32; 2], angle: f32) -> [f32; 2] {
        let [right, down] = direction(angle);
        let (line, to_right, to_down) = (
            self.map(Map::Line),
            self.map(Map::LineRight),
            self.map(Map::LineDown),
        );
        let (mut sum, mut best, mut count) = (0.0, 0.0f32, 0.0);
        for i in self.cells(cell, angle) {
            let (dx, dy) = (to_right[i], to_down[i]);
            let agreement = (dx * right + dy * down) / dx.hypot(dy).max(0.3);
            sum += line[i] * agreement;
            count += 1.0;
            best = best.max(sum / (count + SHORT));
        }
        [best, sum]
    }
}

/// Removes duplicates: a wake is dropped if one with a higher score lies along the same line.
///
/// - `near`: tips closer than this \[pixels\] are the same if the axes agree within [`SAME_AXIS`]
pub(crate) fn without_repeats(mut found: Vec<Detection>, near: f32) -> Vec<Detection> {
    found.sort_by(|a, b| {
        let places = |d: &Detection| (d.wake.tip[1], d.wake.tip[0]);
        let ((ra, ca), (rb, cb)) = (places(a), places(b));
        b.score
            .total_cmp(&a.score)
            .then(ra.total_cmp(&rb))
            .then(ca.total_cmp(&cb))
    });
    let mut kept: Vec<Detection> = Vec::new();
    for one in found {
        let is_repeat = |other: &Detection| {
            same(&other.wake, &one.wake, near) || reversed(&other.wake, &one.wake, near)
        };
        if !kept.iter().any(is_repeat) {
            kept.push(one);
        }
    }
    kept
}

/// Largest difference between the axes of duplicates \[deg\].
const SAME_AXIS: f32 = 30.0;
/// Largest distance between the lines of duplicates \[pixels\].
const SAME_LINE: f32 = 16.0;
/// How far the tip of a duplicate may lie ahead of the other tip or behind it, in units of `near`: farther behind, another
/// ship may follow.
const HIDDEN: f32 = 2.5;
const FOLLOWING: f32 = 5.0;

/// Largest difference between opposite axes of a wake that is followed both ways \[deg\].
const OPPOSITE: f32 = 15.0;

/// Whether a weaker wake is a stronger one followed from end to tip: a line has one tip.
fn reversed(strong: &Wake, weak: &Wake, near: f32) -> bool {
    let turn = turn(weak.axis_deg + 180.0, strong.axis_deg);
    let (dx, dy) = (weak.tip[0] - strong.tip[0], weak.tip[1] - strong.tip[1]);
    let [right, down] = strong.direction();
    let (along, across) = (dx * right + dy * down, dy * right - dx * down);
    turn.abs() < OPPOSITE
        && across.abs() < SAME_LINE
        && (0.0..strong.length + HIDDEN * near).contains(&along)
}

/// Whether a weaker wake is a duplicate of a stronger one.
pub(crate) fn same(strong: &Wake, weak: &Wake, near: f32) -> bool {
    let turn = turn(weak.axis_deg, strong.axis_deg);
    let (dx, dy) = (weak.tip[0] - strong.tip[0], weak.tip[1] - strong.tip[1]);
    if dx.hypot(dy) < 0.5 * near {
        return true;
    }
    if turn.abs() > SAME_AXIS {
        return false;
    }
    let [right, down] = strong.direction();
    let (along, across) = (dx * right + dy * down, dy * right - dx * down);
    // A ship or a bright first part may hide the start of the line.
    let follows = strong.length.clamp(near, FOLLOWING * near);
    let beside = across.abs() < SAME_LINE && (-HIDDEN * near..follows).contains(&along);
    dx.hypot(dy) < near || beside
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "places that nothing may change")]
mod tests {
    use super::*;

    /// Maps with high probabilities along given rays.
    fn drawn(cells: usize, wakes: &[Wake]) -> Maps {
        let mut values = vec![0.0; OUTPUTS * cells * cells];
        values[..2 * cells * cells].fill(-12.0);
        for wake in wakes {
            let [right, down] = wake.direction();
            let mut put = |map: Map, x: f32, y: f32, value: f32| {
                values[(map as usize * cells + y.round() as usize) * cells + x.round() as usize] =
                    value;
            };
            let [x, y] = wake.tip.map(|t| (t - 1.5) / 4.0);
            put(Map::Tip, x, y, 6.0);
            put(Map::TipRight, x, y, right);
            put(Map::TipDown, x, y, down);
            put(Map::Length, x, y, (wake.length / LENGTH_UNIT).ln());
            put(Map::HalfAngle, x, y, wake.half_angle_deg / ANGLE_UNIT);
            for k in 0..(wake.length / 4.0) as usize {
                let (x, y) = (x + k as f32 * right, y + k as f32 * down);
                put(Map::Line, x, y, 6.0);
                put(Map::LineRight, x, y, right);
                put(Map::LineDown, x, y, down);
            }
        }
        Maps::new(cells, cells, values)
    }

    fn wake(tip: [f32; 2], axis_deg: f32) -> Wake {
        Wake {
            tip,
            axis_deg,
            half_angle_deg: 4.0,
            length: 120.0,
            snr: f32::INFINITY,
            contrast_db: None,
        }
    }

    /// Of equal tips two cells apart the first is kept, of tips three cells apart both.
    #[test]
    fn tips_are_the_highest_around() {
        let tips = |apart: f32| {
            let at = |x: f32| wake([81.5 + x, 121.5], 90.0);
            drawn(64, &[at(0.0), at(4.0 * apart)]).tips()
        };
        assert_eq!(tips(2.0), [30 * 64 + 20]);
        assert_eq!(tips(3.0), [30 * 64 + 20, 30 * 64 + 23]);
    }

    /// Two wakes that cross are both found where they were drawn.
    #[test]
    fn crossing_wakes_are_both_found() {
        let drawn_wakes = [wake([41.5, 61.5], 90.0), wake([101.5, 21.5], 180.0)];
        let found = without_repeats(drawn(64, &drawn_wakes).detections(), 40.0);
        assert_eq!(found.len(), 2);
        for wake in drawn_wakes {
            let best = found
                .iter()
                .find(|d| d.wake.tip == wake.tip)
                .expect("its tip");
            let turn = turn(wake.axis_deg, best.wake.axis_deg);
            assert!(turn.abs() < 3.0 && best.score > 0.5, "{best:?}");
            assert!((best.wake.length - 120.0).abs() < 0.1);
        }
    }

    /// A line 8° off the direction at its tip is the axis, one 19° off, as arms are, is not.
    #[test]
    fn arms_are_not_the_axis() {
        let turned = |degrees: f32| {
            let mut maps = drawn(64, &[wake([41.5, 61.5], 90.0)]);
            let (tip, area) = (15 * 64 + 10, 64 * 64);
            let [right, down] = direction(90.0 - degrees);
            maps.values[Map::TipRight as usize * area + tip] = right;
            maps.values[Map::TipDown as usize * area + tip] = down;
            maps.wake(tip)
        };
        let (axis, arm) = (turned(8.0), turned(19.5));
        assert!(turn(90.0, axis.wake.axis_deg).abs() < 1.5, "{axis:?}");
        assert!(turn(90.0, arm.wake.axis_deg).abs() > 7.0, "{arm:?}");
        assert!(arm.score < 0.5 * axis.score, "{axis:?} {arm:?}");
    }

    /// A line in the opposite direction gives no support.
    #[test]
    fn a_line_of_the_wrong_direction_is_no_support() {
        let mut maps = drawn(64, &[wake([41.5, 61.5], 90.0)]);
        let before = maps.detections()[0].score;
        let area = 64 * 64;
        let (right, down) = (
            Map::LineRight as usize * area,
            Map::LineDown as usize * area,
        );
        maps.values[right..right + area]
            .iter_mut()
            .for_each(|x| *x = -*x);
        maps.values[down..down + area]
            .iter_mut()
            .for_each(|x| *x = -*x);
        let after = maps.detections()[0].score;
        assert!(before > 0.6 && after < 0.05, "{before} {after}");
    }

    /// A wake of 120 pixels to the right of (100, 100) followed from its end is the same line; a wake in the opposite direction
    /// on another line, or beyond the end, is another wake.
    #[test]
    fn a_line_that_is_followed_both_ways_is_told_once() {
        let kept = |tip: [f32; 2], axis_deg: f32| {
            let both = vec![
                Detection::new(0.9, wake([100.0, 100.0], 90.0)),
                Detection::new(0.5, wake(tip, axis_deg)),
            ];
            without_repeats(both, 40.0).len()
        };
        assert_eq!(kept([225.0, 104.0], 265.0), 1);
        assert_eq!(kept([225.0, 104.0], 240.0), 2);
        assert_eq!(kept([225.0, 140.0], 270.0), 2);
        assert_eq!(kept([400.0, 100.0], 270.0), 2);
    }

    #[test]
    fn ties_are_told_in_the_order_of_the_image() {
        let tied = vec![
            wake([200.0, 90.0], 0.0),
            wake([20.0, 90.0], 0.0),
            wake([50.0, 10.0], 120.0),
        ];
        let found = |wakes: Vec<Wake>| {
            let all = wakes
                .into_iter()
                .map(|wake| Detection::new(0.5, wake))
                .collect();
            without_repeats(all, 40.0)
        };
        let mut turned = tied.clone();
        turned.reverse();
        let order = found(tied);
        assert_eq!(order, found(turned));
        assert_eq!(order[0].wake.tip, [50.0, 10.0]);
    }
}
