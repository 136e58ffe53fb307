//! Effects of satellite images on the mean of a scene: mottle, fronts, correlated speckle, ships, clutter, eight bits.

use super::draw::Draw;
use wake_detector::direction;

/// Speckle of an image: relative spread and correlation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Speckle {
    /// Standard deviation over mean, of amplitude.
    pub(crate) spread: f32,
    /// Standard deviations of the filter along columns and rows \[pixels\].
    pub(crate) filter: [f32; 2],
}

impl Speckle {
    /// Draws speckle as in products: 4 to 80 equivalent looks of amplitude, lag-1 correlations from 0 to 0.9.
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        let filter = [0, 1].map(|_| match draw.chance(0.3) {
            true => 0.0,
            false => draw.between(0.4, 1.5),
        });
        Self {
            spread: draw.scale(0.11, 0.5),
            filter,
        }
    }

    /// Pixels per independent sample: the sum of the correlations over all lags.
    ///
    /// ```text
    /// Σ_k exp(−k²/4s²) ≈ 2 s √π,    at least 1, in each direction
    /// ```
    pub(crate) fn correlated_pixels(&self) -> f32 {
        let sum = |s: f32| (2.0 * s * std::f32::consts::PI.sqrt()).max(1.0);
        sum(self.filter[0]) * sum(self.filter[1])
    }

    /// A field of normal numbers with these correlations, of variance 1.
    pub(crate) fn normals(&self, size: usize, draw: &mut Draw) -> Vec<f32> {
        let [across, down] = self.filter.map(weights);
        let (margin_x, margin_y) = (across.len() - 1, down.len() - 1);
        let (columns, rows) = (size + margin_x, size + margin_y);
        let white: Vec<f32> = (0..rows * columns).map(|_| draw.normal()).collect();
        let mut filtered = vec![0.0; rows * size];
        for (to, from) in filtered
            .chunks_exact_mut(size)
            .zip(white.chunks_exact(columns))
        {
            for (k, w) in across.iter().enumerate() {
                to.iter_mut()
                    .zip(&from[k..])
                    .for_each(|(to, x)| *to += w * x);
            }
        }
        let mut field = vec![0.0; size * size];
        for (row, to) in field.chunks_exact_mut(size).enumerate() {
            for (k, w) in down.iter().enumerate() {
                let from = &filtered[(row + k) * size..][..size];
                to.iter_mut().zip(from).for_each(|(to, x)| *to += w * x);
            }
        }
        field
    }

    /// Multiplies amplitudes by speckle; its skewness equals the skewness of a Gamma variable's square root, to first order.
    pub(crate) fn apply(&self, amplitude: &mut [f32], size: usize, draw: &mut Draw) {
        let normals = self.normals(size, draw);
        let bend = 0.35 * self.spread * self.spread;
        for (a, n) in amplitude.iter_mut().zip(normals) {
            *a *= (1.0 + self.spread * n + bend * (n * n - 1.0)).max(0.0);
        }
    }
}

/// A Gaussian filter whose output has the variance of its input.
fn weights(deviation: f32) -> Vec<f32> {
    if deviation <= 0.0 {
        return vec![1.0];
    }
    let reach = (3.0 * deviation).ceil() as i32;
    let shape: Vec<f32> = (-reach..=reach)
        .map(|k| (-0.5 * (k as f32 / deviation).powi(2)).exp())
        .collect();
    let norm = shape.iter().map(|w| w * w).sum::<f32>().sqrt();
    shape.into_iter().map(|w| w / norm).collect()
}

/// Smooth noise of standard deviation near 1 that changes over `period` pixels.
fn smooth(size: usize, period: f32, draw: &mut Draw) -> Vec<f32> {
    let cells = (size as f32 / period).ceil() as usize + 2;
    let (dx, dy) = (draw.between(0.0, 1.0), draw.between(0.0, 1.0));
    let knots: Vec<f32> = (0..cells * cells).map(|_| draw.normal()).collect();
    let place = |i: usize, shift: f32| {
        let x = i as f32 / period + shift;
        let cell = (x as usize).min(cells - 2);
        let t = (x - cell as f32).min(1.0);
        (cell, t * t * (3.0 - 2.0 * t))
    };
    let columns: Vec<_> = (0..size).map(|j| place(j, dx)).collect();
    let mut field = Vec::with_capacity(size * size);
    for i in 0..size {
        let (r, v) = place(i, dy);
        let (above, below) = (&knots[r * cells..], &knots[(r + 1) * cells..]);
        field.extend(columns.iter().map(|&(c, u)| {
            let top = above[c] + u * (above[c + 1] - above[c]);
            let bottom = below[c] + u * (below[c + 1] - below[c]);
            1.4 * (top + v * (bottom - top))
        }));
    }
    field
}

