//! Sum of plane waves of arbitrary wavenumbers on a raster by a non-uniform FFT (type 1).
//!
//! Each wave is spread with a smooth kernel onto a lattice of wavenumbers finer than the raster's own, one FFT sums the
//! lattice, and a factor per pixel undoes the kernel. An exact lattice sum of the spread waves repeats the field in
//! neighbouring tiles; what the kernel lets through of these is the error:
//!
//! ```text
//! computed(p) = Σₘ f(p + m·tile) φ̂(p + m·tile)/φ̂(p),     |error| ≤ 2 ε Σ|strength|,  ε the kernel's error an axis
//! ```
//!
//! Two real fields share one complex transform: with strengths c and d,
//! f + ig = ½ Σ [(c + id) e^{ik·x} + (c̄ + id̄) e^{−ik·x}].
//!
//! # References
//!
//! Barnett, Magland and af Klinteberg (2019), SIAM J. Sci. Comput. 41(5), C479.

mod gridding;
mod kernel;
mod spread;

use crate::fft::{Real, Synthesis};
use crate::raster::{Field, Raster};
use crate::waves::{PlaneWaves, Quantity, Transfer, strengths};
use crate::workspace::Workspace;
use gridding::{Demand, Gridding, Size};
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use spread::{Before, Footprints};
use std::f64::consts::TAU;

/// Number of attempts: the error is checked against the computed fields, and weak fields are recomputed.
const ATTEMPTS: usize = 3;

/// Sums plane waves on a raster, one field per quantity, to a tolerance.
///
/// ```text
/// max |fast − harmonic_sum| ≤ tolerance · rms(field)
/// ```
///
/// Kernel width, lattice size and precision follow from the tolerance and the strengths. The error bound is checked against
/// the resulting fields, and fields much weaker than the sum of their waves are recomputed more accurately.
///
/// - `waves`: wavenumbers inside the raster's square |kx|, |ky| ≤ π/spacing (waves outside appear as their aliases on the
///   pixels)
/// - `tolerance`: 1e-6 to 0.1
///
/// # Validity
///
/// Fields are `f32`: each value is rounded to 6e-8 of itself. No field is more accurate than 1e-12 of the sum of its
/// |strength|.
#[must_use]
pub fn synthesize(
    waves: &PlaneWaves,
    transfer: &Transfer,
    quantities: &[Quantity],
    raster: &Raster,
    tolerance: f64,
) -> Vec<Field> {
    let mut fields = vec![Field::constant(raster, 0.0); quantities.len()];
    let mut workspace = Workspace::default();
    let take = |q: usize, field: &mut Field| std::mem::swap(&mut fields[q], field);
    let summands = Summands {
        waves,
        transfer,
        quantities,
        raster,
    };
    synthesize_each(&mut workspace, summands, tolerance, take);
    fields
}

/// Waves, and the quantities that are summed from them on a raster.
#[derive(Clone, Copy)]
pub(crate) struct Summands<'a> {
    pub(crate) waves: &'a PlaneWaves,
    pub(crate) transfer: &'a Transfer,
    pub(crate) quantities: &'a [Quantity],
    pub(crate) raster: &'a Raster,
}

/// [`synthesize`], one field at a time: `take` is called once per quantity, in any order, with its index and its field,
/// which is overwritten afterwards. Fields that are 0 everywhere are not computed.
///
/// Returns the largest bound on the error of a field, relative to its root mean square: above `tolerance` if no kernel is
/// accurate enough, 0 if nothing is computed.
pub(crate) fn synthesize_each(
    workspace: &mut Workspace,
    summands: Summands<'_>,
    tolerance: f64,
    take: impl FnMut(usize, &mut Field),
) -> f64 {
    let sums = CentredSums::new(summands, WAVES_AT_ONCE);
    sums.compute(workspace, summands.waves.len(), tolerance, take)
}

/// Fields Σₙ Re[sₙ exp(i kₙ·x)] of waves with given strengths s, one field per set of strengths, as accurate as
/// [`synthesize`]; `take` as in [`synthesize_each`].
///
/// - `wavenumbers`: kx and ky [rad/m], as many as strengths in each set
pub(crate) fn sum_strengths(
    workspace: &mut Workspace,
    wavenumbers: [&[f64]; 2],
    strengths: Vec<Vec<Complex64>>,
    raster: &Raster,
    tolerance: f64,
    take: impl FnMut(usize, &mut Field),
) -> f64 {
    let part = Part::of(wavenumbers, strengths, raster);
    let count = wavenumbers[0].len();
    CentredSums::of(raster, part).compute(workspace, count, tolerance, take)
}

