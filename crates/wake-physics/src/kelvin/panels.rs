//! Nodes of the wake integral: as many as tolerance, raster and band require.

use super::turning::{RingWork, Rings};
use super::zones::{Piece, Reach};
use super::{CUSP_ANGLE, KelvinWake};
use crate::numeric::{GaussLegendre, largest_phase};
use crate::raster::Raster;
use crate::waves::PlaneWaves;
use num_complex::Complex64;

/// Nodes of a panel. Large panels need the fewest nodes per period (2.4 here; the lower limit is 2).
const PANEL_NODES: usize = 32;

/// Error of a panel as a share of the tolerance: the sum of all amplitudes is some ten times a field's rms.
const PANEL_SHARE: f64 = 0.01;

/// Amplitude below which waves of a turning ship are left out, over the root mean square of all, in units of the tolerance
/// (chosen): these waves hold less than its square of all energy.
const RING_SHARE: f64 = 0.5;

/// Computed range of wave directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zone {
    /// Smallest and largest direction θ to the track \[rad\], to port positive.
    pub directions: [f64; 2],
    /// Number of nodes in the range.
    pub nodes: usize,
}

/// Quadrature of the wake integral on a raster: its range of directions and its nodes.
///
/// A plan without nodes stands for an invisible wake: no wave is long enough for the pixels, the ship is at rest, or the whole
/// raster lies ahead of the bow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WakePlan {
    /// Ranges of directions, in order.
    pub zones: Vec<Zone>,
    /// Number of nodes among the transverse waves, |θ| below [`CUSP_ANGLE`].
    pub transverse_nodes: usize,
    /// Number of nodes among the divergent waves.
    pub divergent_nodes: usize,
    /// Smallest and largest wavenumber [rad/m].
    pub wavenumbers: [f64; 2],
    /// Bound on the error of the quadrature at every pixel, relative to the sum of all |amplitude|.
    pub error_bound: f64,
    /// Nodes u and weights, including the window.
    quadrature: Vec<(f64, f64)>,
    /// Rings of waves instead of nodes, for a turning ship.
    rings: Option<Rings>,
    ring_work: RingWork,
}

impl WakePlan {
    /// Number of plane waves.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.transverse_nodes + self.divergent_nodes
    }

    /// Work to compute the rings, for a turning ship.
    pub(crate) fn ring_work(&self) -> RingWork {
        self.ring_work
    }

    pub(super) fn quadrature(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.quadrature.iter().copied()
    }
}

/// Planning of the nodes.
impl KelvinWake {
    /// Chooses the nodes for a raster, so that the sum of plane waves equals the integral to within `tolerance`.
    ///
    /// The band is |k| ≤ π/spacing, a sharp disk; waves that `filter_depth` weakens below the tolerance are left out. Each panel
    /// of 32 Gauss–Legendre nodes spans as much phase as the remainder of the rule allows, at the pixel where phases change
    /// fastest. A raster far from the ship gets only the directions that reach it. The number of nodes grows with the pixels on a
    /// side of the raster, never with the distance of the ship.
    ///
    /// - `tolerance`: largest error relative to a field's rms, 1e-7 to 0.1
    ///
    /// # Validity
    ///
    /// Phases are accurate to 1e-16 of their size: ships beyond 1e9 m are not placed to the tolerance.
    #[must_use]
    pub fn plan(&self, raster: &Raster, tolerance: f64) -> WakePlan {
        if self.track.turn().is_some() {
            return self.plan_turn(raster, tolerance);
        }
        let corners = astern(&self.track.corners(raster), 0.5 * self.hull.length());
        let Some(last) = self.last(raster, tolerance) else {
            return WakePlan::default();
        };
        if corners.is_empty() {
            return WakePlan::default();
        }
        let decay = self.hull.draft() + self.filter_depth;
        let steady = self.steady_waves();
        let reach = Reach::new(steady, corners, 0.5 * self.hull.length(), decay);
        if !reach.fastest(last).is_finite() {
            return WakePlan::default();
        }
        let error = PANEL_SHARE * tolerance;
        let sharpness = -error.ln();
        let mut builder = Builder::new(&reach, error, sharpness.sqrt());
        for range in self.ranges(last) {
            for piece in reach.pieces(range, 4.0 * sharpness) {
                builder.add(piece, steady.first(), self.grading());
            }
        }
        let mut plan = builder.plan;
        plan.error_bound = error;
        plan.wavenumbers = [
            steady.at(plan.smallest_u()).wavenumber,
            steady.at(plan.largest_u()).wavenumber,
        ];
        plan
    }