/// Multiplies a mean by gusts, and sometimes by a front, swell or slicks.
pub(crate) fn mottle(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let strength = match draw.chance(0.15) {
        true => draw.between(0.1, 0.3),
        false => draw.between(0.0, 0.08),
    };
    for (period, share) in [(160.0, 0.75), (60.0, 0.5), (22.0, 0.25)] {
        let gusts = smooth(size, period, draw);
        for (m, g) in mean.iter_mut().zip(gusts) {
            *m *= (strength * share * g).exp();
        }
    }
    if draw.chance(0.12) {
        front(mean, size, draw);
    }
    if draw.chance(0.12) {
        swell(mean, size, draw);
    }
    for _ in 0..draw.one_of(&[0.8, 0.12, 0.08]) {
        slick(mean, size, draw);
    }
}

/// Sometimes sets a border without data, with a mean of 0.
pub(crate) fn border(mean: &mut [f32], size: usize, draw: &mut Draw) {
    if !draw.chance(0.06) {
        return;
    }
    let width = draw.between(0.02, 0.4) * size as f32;
    let [right, down] = direction(90.0 * draw.between(0.0, 4.0).floor() + draw.between(-4.0, 4.0));
    let middle = 0.5 * size as f32;
    for (i, m) in mean.iter_mut().enumerate() {
        let (x, y) = ((i % size) as f32 - middle, (i / size) as f32 - middle);
        if x * right + y * down > middle - width {
            *m = 0.0;
        }
    }
}

/// A wandering line between darker and brighter water.
pub(crate) fn front(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let [right, down] = direction(draw.between(0.0, 360.0));
    let offset = draw.between(-0.4, 0.4) * size as f32;
    let (step, width) = (draw.sign() * draw.between(0.08, 0.5), draw.scale(1.0, 40.0));
    let wander = smooth(size, 70.0, draw);
    let depth = draw.between(5.0, 40.0);
    let middle = 0.5 * size as f32;
    for (i, (m, w)) in mean.iter_mut().zip(wander).enumerate() {
        let (x, y) = ((i % size) as f32 - middle, (i / size) as f32 - middle);
        let distance = (x * right + y * down - offset + depth * w) / width;
        *m *= 1.0 + step / (1.0 + (-distance.clamp(-20.0, 20.0)).exp());
    }
}

/// Long parallel crests.
fn swell(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let [right, down] = direction(draw.between(0.0, 360.0));
    let (height, wave) = (draw.between(0.03, 0.2), draw.scale(7.0, 40.0));
    let groups = smooth(size, 90.0, draw);
    let phase = draw.between(0.0, 6.3);
    for (i, (m, g)) in mean.iter_mut().zip(groups).enumerate() {
        let along = (i % size) as f32 * right + (i / size) as f32 * down;
        let crest = (std::f32::consts::TAU * along / wave + phase + 0.7 * g).sin();
        *m *= (1.0 + height * crest * (1.0 + 0.5 * g)).max(0.1);
    }
}

