//! Where the crests of the Kelvin wake lie: its stationary phases at every pixel.
//!
//! A network that sees only speed and heading must find phases of tens of radians from smooth numbers, and
//! draws crests in the wrong places. The phases follow from the numbers in closed form; how strong the waves
//! are, how the radar sees them and what the sea does to them is left to learn.

use super::airy::airy;
use super::conditions::{Conditions, SHIP_LENGTH};

/// Acceleration of gravity [m/s²].
const GRAVITY: f64 = 9.81;
/// Side of the squares of pixels that become one latent pixel.
pub const PATCH: usize = 8;
/// Maps at full size that oscillate: cos and sin of five waves from each of two origins.
pub const OSCILLATING: usize = 20;
/// Maps at full size: those that oscillate, bands along the cusp lines, and the turbulent wake.
pub const WAVES: usize = OSCILLATING + 2 * BANDS + 1;
/// Bands along a cusp line, at ζ = 0, 1, 2, 3.
const BANDS: usize = 4;
/// Maps at the size of the latents.
pub const PLACES: usize = 18;
/// Which of them says whether a place is in the wedge.
pub const WEDGE: usize = 5;
/// The first of those that hold the directions of transverse, divergent and cusp wave, cosine and sine of each.
pub const DIRECTIONS: usize = 12;
/// Nearer to their origin than this \[m\], waves are not shown stronger.
const NEAREST: f64 = 50.0;
/// The smallest ζ outside the wedge where anything is shown: Ai(4) is 0.001.
const FARTHEST_OUT: f64 = -4.0;
/// Half-width of a band along the cusp line, in ζ.
const BAND_WIDTH: f64 = 0.5;

/// Size of an image in pixels, and of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Rows and columns of the image, a multiple of [`PATCH`].
    pub size: usize,
    /// Side of a pixel \[m\].
    pub spacing: f64,
}

/// The ship's own axes.
struct Frame {
    forward: [f64; 2],
    position: [f64; 2],
    /// ν = g/U² [rad/m].
    wavenumber: f64,
}

/// One of the two waves that stand at a point behind their origin.
struct Wave {
    phase: f64,
    /// Wavenumbers (x, y) [rad/m].
    wavenumber: [f64; 2],
    /// 1/√r, and what a pixel can carry.
    envelope: f64,
    /// The same of its second harmonic: 1/r.
    second: f64,
}

/// The wave along the cusp line.
struct Cusp {
    phase: f64,
    /// 0 at the edge of the wedge, positive inside.
    zeta: f64,
    envelope: f64,
}

/// Phases of the wake in some squares of pixels; all zero where the track of the ship is not known, or there is no ship.
///
/// With (ξ, η) forward and to port of where the waves start, x = −ξ, and inside x² > 8η²:
///
/// ```text
/// s = (x ∓ √(x² − 8η²))/(4|η|)           − transverse, + divergent waves
/// phase = ν √(1 + s²) (x − s|η|),  k = ν (1 + s²),  ν = g/U²
/// ```
///
/// - from the bow and from the stern: cos and sin of both phases, falling as 1/√r and to 0 where the wavelength is
///   two pixels; where both meet, at the cusp line, cos and sin of their mean phase times Ai(−ζ), ⅔ ζ^(3/2) being half
///   their difference (outside the wedge: half the imaginary part of it, with ζ < 0)
/// - twice both phases, falling as 1/r: the radar's view of steep waves is not linear
/// - bands along the cusp lines, where many waves together change the brightness
/// - the turbulent wake: a band of 40 m half-width behind the stern
///
/// `cells`: squares of [`PATCH`] × [`PATCH`] pixels, counted in rows.
///
/// # Shapes
///
/// `[cells, WAVES, PATCH²]`
///
/// # References
///
/// Kelvin (1887); Lighthill (1978), "Waves in Fluids", section 3.10; Ursell (1960), "On Kelvin's Ship-Wave Pattern",
/// section 4 (cusp line).
pub fn wave_squares(conditions: &Conditions, grid: MapGrid, cells: &[usize]) -> Vec<f32> {
    const PIXELS: usize = PATCH * PATCH;
    let mut maps = vec![0.0; cells.len() * WAVES * PIXELS];
    let Some(frame) = Frame::of(conditions) else {
        return maps;
    };
    for (&cell, maps) in cells.iter().zip(maps.chunks_mut(WAVES * PIXELS)) {
        let [row, column] = grid.corner(cell);
        for pixel in 0..PIXELS {
            let place = grid.place(row + pixel / PATCH, column + pixel % PATCH, 0.0);
            let values = frame.phases(frame.seen_from_ship(place), grid.spacing);
            for (map, value) in values.into_iter().enumerate() {
                maps[map * PIXELS + pixel] = value as f32;
            }
        }
    }
    maps
}

