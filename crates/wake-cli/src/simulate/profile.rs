//! Profiles across a wake: dark line, bright streak and arms.

use serde::Serialize;
use wake_physics::Field;
use wake_physics::labels::Pixel;

/// Pixels more than this many standard deviations above the sea are ships and are left out: chosen, as for textures.
const SHIP: f64 = 8.0;

/// A streak is reported if the profile differs from the sea by this many of its own standard deviations: of some
/// hundred places tested, one in a hundred does so by chance.
const SHOWS: f64 = 4.0;

/// Angles from the axis that count as sea, beyond the arms \[deg\].
const SEA: [f64; 2] = [25.0, 40.0];

/// Largest angle of the dark line from the axis, and of the bright streak from the dark line \[deg\]: chosen.
const BESIDE: f64 = 10.0;

/// Angles of the arms from the axis \[deg\]: chosen around 19.5, with room for the narrower wakes at speed.
const ARMS: [f64; 2] = [11.0, 23.0];

/// Fewest pixels in the mean at one position of a profile.
const FEWEST: usize = 12;

/// The axis of a wake in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WakeAxis {
    /// Tip of the wake, (column, row).
    pub(crate) tip: Pixel,
    /// Direction from the tip along the wake [deg clockwise from the image's up].
    pub(crate) direction: f64,
}

/// A line of an image that is darker or brighter than the sea around it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Streak {
    /// Distance of its middle from the axis, positive clockwise \[pixels\]; for an arm, the angle \[deg\].
    pub(crate) offset: f64,
    /// Amplitude relative to the sea, minus 1.
    pub(crate) contrast: f64,
    /// Difference from the sea in standard deviations of a sea pixel, which is invariant to linear changes of grey.
    pub(crate) strength: f64,
    /// Width at half height \[pixels\].
    pub(crate) width: f64,
}

/// Streaks across a stretch of a wake.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct WakeProfile {
    /// Darkest line within 10° of the axis, if one is significant.
    pub(crate) dark: Option<Streak>,
    /// Brightest line within 10° of the dark one, or of the axis.
    pub(crate) bright: Option<Streak>,
}

/// Profile across a wake, averaged over a stretch along its axis; `None` if the image has too little sea beside it.
///
/// - `amplitude`: square root of the intensity, or the grey of a quick-look
/// - `astern`: distances from the tip along the axis \[pixels\], above 0
///
/// Streaks narrower than three pixels are measured as three pixels wide.
pub(super) fn wake_profile(
    amplitude: &Field,
    axis: &WakeAxis,
    [from, to]: [f64; 2],
) -> Option<WakeProfile> {
    let beyond = SEA[0].to_radians().tan() * to;
    let sea = [beyond, beyond + SEA[1].to_radians().tan() * from.max(60.0)];
    let profile = Profile::new(amplitude, axis, [from, to], sea, |_, across| across)?;
    let beside = BESIDE.to_radians().tan() * 0.5 * (from + to);
    let dark = profile.extreme(-1.0, [-beside, beside]);
    let middle = dark.map_or(0.0, |line| line.offset);
    let bright = profile.extreme(1.0, [middle - beside, middle + beside]);
    Some(WakeProfile { dark, bright })
}

/// Arms of a wake, counter-clockwise and clockwise of its axis, averaged along rays from the tip: on each side the line
/// that differs most from the sea, bright or dark, 11 to 23° off the axis. Its offset is an angle \[deg\], its width is
/// in pixels half-way along the stretch.
///
/// - `amplitude`, `astern` as in [`wake_profile`]
pub(super) fn wake_arms(
    amplitude: &Field,
    axis: &WakeAxis,
    [from, to]: [f64; 2],
) -> [Option<Streak>; 2] {
    // Arcs half-way along the stretch, in pixels.
    let radius = 0.5 * (from + to);
    let arc = |degrees: f64| radius * degrees.to_radians();
    let angle = |along: f64, across: f64| radius * across.atan2(along);
    let Some(profile) = Profile::new(amplitude, axis, [from, to], SEA.map(arc), angle) else {
        return [None; 2];
    };
    [[-ARMS[1], -ARMS[0]], ARMS].map(|side| {
        let strongest = [1.0, -1.0].into_iter();
        let strongest = strongest.filter_map(|sign| profile.extreme(sign, side.map(arc)));
        let strongest = strongest.max_by(|a, b| a.strength.abs().total_cmp(&b.strength.abs()));
        strongest.map(|arm| Streak {
            offset: (arm.offset / radius).to_degrees(),
            ..arm
        })
    })
}