/// A winding dark or bright line without beginning or ship, unlike a wake.
fn slick(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let s = size as f32;
    let (mut x, mut y) = (draw.between(0.0, s), draw.between(0.0, s));
    let mut angle = draw.between(0.0, 360.0);
    let (width, contrast) = (draw.scale(1.5, 8.0), draw.between(-0.45, 0.25));
    let (length, mut bend) = (draw.between(0.4, 2.5) * s, 0.0);
    let winding = draw.scale(0.02, 0.5);
    let [dx, dy] = direction(angle);
    (x, y) = (x - 0.5 * length * dx, y - 0.5 * length * dy);
    let mut reach = vec![0.0f32; size * size];
    let (step, radius) = (2.0, 3.0 * width);
    for k in 0..(length / step) as usize {
        bend = 0.9 * bend + winding * draw.normal();
        angle += bend;
        let [dx, dy] = direction(angle);
        (x, y) = (x + step * dx, y + step * dy);
        let ends = (k as f32 * step / 60.0).min(1.0) * ((length - k as f32 * step) / 60.0).min(1.0);
        around(size, [x, y], radius, |i, dx, dy| {
            let inside = ends * (-0.5 * (dx * dx + dy * dy) / (width * width)).exp();
            reach[i] = reach[i].max(inside);
        });
    }
    for (m, r) in mean.iter_mut().zip(reach) {
        *m *= 1.0 + contrast * r;
    }
}

/// Dark filaments that wind around eddies, as of films in weak wind: level lines of smooth noise, some of them adjacent.
/// Each is as narrow and as dark as the line of a wake, and none is straight for long.
pub(crate) fn filaments(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let (period, width) = (draw.scale(25.0, 110.0), draw.scale(1.0, 3.5));
    let (depth, count) = (draw.between(0.12, 0.45), 1 + draw.one_of(&[0.3, 0.4, 0.3]));
    let field = smooth(size, period, draw);
    let strength = smooth(size, 1.5 * period, draw);
    let levels: Vec<f32> = (0..count).map(|_| 0.8 * draw.normal()).collect();
    for i in 0..size * size {
        let (row, column) = (i / size, i % size);
        let next = |step: usize, last: bool| match last {
            true => field[i] - field[i - step],
            false => field[i + step] - field[i],
        };
        let slope = next(1, column + 1 == size).hypot(next(size, row + 1 == size));
        // Some places of a filament are hardly visible.
        let here = depth / (1.0 + (-2.0 * strength[i]).exp());
        for level in &levels {
            let off = (field[i] - level) / (slope.max(0.2 / period) * width);
            mean[i] *= 1.0 - here * (-0.5 * off * off).exp();
        }
    }
}

/// Calls `f` with every pixel within `radius` of a place, and its offset to the right and down.
fn around(size: usize, [x, y]: [f32; 2], radius: f32, mut f: impl FnMut(usize, f32, f32)) {
    let bounds = |centre: f32| {
        let low = (centre - radius).ceil().clamp(0.0, size as f32);
        let high = (centre + radius + 1.0).floor().clamp(0.0, size as f32);
        low as usize..high as usize
    };
    for row in bounds(y) {
        for column in bounds(x) {
            f(row * size + column, column as f32 - x, row as f32 - y);
        }
    }
}

/// Appearance of the ship echoes of one image, and the axis along which they are displaced and smeared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Echoes {
    vertical: bool,
    displaced: f32,
    smear: f32,
    cross: f32,
    brightness: f32,
}

impl Echoes {
    pub(crate) fn draw(draw: &mut Draw) -> Self {
        Self {
            vertical: draw.chance(0.5),
            displaced: match draw.chance(0.5) {
                true => draw.between(0.0, 6.0),
                false => draw.between(5.0, 50.0),
            },
            smear: match draw.chance(0.6) {
                true => 0.0,
                false => draw.between(1.0, 6.0),
            },
            cross: match draw.chance(0.4) {
                true => draw.scale(0.02, 0.3),
                false => 0.0,
            },
            brightness: draw.scale(2.0, 30.0),
        }
    }

    /// Displacement of a ship's echo, (right, down) \[pixels\].
    pub(crate) fn shift(&self, draw: &mut Draw) -> [f32; 2] {
        let shift = self.displaced * draw.normal().abs().min(1.5) * draw.sign();
        if self.vertical {
            [0.0, shift]
        } else {
            [shift, 0.0]
        }
    }

