//! Impulse response of the radar: from a rough surface to a complex image and its looks.
//!
//! ```text
//! E = √(I/2) (g₁ + i g₂)                       reflectivity of a rough surface of intensity I, white
//! S = F⁻¹[F[E] W_x(f_x) W_y(f_y)] / √mean(W²)  single-look complex image
//! ⟨|S|²⟩ = I ⊛ |h|² / ∫|h|²                    its intensity, in the unit of I
//! ```
//!
//! Sea, noise and ships pass through the same filter. A point of cross section σ is √σ/Δ in one cell of E, with Δ the
//! spacing; its image integrates to σ.

use crate::fft::{self, Filtered, LowPass};
use crate::numeric::vector::{cos_sin, ln_f32, vectorized};
use crate::random::{Stream, generator};
use crate::raster::{Field, Raster};
use crate::window::Window;
use num_complex::Complex32;
use rand::Rng;
use std::f64::consts::TAU;

/// Resolutions between the image and the edge of the sources: sidelobes that wrap around stay beyond it (chosen).
const GUARD: f64 = 8.0;

/// Random lines from one look to the next.
const LOOK_LINES: u64 = 1 << 20;

/// Impulse response along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Resolution ρ \[m\]: the half-power width of the response to a point.
    pub resolution: f64,
    /// Weight over the bandwidth.
    pub window: Window,
}

impl Axis {
    /// Bandwidth B in spatial frequency [1/m].
    #[must_use]
    pub fn bandwidth(&self) -> f64 {
        self.window.width() / self.resolution
    }

    /// Intensity transfer function at a wavenumber [rad/m] along this axis \[1\].
    pub(crate) fn intensity_transfer(&self, k: f64) -> f64 {
        self.window.intensity_transfer(k / (TAU * self.bandwidth()))
    }

    /// W at the frequencies of an FFT of `size` values, with Σ W² = `size`, so that white noise keeps its power.
    fn band(&self, size: usize, spacing: f64) -> fft::Band {
        let step = 1.0 / (size as f64 * spacing * self.bandwidth());
        let highest = ((0.5 / step).floor() as usize).min((size - 1) / 2);
        let weight = |n: usize| self.window.weight((n as f64 - highest as f64) * step);
        let weights: Vec<f64> = (0..=2 * highest).map(weight).collect();
        let power: f64 = weights.iter().map(|w| w * w).sum();
        let scale = (size as f64 / power).sqrt();
        fft::Band(weights.iter().map(|w| (scale * w) as f32).collect())
    }
}

/// Impulse response of a radar in ground range x and azimuth y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpulseResponse {
    /// Response in ground range.
    pub range: Axis,
    /// Response in azimuth.
    pub azimuth: Axis,
}

/// A coherent point scatterer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointTarget {
    /// Imaged position (x, y) \[m\].
    pub position: [f64; 2],
    /// Radar cross section \[m²\], at least 0.
    pub cross_section: f64,
}

/// Surface and points to be imaged.
#[derive(Debug, Clone, Copy)]
pub struct Reflectivity<'a> {
    /// Pixels of the intensity: at least the image and its guard.
    pub raster: &'a Raster,
    /// Mean intensity of the rough surface, noise included, in units of σ⁰.
    pub intensity: &'a Field,
    /// Ships and their azimuth ambiguities.
    pub points: &'a [PointTarget],
}

/// Parameters of multilooking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looks {
    /// Equivalent number of looks, at least 1. Overlapping looks count less than their number, see
    /// [`Window::overlapping_looks`].
    pub equivalent: f64,
    /// Seed; the results do not depend on the number of threads.
    pub seed: u64,
}

impl ImpulseResponse {
    /// Rows and columns of sources needed around the image, at their own spacing \[m\].
    #[must_use]
    pub fn guard(&self, spacing: f64) -> [usize; 2] {
        [self.azimuth, self.range].map(|axis| (GUARD * axis.resolution / spacing).ceil() as usize)
    }

    /// Largest source spacing that resolves the intensity \[m\], 1/(2B) of the finer axis.
    #[must_use]
    pub(crate) fn carrying_spacing(&self) -> f64 {
        let carried = [self.range, self.azimuth].map(|axis| 0.5 / axis.bandwidth());
        carried[0].min(carried[1])
    }

    /// Largest source spacing \[m\]: it resolves the intensity and is at most ρ/4 of the coarser axis (chosen), so that
    /// brightness due to waves shorter than the response does not change on finer sources.
    #[must_use]
    pub(crate) fn largest_spacing(&self) -> f64 {
        let coarser = self.range.resolution.max(self.azimuth.resolution);
        (coarser / 4.0).min(self.carrying_spacing())
    }

