//! Positions of the latent pixels in the ship's frame.

use super::features::TOLD_SPACING;
use wake_physics::Scene;
use wake_physics::kelvin::half_angle;
use wake_physics::scene::{Grid, Ship};

/// Side of the squares of pixels that become one latent pixel.
pub const PATCH_SIZE: usize = 8;
/// Number of maps, which have the size of the latents.
pub const PLACES: usize = 8;
/// Index of the map that says whether a position is in the wedge.
pub const WEDGE: usize = 5;
/// Half-width of the band behind the stern \[m\], for pixels of 4 m like all lengths here.
const BAND: f64 = 40.0;

/// Size of an image in pixels, and of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Rows and columns of the image, a multiple of 8.
    pub size: usize,
    /// Side of a pixel \[m\].
    pub spacing: f64,
}

/// Axes of the ship.
struct Frame {
    forward: [f64; 2],
    position: [f64; 2],
    /// From midship to bow or stern \[m\].
    half_length: f64,
    /// Distance astern at which the wedge is 1 m wide on one side \[m\].
    slope: f64,
    /// Divisor of lengths, which scales pixels to 4 m.
    scale: f64,
}

/// Position maps of latent pixels, each in the frame of the ship in whose wedge it lies deepest; zero without a moving ship.
///
/// The maps hold distances along and across the track, in the image's axes and from the ship, whether a pixel is in the wedge
/// of the bow's waves, its distance from the edge, and a band behind the stern. The wedge opens as the wake does at this speed
/// and depth.
///
/// - `cells`: squares of [`PATCH_SIZE`] × [`PATCH_SIZE`] pixels, numbered row by row
///
/// # Shapes
///
/// `[PLACES, cells]`
///
/// # References
///
/// Kelvin (1887), "On Ship Waves": the wedge.
pub fn places(scene: &Scene, cells: &[usize]) -> Vec<f32> {
    let mut maps = vec![0.0; PLACES * cells.len()];
    let grid = MapGrid::of(&scene.grid);
    let frames = scene.ships.iter().filter_map(|ship| Frame::of(ship, scene));
    let frames: Vec<Frame> = frames.collect();
    for (n, &cell) in cells.iter().enumerate() {
        let middle = grid.middle(cell);
        let seen = frames
            .iter()
            .map(|frame| (frame, frame.seen_from_ship(middle)));
        let nearest = seen.min_by(|(a, p), (b, q)| a.outside(*p).total_cmp(&b.outside(*q)));
        let Some((frame, place)) = nearest else {
            return maps;
        };
        for (map, value) in frame.places(place).into_iter().enumerate() {
            maps[map * cells.len() + n] = value as f32;
        }
    }
    maps
}

impl MapGrid {
    /// Grid of a scene, which must have as many rows as columns.
    pub fn of(grid: &Grid) -> Self {
        Self {
            size: grid.rows,
            spacing: grid.spacing,
        }
    }

    /// Indices of all squares of pixels, row by row.
    pub fn cells(self) -> Vec<usize> {
        let coarse = self.size / PATCH_SIZE;
        (0..coarse * coarse).collect()
    }

    /// Centre (x, y) \[m\] of a square, half a pixel before its pixel `PATCH_SIZE`/2.
    fn middle(self, cell: usize) -> [f64; 2] {
        let coarse = self.size / PATCH_SIZE;
        let [row, column] = [cell / coarse, cell % coarse].map(|n| (n * PATCH_SIZE) as f64);
        let (origin, half) = ((self.size / 2) as f64, 0.5 * (PATCH_SIZE as f64 - 1.0));
        [
            (column + half - origin) * self.spacing,
            (origin - row - half) * self.spacing,
        ]
    }
}

impl Frame {
    /// Frame of a ship, if it moves.
    fn of(ship: &Ship, scene: &Scene) -> Option<Self> {
        let (sin, cos) = ship.heading.to_radians().sin_cos();
        (ship.speed > 0.0).then(|| Self {
            forward: [sin, cos],
            position: ship.position,
            half_length: 0.5 * ship.length,
            slope: half_angle(ship.speed, scene.sea.depth).tan().recip(),
            scale: scene.grid.spacing / TOLD_SPACING,
        })
    }

    /// Position (ξ, η) \[m\]: forward of midship and to port.
    fn seen_from_ship(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.position[0], y - self.position[1]);
        let [fx, fy] = self.forward;
        [dx * fx + dy * fy, dy * fx - dx * fy]
    }

    /// Distance of a position forward of the wedge's edge \[m\]; negative inside.
    fn outside(&self, [along, across]: [f64; 2]) -> f64 {
        self.slope * across.abs() + along - self.half_length
    }

    /// Values of the maps at a position.
    fn places(&self, place: [f64; 2]) -> [f64; PLACES] {
        let [fx, fy] = self.forward;
        let inside = self.outside(place) < 0.0 && place[0] < 0.0;
        let astern = place[0] < -self.half_length;
        let outside = self.outside(place) / self.scale;
        let [along, across] = place.map(|x| x / self.scale);
        let band = (-0.5 * (across / BAND).powi(2)).exp();
        [
            (along / 200.0).tanh(),
            (across / 100.0).tanh(),
            (along * fx - across * fy) / 512.0,
            (along * fy + across * fx) / 512.0,
            (-along.hypot(across) / 150.0).exp(),
            if inside { 1.0 } else { 0.0 },
            (outside / 100.0).tanh(),
            if astern { band } else { 0.0 },
        ]
    }
}

#[cfg(test)]
mod tests;
