//! Where the pixels of the latents lie in the ship's frame.

use super::conditions::Conditions;
use wake_physics::kelvin::half_angle;

/// Side of the squares of pixels that become one latent pixel.
pub(crate) const PATCH: usize = 8;
/// Maps at the size of the latents.
pub(crate) const PLACES: usize = 8;
/// Which of them says whether a place is in the wedge.
#[cfg(any(test, feature = "train"))]
pub(crate) const WEDGE: usize = 5;
/// Half-width of the band behind the stern \[m\].
const BAND: f64 = 40.0;

/// Size of an image in pixels, and of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapGrid {
    /// Rows and columns of the image, a multiple of 8.
    pub size: usize,
    /// Side of a pixel \[m\].
    pub spacing: f64,
}

/// The ship's own axes.
struct Frame {
    forward: [f64; 2],
    position: [f64; 2],
    /// From midship to bow or stern \[m\].
    half_length: f64,
    /// How far the wedge reaches astern where it is 1 m wide on one side \[m\].
    slope: f64,
}

/// Where some latent pixels lie in the ship's frame; all zero where the track of the ship is not known, or there is no
/// ship that moves.
///
/// Distances along and across the track, in the image's axes and from the ship, in the wedge of the bow's waves or not, how
/// far from its edge, and a band behind the stern. The wedge opens as the wake does at this speed and depth.
///
/// `cells`: squares of [`PATCH`] × [`PATCH`] pixels, counted in rows.
///
/// # Shapes
///
/// `[PLACES, cells]`
///
/// # References
///
/// Kelvin (1887), "On Ship Waves": the wedge.
pub(crate) fn places(conditions: &Conditions, grid: MapGrid, cells: &[usize]) -> Vec<f32> {
    let mut maps = vec![0.0; PLACES * cells.len()];
    let Some(frame) = Frame::of(conditions) else {
        return maps;
    };
    for (n, &cell) in cells.iter().enumerate() {
        let place = frame.seen_from_ship(grid.middle(cell));
        for (map, value) in frame.places(place).into_iter().enumerate() {
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

    /// Place (x, y) \[m\] of the middle of a square, half a pixel before its pixel PATCH/2.
    fn middle(self, cell: usize) -> [f64; 2] {
        let coarse = self.size / PATCH;
        let [row, column] = [cell / coarse, cell % coarse].map(|n| (n * PATCH) as f64);
        let (origin, half) = ((self.size / 2) as f64, 0.5 * (PATCH as f64 - 1.0));
        [
            (column + half - origin) * self.spacing,
            (origin - row - half) * self.spacing,
        ]
    }
}

impl Frame {
    /// The frame of a ship whose track is known and that moves.
    fn of(conditions: &Conditions) -> Option<Self> {
        let (speed, heading, position) = conditions.track()?;
        let (sin, cos) = heading.to_radians().sin_cos();
        let depth = conditions.depth.unwrap_or(f64::INFINITY);
        let length = conditions.ship_length?;
        (speed > 0.0).then(|| Self {
            forward: [sin, cos],
            position,
            half_length: 0.5 * length,
            slope: half_angle(speed, depth).tan().recip(),
        })
    }

    /// (ξ, η) \[m\]: forward of midship and to port.
    fn seen_from_ship(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.position[0], y - self.position[1]);
        let [fx, fy] = self.forward;
        [dx * fx + dy * fy, dy * fx - dx * fy]
    }

    /// What the maps show of a place.
    fn places(&self, [along, across]: [f64; 2]) -> [f64; PLACES] {
        let [fx, fy] = self.forward;
        // Negative inside the wedge.
        let outside = self.slope * across.abs() + along - self.half_length;
        let astern = along < -self.half_length;
        let band = (-0.5 * (across / BAND).powi(2)).exp();
        [
            (along / 200.0).tanh(),
            (across / 100.0).tanh(),
            (along * fx - across * fy) / 512.0,
            (along * fy + across * fx) / 512.0,
            (-along.hypot(across) / 150.0).exp(),
            if outside < 0.0 && along < 0.0 {
                1.0
            } else {
                0.0
            },
            (outside / 100.0).tanh(),
            if astern { band } else { 0.0 },
        ]
    }
}

#[cfg(test)]
mod tests;
