//! Wakes and detections in an image.

/// Smallest half-width of a box \[pixels\], for the line itself.
const LEAST_HALF_WIDTH: f32 = 8.0;

/// A wake in an image: a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wake {
    /// Start of the line, (column, row), with whole numbers at the centres of pixels.
    pub tip: [f32; 2],
    /// Direction from the tip along the wake [deg clockwise from the image's up].
    pub axis_deg: f32,
    /// Half the angle between the outer edges \[deg\].
    pub half_angle_deg: f32,
    /// Visible length \[pixels\].
    pub length: f32,
    /// Signal-to-noise ratio of a matched filter, or infinity if unknown.
    pub snr: f32,
    /// Change of intensity \[dB\], if a label states it.
    pub contrast_db: Option<f32>,
}

impl Wake {
    /// The unit vector from the tip along the wake, (right, down).
    #[must_use]
    pub fn direction(&self) -> [f32; 2] {
        direction(self.axis_deg)
    }

    /// The position at a distance `along` the wake from its tip \[pixels\].
    #[must_use]
    pub fn at(&self, along: f32) -> [f32; 2] {
        let [right, down] = self.direction();
        [self.tip[0] + along * right, self.tip[1] + along * down]
    }

    /// The turn from this axis to that of another wake \[deg\], −180 to 180.
    #[must_use]
    pub fn turn_to(&self, other: &Self) -> f32 {
        turn(self.axis_deg, other.axis_deg)
    }

    /// Corners (column, row) of the box around the visible wake, as wide as the distance of the outer edges at half the length,
    /// at least 16 pixels: left and right of the tip, then right and left of the end.
    #[must_use]
    pub fn oriented_box(&self) -> [[f32; 2]; 4] {
        let opening = self.half_angle_deg.clamp(0.0, 30.0).to_radians().tan();
        let half = (0.5 * self.length * opening).max(LEAST_HALF_WIDTH);
        let [right, down] = self.direction();
        let corner = |along: f32, across: f32| {
            let [x, y] = self.at(along);
            [x - across * down, y + across * right]
        };
        [
            (0.0, -half),
            (0.0, half),
            (self.length, half),
            (self.length, -half),
        ]
        .map(|(a, c)| corner(a, c))
    }
}

/// Visible length of a wake, measured in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Length from the tip \[pixels\].
    pub length: f32,
    /// Standard deviation of the length \[pixels\].
    pub deviation: f32,
}

/// A detected wake, in pixels of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Near 0 for sea, near 1 for a wake: a ranking, not a probability.
    pub score: f32,
    /// Tip, axis, half-angle and visible length; the signal-to-noise ratio is unknown, so infinite.
    pub wake: Wake,
    /// Length of the line measured in the image; `None` if it could not be measured.
    pub extent: Option<Extent>,
    /// Agreement of the line's direction with the axis: 1 from tip to end, −1 from end to tip; `None` if the method gives none.
    pub forward: Option<f32>,
    /// Probability of a wake in either direction; `None` without a calibration.
    pub probability: Option<f32>,
    /// Probability that tip and end are not confused, if it is a wake; `None` without a calibration.
    pub direction_probability: Option<f32>,
    /// Whether it counts as found; pictures, tables and summaries show only such detections.
    pub sure: bool,
}

impl Detection {
    /// Makes a sure detection without probabilities.
    #[must_use]
    pub fn new(score: f32, wake: Wake) -> Self {
        Self {
            score,
            wake,
            extent: None,
            forward: None,
            probability: None,
            direction_probability: None,
            sure: true,
        }
    }

    /// The detection with its measured length, if it has one.
    #[must_use]
    pub fn measured(mut self) -> Self {
        self.wake.length = self.extent.map_or(self.wake.length, |extent| extent.length);
        self
    }
}

/// Unit vector (right, down) of an angle \[deg\] clockwise from the image's up.
pub fn direction(degrees: f32) -> [f32; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sin, -cos]
}

/// Angle of a vector (right, down) \[deg\], clockwise from the image's up, 0 to 360.
pub fn angle_of([right, down]: [f32; 2]) -> f32 {
    right.atan2(-down).to_degrees().rem_euclid(360.0) % 360.0
}

/// The turn from one angle to another \[deg\], −180 to 180.
pub(crate) fn turn(from: f32, to: f32) -> f32 {
    (to - from + 180.0).rem_euclid(360.0) - 180.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_vectors_are_inverse() {
        for degrees in [0.0, 37.0, 90.0, 181.0, 270.0, 359.0] {
            assert!((angle_of(direction(degrees)) - degrees).abs() < 1e-3);
        }
        // Up is toward smaller rows, right toward larger columns.
        assert!(direction(0.0)[1] < -0.999 && direction(90.0)[0] > 0.999);
    }

    #[test]
    fn a_box_is_as_long_as_the_wake() {
        let wake = Wake {
            tip: [10.0, 20.0],
            axis_deg: 90.0,
            half_angle_deg: 4.0,
            length: 120.0,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        let corners = wake.oriented_box();
        let expected = [[10.0, 12.0], [10.0, 28.0], [130.0, 28.0], [130.0, 12.0]];
        for (a, b) in corners.iter().zip(expected) {
            // 4° over 60 pixels give a half-width of 4.2, below the smallest one of 8.
            assert!(
                (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3,
                "{corners:?}"
            );
        }
    }
}
