//! Mean σ⁰ of a facet by its slope and by wind and incidence: a polynomial with all its derivatives.
//!
//! ```text
//! σ(s) = ∬ p(u) σ_facet(s + u) du      p Gaussian: the slopes of the whole sea
//! ```
//!
//! The average makes σ an entire function, so Chebyshev polynomials converge as fast as they do for a Gaussian of the
//! width of p. The Bragg return is sampled once on a lattice of slopes and averaged at the nodes; derivatives by the slope are
//! those of the polynomial, derivatives by wind and incidence are central differences of whole tables of nodes.

use crate::numeric::vector::exp;
use crate::numeric::vectorized;
use crate::scattering::Backscatter;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Spacing of plane facets \[1\]: that of the first try of the table.
const SPACING: f64 = 0.02;

/// Standard deviations that an average looks at.
const REACH: f64 = 5.5;

/// Values by which tables are differenced: wind speed, wind direction, incidence.
pub(super) const OUTER: usize = 3;

/// Bragg return, specular return, and the derivatives of both by the outer values.
const CHANNELS: usize = 2 * (1 + OUTER);

/// Cells of the spline across the square of slopes, and beyond it on each side, where the conditions at its ends fade.
const CELLS: usize = 64;
const BEYOND: usize = 6;

/// The polynomial, as a cubic spline that is faster to look up: twice differentiable, of fourth order in cells of a
/// thirty-second of the reach.
pub(super) struct CrossSection {
    /// Half the side of the square of slopes that it covers \[1\].
    reach: f64,
    /// Coefficients of B-splines, `[side, side]`, that of the slope along x running fastest.
    coefficients: Vec<[f64; CHANNELS]>,
}

/// Coefficients along each axis.
const SIDE: usize = CELLS + 2 * BEYOND + 1;

/// σ⁰ at one slope: Bragg and specular.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct At {
    pub(super) value: [f64; 2],
    /// By the slopes along x and y.
    pub(super) slope: [[f64; 2]; 2],
    /// By wind speed, wind direction and incidence.
    pub(super) outer: [[f64; OUTER]; 2],
}

/// Nodes that a polynomial needs over slopes up to `reach`.
pub(super) fn nodes_for(backscatter: &Backscatter, reach: f64) -> usize {
    let narrowest = backscatter.tilt.principal_axes().variance[1].sqrt();
    (7.0 + 6.0 * reach / narrowest).ceil().min(48.0) as usize
}

impl CrossSection {
    /// Fits σ⁰ over the square of slopes up to `reach`.
    ///
    /// - `outer`: for each outer value σ⁰ at a step below and above, and twice the step; `None` for no derivative
    pub(super) fn new(
        here: &Backscatter,
        outer: &[Option<([&Backscatter; 2], f64)>; OUTER],
        reach: f64,
        nodes: usize,
    ) -> Self {
        let axes = here.tilt.principal_axes();
        let beyond = reach * (1.0 + 2.0 * BEYOND as f64 / CELLS as f64);
        let far = beyond + REACH * axes.variance[0].sqrt();
        let places = chebyshev_nodes(nodes, beyond);
        let table = |b: &Backscatter| averages(b, &places, far);
        let mut channels = vec![[0.0; CHANNELS]; nodes * nodes];
        let mut put = |channel: usize, values: &[[f64; 2]]| {
            for (to, from) in channels.iter_mut().zip(values) {
                to[channel] = from[0];
                to[channel + 1 + OUTER] = from[1];
            }
        };
        put(0, &table(here));
        for (n, pair) in outer.iter().enumerate() {
            if let Some(([below, above], width)) = pair {
                let [below, above] = [table(below), table(above)];
                let difference =
                    |(a, b): (&[f64; 2], &[f64; 2])| [(b[0] - a[0]) / width, (b[1] - a[1]) / width];
                let slopes: Vec<_> = below.iter().zip(&above).map(difference).collect();
                put(1 + n, &slopes);
            }
        }
        Self {
            reach,
            coefficients: spline(&coefficients(&channels, nodes), nodes),
        }
    }