impl CentredSums<'_> {
    /// Computes all fields from `waves` waves.
    fn compute(
        &self,
        workspace: &mut Workspace,
        waves: usize,
        tolerance: f64,
        mut take: impl FnMut(usize, &mut Field),
    ) -> f64 {
        let (sums, raster) = (self, self.raster);
        let mut rms: Vec<f64> = sums.sizes.iter().map(|s| s.expected_rms()).collect();
        let mut todo: Vec<usize> = (0..rms.len()).filter(|&q| rms[q] > 0.0).collect();
        let mut reached = 0.0f64;
        for attempt in 1..=ATTEMPTS {
            if todo.is_empty() || raster.is_empty() {
                break;
            }
            let demand =
                Demand::strictest(todo.iter().map(|&q| (sums.sizes[q], rms[q])), tolerance);
            let gridding = Gridding::fastest(&demand, raster, [waves, todo.len()]);
            let mut again = Vec::new();
            let check = |q: usize, field: &mut Field| {
                // A field below its own error is unreliable; the estimate falls, but never to zero.
                rms[q] = field.rms().max(1e-6 * rms[q]);
                let error = gridding.error_bound(&sums.sizes[q]) / rms[q];
                if attempt < ATTEMPTS && error > tolerance {
                    again.push(q);
                } else {
                    reached = reached.max(error);
                    take(q, field);
                }
            };
            if gridding.double_precision {
                sums.run::<f64>(workspace, &gridding, &todo, check);
            } else {
                sums.run::<f32>(workspace, &gridding, &todo, check);
            }
            todo = again;
        }
        reached
    }
}

/// Smallest number of waves per parallel task.
const MANY: usize = 1 << 12;

/// Waves spread at once; beyond that, only the waves themselves are held in memory. Chosen: about a gibibyte.
pub(crate) const WAVES_AT_ONCE: usize = 1 << 22;

/// Waves with phases relative to the raster's middle pixel.
struct CentredSums<'a> {
    raster: &'a Raster,
    /// Source of the parts if not all waves are spread at once.
    summands: Option<Summands<'a>>,
    /// One size per quantity.
    sizes: Vec<Size>,
    /// All waves, if they are spread at once.
    whole: Option<Part>,
    /// Number of waves per part otherwise.
    at_once: usize,
}

/// A part of the waves.
struct Part {
    /// Wavenumbers along y and x, in cycles per pixel.
    cycles: Vec<[f64; 2]>,
    /// One vector per quantity.
    strengths: Vec<Vec<Complex64>>,
}

impl Part {
    fn new(summands: Summands<'_>) -> Self {
        let Summands {
            waves,
            transfer,
            quantities,
            raster,
        } = summands;
        let strengths = strengths(waves, transfer, quantities);
        Self::of([&waves.kx, &waves.ky], strengths, raster)
    }

    fn of([kx, ky]: [&[f64]; 2], mut strengths: Vec<Vec<Complex64>>, raster: &Raster) -> Self {
        let (x, y) = (raster.x(raster.columns / 2), raster.y(raster.rows / 2));
        let phases: Vec<Complex64> = (0..kx.len())
            .into_par_iter()
            .with_min_len(MANY)
            .map(|n| Complex64::cis(kx[n] * x + ky[n] * y))
            .collect();
        strengths.par_iter_mut().for_each(|strengths| {
            strengths.iter_mut().zip(&phases).for_each(|(s, p)| *s *= p);
        });
        let step = raster.spacing / TAU;
        Self {
            cycles: (0..kx.len())
                .into_par_iter()
                .with_min_len(MANY)
                .map(|n| [ky[n] * step, kx[n] * step])
                .collect(),
            strengths,
        }
    }

    fn footprints<T: Real>(&self, gridding: &Gridding) -> Footprints<T> {
        let [rows, columns] = gridding.lattice.map(|n| n as f64);
        let scaled = |c: &[f64; 2]| [c[0] * rows, c[1] * columns];
        let scaled: Vec<[f64; 2]> = self.cycles.iter().map(scaled).collect();
        Footprints::new(&scaled, &gridding.kernel, gridding.lattice)
    }

    /// Strengths at k and −k for a pair of quantities: (c + id)/2 and (c̄ + id̄)/2.
    fn paired<T: Real>(&self, pair: &[usize]) -> Vec<[Complex<T>; 2]> {
        let first = &self.strengths[pair[0]];
        let second = pair.get(1).map(|&q| &self.strengths[q]);
        let round = |c: Complex64| {
            Complex::new(
                <T as Real>::from_f64(0.5 * c.re),
                <T as Real>::from_f64(0.5 * c.im),
            )
        };
        (0..first.len())
            .into_par_iter()
            .with_min_len(MANY)
            .map(|n| {
                let (c, d) = (first[n], second.map_or(Complex64::ZERO, |s| s[n]));
                let i = Complex64::i();
                [round(c + i * d), round(c.conj() + i * d.conj())]
            })
            .collect()
    }
}

