//! Echo of the ship that makes a wake, displaced in azimuth by the ship's radial velocity.

use serde::Serialize;
use wake_detector::Wake;
use wake_geo::{Product, Values, Window};

/// A ship's echo.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Echo {
    /// Line of the echo's middle.
    pub line: f64,
    /// Pixel of the echo's middle.
    pub pixel: f64,
    /// Latitude of the imaged echo \[degrees\].
    pub latitude: f64,
    /// Longitude of the imaged echo \[degrees\].
    pub longitude: f64,
    /// Displacement from the wake's axis along azimuth, positive in the direction of flight \[m\]; `None` if the standard
    /// deviation of the resulting velocity exceeds 0.25 m/s.
    pub displacement: Option<f64>,
    /// Velocity toward the radar, from the displacement \[m/s\].
    pub radial_velocity: Option<f64>,
    /// Standard deviation of that velocity, from the uncertainties of the axis and the echo's middle \[m/s\].
    pub radial_velocity_deviation: Option<f64>,
    /// Position of the ship on the wake's axis, at the echo's range, because motion displaces an echo only along azimuth. `None`
    /// if the axis is so close to azimuth that the uncertainty exceeds 100 m.
    #[serde(skip)]
    pub(crate) ship: Option<ShipOnAxis>,
}

/// Position of a ship on the axis of its wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShipOnAxis {
    /// (Pixel, line) of midship.
    pub(crate) middle: [f64; 2],
    /// Half the length of the echo along the axis \[pixels\].
    pub(crate) half_length: f64,
}

/// Highest speed of a ship \[m/s\].
const FASTEST: f64 = 18.0;
/// Largest distance of the echo from the tip in range, to both sides \[pixels\].
const ASIDE: i64 = 24;
/// Lowest brightness of an echo, relative to the sea.
const BRIGHT: f32 = 8.0;
/// Largest distance of an echo's pixels from its middle \[pixels\]: half the length of the longest ships.
const REACH: usize = 20;
/// Lowest brightness of an echo's pixels as a share of its brightest pixel, to exclude sidelobes.
const LEAST_OF_PEAK: f32 = 0.01;
/// Iterations from the brightest pixel to the middle of an echo.
const STEPS: usize = 4;
/// Standard deviation of the middle of an echo on both axes \[pixels\]: 1.1 in azimuth and 1.5 in range for 20 simulated ships.
const MIDDLE: f64 = 1.5;
/// Standard deviation of the axis across it, for a line that stands out and for any other \[pixels\]: the step of the line
/// fit, and the cell size of the detector's maps.
const ACROSS: [f64; 2] = [1.5, 4.0];
/// Largest standard deviation of a reported velocity \[m/s\].
pub(crate) const MOST_DEVIATION: f64 = 0.25;
/// Largest standard deviation of a ship's position along the axis \[pixels\].
const MOST_ALONG: f64 = 10.0;

/// Conversion of displacements to velocities.
#[derive(Debug, Clone, Copy)]
struct Displacements {
    /// Tip of the wake (pixel, line), and direction from tip to end (right, down).
    tip: [f64; 2],
    direction: [f64; 2],
    /// Distance between lines \[m\], and R/V \[s\].
    line_spacing: f64,
    ratio: f64,
    /// Sine of the incidence angle.
    slant: f64,
    /// Standard deviation of the axis across it \[pixels\].
    across: f64,
}

impl Displacements {
    /// Distance of a place from the axis along azimuth \[m\].
    ///
    /// ```text
    /// d = Δy (line − line of the axis at the same range),    v = d/(R/V)
    /// ```
    fn of(&self, [pixel, line]: [f64; 2]) -> f64 {
        (line - self.line_of_axis(pixel)) * self.line_spacing
    }

    /// Line of the axis at a range.
    fn line_of_axis(&self, pixel: f64) -> f64 {
        let [right, down] = self.direction;
        self.tip[1] + (pixel - self.tip[0]) * down / right
    }

    /// Standard deviation of the velocity \[m/s\], from the axis, projected on azimuth, and from the echo's middle.
    fn deviation(&self) -> f64 {
        let lines = (self.across / self.direction[0]).hypot(MIDDLE);
        lines * self.line_spacing / self.ratio
    }

