//! The linear fields of a ship's wake, and the sums that give their derivatives.
//!
//! ```text
//! F(x)  = Re Σ c e^{ik·(x − p)}                          p midship, c the strength of a wave of the frozen nodes
//! dF(x) = Re Σ [dc + i c (dk·(x − p) − k·dp)] e^{ik·(x − p)},     dk = κ k + ρ (k_y, −k_x)
//! ```
//!
//! A change of speed stretches all waves (κ), in deep water by one factor; a change of heading turns them (ρ). The derivatives by
//! speed, heading and position therefore share the sums of i k c.

use crate::estimate::value::Value;
use crate::kelvin::{KelvinWake, WakePlan};
use crate::nufft;
use crate::raster::{Field, Raster};
use crate::scene::Term;
use crate::track::Track;
use crate::waves::{LARGEST_MODULATING_WAVENUMBER, PlaneWaves, Quantity, Transfer};
use crate::workspace::Workspace;
use num_complex::Complex64;
use rayon::prelude::*;

/// Linear fields from which the image is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Linear {
    SlopeX,
    SlopeY,
    Radial,
    Elevation,
    Acceleration,
    Modulation,
}

/// Number of the fields.
pub(super) const LINEAR: usize = 6;

impl Linear {
    /// Fields that a plan needs, in order.
    pub(super) fn needed(uses: impl Fn(Term) -> bool) -> Vec<Self> {
        let terms = [
            (Self::SlopeX, Term::Kelvin),
            (Self::SlopeY, Term::Kelvin),
            (Self::Radial, Term::VelocityBunching),
            (Self::Elevation, Term::RangeBunching),
            (Self::Acceleration, Term::AzimuthSmear),
            (Self::Modulation, Term::Hydrodynamic),
        ];
        let needed = terms.into_iter().filter(|(_, term)| uses(*term));
        needed.map(|(linear, _)| linear).collect()
    }

    fn factor(self, transfer: &Transfer, k: [f64; 2], omega: f64) -> Complex64 {
        let of = |quantity| transfer.factor(quantity, k, omega);
        match self {
            Self::SlopeX => of(Quantity::SlopeX),
            Self::SlopeY => of(Quantity::SlopeY),
            Self::Radial => transfer.radial(k, omega),
            Self::Elevation => of(Quantity::Elevation),
            Self::Acceleration => of(Quantity::RadialAcceleration),
            Self::Modulation => transfer.modulation(k, omega),
        }
    }
}

/// Waves of a wake and their strengths, one vector per field, with phases relative to midship.
struct Strengths {
    waves: PlaneWaves,
    of: Vec<Vec<Complex64>>,
}

/// A wake with the transfer of its surroundings.
pub(super) type Seen<'a> = (&'a KelvinWake, &'a Transfer);

impl Strengths {
    /// - `modulating`: whether each wave modulates, by the wavenumbers of the frozen plan
    fn new(
        (wake, transfer): Seen<'_>,
        plan: &WakePlan,
        fields: &[Linear],
        modulating: Option<&[bool]>,
    ) -> Self {
        let track = Track {
            position: [0.0; 2],
            ..wake.track
        };
        let waves = KelvinWake { track, ..*wake }.waves(plan);
        let strengths = |&field: &Linear| {
            let strength = |n: usize| {
                let k = [waves.kx[n], waves.ky[n]];
                let mute = field == Linear::Modulation && modulating.is_some_and(|m| !m[n]);
                let factor = field.factor(transfer, k, waves.omega[n]);
                if mute || k[0].hypot(k[1]) <= 0.0 && field != Linear::Elevation {
                    Complex64::ZERO
                } else {
                    factor * waves.amplitude[n]
                }
            };
            (0..waves.len()).map(strength).collect()
        };
        Self {
            of: fields.iter().map(strengths).collect(),
            waves,
        }
    }
}

/// Change of the waves with one value.
pub(super) struct Change<'a> {
    /// The wake and its transfer at −2, −1, 1 and 2 steps; the first and last are missing for two-point differences.
    pub(super) seen: [Option<Seen<'a>>; 4],
    pub(super) step: f64,
    pub(super) value: Value,
}

/// Derivative by central differences: of fourth order with four points, of second order with two.
pub(super) fn difference<T>(points: [Option<T>; 4], step: f64) -> T
where
    T: Copy + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
{
    match points {
        [Some(a), Some(b), Some(c), Some(d)] => ((c - b) * 8.0 - (d - a)) * (1.0 / (12.0 * step)),
        [_, Some(b), Some(c), _] => (c - b) * (1.0 / (2.0 * step)),
        _ => unreachable!("differences have two points at least"),
    }
}

/// The sums of one field.
#[derive(Default)]
pub(super) struct Sums {
    /// F.
    pub(super) field: Field,
    /// Re Σ i k c e^{…} along x and y.
    pub(super) gradient: [Field; 2],
    /// The gradient with each wave multiplied by its κ, where κ differs between waves.
    pub(super) stretched: Option<[Field; 2]>,
    /// Re Σ dc e^{…} by value.
    pub(super) strength: Vec<(Value, Field)>,
}

/// All sums of a wake, and κ by speed where all waves share it.
pub(super) struct WakeSums {
    pub(super) sums: Vec<Sums>,
    pub(super) stretch: f64,
}

/// Sum to which a set of strengths belongs.
#[derive(Clone, Copy)]
enum Part {
    Field,
    Gradient(usize),
    Stretched(usize),
    Strength(Value),
}

