//! Where the crests of the Kelvin wake lie: its stationary phases at every pixel.
//!
//! A network that sees only speed and heading must find phases of tens of radians from smooth numbers, and
//! draws crests in the wrong places. The phases follow from the numbers in closed form; how strong the waves
//! are, how the radar sees them and what the sea does to them is left to learn.

use super::conditions::{Conditions, SHIP_LENGTH};

/// Acceleration of gravity [m/s²].
const GRAVITY: f64 = 9.81;
/// Side of the squares of pixels that become one latent pixel.
pub const PATCH: usize = 8;
/// Maps at full size: cos and sin of four wave systems, and the turbulent wake.
pub const WAVES: usize = 9;
/// Maps at the size of the latents.
pub const PLACES: usize = 12;
/// Nearer to their origin than this \[m\], waves are not shown stronger.
const NEAREST: f64 = 50.0;

/// Size of an image in pixels, and of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Rows and columns of the image, a multiple of [`PATCH`].
    pub size: usize,
    /// Side of a pixel \[m\].
    pub spacing: f64,
}

/// The geometry of one wake.
#[derive(Debug, Clone, PartialEq)]
pub struct WakeMaps {
    /// `[WAVES, size, size]`
    pub waves: Vec<f32>,
    /// `[PLACES, size / PATCH, size / PATCH]`
    pub places: Vec<f32>,
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
}

impl WakeMaps {
    /// The maps of a scene; all zero where the track of the ship is not known, or there is no ship.
    ///
    /// With (ξ, η) forward and to port of where the waves start, x = −ξ, and inside x² > 8η²:
    ///
    /// ```text
    /// s = (x ∓ √(x² − 8η²))/(4|η|)           − transverse, + divergent waves
    /// phase = ν √(1 + s²) (x − s|η|),  k = ν (1 + s²),  ν = g/U²
    /// ```
    ///
    /// - from the bow and from the stern: cos and sin of both phases, falling as 1/√r and to 0 where the
    ///   wavelength is two pixels
    /// - the turbulent wake: a band of 40 m half-width behind the stern
    /// - on the latent grid: places in the ship's frame, in the wedge or not, wavenumbers of both waves
    ///
    /// # References
    ///
    /// Kelvin (1887); Lighthill (1978), "Waves in Fluids", section 3.10.
    pub fn new(conditions: &Conditions, grid: MapGrid) -> Self {
        let coarse = grid.size / PATCH;
        let mut maps = Self {
            waves: vec![0.0; WAVES * grid.size * grid.size],
            places: vec![0.0; PLACES * coarse * coarse],
        };
        let track = conditions.track().filter(|&(speed, ..)| speed > 0.0);
        if let Some((speed, heading, position)) = track {
            let (sin, cos) = heading.to_radians().sin_cos();
            let frame = Frame {
                forward: [sin, cos],
                position,
                wavenumber: GRAVITY / (speed * speed),
            };
            maps.draw_waves(&frame, grid);
            maps.draw_places(&frame, grid);
        }
        maps
    }

    fn draw_waves(&mut self, frame: &Frame, grid: MapGrid) {
        let pixels = grid.size * grid.size;
        for pixel in 0..pixels {
            let place = frame.seen_from_ship(grid.place(pixel / grid.size, pixel % grid.size, 0.0));
            for (i, start) in [0.5, -0.5].into_iter().enumerate() {
                let behind = [place[0] - start * SHIP_LENGTH, place[1]];
                let Some(waves) = frame.waves(behind, grid.spacing) else {
                    continue;
                };
                for (j, wave) in waves.into_iter().enumerate() {
                    let (sin, cos) = wave.phase.sin_cos();
                    let map = 4 * i + 2 * j;
                    self.waves[map * pixels + pixel] = (wave.envelope * cos) as f32;
                    self.waves[(map + 1) * pixels + pixel] = (wave.envelope * sin) as f32;
                }
            }
            self.waves[(WAVES - 1) * pixels + pixel] = turbulent(place) as f32;
        }
    }

    fn draw_places(&mut self, frame: &Frame, grid: MapGrid) {
        let coarse = grid.size / PATCH;
        let pixels = coarse * coarse;
        for pixel in 0..pixels {
            let (row, column) = (pixel / coarse * PATCH, pixel % coarse * PATCH);
            // The middle of a square of PATCH pixels lies half a pixel before its pixel PATCH/2.
            let middle = 0.5 * (PATCH as f64 - 1.0);
            let place = frame.seen_from_ship(grid.place(row, column, middle));
            for (map, value) in frame.places(place, grid.spacing).into_iter().enumerate() {
                self.places[map * pixels + pixel] = value as f32;
            }
        }
    }
}

impl MapGrid {
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
            let resolved = (1.0 - k * spacing / std::f64::consts::PI).max(0.0);
            let far = (NEAREST / x.hypot(off).max(NEAREST)).sqrt();
            Wave {
                phase: self.wavenumber * secant * (x - slope * off),
                wavenumber: self.turned(k / secant, k * slope / secant * across.signum()),
                envelope: far * resolved.min(0.25) * 4.0,
            }
        }))
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
        let distance = along.hypot(across);
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
        ]
    }
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
