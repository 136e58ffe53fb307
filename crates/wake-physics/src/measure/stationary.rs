//! Speed and heading from the waves that are stationary beside the ship.

use super::spectrum::PowerSpectrum;
use super::{Measured, angle_between};
use crate::constants::GRAVITY;
use crate::raster::Field;
use rayon::prelude::*;

/// Speeds tried [m/s]: first, step, number.
const SPEEDS: (f64, f64, usize) = (4.6, 0.3, 32);
/// Fastest speed tried [m/s].
pub(super) const FASTEST: f64 = SPEEDS.0 + SPEEDS.1 * (SPEEDS.2 - 1) as f64;
/// Headings tried to each side of the heading from the arms \[deg\]: step, number.
const HEADINGS: (f64, i64) = (2.0, 15);
/// Wavenumbers used: from this many steps of the spectrum …
const LOWEST: f64 = 7.3;
/// … to this fraction of the largest that a pixel carries.
const HIGHEST: f64 = 0.57;
/// Standard deviations of the ridge and of the surroundings from which it must stand out \[steps of the spectrum\].
const RIDGE: [f64; 2] = [1.0, 5.0];
/// Score from which the ridge is accepted.
const THRESHOLD: f64 = 7.0;
/// Number of refinement steps.
const REFINEMENTS: usize = 8;

/// One wavenumber: its direction, its magnitude, and its strength in the wake.
struct Cell {
    unit: [f64; 2],
    /// √(g/k), the phase speed [m/s].
    phase_speed: f64,
    /// Steps of the spectrum per m/s of residual, 2k/(c Δk).
    steps: f64,
    strength: f64,
}

/// The measured velocity.
pub(super) struct Velocity {
    pub(super) speed: Measured,
    pub(super) heading: Measured,
}

/// The velocity beside which the waves of `wake` are stationary.
///
/// A wave keeps its place beside the ship if the ship's velocity along the wave's direction is its phase speed:
///
/// ```text
/// k̂·U = √(g/k)          (the curve k = g/(U² cos²θ) in the plane of wavenumbers)
/// ```
///
/// Every wavenumber with energy is thus a line in the plane of velocities. The velocity through which most lines pass is searched
/// on a lattice (matched filter: ridge minus surroundings) and refined by weighted least squares. Energy is ln(1 + P/(P₀ + max
/// P₀)) with P₀ the smoothed spectrum of the sea opposite the wake.
///
/// # References
///
/// Lord Kelvin (1887); the curve: Lighthill (1978), *Waves in Fluids*, section 3.10.
pub(super) fn velocity(
    wake: &PowerSpectrum,
    sea: &Field,
    largest_wavenumber: f64,
    heading: f64,
) -> Velocity {
    let cells = cells(wake, sea, largest_wavenumber);
    let candidates: Vec<(f64, f64, f64)> = (-HEADINGS.1..=HEADINGS.1)
        .into_par_iter()
        .flat_map_iter(|n| {
            let tried = heading + HEADINGS.0 * n as f64;
            scores(&cells, tried)
                .into_iter()
                .map(move |(speed, score)| (score, speed, tried))
        })
        .collect();
    let Some(&(score, speed, tried)) = candidates.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Velocity {
            speed: Measured::NOTHING,
            heading: Measured::NOTHING,
        };
    };
    let [u, v] = refined(&cells, velocity_of(speed, tried));
    let (fine_speed, fine) = (u.hypot(v), u.atan2(v).to_degrees().rem_euclid(360.0));
    // Falls back to the lattice where the refinement ran away to another ridge.
    let kept = (fine_speed - speed).abs() < 2.0 * SPEEDS.1
        && angle_between(fine, tried).abs() < 3.0 * HEADINGS.0;
    // A maximum at the end of the lattice is the flank of something beyond it.
    let inner = speed > SPEEDS.0 && speed < FASTEST;
    let score = if inner { score } else { 0.0 };
    let (speed, heading) = if kept {
        (fine_speed, fine)
    } else {
        (speed, tried)
    };
    Velocity {
        speed: Measured::with_threshold(speed, score, THRESHOLD),
        heading: Measured::with_threshold(heading.rem_euclid(360.0), score, THRESHOLD),
    }
}