    /// σ⁰ at a slope; steeper slopes than the polynomial covers are taken as its edge.
    #[inline(always)]
    pub(super) fn at(&self, slope: [f64; 2]) -> At {
        let per = CELLS as f64 / (2.0 * self.reach);
        let mut first_cell = [0; 2];
        let mut weights = [[[0.0; 4]; 2]; 2];
        for axis in 0..2 {
            let inside = slope[axis].clamp(-self.reach, self.reach);
            let place = (inside + self.reach) * per + BEYOND as f64;
            let cell = (place as usize).min(SIDE - 3);
            first_cell[axis] = cell - 1;
            weights[axis] = spline_weights(place - cell as f64);
        }
        let [[u, du], [v, dv]] = weights;
        let mut value = [0.0; CHANNELS];
        let mut first = [[0.0; 2]; 2];
        for j in 0..4 {
            let start = (first_cell[1] + j) * SIDE + first_cell[0];
            let Some(line) = self.coefficients[start..].first_chunk::<4>() else {
                continue;
            };
            let mut sum = [0.0; CHANNELS];
            let mut slope = [0.0; 2];
            for (i, c) in line.iter().enumerate() {
                for (sum, c) in sum.iter_mut().zip(c) {
                    *sum += u[i] * c;
                }
                for (n, c) in [c[0], c[1 + OUTER]].into_iter().enumerate() {
                    slope[n] += du[i] * c;
                }
            }
            for (value, sum) in value.iter_mut().zip(&sum) {
                *value += v[j] * sum;
            }
            for n in 0..2 {
                let sum = sum[n * (1 + OUTER)];
                first[n][0] += v[j] * slope[n];
                first[n][1] += dv[j] * sum;
            }
        }
        At {
            value: [value[0], value[1 + OUTER]],
            slope: first.map(|d| d.map(|d| per * d)),
            outer: [0, 1].map(|n| std::array::from_fn(|p| value[n * (1 + OUTER) + 1 + p])),
        }
    }
}

/// Zeros of the Chebyshev polynomial of degree `count`, scaled to ±`reach`.
fn chebyshev_nodes(count: usize, reach: f64) -> Vec<f64> {
    let node = |n: usize| reach * (PI * (n as f64 + 0.5) / count as f64).cos();
    (0..count).map(node).collect()
}