/// Means of the amplitude by a coordinate across the wake, one per unit, relative to the sea.
struct Profile {
    /// Differences from the sea at coordinates −`reach` to `reach`; NaN where there are too few pixels.
    differences: Vec<f64>,
    reach: i64,
    /// Mean of the sea, standard deviation of its pixels, and standard deviation of its means.
    sea: [f64; 3],
}

impl Profile {
    /// - `sea`: range of coordinates of the sea, on either side
    /// - `coordinate`: function of the distances along and across the axis
    fn new(
        amplitude: &Field,
        axis: &WakeAxis,
        astern: [f64; 2],
        sea: [f64; 2],
        coordinate: impl Fn(f64, f64) -> f64,
    ) -> Option<Self> {
        let (sin, cos) = axis.direction.to_radians().sin_cos();
        let reach = sea[1].floor() as i64;
        let mut bins = vec![Moments::default(); 2 * reach as usize + 1];
        let each = |limit: f64, bins: &mut Vec<Moments>| {
            bins.fill(Moments::default());
            for (n, &value) in amplitude.values.iter().enumerate() {
                let right = (n % amplitude.columns) as f64 - axis.tip[0];
                let down = (n / amplitude.columns) as f64 - axis.tip[1];
                let along = right * sin - down * cos;
                if along < astern[0] || along >= astern[1] || f64::from(value) > limit {
                    continue;
                }
                let bin = coordinate(along, right * cos + down * sin).round() as i64 + reach;
                if let Some(bin) = usize::try_from(bin).ok().and_then(|bin| bins.get_mut(bin)) {
                    bin.add(f64::from(value));
                }
            }
        };
        let first = sea[0].ceil() as i64;
        let at_sea = |n: usize| (n as i64 - reach).abs() >= first;
        let of_sea = |bins: &[Moments]| {
            let mut all = Moments::default();
            let bins = bins.iter().enumerate().filter(|(n, _)| at_sea(*n));
            bins.for_each(|(_, bin)| all.merge(bin));
            all
        };
        each(f64::INFINITY, &mut bins);
        let all = of_sea(&bins);
        each(all.mean() + SHIP * all.variance().sqrt(), &mut bins);
        let all = of_sea(&bins);
        let means: Vec<f64> = bins
            .iter()
            .map(|bin| {
                if bin.count >= FEWEST {
                    bin.mean()
                } else {
                    f64::NAN
                }
            })
            .collect();
        // Averages three neighbours, which reduces the speckle of each.
        let smooth: Vec<f64> = (0..means.len())
            .map(|n| {
                let [a, b] = [n.saturating_sub(1), (n + 2).min(means.len())];
                means[a..b].iter().sum::<f64>() / (b - a) as f64
            })
            .collect();
        let level = level(&smooth, at_sea)?;
        let differences: Vec<f64> = smooth
            .iter()
            .zip(level)
            .map(|(mean, level)| mean - level)
            .collect();
        let left: Vec<f64> = (0..smooth.len())
            .filter(|&n| at_sea(n) && differences[n].is_finite())
            .map(|n| differences[n] * differences[n])
            .collect();
        let scatter = (left.iter().sum::<f64>() / left.len() as f64).sqrt();
        let deviation = all.variance().sqrt();
        (deviation > 0.0 && all.mean() > 0.0).then_some(Self {
            differences,
            reach,
            sea: [all.mean(), deviation, scatter],
        })
    }