fn velocity_of(speed: f64, heading: f64) -> [f64; 2] {
    let (sin, cos) = heading.to_radians().sin_cos();
    [speed * sin, speed * cos]
}

/// Half of the wavenumber plane (the spectrum is even), with strengths scaled to mean 0 and standard deviation 1.
fn cells(wake: &PowerSpectrum, sea: &Field, largest_wavenumber: f64) -> Vec<Cell> {
    let step = wake.resolution();
    let floor = sea.values.iter().copied().fold(0.0f32, f32::max);
    let band = LOWEST * step..HIGHEST * largest_wavenumber;
    let mut cells: Vec<Cell> = (0..sea.values.len())
        .filter_map(|n| {
            let [kx, ky] = wake.wavenumber(n);
            let k = kx.hypot(ky);
            let half = kx > 0.0 || (kx == 0.0 && ky > 0.0);
            (half && band.contains(&k) && floor > 0.0).then(|| {
                let phase_speed = (GRAVITY / k).sqrt();
                Cell {
                    unit: [kx / k, ky / k],
                    phase_speed,
                    steps: 2.0 * k / (phase_speed * step),
                    strength: f64::from(wake.power.values[n] / (sea.values[n] + floor)).ln_1p(),
                }
            })
        })
        .collect();
    let count = cells.len().max(1) as f64;
    let mean = cells.iter().map(|c| c.strength).sum::<f64>() / count;
    let variance = cells
        .iter()
        .map(|c| (c.strength - mean).powi(2))
        .sum::<f64>()
        / count;
    let std = variance.sqrt().max(1e-12);
    for cell in &mut cells {
        cell.strength = (cell.strength - mean) / std;
    }
    cells
}

/// Scores of the matched filter at every speed on one heading.
fn scores(cells: &[Cell], heading: f64) -> Vec<(f64, f64)> {
    let [ux, uy] = velocity_of(1.0, heading);
    let [narrow, wide] = RIDGE;
    let mut sums = vec![(0.0, 0.0); SPEEDS.2];
    for cell in cells {
        let along = (cell.unit[0] * ux + cell.unit[1] * uy).abs();
        for (n, (product, norm)) in sums.iter_mut().enumerate() {
            let speed = SPEEDS.0 + SPEEDS.1 * n as f64;
            let residual = (speed * along - cell.phase_speed) * cell.steps;
            if residual.abs() > 3.0 * wide {
                continue;
            }
            let bell = |std: f64| (-0.5 * (residual / std).powi(2)).exp();
            let filter = bell(narrow) - narrow / wide * bell(wide);
            *product += filter * cell.strength;
            *norm += filter * filter;
        }
    }
    sums.into_iter()
        .enumerate()
        .map(|(n, (product, norm))| {
            let speed = SPEEDS.0 + SPEEDS.1 * n as f64;
            (speed, product / (norm + 1.0f64).sqrt())
        })
        .collect()
}

/// Weighted least squares on ±k̂·U = c, with weights updated from the residuals.
fn refined(cells: &[Cell], start: [f64; 2]) -> [f64; 2] {
    let mut velocity = start;
    for _ in 0..REFINEMENTS {
        let [mut xx, mut xy, mut yy, mut bx, mut by] = [0.0; 5];
        for cell in cells.iter().filter(|cell| cell.strength > 0.0) {
            let along = cell.unit[0] * velocity[0] + cell.unit[1] * velocity[1];
            let [ex, ey] = cell.unit.map(|e| e * along.signum());
            let residual = (along.abs() - cell.phase_speed) * cell.steps;
            if residual.abs() > 5.0 {
                continue;
            }
            let bell = (-0.5 * (residual / RIDGE[0]).powi(2)).exp();
            let weight = cell.strength * bell * cell.steps.powi(2);
            xx += weight * ex * ex;
            xy += weight * ex * ey;
            yy += weight * ey * ey;
            bx += weight * ex * cell.phase_speed;
            by += weight * ey * cell.phase_speed;
        }
        let determinant = xx * yy - xy * xy;
        if determinant <= 1e-9 * xx * yy {
            break;
        }
        velocity = [
            (yy * bx - xy * by) / determinant,
            (xx * by - xy * bx) / determinant,
        ];
    }
    velocity
}