/// Frozen waves, and the fields that are summed from them.
pub(super) struct Nodes<'a> {
    pub(super) plan: &'a WakePlan,
    /// Whether each wave modulates.
    pub(super) modulating: &'a [bool],
    pub(super) fields: &'a [Linear],
    /// Tolerance of the sums.
    pub(super) tolerance: f64,
}

/// Sums of a wake on a raster.
///
/// - `changes`: values with derivatives; empty for a wake that no value changes
pub(super) fn sums(
    workspace: &mut Workspace,
    seen: Seen<'_>,
    nodes: &Nodes<'_>,
    changes: &[Change<'_>],
    raster: &Raster,
) -> WakeSums {
    let Nodes {
        plan,
        modulating,
        fields,
        tolerance,
    } = *nodes;
    let of = |seen| Strengths::new(seen, plan, fields, Some(modulating));
    let here = of(seen);
    let changed: Vec<(Value, [Option<Strengths>; 4], f64)> = changes
        .par_iter()
        .map(|change| (change.value, change.seen.map(|s| s.map(of)), change.step))
        .collect();
    let stretches = changed
        .iter()
        .find(|(value, ..)| *value == Value::Speed)
        .map(|(_, points, step)| stretches(&here.waves, points, *step));
    let common = stretches.as_ref().and_then(|all| {
        let first = *all.first()?;
        let same = all.iter().all(|s| (s - first).abs() < 1e-7 * first.abs());
        same.then_some(first)
    });
    let mut todo: Vec<(usize, Part, Vec<Complex64>)> = Vec::new();
    for (q, strengths) in here.of.iter().enumerate() {
        todo.push((q, Part::Field, strengths.clone()));
        if changes.is_empty() {
            continue;
        }
        let i = Complex64::i();
        for (axis, k) in [&here.waves.kx, &here.waves.ky].into_iter().enumerate() {
            let gradient: Vec<Complex64> =
                strengths.iter().zip(k).map(|(c, k)| i * c * k).collect();
            if let Some(stretches) = stretches.as_ref().filter(|_| common.is_none()) {
                let each = gradient.iter().zip(stretches);
                let stretched = each.map(|(g, s)| g * s).collect();
                todo.push((q, Part::Stretched(axis), stretched));
            }
            todo.push((q, Part::Gradient(axis), gradient));
        }
        for (value, points, step) in &changed {
            let slopes: Vec<Complex64> = (0..here.waves.len())
                .map(|n| difference(points.each_ref().map(|p| Some(p.as_ref()?.of[q][n])), *step))
                .collect();
            if slopes.iter().any(|c| *c != Complex64::ZERO) {
                todo.push((q, Part::Strength(*value), slopes));
            }
        }
    }
    // Phases relative to the origin of the raster.
    let [x, y] = seen.0.track.position;
    let waves = &here.waves;
    let phases: Vec<Complex64> = (0..waves.len())
        .map(|n| Complex64::cis(-(waves.kx[n] * x + waves.ky[n] * y)))
        .collect();
    let mut keys = Vec::new();
    let mut sets = Vec::new();
    for (q, part, mut set) in todo {
        set.iter_mut().zip(&phases).for_each(|(c, p)| *c *= p);
        keys.push((q, part));
        sets.push(set);
    }
    let mut sums: Vec<Sums> = fields.iter().map(|_| Sums::default()).collect();
    for (q, part) in &keys {
        let flat = Field::constant(raster, 0.0);
        *place(&mut sums[*q], *part) = flat;
    }
    let take = |n: usize, field: &mut Field| {
        let (q, part) = keys[n];
        std::mem::swap(place(&mut sums[q], part), field);
    };
    nufft::sum_strengths(
        workspace,
        [&waves.kx, &waves.ky],
        sets,
        raster,
        tolerance,
        take,
    );
    WakeSums {
        sums,
        stretch: common.unwrap_or(0.0),
    }
}

/// Field that holds a part.
fn place(sums: &mut Sums, part: Part) -> &mut Field {
    match part {
        Part::Field => &mut sums.field,
        Part::Gradient(axis) => &mut sums.gradient[axis],
        Part::Stretched(axis) => &mut sums.stretched.get_or_insert_default()[axis],
        Part::Strength(value) => {
            let at = sums.strength.iter().position(|(v, _)| *v == value);
            let at = at.unwrap_or_else(|| {
                sums.strength.push((value, Field::default()));
                sums.strength.len() - 1
            });
            &mut sums.strength[at].1
        }
    }
}

/// κ of each wave, d ln k by speed at a fixed direction.
fn stretches(here: &PlaneWaves, points: &[Option<Strengths>; 4], step: f64) -> Vec<f64> {
    let logarithm = |waves: &PlaneWaves, n: usize| waves.kx[n].hypot(waves.ky[n]).ln();
    let of = |n: usize| {
        let point = |p: &Option<Strengths>| Some(logarithm(&p.as_ref()?.waves, n));
        let stretch: f64 = difference(points.each_ref().map(point), step);
        if stretch.is_finite() { stretch } else { 0.0 }
    };
    (0..here.len()).map(of).collect()
}

/// Whether each wave of a frozen plan modulates.
pub(super) fn modulating(wake: &KelvinWake, plan: &WakePlan) -> Vec<bool> {
    let waves = wake.waves(plan);
    let modulates = |n: usize| waves.kx[n].hypot(waves.ky[n]) <= LARGEST_MODULATING_WAVENUMBER;
    (0..waves.len()).map(modulates).collect()
}
