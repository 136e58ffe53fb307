//! A few thousand waves that represent a ship's wake in an image.

use super::waves;
use super::waves::WaveSample;
use crate::kelvin::KelvinWake;
use crate::raster::Raster;
use crate::track::Track;
use std::f64::consts::PI;

/// Tolerance of the coarse wake used for these estimates.
const COARSE: f64 = 0.1;

/// Number of headings that represent a turning ship: chosen.
const HEADINGS: usize = 8;

/// The waves of the wake in the image, and the ratio of their variance within a ship's length of the stern to the mean.
pub(super) fn sampled(wake: &KelvinWake, image: &Raster) -> (Vec<WaveSample>, f64) {
    match wake.track.turn() {
        None => sampled_straight(wake, image),
        Some((radius, _)) => sampled_turn(wake, radius, image),
    }
}

/// As [`sampled`], for a turning ship: the mean over ships on straight courses, with the headings that it has had, each as
/// far ahead of the image's centre as the ship is from it.
fn sampled_turn(wake: &KelvinWake, radius: f64, image: &Raster) -> (Vec<WaveSample>, f64) {
    if wake.plan(image, COARSE).nodes() == 0 {
        return (Vec::new(), 1.0);
    }
    let middle = [image.x(image.columns / 2), image.y(image.rows / 2)];
    let [dx, dy] = [0, 1].map(|a| wake.track.position[a] - middle[a]);
    let (mut waves, mut largest) = (Vec::new(), 1.0f64);
    for n in 0..HEADINGS {
        let there = wake.track.at(-PI * radius * n as f64 / HEADINGS as f64);
        let ahead = dx.hypot(dy);
        let track = Track {
            position: [0, 1].map(|a| middle[a] + ahead * there.forward[a]),
            ..there.straight()
        };
        let (mut one, crowding) = sampled_straight(&KelvinWake { track, ..*wake }, image);
        one.iter_mut().for_each(|w| w.variance /= HEADINGS as f64);
        waves.extend(one);
        largest = largest.max(crowding);
    }
    (waves, largest)
}

fn sampled_straight(wake: &KelvinWake, image: &Raster) -> (Vec<WaveSample>, f64) {
    let corners = wake.track.corners(image);
    let length = wake.hull.length();
    let farthest = corners
        .iter()
        .map(|c| 0.5 * length - c[0])
        .fold(0.0, f64::max);
    let nearest = corners
        .iter()
        .map(|c| -0.5 * length - c[0])
        .fold(f64::INFINITY, f64::min);
    let nodes = wake.waves(&wake.plan(image, COARSE));
    if nodes.is_empty() || farthest <= 0.0 {
        return (Vec::new(), 1.0);
    }
    let [height, across] = [image.rows, image.columns].map(|n| n as f64 * image.spacing);
    let track_length = farthest
        .min(height.hypot(across))
        .min(farthest - nearest.min(0.0));
    // The wedge is 0.71 of the distance wide, counted from half a length astern of midship. The energy across the track is
    // spread over this width, even where the image is narrower.
    let wedge = track_length * 0.71 * (0.5 * length).max(nearest);
    let area = (height * across).max(wedge);
    let waves = waves::wake(&nodes, wake.track.forward, track_length, area);
    (waves, area / wedge)
}