    /// Adds the echo of a ship to amplitudes: a bar of bright points, displaced, with the response's cross.
    ///
    /// - `from`: beginning of the wake's line, and displacement of the echo; the ship lies a little ahead
    /// - `axis_deg`: from the ship along its wake
    pub(crate) fn add(
        &self,
        mean: &mut [f32],
        size: usize,
        [from, [sx, sy]]: [[f32; 2]; 2],
        axis_deg: f32,
        draw: &mut Draw,
    ) {
        let [right, down] = direction(axis_deg);
        let length = draw.scale(1.5, 18.0);
        let ahead = 0.5 * length + draw.scale(1.0, 14.0);
        let centre = [from[0] - ahead * right + sx, from[1] - ahead * down + sy];
        let level = self.brightness * draw.scale(0.4, 2.5);
        for _ in 0..(3.0 + 1.5 * length) as usize {
            let t = draw.between(-0.5, 0.5) * length;
            let j = self.smear * draw.normal();
            let (jx, jy) = if self.vertical { (0.0, j) } else { (j, 0.0) };
            let place = [
                centre[0] + t * right + jx + 0.4 * draw.normal(),
                centre[1] + t * down + jy + 0.4 * draw.normal(),
            ];
            self.point(mean, size, place, level * draw.between(0.1, 1.0));
        }
        if draw.chance(0.12) {
            let (halo, width) = (draw.between(0.1, 1.2), draw.scale(4.0, 16.0));
            around(size, centre, 3.0 * width, |i, dx, dy| {
                mean[i] += halo * (-0.5 * (dx * dx + dy * dy) / (width * width)).exp();
            });
        }
    }

    fn point(&self, mean: &mut [f32], size: usize, [x, y]: [f32; 2], level: f32) {
        around(size, [x, y], 4.0, |i, dx, dy| {
            mean[i] += level * (-0.5 * (dx * dx + dy * dy) / 0.8).exp();
        });
        if self.cross > 0.0 {
            let (row, column) = (y.round(), x.round());
            let inside = |v: f32| v >= 0.0 && v < size as f32;
            for k in 0..size {
                for (at, other, along) in [(x, row, true), (y, column, false)] {
                    let distance = (k as f32 - at).abs();
                    if distance < 3.0 || !inside(other) {
                        continue;
                    }
                    let o = other as usize;
                    let i = if along { o * size + k } else { k * size + o };
                    mean[i] += level * self.cross * (1.0 / distance - 0.012).max(0.0);
                }
            }
        }
    }
}

/// Bright objects other than ships under way: ships at rest, streaks along the image's axes, land, piers.
pub(crate) fn clutter(mean: &mut [f32], size: usize, echoes: &Echoes, draw: &mut Draw) {
    let s = size as f32;
    for _ in 0..draw.one_of(&[0.45, 0.25, 0.15, 0.1, 0.05]) {
        let place = [draw.between(0.0, s), draw.between(0.0, s)];
        let angle = draw.between(0.0, 360.0);
        let shift = echoes.shift(draw);
        echoes.add(mean, size, [place, shift], angle, draw);
    }
    if draw.chance(0.12) {
        for _ in 0..1 + draw.one_of(&[0.4, 0.3, 0.3]) {
            streak(mean, size, draw);
        }
    }
    if draw.chance(0.08) {
        land(mean, size, draw);
    }
    if draw.chance(0.06) {
        piers(mean, size, draw);
    }
}

/// A line along an image axis, as interference and ghosts of ships leave it.
fn streak(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let s = size as f32;
    let centre = [draw.between(0.0, s), draw.between(0.0, s)];
    let (length, width) = (draw.scale(15.0, 150.0), draw.scale(0.6, 5.0));
    let (level, vertical) = (draw.scale(0.1, 2.0), draw.chance(0.7));
    around(size, centre, 2.0 * length, |i, dx, dy| {
        let (along, across) = if vertical { (dy, dx) } else { (dx, dy) };
        let shape = (across / width).powi(2) + (along / length).powi(4);
        if shape < 18.0 {
            mean[i] += level * (-0.5 * shape).exp();
        }
    });
}

