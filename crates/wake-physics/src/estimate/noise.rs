//! Deviations from the expected image: sea and speckle, as a stationary field of relative intensity.
//!
//! ```text
//! I = μ (1 + s) n,     r = I/μ − 1,     cov r(d) = c_s(d) + (1 + c_s(d)) ρ²(d)/N
//! ```
//!
//! where s is the open sea by the nonlinear transform ([`sea`]), n the speckle of N looks (Gamma, mean 1), and ρ² the correlation
//! of the speckle's intensity by the radar's impulse response. Without an impulse response, ρ² is 1 at distance 0 and 0
//! elsewhere.

use super::sea;
use super::torus::Torus;
use crate::error::Result;
use crate::random::{Stream, generator};
use crate::raster::Field;
use crate::scene::Scene;
use crate::window::Window;
use rand_distr::{Distribution, StandardNormal};

/// Covariance of relative intensity on a torus, by distance in rows and columns.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    pub(super) size: usize,
    /// Covariance of the sea.
    sea: Vec<f32>,
    /// Correlation of the speckle, divided by the looks.
    speckle: Vec<f32>,
}

/// Equivalent number of looks of a scene's image.
pub(super) fn equivalent_looks(scene: &Scene) -> f64 {
    let radar = &scene.radar;
    if radar.range_resolution.is_none() {
        return f64::from(radar.looks);
    }
    let window = radar.window.unwrap_or(Window::Uniform);
    window.overlapping_looks(radar.looks, radar.look_overlap.unwrap_or(0.0))
}

impl Noise {
    /// # Errors
    ///
    /// A value of the scene out of its range, or an image that does not fit in memory.
    pub(super) fn new(scene: &Scene) -> Result<Self> {
        let covariance = sea::covariance(scene)?;
        let size = covariance.rows;
        let lags = correlations(scene, size);
        let looks = equivalent_looks(scene);
        let speckle =
            (0..size * size).map(|n| (lags[0][n / size] * lags[1][n % size] / looks) as f32);
        Ok(Self {
            size,
            speckle: speckle.collect(),
            sea: covariance.values,
        })
    }

    /// Adds a fraction of the change from one sea to another.
    pub(super) fn add_change(&mut self, part: f32, from: &Self, to: &Self) {
        let changes = to.sea.iter().zip(&from.sea).map(|(to, from)| to - from);
        for (value, change) in self.sea.iter_mut().zip(changes) {
            *value += part * change;
        }
    }

    /// Draws a Gaussian sea with this covariance.
    pub(super) fn drawn(&self, size: [usize; 2], seed: u64) -> Field {
        let torus = Torus::new(self.size);
        let mut random = generator(seed, Stream::Sea, 0);
        let mut gaussian = || -> f32 { StandardNormal.sample(&mut random) };
        let white = self.field((0..self.size * self.size).map(|_| gaussian()));
        let mut spectrum = torus.spectrum(&white);
        let power = torus.spectrum(&self.field(self.sea.iter().copied()));
        for (value, power) in spectrum.iter_mut().zip(&power) {
            *value *= power.re.max(0.0).sqrt();
        }
        let [sea, _] = torus.fields([&spectrum, &spectrum], size);
        sea
    }

    /// Covariance of the sea alone.
    #[cfg(test)]
    pub(super) fn sea(&self) -> Field {
        self.field(self.sea.iter().copied())
    }

    /// Share of the sea in the variance of a pixel, including its product with the speckle.
    pub(super) fn share_of_sea(&self) -> f64 {
        let [sea, speckle] = [&self.sea, &self.speckle].map(|c| f64::from(c[0]));
        let by_sea = sea * (1.0 + speckle);
        by_sea / (by_sea + speckle)
    }

    /// Variance of a pixel with the sea's variance multiplied by a factor.
    pub(super) fn variance(&self, factor: f64) -> f32 {
        together(factor, self.sea[0], self.speckle[0])
    }

    /// Covariance with the sea's variance multiplied by a factor.
    pub(super) fn covariance(&self, factor: f64) -> Field {
        let pairs = self.sea.iter().zip(&self.speckle);
        self.field(pairs.map(|(&sea, &speckle)| together(factor, sea, speckle)))
    }