impl<'a> CentredSums<'a> {
    /// Waves to be summed, all at once or in parts.
    ///
    /// - `at_once`: largest number of waves spread at once
    fn new(summands: Summands<'a>, at_once: usize) -> Self {
        let Summands {
            waves,
            quantities,
            raster,
            ..
        } = summands;
        Self {
            raster,
            summands: Some(summands),
            sizes: Vec::new(),
            whole: (waves.len() <= at_once).then(|| Part::new(summands)),
            at_once,
        }
        .sized(quantities.len())
    }

    /// Sums of the waves of one part.
    fn of(raster: &'a Raster, part: Part) -> Self {
        let count = part.strengths.len();
        Self {
            raster,
            summands: None,
            sizes: Vec::new(),
            whole: Some(part),
            at_once: usize::MAX,
        }
        .sized(count)
    }

    /// Computes the sizes of the strengths of `count` fields.
    fn sized(mut self, count: usize) -> Self {
        let mut totals = vec![[0.0; 2]; count];
        self.each_part(|part| {
            let sums = totals.par_iter_mut().zip(&part.strengths);
            sums.for_each(|(total, strengths)| {
                for strength in strengths {
                    let square = strength.norm_sqr();
                    total[0] += square.sqrt();
                    total[1] += square;
                }
            });
        });
        let size = |[sum, squares]: [f64; 2]| Size {
            sum,
            root: squares.sqrt(),
        };
        self.sizes = totals.into_iter().map(size).collect();
        self
    }

    /// Visits the waves, part by part.
    fn each_part(&self, mut look: impl FnMut(&Part)) {
        if let Some(part) = &self.whole {
            return look(part);
        }
        let Some(summands) = self.summands else {
            return;
        };
        let waves = summands.waves;
        for start in (0..waves.len()).step_by(self.at_once) {
            let some = waves.part(start..(start + self.at_once).min(waves.len()));
            look(&Part::new(Summands {
                waves: &some,
                ..summands
            }));
        }
    }

    /// Computes the fields with the indices `todo`, two at a time, and passes each to `done`.
    fn run<T: Real>(
        &self,
        workspace: &mut Workspace,
        gridding: &Gridding,
        todo: &[usize],
        mut done: impl FnMut(usize, &mut Field),
    ) {
        let raster = self.raster;
        let [rows, columns] = gridding.lattice;
        let mut fields = [(); 2].map(|()| workspace.field(raster));
        let (blocks, planner) = T::of(workspace);
        let synthesis = Synthesis::<T>::planned(planner, rows, columns);
        let correct = |pixels, lattice| -> Vec<T> {
            let factors = gridding.kernel.correction(pixels, lattice);
            factors.into_iter().map(<T as Real>::from_f64).collect()
        };
        let down = correct(raster.rows, rows);
        let right = correct(raster.columns, columns);
        let start = [rows / 2 - raster.rows / 2, columns / 2 - raster.columns / 2];
        let keep = [raster.rows, raster.columns];
        let mut transform = |pair: &[usize], lattice: &mut [Complex<T>]| {
            let [re, im] = fields.each_mut().map(|field| &mut field.values[..]);
            synthesis.run_window(lattice, start, keep, [re, im], |i, row| {
                for (v, &factor) in row.iter_mut().zip(&right) {
                    *v = *v * (factor * down[i]);
                }
            });
            for (&q, field) in pair.iter().zip(&mut fields) {
                done(q, field);
            }
        };
        if let Some(part) = &self.whole {
            let footprints = part.footprints::<T>(gridding);
            let mut lattice = blocks.take(rows * columns);
            for pair in todo.chunks(2) {
                let before = Before::Nothing;
                footprints.spread(&part.paired::<T>(pair), &mut lattice, before);
                transform(pair, &mut lattice);
            }
            blocks.give(lattice);
        } else {
            // One lattice per pair, so that each part is visited only once.
            let mut lattices: Vec<Vec<Complex<T>>> = todo
                .chunks(2)
                .map(|_| blocks.take(rows * columns))
                .collect();
            let mut before = Before::Nothing;
            self.each_part(|part| {
                let footprints = part.footprints::<T>(gridding);
                for (pair, lattice) in todo.chunks(2).zip(&mut lattices) {
                    footprints.spread(&part.paired::<T>(pair), lattice, before);
                }
                before = Before::Waves;
            });
            for (pair, mut lattice) in todo.chunks(2).zip(lattices) {
                transform(pair, &mut lattice);
                blocks.give(lattice);
            }
        }
        fields.into_iter().for_each(|field| workspace.give(field));
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact zeros")]
mod tests;