/// Bright, rough ground behind a winding coast, or an islet; often divided into fields.
fn land(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let s = size as f32;
    let centre = [0, 1].map(|_| draw.between(-0.3, 1.3) * s);
    let (radius, rough) = (draw.scale(4.0, 0.7 * s), draw.between(0.1, 0.5));
    let (coast, texture) = (smooth(size, 30.0, draw), smooth(size, 5.0, draw));
    let level = draw.scale(0.5, 8.0);
    let contrast = if draw.chance(0.6) {
        draw.between(0.2, 1.2)
    } else {
        0.0
    };
    let (field, [right, down]) = (draw.scale(6.0, 50.0), direction(draw.between(0.0, 90.0)));
    let fields: Vec<f32> = (0..FIELDS * FIELDS)
        .map(|_| (contrast * draw.normal()).exp())
        .collect();
    for (i, m) in mean.iter_mut().enumerate() {
        let (x, y) = ((i % size) as f32 - centre[0], (i / size) as f32 - centre[1]);
        if x.hypot(y) < radius * (1.0 + rough * coast[i]) {
            let cell = |along: f32| (along / field).floor().rem_euclid(FIELDS as f32) as usize;
            let (u, v) = (cell(x * right + y * down), cell(y * right - x * down));
            *m = level * (0.6 * texture[i]).exp() * fields[v * FIELDS + u];
        }
    }
}

/// Number of different fields in a row.
const FIELDS: usize = 24;

/// Straight bright lines with sharp ends: piers, dams, rows of stakes.
fn piers(mean: &mut [f32], size: usize, draw: &mut Draw) {
    let s = size as f32;
    for _ in 0..1 + draw.one_of(&[0.4, 0.3, 0.3]) {
        let [x, y] = [0, 1].map(|_| draw.between(0.0, s));
        let [right, down] = direction(draw.between(0.0, 360.0));
        let (length, level, width) = (
            draw.scale(20.0, 200.0),
            draw.scale(0.4, 8.0),
            draw.scale(0.6, 2.0),
        );
        let beads = draw.between(0.0, 0.9);
        for k in 0..(length / width) as usize {
            let bead = (beads * draw.normal()).exp();
            let place = [x + k as f32 * width * right, y + k as f32 * width * down];
            around(size, place, 3.0 * width, |i, dx, dy| {
                mean[i] +=
                    0.4 * level * bead * (-0.5 * (dx * dx + dy * dy) / (width * width)).exp();
            });
        }
    }
}

/// Turns amplitudes into a quick-look: stretched by an unknown factor, cut to eight bits.
pub(crate) fn quick_look(mut amplitude: Vec<f32>, draw: &mut Draw) -> Vec<f32> {
    let (gain, offset) = (draw.scale(22.0, 110.0), draw.between(-8.0, 12.0));
    for a in &mut amplitude {
        *a = (gain * *a + offset).round().clamp(0.0, 255.0);
    }
    amplitude
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Filaments darken, by no more than their depth each, and only near their lines.
    #[test]
    fn filaments_are_dark_and_narrow() {
        let size = 128;
        for seed in 0..8 {
            let mut mean = vec![1.0f32; size * size];
            filaments(&mut mean, size, &mut Draw::new(seed, 1));
            assert!(mean.iter().all(|m| (0.16..=1.0).contains(m)));
            let dark = mean.iter().filter(|m| **m < 0.95).count();
            assert!(dark < size * size / 2, "{seed}: {dark}");
        }
    }

    /// Variance 1 and the lag-1 correlation exp(−1/4s²) of a Gaussian filter, each within five standard errors.
    #[test]
    fn speckle_has_the_correlation_of_its_filter() {
        let speckle = Speckle {
            spread: 0.2,
            filter: [0.8, 1.3],
        };
        let size = 400;
        let field = speckle.normals(size, &mut Draw::new(3, 0));
        let n = (size * size) as f32 / speckle.correlated_pixels();
        let mean = |f: &dyn Fn(usize) -> f32| {
            let places = (0..size * (size - 1)).filter(|i| i % size + 1 < size);
            let (sum, count) =
                places.fold((0.0f64, 0.0), |(s, c), i| (s + f64::from(f(i)), c + 1.0));
            (sum / count) as f32
        };
        let error = 5.0 * (2.0 / n).sqrt();
        assert!((mean(&|i| field[i] * field[i]) - 1.0).abs() < error);
        for (s, step) in [(0.8f32, 1), (1.3, size)] {
            let expected = (-0.25 / (s * s)).exp();
            let found = mean(&|i| field[i] * field[i + step]);
            assert!((found - expected).abs() < error, "{found} {expected}");
        }
    }
}