/// Where some latent pixels lie in the ship's frame; all zero where [`wave_squares`] are.
///
/// Distances along and across the track, in the image's axes and from the ship, in the wedge or not, how far from its
/// edge, in the turbulent wake or not, the wavenumbers of the transverse and the divergent wave from the stern, then
/// the directions of both and of the wave at the cusp line.
///
/// # Shapes
///
/// `[PLACES, cells]`
pub fn places(conditions: &Conditions, grid: MapGrid, cells: &[usize]) -> Vec<f32> {
    let mut maps = vec![0.0; PLACES * cells.len()];
    let Some(frame) = Frame::of(conditions) else {
        return maps;
    };
    // The middle of a square of PATCH pixels lies half a pixel before its pixel PATCH/2.
    let middle = 0.5 * (PATCH as f64 - 1.0);
    for (n, &cell) in cells.iter().enumerate() {
        let [row, column] = grid.corner(cell);
        let place = frame.seen_from_ship(grid.place(row, column, middle));
        for (map, value) in frame.places(place, grid.spacing).into_iter().enumerate() {
            maps[map * cells.len() + n] = value as f32;
        }
    }
    maps
}

impl MapGrid {
    /// All squares of pixels, in rows.
    pub fn cells(self) -> Vec<usize> {
        let coarse = self.size / PATCH;
        (0..coarse * coarse).collect()
    }

    /// Row and column of the first pixel of a square.
    fn corner(self, cell: usize) -> [usize; 2] {
        let coarse = self.size / PATCH;
        [cell / coarse * PATCH, cell % coarse * PATCH]
    }

    /// Place (x, y) \[m\] of a pixel, moved down and right by a part of a pixel.
    fn place(self, row: usize, column: usize, offset: f64) -> [f64; 2] {
        let origin = (self.size / 2) as f64;
        [
            (column as f64 + offset - origin) * self.spacing,
            (origin - row as f64 - offset) * self.spacing,
        ]
    }
}

impl Frame {
    /// The frame of a ship whose track is known and that moves.
    fn of(conditions: &Conditions) -> Option<Self> {
        let (speed, heading, position) = conditions.track()?;
        let (sin, cos) = heading.to_radians().sin_cos();
        (speed > 0.0).then(|| Self {
            forward: [sin, cos],
            position,
            wavenumber: GRAVITY / (speed * speed),
        })
    }