    /// Plane waves at the nodes of a plan, including phases and time.
    #[must_use]
    pub fn waves(&self, plan: &WakePlan) -> PlaneWaves {
        if let Some(rings) = &plan.rings {
            return rings.waves(self);
        }
        let mut out = PlaneWaves::default();
        let steady = self.steady_waves();
        let [x, y] = self.track.position;
        for (u, weight) in plan.quadrature() {
            let wave = steady.at(u);
            let k = self.track.turned([wave.along, wave.across]);
            let phase = Complex64::cis(-(k[0] * x + k[1] * y));
            let amplitude = self.free_wave(&wave) * phase * weight;
            out.push(k, self.speed * wave.along, amplitude);
        }
        out
    }

    /// Rings of waves of a turning ship.
    fn plan_turn(&self, raster: &Raster, tolerance: f64) -> WakePlan {
        let Some(rings) = Rings::of(self, raster, RING_SHARE * tolerance) else {
            return WakePlan::default();
        };
        let cusp = self.steady_waves().at(CUSP_ANGLE.tan().asinh()).wavenumber;
        let [transverse_nodes, divergent_nodes] = rings.nodes(cusp);
        WakePlan {
            transverse_nodes,
            divergent_nodes,
            wavenumbers: rings.wavenumbers(),
            error_bound: RING_SHARE * tolerance,
            rings: Some(rings),
            ..WakePlan::default()
        }
    }

    /// The plan with the work for its rings, estimated from a few of them.
    pub(crate) fn with_ring_work(&self, plan: WakePlan) -> WakePlan {
        WakePlan {
            ring_work: plan
                .rings
                .map_or(RingWork::default(), |rings| rings.work(self)),
            ..plan
        }
    }

    /// Largest |u|, limited by the band of the raster or by the filter.
    fn last(&self, raster: &Raster, tolerance: f64) -> Option<f64> {
        let steady = self.steady_waves();
        let first = steady.at(steady.first()).wavenumber;
        // The slopes of short waves are larger by a factor of k: a thousandth of the tolerance covers the band.
        let filtered = first + (1e3 / tolerance).ln() / self.filter_depth;
        steady.last(raster.nyquist_wavenumber().min(filtered))
    }

    /// The curve as one range of u, or two where it has no transverse waves.
    fn ranges(&self, last: f64) -> Vec<[f64; 2]> {
        let first = self.steady_waves().first();
        if first > 0.0 {
            vec![[-last, -first], [first, last]]
        } else {
            vec![[-last, last]]
        }
    }

    /// Number of times that panels are halved toward the beginning of the curve, which has a fine structure of the width √|νh −
    /// 1| near the critical speed.
    pub(super) fn grading(&self) -> i32 {
        let width = self.steady_waves().subcriticality().abs().sqrt();
        (0.5 / width.max(1e-6)).log2().ceil().max(0.0) as i32
    }
}

impl WakePlan {
    fn smallest_u(&self) -> f64 {
        self.quadrature
            .iter()
            .map(|n| n.0.abs())
            .fold(f64::INFINITY, f64::min)
    }

    fn largest_u(&self) -> f64 {
        self.quadrature
            .iter()
            .map(|n| n.0.abs())
            .fold(0.0, f64::max)
    }
}

/// Lays panels along pieces of the curve.
struct Builder<'a> {
    reach: &'a Reach,
    rule: GaussLegendre,
    /// Phase that a panel may span \[rad\].
    phase: f64,
    sharpness: f64,
    plan: WakePlan,
}

impl<'a> Builder<'a> {
    fn new(reach: &'a Reach, error: f64, sharpness: f64) -> Self {
        Self {
            reach,
            rule: GaussLegendre::new(PANEL_NODES),
            phase: largest_phase(PANEL_NODES, error),
            sharpness,
            plan: WakePlan::default(),
        }
    }

