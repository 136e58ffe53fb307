//! Visible extent of a wake, and its expected contrast against sea and speckle, without an image.

use super::dark_line::{DarkLine, DarkNearby};
use super::independent_pixel::independent_pixel;
use super::rows::rows_in;
use super::short_waves::ShortWaves;
use crate::effects::Effects;
use crate::kelvin::{KelvinWake, Ray};
use crate::linear::over_mean;
use crate::models::Models;
use crate::prepared::Prepared;
use crate::raster::Raster;
use crate::scattering::modulation::{ModulationTransfer, smear};
use crate::scene::Term;
use crate::track::Track;
use crate::turbulent::TurbulentWake;
use crate::turbulent::current::WakeEdge;
use crate::window::sinc;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Side of the windows in which a wake is searched, in independent pixels (chosen). Pixels that an impulse response correlates
/// make a window larger, so that visibility does not depend on how finely an image is sampled.
const WINDOW: f64 = 16.0;

/// Ratio from which a window shows the wake (chosen): root of the sum, over independent pixels, of the squared change by the
/// wake, over the standard deviation of one pixel. Five standard deviations of a matched filter, about ⅓ of one in each pixel.
const THRESHOLD: f64 = 5.0;

/// Rows of windows in which a part of a wake must be visible (chosen). A line of one row has no measurable direction.
const LEAST_ROWS: usize = 2;

/// Ratio of the resolution ρ of a Gaussian exp(−(πy/ρ)²) to its width at half power: π/(2√ln 2).
const OF_HALF_POWER: f64 = 1.886_718_667_752_793_6;

/// Smallest standard deviation of a pixel that counts: the rounding of the fields.
const LEAST_NOISE: f64 = 1e-6;

/// Visibility of a wake.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Visibility {
    /// 10 log₁₀(1 + s) \[dB\], where s is the root mean square of the relative change of the intensity expected from the wake; 0
    /// where nothing is visible.
    pub contrast_db: f64,
    /// s over the standard deviation of one pixel due to sea and speckle \[1\].
    pub snr: f64,
}

/// Extent of the visible parts of a wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Distance astern of the bow up to which waves are visible \[m\]; 0 where none are.
    pub(super) waves: f64,
    /// Distance astern of the bow up to which the dark line is visible \[m\]; 0 where it is not.
    pub(super) dark_line: f64,
    /// Half-width of the dark line at its end \[m\].
    pub(super) half_width: f64,
    /// Visibility averaged up to the longer end, or over the whole wedge if nothing is visible; `None` where the wedge does not
    /// meet the image.
    pub(super) visibility: Option<Visibility>,
}

impl Extent {
    /// No wake, or none in the image.
    pub(super) const NOTHING: Self = Self {
        waves: 0.0,
        dark_line: 0.0,
        half_width: 0.0,
        visibility: None,
    };

    /// Distance astern of the bow up to which anything is visible \[m\].
    pub(super) fn longest(&self) -> f64 {
        self.waves.max(self.dark_line)
    }
}

/// The waves of one ray as they are imaged.
#[derive(Debug, Clone, Copy)]
struct ImagedRay {
    /// Distance off the track to port over the distance astern of midship \[1\].
    tangent: f64,
    /// Mean square of the relative change of the image, integrated across the ray \[m\].
    change: f64,
    /// Mean square of the velocity toward the radar, integrated across the ray [m³/s²].
    velocity: f64,
    /// Squared azimuth phase by which a unit of velocity moves the wave, (ky R/V)² [s²/m²].
    displaced: f64,
}