    /// Derivative of the covariance by the logarithm of the factor.
    pub(super) fn by_factor(&self, factor: f64) -> Field {
        let pairs = self.sea.iter().zip(&self.speckle);
        let factor = factor as f32;
        self.field(pairs.map(|(sea, speckle)| factor * sea * (1.0 + speckle)))
    }

    fn field(&self, values: impl Iterator<Item = f32>) -> Field {
        Field {
            rows: self.size,
            columns: self.size,
            values: values.collect(),
        }
    }
}

/// Covariance of sea and speckle at one distance, the sea's multiplied by a factor.
fn together(factor: f64, sea: f32, speckle: f32) -> f32 {
    let sea = factor as f32 * sea;
    sea + (1.0 + sea) * speckle
}

/// Correlation of the speckle's intensity by distance along rows (first axis: azimuth) and columns.
fn correlations(scene: &Scene, size: usize) -> [Vec<f64>; 2] {
    let radar = &scene.radar;
    let window = radar.window.unwrap_or(Window::Uniform);
    let axes = [
        (
            radar.azimuth_resolution,
            radar.azimuth_window.unwrap_or(window),
        ),
        (radar.range_resolution.unwrap_or(1.0), window),
    ];
    axes.map(|(resolution, window)| {
        let of = |lag: usize| match radar.range_resolution {
            None => f64::from(u8::from(lag == 0)),
            Some(_) => {
                let distance = lag as f64 * scene.grid.spacing;
                window.correlation(distance * window.width() / resolution)
            }
        };
        (0..size).map(|n| of(n.min(size - n))).collect()
    })
}

/// A window over the image, and its effects on spectra.
#[derive(Debug, Clone)]
pub(super) struct Taper {
    pub(super) weights: Field,
    /// Σ w².
    pub(super) energy: f64,
    /// Σ w⁴/Σ w².
    pub(super) peakedness: f64,
    /// Σ w(x) w(x + d) by distance on the torus.
    overlap: Field,
}

/// Relative width of the edge over which a window falls to 0.
const EDGE: f64 = 1.0 / 32.0;

impl Taper {
    /// A window that falls to 0 at the border of the image, times `shown` at the row and column.
    pub(super) fn new(
        torus: &Torus,
        [rows, columns]: [usize; 2],
        shown: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let edge = |at: usize, count: usize| {
            let from = (at.min(count - 1 - at) as f64 + 1.0) / (EDGE * count as f64 + 1.0);
            0.5 - 0.5 * (std::f64::consts::PI * from.min(1.0)).cos()
        };
        let weight = |n: usize| {
            let (i, j) = (n / columns, n % columns);
            (edge(i, rows) * edge(j, columns) * shown(i, j)) as f32
        };
        Self::of_weights(torus, [rows, columns], weight)
    }

    /// A window of 1 over the whole image.
    pub(super) fn flat(torus: &Torus, size: [usize; 2]) -> Self {
        Self::of_weights(torus, size, |_| 1.0)
    }

    fn of_weights(
        torus: &Torus,
        [rows, columns]: [usize; 2],
        weight: impl Fn(usize) -> f32,
    ) -> Self {
        let weights = Field {
            rows,
            columns,
            values: (0..rows * columns).map(weight).collect(),
        };
        let power = |p: i32| -> f64 { weights.values.iter().map(|w| f64::from(w.powi(p))).sum() };
        let mut spectrum = torus.spectrum(&weights);
        for value in &mut spectrum {
            *value = value.norm_sqr().into();
        }
        let [overlap, _] = torus.fields([&spectrum, &spectrum], [torus.size; 2]);
        Self {
            energy: power(2),
            peakedness: power(4) / power(2),
            weights,
            overlap,
        }
    }

    /// Multiplies a field by the window.
    pub(super) fn of(&self, values: impl Iterator<Item = f32>) -> Field {
        let weighed = values.zip(&self.weights.values).map(|(v, w)| v * w);
        Field {
            values: weighed.collect(),
            ..self.weights
        }
    }

    /// Expected power |R|² of a field with a given covariance, in the window.
    pub(super) fn power(&self, torus: &Torus, covariance: &Field) -> Vec<f32> {
        let pairs = covariance.values.iter().zip(&self.overlap.values);
        let seen = Field {
            values: pairs.map(|(c, w)| c * w).collect(),
            ..*covariance
        };
        torus.spectrum(&seen).iter().map(|v| v.re).collect()
    }
}