    /// The darkest (sign −1) or brightest (1) line between two coordinates, if it is significant.
    fn extreme(&self, sign: f64, [from, to]: [f64; 2]) -> Option<Streak> {
        let at = |u: i64| {
            let bin = usize::try_from(u + self.reach).ok();
            bin.and_then(|bin| self.differences.get(bin))
                .map_or(f64::NAN, |d| sign * d)
        };
        let places = from.ceil() as i64..=to.floor() as i64;
        let places = places.filter(|&u| at(u).is_finite());
        let middle = places.max_by(|&a, &b| at(a).total_cmp(&at(b)))?;
        let [mean, deviation, scatter] = self.sea;
        let height = at(middle);
        if height <= SHOWS * scatter {
            return None;
        }
        // Distance at which the profile falls below half height on one side, interpolated.
        let half = |step: i64| {
            let mut u = middle;
            while at(u + step) >= 0.5 * height {
                u += step;
            }
            let fall = (at(u) - 0.5 * height) / (at(u) - at(u + step));
            (u - middle).abs() as f64 + if fall.is_finite() { fall } else { 0.0 }
        };
        Some(Streak {
            offset: middle as f64,
            contrast: sign * height / mean,
            strength: sign * height / deviation,
            width: half(-1) + half(1),
        })
    }
}

/// Sea level under a profile: a line through the means on either side; if one side lies outside the image, the mean of
/// the other.
fn level(means: &[f64], at_sea: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
    let half = means.len() / 2;
    let side = |places: std::ops::Range<usize>| {
        let known = places.filter(|&n| at_sea(n) && means[n].is_finite());
        let known: Vec<usize> = known.collect();
        let count = known.len() as f64;
        let place = known.iter().sum::<usize>() as f64 / count;
        let mean = known.iter().map(|&n| means[n]).sum::<f64>() / count;
        (known.len() >= FEWEST).then_some((place, mean))
    };
    let (left, right) = (side(0..half), side(half + 1..means.len()));
    let (a, b) = (left.or(right)?, right.or(left)?);
    let slope = if a.0 < b.0 {
        (b.1 - a.1) / (b.0 - a.0)
    } else {
        0.0
    };
    Some(
        (0..means.len())
            .map(|n| a.1 + slope * (n as f64 - a.0))
            .collect(),
    )
}