    /// Position on the axis of a ship with an echo at a range; `None` if too uncertain.
    fn ship(&self, pixel: f64, half_length: f64) -> Option<ShipOnAxis> {
        let along = self.across.hypot(MIDDLE) / self.direction[0].abs();
        (along <= MOST_ALONG).then(|| ShipOnAxis {
            middle: [pixel, self.line_of_axis(pixel)],
            half_length,
        })
    }

    /// Whether an echo can belong to a ship that leaves this wake astern: its speed toward the tip must be possible.
    ///
    /// ```text
    /// u = v/(sin θ · right),    right = the share of the wake's direction that leads away from the radar
    /// ```
    fn is_possible(&self, place: [f64; 2]) -> bool {
        let deviation = self.deviation();
        if !deviation.is_finite() || deviation > MOST_DEVIATION {
            return true;
        }
        let along = self.slant * self.direction[0];
        let speed = self.of(place) / self.ratio / along;
        let doubt = 3.0 * deviation / along.abs();
        (-doubt..FASTEST + doubt).contains(&speed)
    }
}

/// Finds the echo that belongs to a wake, if there is one.
///
/// - `is_clear`: whether the line stands out where it was fitted
pub(crate) fn echo(product: &Product, wake: &Wake, is_clear: bool) -> Option<Echo> {
    if product.values() != Values::SigmaNought {
        return None;
    }
    let (lines, pixels) = product.size();
    let [tip_pixel, tip_line] = wake.tip.map(f64::from);
    let clamped = |value: f64, size: usize| value.round().clamp(0.0, size as f64 - 1.0);
    let (at_line, at_pixel) = (clamped(tip_line, lines), clamped(tip_pixel, pixels));
    let ratio = product.range_to_velocity(at_line, at_pixel).ok()??;
    let axes = product.axes(at_line, at_pixel).ok()?;
    let place = product.place(at_line, at_pixel).ok()?;
    let slant = place.incidence?.to_radians().sin();
    let fastest = FASTEST * slant;
    let displacements = Displacements {
        tip: [tip_pixel, tip_line],
        direction: wake.direction().map(f64::from),
        line_spacing: axes.line_spacing,
        ratio,
        slant,
        across: ACROSS[usize::from(!is_clear)],
    };
    let along = (ratio * fastest / axes.line_spacing).ceil() as i64;
    let range = |middle: f64, reach: i64, size: usize| {
        let middle = middle as i64;
        (middle - reach).max(0) as usize..(middle + reach + 1).clamp(0, size as i64) as usize
    };
    let reach = REACH as i64;
    let (rows, columns) = (
        range(at_line, along + reach, lines),
        range(at_pixel, ASIDE + reach, pixels),
    );
    let window = product.read_window(rows.clone(), columns.clone()).ok()?;
    let mut sorted: Vec<f32> = window
        .values
        .iter()
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    if sorted.is_empty() {
        return None;
    }
    let middle = sorted.len() / 2;
    let sea = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let width = columns.len();
    // Among bright pixels, prefer bright ones near the tip.
    let score = |n: usize| {
        let value = window.values[n];
        let [row, column] = [n / width, n % width].map(|x| x as f64);
        let aside = (column + columns.start as f64 - tip_pixel) / ASIDE as f64;
        let away = (row + rows.start as f64 - tip_line) / along as f64;
        f64::from(value) / (1.0 + aside * aside + away * away)
    };
    let is_possible = |n: &usize| {
        let [row, column] = [n / width, n % width];
        displacements.is_possible([(column + columns.start) as f64, (row + rows.start) as f64])
    };
    let is_near = |n: &usize| {
        let [row, column] = [n / width, n % width].map(|x| x as f64);
        let aside = column + columns.start as f64 - tip_pixel;
        let away = row + rows.start as f64 - tip_line;
        aside.abs() <= ASIDE as f64 && away.abs() <= along as f64
    };
    let bright = (0..window.values.len()).filter(|&n| window.values[n] > BRIGHT * sea);
    let bright = bright.filter(is_near).filter(is_possible);
    let peak = bright.max_by(|&a, &b| score(a).total_cmp(&score(b)))?;
    let least = (BRIGHT * sea).max(LEAST_OF_PEAK * window.values[peak]);
    let middle = Middle::of(&window, peak, least);
    let (line, pixel) = (
        middle.row + rows.start as f64,
        middle.column + columns.start as f64,
    );
    let there = product.place(line, pixel).ok()?;
    let deviation = displacements.deviation();
    let is_known = deviation.is_finite() && deviation <= MOST_DEVIATION;
    let displacement = is_known.then(|| displacements.of([pixel, line]));
    Some(Echo {
        line,
        pixel,
        latitude: there.latitude,
        longitude: there.longitude,
        displacement,
        radial_velocity: displacement.map(|metres| metres / ratio),
        radial_velocity_deviation: displacement.map(|_| deviation),
        ship: displacements.ship(pixel, middle.half_length(displacements.direction)),
    })
}

