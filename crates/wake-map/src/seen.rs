//! Refinement of detections at full resolution: axis and start of each wake, and removal of duplicates of one ship.

use wake_detector::{Detection, Wake};
use wake_geo::Product;

use crate::echo::{Echo, ShipOnAxis, echo};
use crate::profile::{Contrast, Kind, Surroundings};

/// A detection with its measurements at full resolution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) detection: Detection,
    /// The wake on its refined line, from the stern.
    pub(crate) wake: Wake,
    pub(crate) measured: Option<Contrast>,
    pub(crate) echo: Option<Echo>,
}

/// Largest shift of a wake's tip along its axis to the stern, given by the echo \[pixels\].
const FARTHEST: f64 = 60.0;
/// Largest turn of the line for which the length measured by the detector is kept \[degrees\].
const MEASURED: f32 = 3.0;
/// Echoes closer than this are the same \[pixels\], and wakes with the same echo are the same if their axes differ by less
/// \[degrees\].
const SAME_ECHO: f64 = 6.0;
const SAME_AXIS: f32 = 30.0;
/// A wake without an echo is a later part of a wake with a higher score, in either direction, if its tip is within these bounds:
/// distance astern and distance from the axis \[pixels\], growth of the latter per distance astern, and turn \[degrees\].
const ASTERN: f32 = 600.0;
const OFF: f32 = 12.0;
const SPREAD: f32 = 0.03;
const TURNED: f32 = 8.0;
/// A line without an echo that ends this close to the tip of a wake with a higher score \[pixels\] belongs to that ship if the
/// axes differ by less \[degrees\]: arms, 19.5 degrees off the axis, detected together with features ahead of the bow.
const AT_TIP: f32 = 25.0;
const AHEAD: f32 = 23.0;

impl Seen {
    pub(crate) fn of(product: &Product, one: &Detection) -> Self {
        let (line, measured) = match Surroundings::of(product, &one.wake) {
            Some(pixels) => pixels.refined(&one.wake),
            None => (one.wake, None),
        };
        let is_clear = measured.is_some_and(|contrast| contrast.kind() != Kind::Arms);
        let echo = echo(product, &line, is_clear);
        Self {
            detection: measured_along(*one, &line),
            wake: placed(&one.wake, &line, echo.and_then(|echo| echo.ship)),
            measured,
            echo,
        }
    }

    /// The wake up to the measured end of its line, if that was measured.
    pub(crate) fn visible(&self) -> Wake {
        let Some(extent) = self.detection.extent else {
            return self.wake;
        };
        let [right, down] = self.wake.direction();
        let moved = [0, 1].map(|k| self.wake.tip[k] - self.detection.wake.tip[k]);
        let begun = moved[0] * right + moved[1] * down;
        Wake {
            length: (extent.length - begun).max(1.0),
            ..self.wake
        }
    }

    /// Whether another detection with a lower score is the same wake.
    fn is_again(&self, other: &Self) -> bool {
        let turn = self.wake.turn_to(&other.wake).abs();
        match (&self.echo, &other.echo) {
            (Some(a), Some(b)) => {
                let away = (a.line - b.line).hypot(a.pixel - b.pixel);
                away < SAME_ECHO && turn < SAME_AXIS
            }
            (_, Some(_)) => false,
            (_, None) => {
                let [right, down] = self.wake.direction();
                let [x, y] = [0, 1].map(|k| other.wake.tip[k] - self.wake.tip[k]);
                let (along, across) = (x * right + y * down, y * right - x * down);
                let astern = (0.0..ASTERN).contains(&along)
                    && across.abs() < OFF + SPREAD * along
                    && turn.min(180.0 - turn) < TURNED;
                let end = other.wake.at(other.wake.length);
                let from_tip = (end[0] - self.wake.tip[0]).hypot(end[1] - self.wake.tip[1]);
                astern || (from_tip < AT_TIP && turn < AHEAD)
            }
        }
    }
}

/// Drops the measured length of a detection if the refined line is turned too far from the axis of that measurement.
fn measured_along(mut detection: Detection, line: &Wake) -> Detection {
    if detection.wake.turn_to(line).abs() > MEASURED {
        detection.extent = None;
    }
    detection
}

/// Places a detected wake on its refined line, starting at the ship's stern if the echo gives it; the length changes by the
/// same shift.
fn placed(found: &Wake, line: &Wake, ship: Option<ShipOnAxis>) -> Wake {
    let mut placed = Wake {
        tip: line.tip,
        axis_deg: line.axis_deg,
        ..*found
    };
    let Some(ship) = ship else { return placed };
    let [right, down] = line.direction().map(f64::from);
    let along = |place: [f64; 2]| {
        (place[0] - f64::from(line.tip[0])) * right + (place[1] - f64::from(line.tip[1])) * down
    };
    let stern = along(ship.middle) + ship.half_length;
    if stern.abs() <= FARTHEST && stern < f64::from(found.length) {
        placed.tip = line.at(stern as f32);
        placed.length -= stern as f32;
    }
    placed
}