/// The sea against which a wake is visible.
#[derive(Debug)]
pub(super) struct Background<'a> {
    models: &'a Models,
    effects: &'a Effects,
    transfer: ModulationTransfer,
    raster: Raster,
    /// Largest wavenumber that the computed pixels carry [rad/m].
    largest: f64,
    /// Share of the intensity that waves change; the rest is breaking waves and the radar's noise.
    share: f64,
    /// Resolution in range where it is not the pixel \[m\].
    range_resolution: f64,
    /// Side of the squares over which the image averages, where finer pixels are computed \[m\].
    square: f64,
    /// Azimuth resolution of the moving sea \[m\].
    resolution: f64,
    /// Standard deviation of one pixel over its mean.
    noise: f64,
    /// Side of the windows in which the wake is searched \[m\].
    window: f64,
    waves_drawn: bool,
    dark_line_drawn: bool,
    edges_drawn: bool,
    /// Change of the mean by the waves, if they are drawn on an impulse response.
    short_waves: Option<ShortWaves>,
    /// Mean velocity toward the radar [m/s].
    pub(super) velocity: f64,
}

impl<'a> Background<'a> {
    /// The open sea of a scene, `None` if the image is dark.
    pub(super) fn new(prepared: &'a Prepared<'_>) -> Option<Self> {
        let Prepared {
            scene,
            models,
            effects,
            open,
        } = prepared;
        let drawn = |term| scene.model.terms.allow(term);
        let mean = open.mean();
        if mean[0] + mean[1] <= 0.0 {
            return None;
        }
        let [range_resolution, own] = models.response.map_or([0.0; 2], |response| {
            [response.range, response.azimuth].map(|axis| OF_HALF_POWER * axis.resolution)
        });
        let mut resolution = models.resolution_at_rest().nominal;
        let averaged = match drawn(Term::Sea) {
            true => open.averaged(models),
            false => models.clone(),
        };
        if drawn(Term::VelocityBunching) {
            resolution = averaged.resolution().at(0.0);
        }
        resolution = resolution.hypot(own);
        let mut transfer = open.modulation_of(&averaged);
        if !drawn(Term::VelocityBunching) {
            transfer.range_to_velocity = 0.0;
        }
        let added: f64 = [Term::Breaking, Term::Noise]
            .into_iter()
            .zip(effects.added())
            .filter(|(term, _)| drawn(*term))
            .map(|(_, sigma0)| over_mean(sigma0, mean))
            .sum();
        let mut background = Self {
            models,
            effects,
            transfer,
            raster: models.pixels.image,
            largest: models.pixels.computed.nyquist_wavenumber(),
            share: 1.0 / (1.0 + added),
            resolution,
            range_resolution,
            square: match models.response {
                None if models.pixels.are_refined() => models.pixels.image.spacing,
                _ => 0.0,
            },
            noise: 0.0,
            window: WINDOW * models.pixels.image.spacing * independent_pixel(scene),
            waves_drawn: drawn(Term::Kelvin),
            dark_line_drawn: drawn(Term::Turbulent),
            edges_drawn: drawn(Term::BrightEdge),
            short_waves: ShortWaves::new(&averaged, effects, drawn),
            velocity: open.mean_velocity(scene, models),
        };
        let sea: f64 = open
            .waves
            .iter()
            .filter(|_| drawn(Term::Sea))
            .map(|w| w.variance * background.modulation(w.k, w.omega))
            .sum();
        let speckle = if drawn(Term::Speckle) {
            (1.0 + sea) / f64::from(scene.radar.looks)
        } else {
            0.0
        };
        background.noise = (sea + speckle).sqrt().max(LEAST_NOISE);
        Some(background)
    }

    /// Mean square of the relative change of the image by a wave of unit mean square elevation [1/m²].
    fn modulation(&self, k: [f64; 2], omega: f64) -> f64 {
        let mean = k.map(|k| sinc(k * self.square / TAU));
        let smeared =
            smear(k[1], self.resolution) * smear(k[0], self.range_resolution) * mean[0] * mean[1];
        let change = self.share * smeared;
        self.transfer.at(k, omega).total().norm_sqr() * change * change
    }

