//! Outline of a wake behind a turning ship: points along its past track, joined by straight lines.

use super::clip::Polygon;
use super::visibility::Extent;
use super::{Frame, Pixel, WakeLabel};
use crate::dispersion::group_speed;
use crate::kelvin::{KELVIN_ANGLE, KelvinWake};
use crate::track::Track;
use std::f64::consts::PI;

/// Number of parts of an outline (chosen): on a half circle, the chords deviate by 0.2 % of the radius.
const PARTS: usize = 24;

/// Place of the waves on the arms relative to where they were sent, per distance that the ship has run since.
///
/// These waves have the steepest ray, and travel r = `c_g`/c cos θ of that distance in their own direction θ:
///
/// ```text
/// forward r cos θ, aside r sin θ          deep water: 1/3 and √2/6
/// ```
#[derive(Debug, Clone, Copy)]
struct Arms {
    forward: f64,
    aside: f64,
}

impl Arms {
    /// Arms of a wake, for the waves that a pixel carries (k up to `largest` [rad/m]).
    fn of(wake: &KelvinWake, largest: f64) -> Self {
        let rays = wake.rays(largest);
        let steepest = rays.iter().max_by(|a, b| a.tangent.total_cmp(&b.tangent));
        let Some(ray) = steepest else {
            // cos²θ = 2/3 on the cusp of deep water.
            let aside = KELVIN_ANGLE.tan() * 2.0 / 3.0;
            return Self {
                forward: 1.0 / 3.0,
                aside,
            };
        };
        let [along, across] = ray.k;
        let k = along.hypot(across);
        let share = group_speed(k, wake.depth) * k / ray.omega * (along / k);
        Self {
            forward: share * along / k,
            aside: share * across / k,
        }
    }
}

/// Visible parts of a wake: convex pieces cut to the image, each with the distance astern of the bow at which it ends \[m\].
type Pieces = Vec<(Polygon, f64)>;

impl Frame<'_> {
    /// Label of the wake of a turning ship.
    ///
    /// - `opening`: half-angle of the wedge \[rad\]
    pub(super) fn curved_wake(
        &self,
        wake: &KelvinWake,
        opening: f64,
        extent: &Extent,
    ) -> WakeLabel {
        let (track, length) = (&wake.track, wake.hull.length());
        let bow = 0.5 * length;
        let arms = Arms::of(wake, PI / self.raster.spacing);
        let mut pieces = self.wedge(track, bow, arms, extent.waves);
        pieces.extend(self.band(track, bow, extent.half_width, extent.dark_line));
        let end = pieces.iter().map(|piece| piece.1).fold(0.0, f64::max);
        let seen: Vec<Polygon> = pieces.into_iter().map(|piece| piece.0).collect();
        WakeLabel {
            arms_px: self.arm_lines(track, bow, arms, extent.waves),
            centreline_px: self.track_line(track, bow, [length, extent.longest()]),
            visibility: extent.visibility,
            ..self.outlined(self.offset(self.position, bow, 0.0), opening, &seen, end)
        }
    }

    /// Track between two distances astern of the bow, as far as it is in the image.
    fn track_line(&self, track: &Track, bow: f64, [from, to]: [f64; 2]) -> Vec<Pixel> {
        if to <= from {
            return Vec::new();
        }
        let at = |n: usize| {
            let astern = from + (to - from) * n as f64 / PARTS as f64;
            track.at(bow - astern).position
        };
        self.line_inside(&(0..=PARTS).map(at).collect::<Vec<_>>())
    }

    /// Points of an arm up to a distance astern of the bow; `side` is 1 to port, −1 to starboard.
    fn arm(track: &Track, bow: f64, arms: Arms, side: f64, end: f64) -> Vec<[f64; 2]> {
        let longest = end / (1.0 - arms.forward);
        let at = |n: usize| {
            let run = longest * n as f64 / PARTS as f64;
            let sent = track.at(bow - run);
            let [dx, dy] = sent.turned([run * arms.forward, side * run * arms.aside]);
            [sent.position[0] + dx, sent.position[1] + dy]
        };
        (0..=PARTS).map(at).collect()
    }

    /// The arms up to a distance astern of the bow, port before starboard, as far as they are in the image.
    fn arm_lines(&self, track: &Track, bow: f64, arms: Arms, end: f64) -> Vec<Vec<Pixel>> {
        let lines =
            [1.0, -1.0].map(|side| self.line_inside(&Self::arm(track, bow, arms, side, end)));
        lines.into_iter().filter(|line| line.len() > 1).collect()
    }

    /// The wedge between the arms, in pieces.
    fn wedge(&self, track: &Track, bow: f64, arms: Arms, end: f64) -> Pieces {
        if end <= 0.0 {
            return Vec::new();
        }
        let [port, starboard] = [1.0, -1.0].map(|side| Self::arm(track, bow, arms, side, end));
        self.strip(&port, &starboard, end)
    }

    /// The dark line, `half_width` to each side, in pieces.
    fn band(&self, track: &Track, bow: f64, half_width: f64, end: f64) -> Pieces {
        if end <= 0.0 {
            return Vec::new();
        }
        let side = |port: f64| {
            let at = |n: usize| track.on_sea([bow - end * n as f64 / PARTS as f64, port]);
            (0..=PARTS).map(at).collect::<Vec<_>>()
        };
        self.strip(&side(half_width), &side(-half_width), end)
    }

    /// The pieces between two lines that both end at a distance astern of the bow.
    fn strip(&self, port: &[[f64; 2]], starboard: &[[f64; 2]], end: f64) -> Pieces {
        let piece = |n: usize| {
            let corners = vec![port[n], starboard[n], starboard[n + 1], port[n + 1]];
            let polygon = Polygon::new(corners).cut_to(&self.image)?;
            Some((polygon, end * (n + 1) as f64 / PARTS as f64))
        };
        (0..PARTS).filter_map(piece).collect()
    }

    /// The first part of a line that is in the image.
    fn line_inside(&self, places: &[[f64; 2]]) -> Vec<Pixel> {
        let mut line: Vec<[f64; 2]> = Vec::new();
        for pair in places.windows(2) {
            let [dx, dy] = [0, 1].map(|a| pair[1][a] - pair[0][a]);
            let length = dx.hypot(dy);
            let along = [dx / length, dy / length];
            let inside = (length > 0.0).then(|| self.image.clip_ray(pair[0], along, length));
            let Some([start, stop]) = inside.flatten() else {
                if line.is_empty() {
                    continue;
                }
                break;
            };
            if line.is_empty() {
                line.push(start);
            }
            line.push(stop);
            if !self.image.contains(pair[1]) {
                break;
            }
        }
        line.into_iter().map(|place| self.pixel(place)).collect()
    }
}