/// Removes duplicates from detections in descending order of score; a duplicate may lengthen the wake that is kept.
pub(crate) fn one_a_ship(seen: Vec<Seen>) -> Vec<Seen> {
    let mut kept: Vec<Seen> = Vec::new();
    for one in seen {
        match kept.iter_mut().find(|surer| surer.is_again(&one)) {
            None => kept.push(one),
            Some(surer) => {
                let wake = &mut surer.wake;
                let [right, down] = wake.direction();
                for [x, y] in [one.wake.tip, one.wake.at(one.wake.length)] {
                    let along = (x - wake.tip[0]) * right + (y - wake.tip[1]) * down;
                    wake.length = wake.length.max(along.min(ASTERN));
                }
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wake(tip: [f32; 2], axis_deg: f32) -> Wake {
        Wake {
            tip,
            axis_deg,
            half_angle_deg: 1.0,
            length: 100.0,
            snr: f32::INFINITY,
            contrast_db: None,
        }
    }

    fn seen(score: f32, tip: [f32; 2], axis_deg: f32, echo: Option<[f64; 2]>) -> Seen {
        let wake = wake(tip, axis_deg);
        let echo = echo.map(|[pixel, line]| Echo {
            line,
            pixel,
            latitude: 0.0,
            longitude: 0.0,
            displacement: None,
            radial_velocity: None,
            radial_velocity_deviation: None,
            ship: None,
        });
        Seen {
            detection: Detection::new(score, wake),
            wake,
            measured: None,
            echo,
        }
    }

    /// A wake to the right from (500, 500): a detection of its later part lengthens it; a reversed one, one with the same echo
    /// and one that ends at its tip are removed; a parallel wake, a crossing wake and one with its own echo are of other ships.
    #[test]
    fn a_ship_has_one_wake() {
        let echo = Some([505.0, 560.0]);
        let first = seen(0.9, [500.0, 500.0], 90.0, echo);
        let later = seen(0.5, [760.0, 512.0], 93.0, None);
        let again = seen(0.4, [510.0, 503.0], 78.0, Some([506.0, 558.0]));
        let reversed = seen(0.45, [700.0, 505.0], 266.0, None);
        let ahead = seen(0.35, [402.0, 505.0], 95.0, None);
        let others = [
            seen(0.8, [760.0, 560.0], 90.0, None),
            seen(0.7, [700.0, 500.0], 120.0, None),
            seen(0.6, [760.0, 500.0], 90.0, Some([760.0, 470.0])),
            seen(0.3, [510.0, 503.0], 200.0, echo),
            seen(0.2, [440.0, 500.0], 90.0, None),
        ];
        let mut all = vec![first, later, again, ahead, reversed];
        all.extend(others);
        all.sort_by(|a, b| b.detection.score.total_cmp(&a.detection.score));
        let kept = one_a_ship(all);
        let scores: Vec<i32> = kept
            .iter()
            .map(|one| (10.0 * one.detection.score).round() as i32)
            .collect();
        assert_eq!(scores, [9, 8, 7, 6, 3, 2]);
        let end = 260.0 + 100.0 * 93f32.to_radians().sin();
        assert!(
            (kept[0].wake.length - end).abs() < 1e-3,
            "{}",
            kept[0].wake.length
        );
        assert!((kept[1].wake.length - 100.0).abs() < 1e-6);
    }

    /// The measured end of a line stays in place wherever the wake begins.
    #[test]
    fn a_wake_ends_where_it_was_measured() {
        let mut one = seen(0.9, [480.0, 500.0], 90.0, None);
        assert!((one.visible().length - 100.0).abs() < 1e-6);
        let extent = wake_detector::Extent {
            length: 250.0,
            deviation: 20.0,
        };
        one.detection.extent = Some(extent);
        one.wake.tip[0] += 30.0;
        let visible = one.visible();
        assert!((visible.at(visible.length)[0] - 730.0).abs() < 1e-3);
        assert!((one.detection.measured().wake.length - 250.0).abs() < 1e-6);
    }

    /// A measured length is kept for turns of two degrees, also across north, but not for four.
    #[test]
    fn a_turned_wake_has_another_length() {
        let mut one = Detection::new(0.9, wake([480.0, 500.0], 1.0));
        one.extent = Some(wake_detector::Extent {
            length: 250.0,
            deviation: 20.0,
        });
        for (axis, kept) in [(359.0, true), (3.0, true), (357.0, false), (5.0, false)] {
            let measured = measured_along(one, &wake([480.0, 500.0], axis));
            assert_eq!(measured.extent.is_some(), kept, "{axis}");
        }
    }

    /// A line to the right that was detected 5 pixels too high and 20 pixels ahead of the stern of a 30-pixel ship: the wake is
    /// moved to begin at the stern, with the same end. A ship too far away changes nothing.
    #[test]
    fn a_wake_begins_at_the_stern() {
        let found = wake([480.0, 495.0], 90.0);
        let line = wake([480.0, 500.0], 90.0);
        let ship = |pixel: f64| ShipOnAxis {
            middle: [pixel, 500.0],
            half_length: 15.0,
        };
        let moved = placed(&found, &line, Some(ship(485.0)));
        assert!((moved.tip[0] - 500.0).abs() < 1e-4 && (moved.tip[1] - 500.0).abs() < 1e-4);
        assert!((moved.at(moved.length)[0] - 580.0).abs() < 1e-4);
        for ship in [None, Some(ship(530.0))] {
            let moved = placed(&found, &line, ship);
            assert!((moved.tip[0] - 480.0).abs() < 1e-6 && (moved.length - 100.0).abs() < 1e-6);
        }
    }
}