    /// Visible extent of a wake that opens by `half_angle` \[rad\].
    pub(super) fn extent(&self, ship: usize, half_angle: f64) -> Extent {
        let step = self.window;
        let edge = self.effects.bright_edge.edges[ship];
        let band = self.dark_line(self.effects.turbulent.wakes[ship], edge);
        let wake = &self.models.wakes[ship];
        let rays = self.rays(wake);
        let short = self.short_waves.as_ref().and_then(|short| short.of(ship));
        let half_length = 0.5 * wake.hull.length();
        let mut extent = Extent::NOTHING;
        let (mut rows, mut seen_rows) = (Vec::new(), [0; 2]);
        for n in rows_in(&wake.track, &self.raster, half_length, step)
            .into_iter()
            .flatten()
        {
            // Middle of the row of windows, astern of the stern.
            let distance = (n as f64 + 0.5) * step;
            let Some(windows) = self.windows(wake, distance, half_angle, &band) else {
                continue;
            };
            let profile = short
                .as_ref()
                .map(|short| short.profile(wake, distance + half_length));
            // Behind a turning ship, waves and dark line lie as beside a straight track along the tangent.
            let tangent = wake.track.turn().map(|_| {
                let track = wake.track.at(-distance - half_length).straight();
                let band = TurbulentWake { track, ..band.wake };
                let rays = self.rays(&KelvinWake { track, ..*wake });
                (rays, self.dark_line(band, edge))
            });
            let (rays, local) = tangent.as_ref().map_or((&rays, &band), |(r, b)| (r, b));
            let dark = DarkNearby {
                line: local,
                short: profile.as_ref(),
            };
            let row = self.row(wake, distance, windows, rays, &dark);
            let end = distance + 0.5 * step + 2.0 * half_length;
            let seen = |square: f64| WINDOW * square.sqrt() >= THRESHOLD * self.noise;
            if seen(row.largest[0]) {
                seen_rows[0] += 1;
                extent.waves = end;
            }
            if seen(row.largest[1]) {
                seen_rows[1] += 1;
                extent.dark_line = end;
                extent.half_width = band.half_width(distance + 0.5 * step);
            }
            rows.push((end, row));
        }
        if seen_rows[0] < LEAST_ROWS {
            extent.waves = 0.0;
        }
        if seen_rows[1] < LEAST_ROWS {
            (extent.dark_line, extent.half_width) = (0.0, 0.0);
        }
        let seen = extent.longest();
        let counted = rows.iter().filter(|(end, _)| seen == 0.0 || *end <= seen);
        let (sum, count) = counted.fold((0.0, 0.0), |(sum, count), (_, row)| {
            // If no wave is visible, the box holds the dark line alone.
            let of = if extent.waves > 0.0 || seen == 0.0 {
                row.wedge
            } else {
                row.line
            };
            (sum + of[0], count + of[1])
        });
        extent.visibility = (count > 0.0).then(|| self.visibility(sum / count));
        extent
    }

    fn dark_line(&self, wake: TurbulentWake, edge: Option<WakeEdge>) -> DarkLine {
        let damped = if self.dark_line_drawn {
            self.share * self.transfer.bragg_share
        } else {
            0.0
        };
        let edge = edge.filter(|_| self.edges_drawn);
        DarkLine::new(wake, edge, [damped, self.share], self.resolution)
    }

    fn visibility(&self, mean_square: f64) -> Visibility {
        let change = mean_square.sqrt();
        Visibility {
            contrast_db: 10.0 * (1.0 + change).log10(),
            snr: change / self.noise,
        }
    }

    /// Rays of the drawn wake, on both sides.
    fn rays(&self, wake: &KelvinWake) -> Vec<ImagedRay> {
        if !self.waves_drawn {
            return Vec::new();
        }
        let of_side = |ray: &Ray, side: f64| {
            let k = wake.track.turned([ray.k[0], side * ray.k[1]]);
            let radial = self.transfer.transfer.radial(k, ray.omega);
            ImagedRay {
                tangent: side * ray.tangent,
                change: ray.energy * self.modulation(k, ray.omega),
                velocity: ray.energy * radial.norm_sqr(),
                displaced: (k[1] * self.transfer.range_to_velocity).powi(2),
            }
        };
        let rays = wake.rays(self.largest);
        rays.iter()
            .flat_map(|ray| [1.0, -1.0].map(|side| of_side(ray, side)))
            .collect()
    }

