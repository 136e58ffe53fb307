//! Work of the stages of a simulation, counted in advance: operations, the time they take, and memory.

use super::sizes::Sizes;
use super::terms::SHARES;
use crate::kelvin::{LARGEST_SLOPE_VARIANCE, RingWork, WakePlan};
use crate::linear::FirstOrder;
use crate::models::Models;
use crate::nufft::WAVES_AT_ONCE;
use crate::prepared::Prepared;
use crate::sar::Imaging;
use crate::scattering::{BackscatterTable, SlopeCovariance};
use crate::scene::{Scene, Term};

/// Tolerance below which sums of waves are transformed in double precision: about the rounding of `f32` over a sum's share
/// of the tolerance.
const PRECISE: f64 = 5e-4;

/// Accelerations of the fastest pixels over their standard deviation, and columns that a thread sums at once.
const FARTHEST_MOVED: f64 = 5.0;
const BLOCK: usize = 64;

/// Advice on what makes a scene cheaper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Advice {
    /// Pixels dominate.
    Pixels,
    /// Waves of turning ships dominate.
    Turn,
    /// Looks through an impulse response dominate.
    Looks,
    /// The table of σ⁰ dominates.
    Tolerance,
}

impl Advice {
    /// Advice, beginning with a verb.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Pixels => {
                "lower grid.rows, grid.columns, grid.oversampling or radar.range_to_velocity, or raise grid.spacing"
            }
            Self::Turn => {
                "set ship.turn_rate to 0 or farther from 0, because the waves of a wide turn cost most, or raise grid.spacing"
            }
            Self::Looks => "lower radar.looks or grid.oversampling",
            Self::Tolerance => "raise model.tolerance",
        }
    }
}

/// Amounts of work of the stages.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Work {
    /// Pixels computed; pixels of overlapping strips are counted repeatedly.
    pub(crate) computed: f64,
    /// Pixels in memory at once, computed or as sources.
    pub(crate) at_once: f64,
    /// Pixels kept for the whole image while strips are computed: computed pixels and image pixels.
    pub(crate) whole: [f64; 2],
    /// Pixels of the image.
    pub(crate) image: f64,
    /// Points of the periodic lattice of the sea.
    pub(crate) lattice: f64,
    /// Sums by non-uniform FFTs: one for the swell and one for each wake that has waves.
    pub(crate) sums: f64,
    /// Whether these need more than single precision.
    pub(crate) precise: bool,
    /// Ships with a dark line, with bright edges, and with waves too short for the pixels.
    pub(crate) ships: [f64; 3],
    /// Turning ships among those with a dark line or edges: each pixel is located on a circle.
    pub(crate) turning: f64,
    /// Fields of slicks and gusts.
    pub(crate) patterns: f64,
    /// Pixels over which the return of one pixel is spread.
    pub(crate) taps: f64,
    /// Nodes of the table of σ⁰, and pixels steeper than its range.
    pub(crate) table: f64,
    pub(crate) steep: f64,
    /// Values of the image buffer, extended by the largest spread of any pixel.
    pub(crate) summed: f64,
    /// Source pixels of an impulse response, and looks.
    pub(crate) sources: f64,
    pub(crate) looks: f64,
    /// Waves of turning ships.
    pub(crate) rings: RingWork,
}

/// Core seconds per unit of work, measured on x86-64 with AVX-512 at 2 to 3 GHz.
mod seconds {
    /// First-order theory, plan and labels of a scene; additional time per ship.
    pub(super) const SCENE: f64 = 0.004;
    pub(super) const SHIP: f64 = 0.02;
    /// A pixel: σ⁰ and the fields; additional time per tap of the imaging.
    pub(super) const PIXEL: f64 = 6e-8;
    pub(super) const TAP: f64 = 3e-10;
    /// A pixel steeper than the table of σ⁰.
    pub(super) const STEEP: f64 = 2e-4;
    /// A point of the sea's lattice, for all fields.
    pub(super) const LATTICE: f64 = 5e-8;
    /// A pixel of the fields of one sum of waves, in single and in double precision.
    pub(super) const SUM: [f64; 2] = [6.5e-8, 1e-7];
    /// A pixel of a ship's dark line, of its edges, of its short waves; additional time if the ship turns.
    pub(super) const SHIPS: [f64; 3] = [1.5e-8, 3e-8, 8e-8];
    pub(super) const TURNING: f64 = 1e-7;
    /// A pixel of slicks or gusts.
    pub(super) const PATTERN: f64 = 1.5e-8;
    /// A node of the table.
    pub(super) const NODE: f64 = 1e-7;
    /// A source of one look, and an image pixel with independent speckle.
    pub(super) const LOOK: f64 = 6e-9;
    pub(super) const SPECKLE: f64 = 1e-8;
    /// A wave of a ring, a kept wave, a Bessel function.
    pub(super) const RING: f64 = 3e-8;
    pub(super) const KEPT: f64 = 1.8e-6;
    pub(super) const BESSEL: f64 = 1e-7;
}

