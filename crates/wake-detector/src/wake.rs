//! Wakes in an image.

/// Half the width of a box at least \[pixels\]: that of the line itself.
const LEAST_HALF_WIDTH: f32 = 8.0;

/// A wake in an image: a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wake {
    /// Where its line begins, (column, row); whole numbers at the centres of pixels.
    pub tip: [f32; 2],
    /// From the tip along the wake [deg clockwise from the image's up].
    pub axis_deg: f32,
    /// Half the angle between the outer edges \[deg\].
    pub half_angle_deg: f32,
    /// How far it can be seen \[pixels\].
    pub length: f32,
    /// Signal over noise of a filter that knows the wake, or infinity where a label states none.
    pub snr: f32,
    /// How much it changes the intensity \[dB\], where a label states it.
    pub contrast_db: Option<f32>,
}

impl Wake {
    /// The unit vector from the tip along the wake, (right, down).
    #[must_use]
    pub fn direction(&self) -> [f32; 2] {
        direction(self.axis_deg)
    }

    /// The place `along` the wake.
    #[must_use]
    pub fn at(&self, along: f32) -> [f32; 2] {
        let [right, down] = self.direction();
        [self.tip[0] + along * right, self.tip[1] + along * down]
    }

    /// Corners (column, row) of the box from the tip to the end of what is visible, as wide as the outer edges are apart at half
    /// the length, at least 16 pixels: to the left of the tip, to its right, and the end.
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
    /// From the tip \[pixels\].
    pub length: f32,
    /// Its standard deviation \[pixels\].
    pub deviation: f32,
}

/// A wake that was found, in pixels of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Near 0: sea; near 1: a wake. An order, not a probability.
    pub score: f32,
    /// Tip, axis, half-angle and visible length; its signal-to-noise is unknown, so infinite.
    pub wake: Wake,
    /// The end of the line as measured in the image; `None` where it was not.
    pub extent: Option<Extent>,
    /// Agreement of the line's direction with the axis: 1 from tip to end, −1 from end to tip; `None` where the method gives none.
    pub forward: Option<f32>,
    /// Probability of a wake in either direction; `None` without a calibration.
    pub probability: Option<f32>,
    /// Probability that tip and end are not taken for each other, if it is a wake; `None` without a calibration.
    pub direction_probability: Option<f32>,
    /// Whether it counts as found. Pictures, tables and summaries show these detections.
    pub sure: bool,
}

impl Detection {
    /// A sure detection of a method without probabilities.
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

    /// The detection with the length that was measured, where one was.
    #[must_use]
    pub fn measured(mut self) -> Self {
        self.wake.length = self.extent.map_or(self.wake.length, |extent| extent.length);
        self
    }
}

/// The unit vector (right, down) of an angle clockwise from the image's up.
pub fn direction(degrees: f32) -> [f32; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sin, -cos]
}

/// The angle of a vector (right, down), clockwise from the image's up, 0 to 360.
pub fn angle_of([right, down]: [f32; 2]) -> f32 {
    right.atan2(-down).to_degrees().rem_euclid(360.0) % 360.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_vectors_are_inverse() {
        for degrees in [0.0, 37.0, 90.0, 181.0, 270.0, 359.0] {
            assert!((angle_of(direction(degrees)) - degrees).abs() < 1e-3);
        }
        // Up is a smaller row, right a larger column.
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
            // Half the opening of 4° over 60 pixels is 4.2, below the least half-width of 8.
            assert!(
                (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3,
                "{corners:?}"
            );
        }
    }
}