    /// Adds a piece; the curve begins at ±`first`, where panels are halved `grading` times.
    fn add(&mut self, piece: Piece, first: f64, grading: i32) {
        let before = self.plan.nodes();
        let mut breaks = vec![piece.from, piece.to];
        for side in [-1.0, 1.0] {
            let start = side * first;
            breaks.push(start);
            breaks.extend((1..=grading).map(|level| start + side * 0.5f64.powi(level)));
        }
        breaks.retain(|&u| (piece.from..=piece.to).contains(&u));
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        for pair in breaks.windows(2) {
            self.add_smooth(piece, [pair[0], pair[1]], first);
        }
        let nodes = self.plan.nodes() - before;
        let directions = [piece.from, piece.to].map(|u| u.sinh().atan());
        self.plan.zones.push(Zone { directions, nodes });
    }

    fn add_smooth(&mut self, piece: Piece, [from, to]: [f64; 2], first: f64) {
        let mut start = from;
        while start < to {
            let end = self.panel_end(start, to).max(start.next_up());
            // A curve that begins off the axis has no point between ±first.
            let begins =
                first > 0.0 && (start > 0.0 && start <= first || end < 0.0 && end >= -first);
            for (t, w) in self.rule.on(0.0, 1.0) {
                // Where the curve begins off the axis, its points vary as the square root of u: u ∝ t².
                let (s, ds) = match (begins, start > 0.0) {
                    (false, _) => (t, 1.0),
                    (true, true) => (t * t, 2.0 * t),
                    (true, false) => (t * (2.0 - t), 2.0 - 2.0 * t),
                };
                let u = start + (end - start) * s;
                let weight = (end - start) * ds * w * piece.window(u, self.sharpness);
                self.plan.quadrature.push((u, weight));
                if u.sinh().atan().abs() < CUSP_ANGLE {
                    self.plan.transverse_nodes += 1;
                } else {
                    self.plan.divergent_nodes += 1;
                }
            }
            start = end;
        }
    }

    /// End of a panel from `start` in which no phase turns by more than allowed.
    fn panel_end(&self, start: f64, to: f64) -> f64 {
        let mut width = (to - start).min(1.0);
        for _ in 0..12 {
            let fastest = [0.02, 0.5, 1.0]
                .map(|part| self.reach.fastest(start + part * width))
                .into_iter()
                .fold(0.0, f64::max);
            if fastest * width <= self.phase {
                break;
            }
            width = (self.phase / fastest).max(0.5 * width);
        }
        let panels = ((to - start) / width).ceil();
        if panels <= 2.0 {
            return start + (to - start) / panels;
        }
        start + width
    }
}

/// Nodes and weights over a range of the curve with sharp ends.
#[cfg(test)]
pub(super) fn unwindowed(
    reach: &Reach,
    [from, to]: [f64; 2],
    first: f64,
    grading: i32,
    error: f64,
) -> Vec<(f64, f64)> {
    let mut builder = Builder::new(reach, error, 1.0);
    let piece = Piece {
        from,
        to,
        rise: 0.0,
        fall: 0.0,
    };
    builder.add(piece, first, grading);
    builder.plan.quadrature
}

/// Nodes and weights of one piece, window included.
#[cfg(test)]
pub(super) fn nodes_of(reach: &Reach, piece: Piece, error: f64) -> Vec<(f64, f64)> {
    let mut builder = Builder::new(reach, error, (-error.ln()).sqrt());
    builder.add(piece, 0.0, 0);
    builder.plan.quadrature
}

/// The part of a convex polygon that lies astern of `bow` \[m\]: corners (ξ, η) with ξ ≤ `bow`.
fn astern(corners: &[[f64; 2]], bow: f64) -> Vec<[f64; 2]> {
    let mut out = Vec::with_capacity(corners.len() + 1);
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        if a[0] <= bow {
            out.push(*a);
        }
        if (a[0] - bow) * (b[0] - bow) < 0.0 {
            let part = (bow - a[0]) / (b[0] - a[0]);
            out.push([bow, a[1] + part * (b[1] - a[1])]);
        }
    }
    out
}