    /// Largest speckle correlation between two pixels of a row or a column, see [`Window::pixel_correlation`].
    #[must_use]
    pub fn pixel_correlation(&self, spacing: f64) -> f64 {
        let of = |axis: &Axis| axis.window.pixel_correlation(spacing / axis.resolution);
        of(&self.range).max(of(&self.azimuth))
    }

    /// Mean of the image's intensity over all speckle, I ⊛ |h|²/∫|h|², `[rows, columns]` of the image.
    ///
    /// # Panics
    ///
    /// As [`Self::multilook`], and if the sources are too coarse for twice the bandwidth.
    #[must_use]
    pub fn mean(&self, sources: &Reflectivity<'_>, image: &Raster) -> Field {
        let mut mean = self.filtered(sources, image);
        mean.values.iter_mut().for_each(|v| *v = v.max(0.0));
        mean
    }

    /// [`Self::mean`] for an intensity that may be negative, such as a derivative.
    pub(crate) fn filtered(&self, sources: &Reflectivity<'_>, image: &Raster) -> Field {
        let view = View::new(sources, image);
        let raster = sources.raster;
        let bands = self.bands(&view, raster.spacing).map(|b| power_band(&b));
        let filter = LowPass::new(view.sizes, view.step, bands);
        let points: Vec<_> = sources
            .points
            .iter()
            .map(|p| {
                view.point(
                    raster,
                    p.position,
                    Complex32::new(view.power(p) as f32, 0.0),
                )
            })
            .collect();
        let fill = |i: usize, row: &mut [Complex32]| {
            for (value, intensity) in row.iter_mut().zip(view.row(sources, i)) {
                value.re = *intensity;
            }
        };
        let mut out = Field::constant(image, 0.0);
        let take = |from: &[Complex32], to: &mut [f32]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = from.re;
            }
        };
        let filtered = filter.filtered(raster.rows, fill, &points, &view.window);
        filter.kept_rows(&filtered, &mut out.values, take);
        out
    }

    /// Single-look complex image S, `[rows, columns]` of the image; |S|² is its intensity.
    ///
    /// # Panics
    ///
    /// As [`Self::multilook`].
    #[must_use]
    pub fn single_look(
        &self,
        sources: &Reflectivity<'_>,
        image: &Raster,
        seed: u64,
    ) -> Vec<Complex32> {
        let mut out = vec![Complex32::ZERO; image.len()];
        let view = View::new(sources, image);
        let filter = self.filter(&view, sources);
        let look = look(&filter, &view, sources, seed, 0);
        filter.kept_rows(&look, &mut out, |from, to| to.copy_from_slice(from));
        out
    }

    /// Mean intensity of independent looks, `[rows, columns]` of the image.
    ///
    /// All looks have the same weight except the last, which has less, so that (Σw)²/Σw² is the requested equivalent
    /// number. Mean, variance and correlation are as for overlapping bands of one aperture.
    ///
    /// # Panics
    ///
    /// If the image's spacing is not a multiple of the sources', its pixels lie between theirs or outside them, or the
    /// intensity does not match the raster in size.
    #[must_use]
    pub fn multilook(&self, sources: &Reflectivity<'_>, image: &Raster, looks: &Looks) -> Field {
        let weights = look_weights(looks.equivalent);
        let mut out = Field::constant(image, 0.0);
        let view = View::new(sources, image);
        let filter = self.filter(&view, sources);
        for (n, weight) in weights.into_iter().enumerate() {
            let look = look(&filter, &view, sources, looks.seed, n as u64);
            let weight = weight as f32;
            filter.kept_rows(&look, &mut out.values, |from, to| {
                for (to, from) in to.iter_mut().zip(from) {
                    *to += weight * from.norm_sqr();
                }
            });
        }
        out
    }

    /// The low-pass filter of a look.
    fn filter(&self, view: &View, sources: &Reflectivity<'_>) -> LowPass {
        let bands = self.bands(view, sources.raster.spacing);
        LowPass::new(view.sizes, view.step, bands)
    }

    /// Filter weights of rows and columns.
    fn bands(&self, view: &View, spacing: f64) -> [fft::Band; 2] {
        [
            self.azimuth.band(view.sizes[0], spacing),
            self.range.band(view.sizes[1], spacing),
        ]
    }
}

/// Position of the image within the sources.
struct View {
    sizes: [usize; 2],
    step: usize,
    window: fft::Window,
    /// Area of a source pixel \[m²\].
    area: f64,
}