    /// (ξ, η) \[m\]: forward of midship and to port.
    fn seen_from_ship(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.position[0], y - self.position[1]);
        let [fx, fy] = self.forward;
        [dx * fx + dy * fy, dy * fx - dx * fy]
    }

    /// The transverse and the divergent wave at (ξ, η) from their origin; `None` outside the wedge.
    fn waves(&self, [along, across]: [f64; 2], spacing: f64) -> Option<[Wave; 2]> {
        let (x, off) = (-along, across.abs().max(1e-3));
        let root = x * x - 8.0 * off * off;
        if x <= 0.0 || root <= 0.0 {
            return None;
        }
        Some([-1.0, 1.0].map(|sign| {
            let slope = (x + sign * root.sqrt()) / (4.0 * off);
            let secant = (1.0 + slope * slope).sqrt();
            let k = self.wavenumber * secant * secant;
            let far = far(x, off);
            Wave {
                phase: self.wavenumber * secant * (x - slope * off),
                wavenumber: self.turned(k / secant, k * slope / secant * across.signum()),
                envelope: far * resolved(k, spacing),
                second: far * far * resolved(2.0 * k, spacing),
            }
        }))
    }

    /// The wave along the cusp line, at (ξ, η) from its origin; `None` ahead of it and far outside the wedge.
    ///
    /// With s = (x ∓ √(x² − 8η²))/(4|η|), complex outside the wedge, the phase is the mean of both waves', and half
    /// their difference is ⅔ ζ^(3/2).
    fn cusp(&self, [along, across]: [f64; 2], spacing: f64) -> Option<Cusp> {
        let (x, off) = (-along, across.abs().max(1e-3));
        let square = x * x - 8.0 * off * off;
        let root = square.abs().sqrt() / (4.0 * off);
        let phase = |slope: [f64; 2]| self.complex_phase(x, off, slope);
        let middle = x / (4.0 * off);
        let (mean, zeta) = if square > 0.0 {
            let [transverse, divergent] =
                [-1.0, 1.0].map(|sign| phase([middle + sign * root, 0.0])[0]);
            let half = 0.5 * (transverse - divergent).abs();
            (0.5 * (transverse + divergent), (1.5 * half).cbrt().powi(2))
        } else {
            let [mean, imaginary] = phase([middle, -root]);
            (mean, -(1.5 * imaginary.abs()).cbrt().powi(2))
        };
        let k = 1.5 * self.wavenumber;
        (x > 0.0 && zeta > FARTHEST_OUT).then(|| Cusp {
            phase: mean,
            zeta,
            envelope: far(x, off) * resolved(k, spacing),
        })
    }

    /// ν √(1 + s²) (x − s|η|) for a complex s.
    fn complex_phase(&self, x: f64, off: f64, [re, im]: [f64; 2]) -> [f64; 2] {
        // 1 + s², its root in the right half plane, and the rest of the product.
        let (a, b) = (1.0 + re * re - im * im, 2.0 * re * im);
        let length = a.hypot(b);
        let root = [
            (0.5 * (length + a)).max(0.0).sqrt(),
            (0.5 * (length - a)).max(0.0).sqrt() * b.signum(),
        ];
        let rest = [x - re * off, -im * off];
        [
            self.wavenumber * (root[0] * rest[0] - root[1] * rest[1]),
            self.wavenumber * (root[0] * rest[1] + root[1] * rest[0]),
        ]
    }

    /// What the full grid shows of a place.
    fn phases(&self, place: [f64; 2], spacing: f64) -> [f64; WAVES] {
        let mut values = [0.0; WAVES];
        for (i, start) in [0.5, -0.5].into_iter().enumerate() {
            let behind = [place[0] - start * SHIP_LENGTH, place[1]];
            let mut set = |wave: usize, phase: f64, envelope: f64| {
                let (sin, cos) = phase.sin_cos();
                let map = OSCILLATING / 2 * i + 2 * wave;
                (values[map], values[map + 1]) = (envelope * cos, envelope * sin);
            };
            for (j, wave) in self.waves(behind, spacing).iter().flatten().enumerate() {
                set(j, wave.phase, wave.envelope);
                set(3 + j, 2.0 * wave.phase, wave.second);
            }
            let Some(cusp) = self.cusp(behind, spacing) else {
                continue;
            };
            set(2, cusp.phase, cusp.envelope * airy(-cusp.zeta));
            for band in 0..BANDS {
                let off = (cusp.zeta - band as f64) / BAND_WIDTH;
                values[OSCILLATING + BANDS * i + band] = cusp.envelope * (-0.5 * off * off).exp();
            }
        }
        values[WAVES - 1] = turbulent(place);
        values
    }

    /// A vector (along the track, to port) in the directions (x, y).
    fn turned(&self, along: f64, across: f64) -> [f64; 2] {
        let [fx, fy] = self.forward;
        [along * fx - across * fy, along * fy + across * fx]
    }

    /// What the latent grid shows of a place.
    fn places(&self, place: [f64; 2], spacing: f64) -> [f64; PLACES] {
        let [along, across] = place;
        let [x, y] = self.turned(along, across);
        let from_stern = [along + 0.5 * SHIP_LENGTH, across];
        let waves = self.waves(from_stern, spacing);
        let k = |i: usize, axis: usize| {
            let resolved = waves
                .as_ref()
                .map(|waves| &waves[i])
                .filter(|wave| wave.envelope > 0.0);
            resolved.map_or(0.0, |wave| wave.wavenumber[axis] * 10.0)
        };
        let direction = |i: usize, axis: usize| {
            let length = k(i, 0).hypot(k(i, 1));
            if length > 0.0 {
                k(i, axis) / length
            } else {
                0.0
            }
        };
        let distance = along.hypot(across);
        // s = 1/√2 at the cusp line.
        let cusp = self.turned((2f64 / 3.0).sqrt(), (1f64 / 3.0).sqrt() * across.signum());
        [
            (along / 200.0).tanh(),
            (across / 100.0).tanh(),
            x / 512.0,
            y / 512.0,
            (-distance / 150.0).exp(),
            if waves.is_some() { 1.0 } else { 0.0 },
            ((8f64.sqrt() * across.abs() + from_stern[0]) / 100.0).tanh(),
            turbulent(place),
            k(0, 0),
            k(0, 1),
            k(1, 0),
            k(1, 1),
            direction(0, 0),
            direction(0, 1),
            direction(1, 0),
            direction(1, 1),
            cusp[0],
            cusp[1],
        ]
    }
}

/// 1/√r, bounded near the origin.
fn far(x: f64, off: f64) -> f64 {
    (NEAREST / x.hypot(off).max(NEAREST)).sqrt()
}

/// 1, falling to 0 from four pixels a half wave to one.
fn resolved(k: f64, spacing: f64) -> f64 {
    4.0 * (1.0 - k * spacing / std::f64::consts::PI).clamp(0.0, 0.25)
}

/// A band behind the stern.
fn turbulent([along, across]: [f64; 2]) -> f64 {
    let behind = -along - 0.5 * SHIP_LENGTH;
    if behind <= 0.0 {
        return 0.0;
    }
    (-0.5 * (across / 40.0).powi(2)).exp()
}

#[cfg(test)]
#[path = "maps_tests.rs"]
mod tests;