/// Middle of an echo, and the second central moments of its pixels.
#[derive(Debug, Clone, Copy)]
struct Middle {
    row: f64,
    column: f64,
    /// Variances of columns and rows, and their covariance.
    squares: [f64; 3],
}

impl Middle {
    /// Finds the middle of the bright pixels around the brightest one.
    ///
    /// All bright pixels have equal weight, because a few strong scatterers, anywhere on the ship, outshine the rest.
    fn of(window: &Window, peak: usize, least: f32) -> Self {
        let (rows, columns) = (window.lines, window.pixels);
        let mut middle = Self {
            row: (peak / columns) as f64,
            column: (peak % columns) as f64,
            squares: [0.0; 3],
        };
        for _ in 0..STEPS {
            let around = |at: f64, size: usize| {
                let at = at.round() as usize;
                at.saturating_sub(REACH)..(at + REACH + 1).min(size)
            };
            let (mut count, mut sums, mut squares) = (0.0, [0.0; 2], [0.0; 3]);
            for row in around(middle.row, rows) {
                for column in around(middle.column, columns) {
                    if window.line(row)[column] <= least {
                        continue;
                    }
                    let (x, y) = (column as f64 - middle.column, row as f64 - middle.row);
                    count += 1.0;
                    sums = [sums[0] + x, sums[1] + y];
                    squares = [squares[0] + x * x, squares[1] + y * y, squares[2] + x * y];
                }
            }
            if count == 0.0 {
                break;
            }
            let [x, y] = sums.map(|sum| sum / count);
            let [xx, yy, xy] = squares.map(|sum| sum / count);
            middle = Self {
                row: middle.row + y,
                column: middle.column + x,
                squares: [xx - x * x, yy - y * y, xy - x * y],
            };
        }
        middle
    }

    /// Half the length along a direction (right, down), as if the echo were a uniform bar: √3 standard deviations.
    fn half_length(&self, [right, down]: [f64; 2]) -> f64 {
        let [xx, yy, xy] = self.squares;
        let variance = right * right * xx + down * down * yy + 2.0 * right * down * xy;
        (3.0 * variance.max(0.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For a wake toward larger range and larger lines, the ship approaches the radar, and its echo is displaced along the
    /// flight.
    #[test]
    fn echoes_lie_where_a_ship_that_leaves_the_wake_is_imaged() {
        let across = |direction: [f64; 2], across: f64| Displacements {
            tip: [500.0, 800.0],
            direction,
            line_spacing: 10.0,
            ratio: 115.0,
            slant: 0.6,
            across,
        };
        let wake = across([0.8, 0.6], 1.5);
        // 8 m/s times 0.8 times 0.6 times 115 s are 441.6 m.
        let place = [500.0, 800.0 + 44.16];
        assert!((wake.of(place) - 441.6).abs() < 1e-9);
        assert!(wake.is_possible(place));
        // On the other side the ship would have to run astern; 40 m/s are too fast.
        assert!(!wake.is_possible([500.0, 800.0 - 44.16]));
        assert!(!wake.is_possible([500.0, 800.0 + 220.0]));
        // At another range the axis lies elsewhere.
        assert!((wake.of([508.0, 806.0])).abs() < 1e-9);
        assert!((wake.deviation() - (1.5f64 / 0.8).hypot(1.5) * 10.0 / 115.0).abs() < 1e-12);
        // If the velocity is too uncertain, no place is ruled out.
        for wake in [
            across([0.3, 0.954], 1.5),
            across([0.8, 0.6], 4.0),
            across([0.0, 1.0], 1.5),
        ] {
            assert!(
                wake.deviation()
                    .partial_cmp(&MOST_DEVIATION)
                    .is_none_or(std::cmp::Ordering::is_gt)
                    && wake.is_possible([500.0, 700.0])
            );
        }
    }
}