impl View {
    fn new(sources: &Reflectivity<'_>, image: &Raster) -> Self {
        let raster = sources.raster;
        assert_eq!(
            (sources.intensity.rows, sources.intensity.columns),
            (raster.rows, raster.columns),
            "the intensity and its raster differ in size"
        );
        let step = (image.spacing / raster.spacing).round();
        assert!(
            step >= 1.0 && (step * raster.spacing - image.spacing).abs() <= 1e-9 * image.spacing,
            "image spacing is {} m, expected a multiple of the sources' spacing of {} m",
            image.spacing,
            raster.spacing
        );
        let step = step as usize;
        let start = [
            raster.origin_row - image.origin_row * step as i64,
            raster.origin_column - image.origin_column * step as i64,
        ];
        let keep = [image.rows, image.columns];
        let inside = |axis: usize, size: usize| {
            start[axis] >= 0 && start[axis] as usize + step * (keep[axis] - 1) < size
        };
        assert!(
            inside(0, raster.rows) && inside(1, raster.columns),
            "the image reaches beyond its sources"
        );
        Self {
            sizes: LowPass::sizes([raster.rows, raster.columns], step),
            step,
            window: fft::Window {
                start: start.map(|s| s as usize),
                keep,
            },
            area: raster.spacing * raster.spacing,
        }
    }

    /// One row of the intensity.
    fn row<'a>(&self, sources: &Reflectivity<'a>, i: usize) -> &'a [f32] {
        let columns = sources.raster.columns;
        &sources.intensity.values[i * columns..(i + 1) * columns]
    }

    /// Squared amplitude of a point in one cell.
    fn power(&self, point: &PointTarget) -> f64 {
        point.cross_section / self.area
    }

    fn point(&self, raster: &Raster, [x, y]: [f64; 2], amplitude: Complex32) -> fft::Point {
        let [column, row] = raster.pixel(x, y);
        fft::Point {
            place: [row, column],
            amplitude,
        }
    }
}

/// One look: rough surface and points, with random phases determined by the look's number.
fn look(
    filter: &LowPass,
    view: &View,
    sources: &Reflectivity<'_>,
    seed: u64,
    number: u64,
) -> Filtered {
    let raster = sources.raster;
    let first = number * LOOK_LINES;
    let mut phases = generator(seed, Stream::Points, number);
    let points: Vec<_> = sources
        .points
        .iter()
        .map(|p| {
            let [cos, sin] = cos_sin((phases.next_u64() >> 32) as u32);
            let amplitude = view.power(p).sqrt() as f32;
            let amplitude = Complex32::new(amplitude * cos, amplitude * sin);
            view.point(raster, p.position, amplitude)
        })
        .collect();
    let fill = |i: usize, row: &mut [Complex32]| {
        rough_row(view.row(sources, i), seed, first + i as u64, row);
    };
    filter.filtered(raster.rows, fill, &points, &view.window)
}

/// Weights of looks with sum 1, such that 1/Σw² is `equivalent`.
///
/// m full looks of weight 1 and one of weight a with (m + a)² = n(m + a²), n being the equivalent number.
fn look_weights(equivalent: f64) -> Vec<f64> {
    let n = equivalent.max(1.0);
    let full = n.floor();
    if n - full < 1e-9 {
        return vec![1.0 / full; full as usize];
    }
    // The root between 0 and 1 of (n − 1)a² − 2ma + m(n − m) = 0.
    let root = (full * full + (n - 1.0) * full * (full - n))
        .max(0.0)
        .sqrt();
    let last = (full - root) / (n - 1.0);
    let mut weights = vec![1.0; full as usize];
    weights.push(last);
    weights.iter().map(|w| w / (full + last)).collect()
}

/// Weights of the intensity: the autocorrelation of the amplitude's weights, 1 at frequency 0.
fn power_band(band: &fft::Band) -> fft::Band {
    let weights = &band.0;
    let total: f64 = weights.iter().map(|&w| f64::from(w * w)).sum();
    let at = |shift: usize| {
        let pairs = weights.iter().zip(&weights[shift..]);
        let sum: f64 = pairs.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum();
        (sum / total) as f32
    };
    let highest = weights.len() - 1;
    fft::Band(
        (0..=2 * highest)
            .map(|n: usize| at(n.abs_diff(highest)))
            .collect(),
    )
}

/// One row of the reflectivity √(I/2)(g₁ + i g₂), with modulus √(−I ln u) and uniform phase (Box and Muller 1958).
fn rough_row(intensity: &[f32], seed: u64, line: u64, row: &mut [Complex32]) {
    let mut random = generator(seed, Stream::Reflectivity, line);
    let bits: Vec<u64> = intensity.iter().map(|_| random.next_u64()).collect();
    vectorized(
        #[inline(always)]
        || {
            for ((value, &intensity), bits) in row.iter_mut().zip(intensity).zip(&bits) {
                let uniform =
                    ((*bits as u32 >> 1) as i32 as f32 + 0.5) * f32::from_bits((127 - 31) << 23);
                let length = (-intensity * ln_f32(uniform)).max(0.0).sqrt();
                let [cos, sin] = cos_sin((*bits >> 32) as u32);
                *value = Complex32::new(length * cos, length * sin);
            }
        },
    );
}

#[cfg(test)]
#[path = "impulse_tests.rs"]
mod tests;
