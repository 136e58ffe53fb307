//! Images whose pixels are an affine map of projected coordinates.

/// Affine map from (pixel, line) to projected coordinates; pixel 0, line 0 is the centre of the first pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// x of the first pixel's centre, its change by pixel, its change by line.
    pub x: [f64; 3],
    /// y of the first pixel's centre, its change by pixel, its change by line.
    pub y: [f64; 3],
}

impl Affine {
    /// Coordinates of a pixel.
    pub fn coordinates(&self, line: f64, pixel: f64) -> (f64, f64) {
        let of = |[start, by_pixel, by_line]: [f64; 3]| start + by_pixel * pixel + by_line * line;
        (of(self.x), of(self.y))
    }

    /// The (line, pixel) at coordinates.
    pub fn pixel_of(&self, x: f64, y: f64) -> (f64, f64) {
        let (dx, dy) = (x - self.x[0], y - self.y[0]);
        let determinant = self.determinant();
        (
            (self.x[1] * dy - self.y[1] * dx) / determinant,
            (dx * self.y[2] - dy * self.x[2]) / determinant,
        )
    }

    /// Signed area of a pixel; 0 or not finite if the map has no inverse.
    pub(crate) fn determinant(&self) -> f64 {
        self.x[1] * self.y[2] - self.x[2] * self.y[1]
    }

    /// The map with its origin moved by `lines` and `pixels`.
    pub(crate) fn shifted(self, lines: f64, pixels: f64) -> Self {
        let (x, y) = self.coordinates(lines, pixels);
        Self {
            x: [x, self.x[1], self.x[2]],
            y: [y, self.y[1], self.y[2]],
        }
    }
}