/// Bytes per unit of work.
mod bytes {
    /// Any scene: tables of formulas, plans of small FFTs, threads.
    pub(super) const SCENE: f64 = 16e6;
    /// A pixel at once; additional bytes for a sum of waves in single and in double precision, short waves, slicks and
    /// gusts.
    pub(super) const PIXEL: f64 = 60.0;
    pub(super) const SUM: [f64; 2] = [60.0, 110.0];
    pub(super) const SHORT: f64 = 12.0;
    pub(super) const PATTERN: f64 = 4.0;
    /// A point of the sea's lattice: amplitudes and half a spectrum.
    pub(super) const LATTICE: f64 = 20.0;
    /// A value of the image buffer.
    pub(super) const SUMMED: f64 = 8.0;
    /// A source of an impulse response.
    pub(super) const SOURCE: f64 = 24.0;
    /// A computed pixel and an image pixel while other pixels are computed in strips.
    pub(super) const WHOLE: [f64; 2] = [8.0, 52.0];
    /// A node of the table during its construction.
    pub(super) const NODE: f64 = 16.0;
    /// A wave of a ring, a kept wave, and a wave spread at once in single and in double precision.
    pub(super) const RING: f64 = 18.0;
    pub(super) const KEPT: f64 = 40.0;
    pub(super) const SPREAD: [f64; 2] = [560.0, 900.0];
}

/// Inputs from which the work is counted.
pub(super) struct Counts<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) first: &'a FirstOrder<'a>,
    pub(super) sizes: &'a Sizes,
    /// The waves of the ships, after they have been planned.
    pub(super) wakes: &'a [WakePlan],
}

impl Work {
    /// Counts the work of a planned scene.
    pub(super) fn of(counts: &Counts<'_>, uses: impl Fn(Term) -> bool) -> Self {
        let Counts {
            prepared,
            first,
            sizes,
            wakes,
        } = *counts;
        let Prepared {
            scene,
            models,
            effects,
            ..
        } = prepared;
        let when = |is: bool| f64::from(u8::from(is));
        let ([computed_rows, columns], [margin, _]) = (sizes.computed, sizes.margin);
        let pixels = computed_rows * columns;
        let all = pixels as f64;
        let rows = match sizes.strips {
            1 => computed_rows,
            // A margin and the overlap on both sides of a strip.
            strips => computed_rows / strips + 6 * margin,
        };
        let at_once = (rows * columns) as f64;
        let turns = |n: usize| models.wakes[n].track.turn().is_some();
        let moving = (0..models.wakes.len()).filter(|&n| models.wakes[n].speed > 0.0);
        let dark: Vec<usize> = match uses(Term::Turbulent) {
            true => moving.clone().collect(),
            false => Vec::new(),
        };
        let edged = |n: &usize| effects.bright_edge.edges[*n].is_some();
        let edges: Vec<usize> = match uses(Term::BrightEdge) {
            true => moving.filter(edged).collect(),
            false => Vec::new(),
        };
        let turning = dark.iter().chain(&edges).filter(|&&n| turns(n)).count();
        let waves = wakes.iter().filter(|wake| wake.nodes() > 0).count();
        let swell = uses(Term::Swell) && models.swell.is_some();
        let tolerance = scene.model.tolerance;
        // Transverse and divergent waves, both at their largest steepness.
        let short_waves = when(uses(Term::SubpixelWake)) * 2.0 * LARGEST_SLOPE_VARIANCE;
        let leans = if uses(Term::RangeBunching) { 2.0 } else { 1.0 };
        let backscatter = models.backscatter(uses(Term::TiltAverage), false);
        let moves = uses(Term::Sea) || swell || waves > 0;
        let coherent = uses(Term::AzimuthSmear);
        let acceleration = match coherent && moves {
            true => first.acceleration(),
            false => 0.0,
        };
        let taps = leans * taps(models, coherent, acceleration, tolerance);
        let slopes = if moves {
            first.resolved
        } else {
            SlopeCovariance::NONE
        };
        let strip = sizes.strips as f64;
        let subpixel = effects.subpixel_wake.waves.iter().flatten().count();
        Self {
            computed: strip * at_once,
            at_once,
            whole: match sizes.strips {
                1 => [0.0; 2],
                _ => [all, models.pixels.image.len() as f64],
            },
            image: models.pixels.image.len() as f64,
            lattice: (sizes.sea_lattice[0] * sizes.sea_lattice[1]) as f64,
            sums: waves as f64 + when(swell),
            precise: tolerance < PRECISE,
            ships: [
                dark.len() as f64,
                edges.len() as f64,
                when(uses(Term::SubpixelWake)) * subpixel as f64,
            ],
            turning: turning as f64,
            patterns: when(uses(Term::Slicks))
                + when(uses(Term::Gusts)) * effects.gusts.patterns(models.pixels.computed.spacing),
            taps,
            table: BackscatterTable::foreseen(
                &backscatter,
                &slopes,
                short_waves,
                SHARES.table * tolerance * first.mean_sigma0(),
                pixels,
            ),
            steep: all * backscatter.steep_share(&first.open.slopes) * when(moves),
            summed: (taps / leans * FARTHEST_MOVED)
                * (models.pixels.computed.columns + BLOCK) as f64,
            sources: models
                .response
                .map_or(0.0, |_| models.pixels.computed.len() as f64),
            looks: looks(scene, models, uses(Term::Speckle)),
            rings: wakes
                .iter()
                .map(WakePlan::ring_work)
                .fold(RingWork::default(), |sum, one| RingWork {
                    // Ships are processed one after the other.
                    nodes: sum.nodes + one.nodes,
                    most_nodes: sum.most_nodes.max(one.most_nodes),
                    kept: sum.kept + one.kept,
                    most_kept: sum.most_kept.max(one.most_kept),
                    terms: sum.terms + one.terms,
                }),
        }
    }