/// Count, sum and sum of squares.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: usize,
    sum: f64,
    square: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.square += value * value;
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.square += other.square;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    fn variance(&self) -> f64 {
        (self.square / self.count as f64 - self.mean().powi(2)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_physics::Raster;
    use wake_physics::sar::speckle::speckle;

    const SIZE: usize = 500;
    const AXIS: WakeAxis = WakeAxis {
        tip: [120.0, 90.0],
        direction: 130.0,
    };

    /// Amplitude 1 times a pattern of (along, across), with speckle of a number of looks.
    fn image(looks: u32, seed: u64, pattern: impl Fn(f64, f64) -> f64 + Sync) -> Field {
        let (sin, cos) = AXIS.direction.to_radians().sin_cos();
        let raster = Raster::image(SIZE, SIZE, 1.0);
        let mut field = Field::from_fn(&raster, |i, j| {
            let (right, down) = (j as f64 - AXIS.tip[0], i as f64 - AXIS.tip[1]);
            pattern(right * sin - down * cos, right * cos + down * sin).powi(2) as f32
        });
        speckle(&mut field, looks, seed);
        field.values.iter_mut().for_each(|v| *v = v.sqrt());
        field
    }

    fn bell(x: f64, std: f64) -> f64 {
        (-0.5 * (x / std).powi(2)).exp()
    }

    /// Bells of standard deviation s are 2.355 s wide at half height; the mean over three pixels adds 2/3 of a square
    /// pixel to their variance and lowers them by the square root of the same ratio. The means have a standard error of
    /// the speckle, 0.13 at 16 looks, over √(3 × 85): 0.008; five times that is allowed.
    #[test]
    fn dark_line_and_streak_are_found_where_they_are() {
        let pattern =
            |_, across| 1.0 - 0.3 * bell(across + 2.0, 4.0) + 0.4 * bell(across - 12.0, 3.0);
        let found = wake_profile(&image(16, 1, pattern), &AXIS, [85.0, 170.0]).unwrap();
        let (dark, bright) = (found.dark.unwrap(), found.bright.unwrap());
        for (line, offset, height, std) in [(dark, -2.0, -0.3, 4.0), (bright, 12.0, 0.4, 3.0)] {
            let wider = (std * std + 2.0f64 / 3.0).sqrt();
            let lower = height * std / wider;
            assert!((line.offset - offset).abs() <= 1.0, "{line:?}");
            assert!((line.contrast - lower).abs() < 0.04, "{line:?}");
            // Errors of 0.04 in height move the half-height point by 0.04 on flanks that fall by some height/(2.4 s) a
            // pixel.
            let allowed = 2.0 * 0.04 * 2.4 * std / lower.abs();
            assert!((line.width - 2.355 * wider).abs() < allowed, "{line:?}");
            // Amplitude of 16 looks has a variation of 1/√(4 · 16), 1 % more with the next order.
            assert!(
                (line.strength * 0.125 - line.contrast).abs() < 0.03 * line.contrast.abs() + 0.002
            );
        }
    }

    /// Arms at 17 and −19°, one bright and one dark, with a standard deviation of 1.5 degrees.
    #[test]
    fn arms_are_found_at_their_angles() {
        let pattern = |along: f64, across: f64| {
            let angle = across.atan2(along).to_degrees();
            1.0 + 0.2 * bell(angle - 17.0, 1.5) - 0.15 * bell(angle + 19.0, 1.5)
        };
        let [left, right] = wake_arms(&image(4, 2, pattern), &AXIS, [85.0, 250.0]);
        let (left, right) = (left.unwrap(), right.unwrap());
        // 1.5° are 4.4 pixels half-way; averaging three pixels widens them by 2 %.
        assert!((right.width / (2.355 * 4.4) - 1.0).abs() < 0.3, "{right:?}");
        assert!(
            (left.offset + 19.0).abs() <= 1.0 && left.contrast < -0.08,
            "{left:?}"
        );
        assert!(
            (right.offset - 17.0).abs() <= 1.0 && right.contrast > 0.12,
            "{right:?}"
        );
    }

    /// Open sea gives no detection, even with a brightness gradient across the image.
    #[test]
    fn sea_shows_no_wake() {
        let mut shown = 0;
        for seed in 0..20 {
            let slope = |along: f64, across: f64| 1.0 + 5e-4 * (across + along);
            let image = image(2, seed, slope);
            for astern in [[25.0, 85.0], [85.0, 170.0]] {
                let found = wake_profile(&image, &AXIS, astern).unwrap();
                shown += usize::from(found.dark.is_some()) + usize::from(found.bright.is_some());
            }
            let arms = wake_arms(&image, &AXIS, [25.0, 200.0]);
            shown += arms.into_iter().flatten().count();
        }
        // 120 tests for a line: one in a hundred passes by chance.
        assert!(shown <= 4, "{shown}");
    }

    #[test]
    fn a_ship_is_no_streak_and_a_border_no_sea() {
        let pattern = |along: f64, across: f64| {
            if (across - 5.0).abs() < 2.0 && (along - 60.0).abs() < 3.0 {
                50.0
            } else {
                1.0
            }
        };
        let found = wake_profile(&image(16, 3, pattern), &AXIS, [25.0, 85.0]).unwrap();
        assert_eq!(found.bright, None);
        let far = WakeAxis {
            tip: [-900.0, 0.0],
            ..AXIS
        };
        assert_eq!(
            wake_profile(&image(16, 3, pattern), &far, [25.0, 85.0]),
            None
        );
        assert_eq!(
            wake_arms(&image(16, 3, pattern), &far, [25.0, 85.0]),
            [None; 2]
        );
    }
}