    /// First and last of the windows across the track that may be in the image, at one distance astern of the stern, in window
    /// widths off the track.
    fn windows(
        &self,
        wake: &KelvinWake,
        distance: f64,
        half_angle: f64,
        band: &DarkLine,
    ) -> Option<[f64; 2]> {
        let width = self.window;
        let half_length = 0.5 * wake.hull.length();
        let from_midship = distance + half_length;
        let reach = (half_angle.tan() * (from_midship + half_length)).min(self.diagonal());
        let half_band = band.half_width(distance);
        let half = (reach.max(half_band) / width - 0.5).ceil().max(0.0);
        let [starboard, port] = self.across(&wake.track.at(-from_midship))?;
        let first = (starboard / width).ceil().max(-half);
        let last = (port / width).floor().min(half);
        (first <= last).then_some([first, last])
    }

    /// Changes in the windows of a row.
    fn row(
        &self,
        wake: &KelvinWake,
        distance: f64,
        [first, last]: [f64; 2],
        rays: &[ImagedRay],
        dark: &DarkNearby<'_>,
    ) -> Row {
        let width = self.window;
        let from_midship = distance + 0.5 * wake.hull.length();
        let half_band = dark.line.half_width(distance);
        let windows = (last - first) as usize + 1;
        let place = |ray: &ImagedRay| {
            let place = (ray.tangent * from_midship / width).round();
            let inside = (first..=last).contains(&place);
            inside.then_some((place - first) as usize)
        };
        // Mean square velocity in each window, which displaces the waves there.
        let mut velocity = vec![0.0; windows];
        for ray in rays {
            if let Some(n) = place(ray) {
                velocity[n] += ray.velocity / width;
            }
        }
        let mut waves = vec![0.0; windows];
        for ray in rays {
            if let Some(n) = place(ray) {
                waves[n] += ray.change / width * bunched(ray.displaced * velocity[n]);
            }
        }
        let mut row = Row::default();
        for (n, waves) in waves.into_iter().enumerate() {
            let off = (first + n as f64) * width;
            if !self.holds(wake.track.on_sea([-from_midship, off])) {
                continue;
            }
            let [dark, short, both] = dark.line.mean_squares(distance, off, width, dark.short);
            let all = waves + both;
            row.largest = [row.largest[0].max(waves + short), row.largest[1].max(dark)];
            row.wedge = [row.wedge[0] + all, row.wedge[1] + 1.0];
            if off.abs() <= half_band.max(0.5 * width) {
                row.line = [row.line[0] + all, row.line[1] + 1.0];
            }
        }
        row
    }

    /// Smallest and largest distance off the track at which the perpendicular at a place of the track may be in the image, with
    /// half a window to spare \[m\]; `None` where the whole image lies ahead or astern of the place.
    fn across(&self, there: &Track) -> Option<[f64; 2]> {
        let corners = there.straight().corners(&self.raster);
        let [astern, ahead] = span(corners.map(|corner| corner[0]));
        let [starboard, port] = span(corners.map(|corner| corner[1]));
        let spare = 0.5 * self.window;
        (astern <= spare && ahead >= -spare).then_some([starboard - spare, port + spare])
    }

    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let inside = |at: f64, count: usize| {
            // One row or column reaches to the edges of its pixels.
            let edge = if count > 1 { 0.0 } else { 0.5 };
            (-edge..=count as f64 - 1.0 + edge).contains(&at)
        };
        let [column, row] = self.raster.pixel(x, y);
        inside(column, self.raster.columns) && inside(row, self.raster.rows)
    }

    /// Twice the diagonal of the image \[m\]; windows farther away are outside.
    fn diagonal(&self) -> f64 {
        let [height, across] = [self.raster.rows, self.raster.columns].map(|n| n as f64);
        2.0 * height.hypot(across) * self.raster.spacing
    }
}

/// Smallest and largest of some values.
fn span<const N: usize>(values: [f64; N]) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    let wider = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
    values.into_iter().fold(start, wider)
}