/// Weights of four B-splines at t in their middle cell, with their derivatives.
#[inline(always)]
fn spline_weights(t: f64) -> [[f64; 4]; 2] {
    let r = 1.0 - t;
    [
        [
            r * r * r / 6.0,
            (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0,
            t * t * t / 6.0,
        ],
        [
            -0.5 * r * r,
            -2.0 * t + 1.5 * t * t,
            2.0 * r - 1.5 * r * r,
            0.5 * t * t,
        ],
    ]
}

/// B-spline coefficients of a polynomial given by Chebyshev coefficients: values at the knots, then the inverse of 1/6, 4/6, 1/6 along both axes.
fn spline(polynomial: &[[f64; CHANNELS]], count: usize) -> Vec<[f64; CHANNELS]> {
    let chebyshev: Vec<f64> = (0..SIDE)
        .flat_map(|n| {
            let half = (CELLS / 2 + BEYOND) as f64;
            let at = n as f64 / half - 1.0;
            let angle = at.clamp(-1.0, 1.0).acos();
            (0..count).map(move |degree| (degree as f64 * angle).cos())
        })
        .collect();
    let sum = |rows: &[[f64; CHANNELS]], stride: usize, n: usize| {
        let mut sum = [0.0; CHANNELS];
        for degree in 0..count {
            let t = chebyshev[n * count + degree];
            for (sum, c) in sum.iter_mut().zip(&rows[degree * stride]) {
                *sum += t * c;
            }
        }
        sum
    };
    // [degree along y, knot along x], then [knot along y, knot along x].
    let half: Vec<[f64; CHANNELS]> = (0..count * SIDE)
        .map(|n| sum(&polynomial[(n / SIDE) * count..], 1, n % SIDE))
        .collect();
    let mut out: Vec<[f64; CHANNELS]> = (0..SIDE * SIDE)
        .map(|n| sum(&half[n % SIDE..], SIDE, n / SIDE))
        .collect();
    for (step, line) in [(1, SIDE), (SIDE, 1)] {
        for n in 0..SIDE {
            let places: Vec<usize> = (0..SIDE).map(|k| n * line + k * step).collect();
            (0..CHANNELS).for_each(|channel| {
                let mut values: Vec<f64> = places.iter().map(|&at| out[at][channel]).collect();
                unsmooth(&mut values);
                for (&at, value) in places.iter().zip(values) {
                    out[at][channel] = value;
                }
            });
        }
    }
    out
}

/// Solves (c₋ + 4c + c₊)/6 = value along a line, its ends left as they are.
fn unsmooth(values: &mut [f64]) {
    let last = values.len() - 1;
    let mut factor = vec![0.0; last];
    for n in 1..last {
        let pivot = 1.0 / (4.0 - factor[n - 1]);
        factor[n] = pivot;
        values[n] = (6.0 * values[n] - values[n - 1]) * pivot;
    }
    for n in (1..last).rev() {
        values[n] -= factor[n] * values[n + 1];
    }
}

/// Coefficients of the polynomial through values at the nodes.
fn coefficients(values: &[[f64; CHANNELS]], count: usize) -> Vec<[f64; CHANNELS]> {
    let cosine = |degree: usize, node: usize| {
        let weight = if degree == 0 { 1.0 } else { 2.0 };
        weight / count as f64 * (PI * degree as f64 * (node as f64 + 0.5) / count as f64).cos()
    };
    let mut half = vec![[0.0; CHANNELS]; count * count];
    let mut out = half.clone();
    for (n, half) in half.iter_mut().enumerate() {
        let (j, degree) = (n / count, n % count);
        for i in 0..count {
            let weight = cosine(degree, i);
            for (sum, v) in half.iter_mut().zip(&values[j * count + i]) {
                *sum += weight * v;
            }
        }
    }
    for (n, out) in out.iter_mut().enumerate() {
        let (degree, i) = (n / count, n % count);
        for j in 0..count {
            let weight = cosine(degree, j);
            for (sum, v) in out.iter_mut().zip(&half[j * count + i]) {
                *sum += weight * v;
            }
        }
    }
    out
}

/// Bragg and specular return at all pairs of places, the one along x running fastest.
///
/// - `far`: half the side of the lattice of plane facets
fn averages(backscatter: &Backscatter, places: &[f64], far: f64) -> Vec<[f64; 2]> {
    let half = (far / SPACING).ceil() as i32;
    let side = (2 * half + 1) as usize;
    let first = -f64::from(half) * SPACING;
    let at = |n: usize| first + n as f64 * SPACING;
    let mut facets = vec![0.0; side * side];
    let rows = facets.par_chunks_exact_mut(side).enumerate();
    rows.for_each(|(j, row)| {
        let two_scale = &backscatter.two_scale;
        two_scale.facets([first, at(j)], [SPACING, 0.0], row);
    });
    let tilt = &backscatter.tilt;
    let determinant = tilt.determinant();
    let [xx, xy, yy] = [tilt.yy, -tilt.xy, tilt.xx].map(|c| 0.5 * c / determinant);
    let count = places.len();
    (0..count * count)
        .into_par_iter()
        .map(|n| {
            let [x, y] = [places[n % count], places[n / count]];
            let (mut sum, mut weights) = (0.0, 0.0);
            let around = (REACH + 1.0) * tilt.xx.sqrt() / SPACING;
            let middle = (x - first) / SPACING;
            let from = (middle - around).max(0.0) as usize;
            let to = ((middle + around).ceil() as usize).min(side);
            for (j, row) in facets.chunks_exact(side).enumerate() {
                let dy = at(j) - y;
                let dx = at(from) - x;
                let start = xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy;
                // Rows this far weigh nothing.
                if dy * dy > tilt.yy * (REACH * REACH + 16.0) {
                    continue;
                }
                let slope = 2.0 * (xx * dx + xy * dy) * SPACING + xx * SPACING * SPACING;
                let [line, weight] =
                    weighed_row(&row[from..to], start, slope, 2.0 * xx * SPACING * SPACING);
                sum += line;
                weights += weight;
            }
            [sum / weights, backscatter.specular.sigma0([x, y])]
        })
        .collect()
}

/// Σ f e^{−q(n)} and Σ e^{−q(n)} of a quadratic q with the given start, first and second difference.
///
/// Weights that are eight apart follow from one another: e^{−q(n+8)} = e^{−q(n)} r(n), and r(n+8) = r(n) e^{−64 q''}.
fn weighed_row(row: &[f64], start: f64, slope: f64, bend: f64) -> [f64; 2] {
    const LANES: usize = 8;
    let lanes = LANES as f64;
    let (mut sum, mut weights) = ([0.0; LANES], [0.0; LANES]);
    vectorized(
        #[inline(always)]
        || {
            let (mut weight, mut ratio) = ([0.0; LANES], [0.0; LANES]);
            for n in 0..LANES {
                let at = n as f64;
                weight[n] = exp(-start - at * slope - 0.5 * at * (at - 1.0) * bend);
                ratio[n] = exp(-lanes * slope - bend * (lanes * at + 0.5 * lanes * (lanes - 1.0)));
            }
            let change = exp(-lanes * lanes * bend);
            for chunk in row.chunks(LANES) {
                for (lane, &value) in chunk.iter().enumerate() {
                    sum[lane] += weight[lane] * value;
                    weights[lane] += weight[lane];
                }
                for lane in 0..LANES {
                    weight[lane] *= ratio[lane];
                    ratio[lane] *= change;
                }
            }
        },
    );
    [sum.iter().sum(), weights.iter().sum()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// Splines of Chebyshev polynomials have their values and derivatives.
    #[test]
    fn the_spline_is_the_polynomial() {
        let count = 9;
        let mut polynomial = vec![[0.0; CHANNELS]; count * count];
        // T₃(x) T₂(y) in the first channel, T₄(x) in the specular one.
        polynomial[2 * count + 3][0] = 1.0;
        polynomial[4][1 + OUTER] = 1.0;
        let section = CrossSection {
            reach: 1.0 / (1.0 + 2.0 * BEYOND as f64 / CELLS as f64),
            coefficients: spline(&polynomial, count),
        };
        for [x, y] in [[0.0, 0.0], [0.31, -0.52], [-0.8, 0.7], [0.123, 0.456]] {
            let at = section.at([x, y]);
            let (t3, t2) = (4.0 * x * x * x - 3.0 * x, 2.0 * y * y - 1.0);
            let (d3, d2) = (12.0 * x * x - 3.0, 4.0 * y);
            // Fourth order in cells of 1/38, fourth derivatives up to 192.
            assert!((at.value[0] - t3 * t2).abs() < 1e-5);
            assert!((at.value[1] - (8.0 * x.powi(4) - 8.0 * x * x + 1.0)).abs() < 1e-5);
            assert!((at.slope[0][0] - d3 * t2).abs() < 1e-3);
            assert!((at.slope[0][1] - t3 * d2).abs() < 1e-3);
        }
    }

    /// Weights by recurrence are those of the exponential function.
    #[test]
    fn rows_are_weighed_by_the_exponential_function() {
        let row: Vec<f64> = (0..117).map(|n| 1.0 + 0.3 * f64::from(n % 7)).collect();
        let (start, slope, bend) = (14.0, -0.52, 0.0093);
        let weight = |n: usize| {
            let n = n as f64;
            (-start - n * slope - 0.5 * n * (n - 1.0) * bend).exp()
        };
        let expected: [f64; 2] = [
            (0..117).map(|n| weight(n) * row[n]).sum(),
            (0..117).map(weight).sum(),
        ];
        let found = weighed_row(&row, start, slope, bend);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-12);
        }
    }

    /// The fitted σ⁰ is the one by direct quadrature.
    #[test]
    fn it_is_the_exact_cross_section() {
        for keys in [
            &[][..],
            &["sea.wind_speed=3", "radar.incidence=24"],
            &["sea.wind_toward=130", "radar.polarization=HH"],
        ] {
            let scene = Scene::default().with_assignments(keys).unwrap();
            let models = super::super::frozen::averaged(&scene);
            let exact = models.backscatter(true, true);
            let nodes = nodes_for(&exact, 0.4);
            let section = CrossSection::new(&exact, &[const { None }; OUTER], 0.4, nodes);
            let calm: f64 = exact.parts([0.0; 2]).iter().sum();
            for slope in [[0.0, 0.0], [0.2, -0.1], [-0.35, 0.3]] {
                let found = section.at(slope).value;
                for (found, expected) in found.iter().zip(exact.parts(slope)) {
                    assert!(
                        (found - expected).abs() < 2e-4 * calm.max(expected),
                        "{keys:?} {slope:?}: {found} {expected}"
                    );
                }
            }
        }
    }
}
