//! Clipping of rays and convex polygons to a rectangle.

use crate::raster::Raster;

/// Rectangle of the pixel centres \[m\]. An image with one row or one column of several pixels reaches to the edges of the pixels
/// across it, so that what crosses the image has a length and a box.
pub(super) struct Rectangle {
    low: [f64; 2],
    high: [f64; 2],
}

impl Rectangle {
    pub(super) fn of(raster: &Raster) -> Self {
        let edge = |count: usize, other: usize| match (count, other) {
            (1, 2..) => 0.5 * raster.spacing,
            _ => 0.0,
        };
        let x = edge(raster.columns, raster.rows);
        let y = edge(raster.rows, raster.columns);
        let (right, bottom) = (
            raster.x(raster.columns.saturating_sub(1)),
            raster.y(raster.rows.saturating_sub(1)),
        );
        Self {
            low: [raster.x(0) - x, bottom - y],
            high: [right + x, raster.y(0) + y],
        }
    }

    pub(super) fn contains(&self, point: [f64; 2]) -> bool {
        (0..2).all(|a| (self.low[a]..=self.high[a]).contains(&point[a]))
    }

    /// Part of a ray inside, from its start outward and no longer than `longest`; `None` if it has no length.
    ///
    /// - `along`: a unit vector
    ///
    /// Liang and Barsky (1984), ACM Trans. Graph. 3: every side clips the ray's parameter.
    pub(super) fn clip_ray(
        &self,
        from: [f64; 2],
        along: [f64; 2],
        longest: f64,
    ) -> Option<[[f64; 2]; 2]> {
        let (mut start, mut end) = (0.0f64, longest);
        for a in 0..2 {
            let to_low = (self.low[a] - from[a]) / along[a];
            let to_high = (self.high[a] - from[a]) / along[a];
            if along[a].abs() > 0.0 {
                start = start.max(to_low.min(to_high));
                end = end.min(to_low.max(to_high));
            } else if !(self.low[a]..=self.high[a]).contains(&from[a]) {
                return None;
            }
        }
        let at = |t: f64| {
            // Rounding must not move an end outside.
            [0, 1].map(|a| (from[a] + t * along[a]).clamp(self.low[a], self.high[a]))
        };
        (start < end && end.is_finite()).then(|| [at(start), at(end)])
    }
}

/// A convex polygon, corners in order.
pub(super) struct Polygon(Vec<[f64; 2]>);

impl From<&Rectangle> for Polygon {
    fn from(r: &Rectangle) -> Self {
        let ([x0, y0], [x1, y1]) = (r.low, r.high);
        Self(vec![[x0, y0], [x0, y1], [x1, y1], [x1, y0]])
    }
}

impl Polygon {
    pub(super) fn new(corners: Vec<[f64; 2]>) -> Self {
        Self(corners)
    }

    /// The part on the right-hand side of a line; `None` if it has no area.
    ///
    /// Sutherland and Hodgman (1974), Commun. ACM 17.
    pub(super) fn right_of(&self, point: [f64; 2], along: [f64; 2]) -> Option<Self> {
        let side = |p: [f64; 2]| along[1] * (p[0] - point[0]) - along[0] * (p[1] - point[1]);
        let mut corners = Vec::with_capacity(self.0.len() + 1);
        for (i, &to) in self.0.iter().enumerate() {
            let from = self.0[(i + self.0.len() - 1) % self.0.len()];
            let (a, b) = (side(from), side(to));
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                let t = a / (a - b);
                corners.push([0, 1].map(|k| from[k] + t * (to[k] - from[k])));
            }
            if b >= 0.0 {
                corners.push(to);
            }
        }
        let cut = Self(corners);
        (cut.area() > 0.0).then_some(cut)
    }

    /// The part inside a rectangle.
    pub(super) fn cut_to(&self, r: &Rectangle) -> Option<Self> {
        self.right_of(r.low, [0.0, 1.0])?
            .right_of(r.high, [0.0, -1.0])?
            .right_of(r.high, [1.0, 0.0])?
            .right_of(r.low, [-1.0, 0.0])
    }

    /// Smallest and largest coordinate along a unit vector.
    pub(super) fn extent(&self, axis: [f64; 2]) -> [f64; 2] {
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        self.0.iter().fold(start, |[low, high], p| {
            let at = p[0] * axis[0] + p[1] * axis[1];
            [low.min(at), high.max(at)]
        })
    }

    /// Area, by the shoelace formula.
    fn area(&self) -> f64 {
        let next = self.0.iter().cycle().skip(1);
        let twice: f64 = self
            .0
            .iter()
            .zip(next)
            .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
            .sum();
        0.5 * twice.abs()
    }
}