/// Share of a wave's power that is left by displacement with its own velocity.
///
/// ```text
/// (2 J₁(C)/C)²,     C² = 2 (ky R/V)² ⟨u²⟩
/// ```
///
/// The echoes of a sinusoid displaced by (C/ky) sin have the fundamental 2J₁(C), to first order C. Harmonics are left out; the
/// smear of the sea weakens them most.
///
/// - `phase`: (ky R/V)² ⟨u²⟩ \[1\], at least 0
fn bunched(phase: f64) -> f64 {
    let c = (2.0 * phase).sqrt();
    if c < 1e-4 {
        return 1.0;
    }
    (2.0 * libm::j1(c) / c).powi(2)
}

/// The windows of one row.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    /// Largest mean squared change by waves, and by the dark line.
    largest: [f64; 2],
    /// Sum of the mean squares, and number of windows, in the wedge.
    wedge: [f64; 2],
    /// Sum of the mean squares, and number of windows, along the dark line.
    line: [f64; 2],
}

#[cfg(test)]
mod tests {
    use super::{bunched, rows_in};
    use crate::raster::Raster;
    use crate::track::Track;
    use std::f64::consts::TAU;

    /// The rows of windows include every place of the image, and do not grow in number for a ship far away.
    #[test]
    fn rows_of_windows_do_not_grow_with_the_distance() {
        let raster = Raster::image(64, 48, 5.0);
        let step = 80.0;
        let count = |track: &Track| -> u64 {
            let rows = rows_in(track, &raster, 50.0, step);
            rows.into_iter().map(|rows| rows.end - rows.start).sum()
        };
        for curvature in [0.0, 1.0 / 400.0, -1.0 / 900.0] {
            for (position, heading) in [
                ([40.0, 90.0], 20.0),
                ([900.0, 700.0], 200.0),
                ([5e3, 4e3], 50.0),
            ] {
                let track = Track::turning(position, heading, 0.0, curvature);
                let rows = rows_in(&track, &raster, 50.0, step);
                for (i, j) in (0..64).flat_map(|i| (0..48).map(move |j| (i, j))) {
                    let [ahead, _] = track.seen_from_ship([raster.x(j), raster.y(i)]);
                    // Within half a step of the middle of a row, which lies half a step astern of its beginning.
                    let row = ((-ahead - 50.0) / step).floor();
                    let inside = rows.iter().any(|rows| rows.contains(&(row as u64)));
                    assert!(
                        row < 0.0 || inside,
                        "{curvature} {position:?}: {row} {rows:?}"
                    );
                }
            }
        }
        for far in [1e7, 1e13, 1e30, 1e100] {
            let straight = Track::new([far, far], 45.0, 0.0);
            // 400 m from corner to corner, and three rows to spare; half a circle of 1260 m.
            assert!(count(&straight) <= 8, "{far}");
            let turning = Track::turning([far, far], 225.0, 0.0, 1.0 / 400.0);
            assert!(count(&turning) <= 8 + 20, "{far}");
        }
    }

    /// The fundamental of displaced echoes agrees with counting them, at places y + (C/k) sin(ky) of even sources.
    #[test]
    fn a_displaced_sinusoid_has_the_fundamental_of_its_echoes() {
        for c in [0.1f64, 0.5, 1.0, 2.0, 3.0] {
            let count = 4096;
            let mean = |f: fn(f64) -> f64| -> f64 {
                (0..count)
                    .map(|n| {
                        let phase = TAU * f64::from(n) / f64::from(count);
                        f(phase + c * phase.sin())
                    })
                    .sum::<f64>()
                    / f64::from(count)
            };
            let fundamental = 2.0 * mean(f64::cos).hypot(mean(f64::sin));
            // A periodic sum of 4096 points of a smooth function is exact.
            assert!(
                (bunched(0.5 * c * c) - (fundamental / c).powi(2)).abs() < 1e-10,
                "{c}"
            );
        }
        assert!((bunched(0.0) - 1.0).abs() < 1e-15);
    }
}