    /// Core seconds, and advice on what to change.
    pub(super) fn seconds(&self) -> (f64, Advice) {
        use seconds::*;
        let per_pixel = PIXEL
            + TAP * self.taps
            + STEEP * self.steep / self.computed.max(1.0)
            + SUM[usize::from(self.precise)] * self.sums
            + (0..3).map(|n| SHIPS[n] * self.ships[n]).sum::<f64>()
            + TURNING * self.turning
            + PATTERN * self.patterns;
        let ships = self.ships[0].max(self.sums);
        let pixels = SCENE + SHIP * ships + self.computed * per_pixel + LATTICE * self.lattice;
        let rings = RING * self.rings.nodes + KEPT * self.rings.kept + BESSEL * self.rings.terms;
        let looks = LOOK * self.sources * (1.0 + self.looks) + SPECKLE * self.image;
        let table = NODE * self.table;
        let parts = [
            (pixels, Advice::Pixels),
            (rings, Advice::Turn),
            (looks, Advice::Looks),
            (table, Advice::Tolerance),
        ];
        let sum = parts.iter().map(|part| part.0).sum();
        let most = parts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        (sum, most.map_or(Advice::Pixels, |part| part.1))
    }

    /// Upper bound on bytes held at once, and advice on what to change.
    pub(super) fn bytes(&self) -> (u64, Advice) {
        use bytes::*;
        let precise = usize::from(self.precise);
        let any = |count: f64| count.min(1.0);
        let per_pixel = PIXEL
            + SUM[precise] * any(self.sums)
            + SHORT * any(self.ships[2])
            + PATTERN * self.patterns;
        let many = self.rings.most_kept > WAVES_AT_ONCE as f64;
        // Lattices of all fields at once.
        let per_pixel = per_pixel + if many { 3.0 * SUM[precise] } else { 0.0 };
        let pixels = SCENE
            + per_pixel * self.at_once
            + LATTICE * self.lattice
            + WHOLE[0] * self.whole[0]
            + WHOLE[1] * self.whole[1]
            + SUMMED * self.summed
            + SOURCE * self.sources;
        let kept = self.rings.most_kept;
        let rings = RING * self.rings.most_nodes
            + KEPT * kept
            + SPREAD[precise] * kept.min(WAVES_AT_ONCE as f64);
        let table = NODE * self.table;
        let advice = if rings > pixels {
            Advice::Turn
        } else {
            Advice::Pixels
        };
        ((pixels + rings + table) as u64, advice)
    }
}

/// Pixels over which the imaging spreads a pixel of given acceleration [m/s²].
fn taps(models: &Models, coherent: bool, acceleration: f64, tolerance: f64) -> f64 {
    let imaging = Imaging {
        range_to_velocity: models.range_to_velocity,
        incidence: models.incidence,
        resolution: match coherent {
            true => models.resolution(),
            false => models.resolution_at_rest(),
        },
    };
    let tolerance = SHARES.kernels * tolerance;
    imaging.taps(acceleration, models.pixels.computed.spacing, tolerance)
}

/// Looks simulated through an impulse response.
fn looks(scene: &Scene, models: &Models, speckled: bool) -> f64 {
    let Some(response) = models.response.filter(|_| speckled) else {
        return 0.0;
    };
    let overlap = scene.radar.look_overlap.unwrap_or(0.0);
    let window = response.range.window;
    window
        .overlapping_looks(scene.radar.looks, overlap)
        .ceil()
        .max(1.0)
}
