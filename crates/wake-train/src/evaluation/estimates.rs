//! Errors and error bars of estimates of ship and wind.

use serde::{Deserialize, Serialize};
use std::time::Instant;
use wake_physics::estimate::{Parameter, Priors, Sighting, Value, bound, estimate, refine};
use wake_physics::measure::{angle_between, axis_between};
use wake_physics::{Field, Scene};

use super::reading::{Quantity, Reading};
use super::statistics::{mean, quantile};
use crate::error::Result;

/// The estimate of one image, against its scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EstimatedImage {
    /// Number of the image in its set.
    pub index: u64,
    /// True speed of the ship \[m/s\].
    pub speed: f64,
    /// Incidence \[deg\].
    pub incidence: f64,
    /// True if the estimate passed the tests of [`estimate`].
    pub identifiable: bool,
    /// Largest misfit of the residual spectrum, as a factor.
    pub misfit: f64,
    /// Log-likelihood ratio to the open sea.
    pub over_open_sea: f64,
    /// Seconds of the estimate times the number of its threads.
    pub seconds: f64,
    /// Error, standard deviation and Cramér–Rao bound of each of [`Parameter::OF_WAKE`]; `None` where not finite.
    pub values: Vec<[Option<f64>; 3]>,
    /// Errors of `wake_physics::measure` on the same image: heading \[deg\] and speed \[m/s\].
    pub measured: [Option<f64>; 2],
    /// Error of the heading of the sighting \[deg\].
    pub sighted: f64,
}

/// An image to estimate, with its truth and the inputs of the estimate.
#[derive(Debug, Clone)]
pub struct ToEstimate {
    /// Number in its set.
    pub index: u64,
    /// The scene that made the image, with one ship.
    pub truth: Scene,
    /// Intensity with speckle.
    pub image: Field,
    /// Scene given to the estimator.
    pub known: Scene,
    /// Initial place and heading of the wake.
    pub sighting: Sighting,
    /// Priors on calibration and texture.
    pub priors: Priors,
    /// Whether to start from the true scene, without a search.
    pub from_truth: bool,
}

impl ToEstimate {
    /// Estimates the image, and compares the result with the truth.
    ///
    /// # Errors
    ///
    /// As [`estimate`], [`refine`] and [`bound`].
    pub fn estimated(&self) -> Result<EstimatedImage> {
        let begin = Instant::now();
        let found = match self.from_truth {
            true => refine(&self.image, &self.truth, &self.priors)?,
            false => estimate(&self.image, &self.known, &self.sighting, &self.priors)?,
        };
        let seconds = begin.elapsed().as_secs_f64() * rayon::current_num_threads() as f64;
        let limit = bound(&self.truth, &Parameter::OF_WAKE, &self.priors)?;
        let told = |value: f64| value.is_finite().then_some(value);
        let values = Parameter::OF_WAKE.map(|parameter| {
            let [value, deviation] = found.of(parameter);
            [
                told(error(value, &self.truth, parameter)),
                told(deviation),
                told(limit.of(parameter)),
            ]
        });
        let reading = Reading::of_speckled(&self.image, &self.truth)?;
        let read = |quantity| reading.error(quantity, &self.truth);
        let ship = self.truth.ships.first();
        Ok(EstimatedImage {
            index: self.index,
            speed: ship.map_or(0.0, |ship| ship.speed),
            incidence: self.truth.radar.incidence,
            identifiable: found.identifiable,
            misfit: found.misfit(),
            over_open_sea: found.over_open_sea,
            seconds,
            values: values.to_vec(),
            measured: [read(Quantity::Heading), read(Quantity::Speed)],
            sighted: ship.map_or(0.0, |ship| {
                angle_between(self.sighting.heading, ship.heading)
            }),
        })
    }
}

/// Estimated less true value; for the wind direction the error of its axis, for factors the logarithm.
fn error(value: f64, truth: &Scene, parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Gain | Parameter::Texture => value,
        Parameter::Size => value - Value::Size.of(truth),
        Parameter::Value(Value::Heading) => angle_between(value, Value::Heading.of(truth)),
        Parameter::Value(Value::WindToward) => axis_between(value, Value::WindToward.of(truth)),
        Parameter::Value(of) => value - of.of(truth),
    }
}

/// Errors of one value over the identifiable images of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimateRow {
    /// Name of the value.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Median absolute error.
    pub median: Option<f64>,
    /// 90th percentile of the absolute error.
    pub percentile_90: Option<f64>,
    /// Share of the errors within 1, 2 and 3 standard deviations; for a Gaussian 0.683, 0.954 and 0.997.
    pub within: Option<[f64; 3]>,
    /// Mean over the images of squared error over squared Cramér–Rao bound; 1 for an efficient estimate.
    pub over_bound: Option<f64>,
    /// Median of the standard deviation over the bound.
    pub deviation_over_bound: Option<f64>,
    /// Histogram of Φ(error/deviation) in tenths: flat for exact error bars.
    pub ranks: [usize; 10],
}

impl EstimateRow {
    /// The rows of all values.
    #[must_use]
    pub fn of_all(images: &[EstimatedImage]) -> Vec<Self> {
        let parameters = Parameter::OF_WAKE.into_iter().enumerate();
        parameters
            .map(|(n, parameter)| {
                let of = images.iter().filter(|image| image.identifiable);
                Self::of(parameter, of.filter_map(|image| image.values.get(n)))
            })
            .collect()
    }

    fn of<'a>(parameter: Parameter, values: impl Iterator<Item = &'a [Option<f64>; 3]>) -> Self {
        let values: Vec<&[Option<f64>; 3]> = values.collect();
        let errors: Vec<f64> = values.iter().filter_map(|v| Some(v[0]?.abs())).collect();
        let pairs = values.iter().filter_map(|v| Some(v[0]? / v[1]?));
        let pulls: Vec<f64> = pairs.filter(|pull| pull.is_finite()).collect();
        let of_bound = |n: usize| -> Vec<f64> {
            let ratios = values.iter().filter_map(|v| Some(v[n]? / v[2]?));
            ratios.filter(|ratio| ratio.is_finite()).collect()
        };
        let squares: Vec<f64> = of_bound(0).iter().map(|ratio| ratio * ratio).collect();
        let mut ranks = [0; 10];
        for pull in &pulls {
            ranks[((10.0 * gaussian(*pull)) as usize).min(9)] += 1;
        }
        let within = |limit: f64| {
            let inside = pulls.iter().filter(|pull| pull.abs() < limit);
            inside.count() as f64 / pulls.len() as f64
        };
        Self {
            quantity: parameter.name(),
            unit: parameter.unit(),
            median: quantile(&errors, 0.5),
            percentile_90: quantile(&errors, 0.9),
            within: (!pulls.is_empty()).then(|| [1.0, 2.0, 3.0].map(within)),
            over_bound: mean(&squares),
            deviation_over_bound: quantile(&of_bound(1), 0.5),
            ranks,
        }
    }
}

/// Distribution function Φ of the standard Gaussian, by Simpson's rule from 0: exact to 1e-6.
fn gaussian(z: f64) -> f64 {
    let end = z.clamp(-6.0, 6.0);
    let step = end / 64.0;
    let density = |n: usize| {
        let x = step * n as f64;
        let weight = match n {
            0 | 64 => 1.0,
            _ if n % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * (-0.5 * x * x).exp()
    };
    let sum: f64 = (0..=64).map(density).sum();
    0.5 + sum * step / (3.0 * std::f64::consts::TAU.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(identifiable: bool, error: f64) -> EstimatedImage {
        EstimatedImage {
            index: 0,
            speed: 9.0,
            incidence: 30.0,
            identifiable,
            misfit: 1.0,
            over_open_sea: 100.0,
            seconds: 1.0,
            values: vec![[Some(error), Some(2.0), Some(1.0)]; 9],
            measured: [None; 2],
            sighted: 0.0,
        }
    }

    #[test]
    fn errors_are_estimates_less_true_values() {
        let mut truth = Scene::default();
        let mut ship = wake_physics::Ship::default();
        (ship.speed, ship.heading) = (9.0, 350.0);
        truth.ships = vec![ship];
        (truth.sea.wind_speed, truth.sea.wind_toward) = (6.0, 100.0);
        let size = Value::Size.of(&truth);
        for (parameter, value, expected) in [
            (Parameter::Value(Value::Speed), 10.5, 1.5),
            (Parameter::Value(Value::Heading), 20.0, 30.0),
            (Parameter::Value(Value::WindSpeed), 5.0, -1.0),
            // An axis: toward 290° is 10° from toward 100°, as is 110°.
            (Parameter::Value(Value::WindToward), 290.0, 10.0),
            (Parameter::Size, size + 0.25, 0.25),
            (Parameter::Gain, 0.1, 0.1),
        ] {
            let found = error(value, &truth, parameter);
            assert!((found - expected).abs() < 1e-9, "{parameter:?}: {found}");
        }
        assert!(size > 0.0);
    }

    /// Table of Abramowitz & Stegun (1964), 26.1.
    #[test]
    fn the_distribution_is_that_of_the_tables() {
        for (z, expected) in [
            (0.0, 0.5),
            (1.0, 0.841_344_7),
            (-2.0, 0.022_750_1),
            (3.0, 0.998_650_1),
        ] {
            assert!(
                (gaussian(z) - expected).abs() < 1e-6,
                "{z}: {}",
                gaussian(z)
            );
        }
    }

    /// Errors of 1, −3 and 5 with deviations of 2 and bounds of 1; an image that is not identifiable is ignored.
    #[test]
    fn rows_count_identifiable_images() {
        let images = [
            image(true, 1.0),
            image(true, -3.0),
            image(true, 5.0),
            image(false, 90.0),
        ];
        let rows = EstimateRow::of_all(&images);
        assert_eq!((rows.len(), rows[0].quantity), (9, "speed"));
        let row = &rows[0];
        assert_eq!(
            (row.median, row.deviation_over_bound),
            (Some(3.0), Some(2.0))
        );
        let within = row.within.unwrap_or_default();
        for (found, expected) in within.into_iter().zip([1.0 / 3.0, 2.0 / 3.0, 1.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert!(
            row.over_bound
                .is_some_and(|v| (v - 35.0 / 3.0).abs() < 1e-12)
        );
        // Φ(0.5) = 0.69, Φ(−1.5) = 0.07, Φ(2.5) = 0.99.
        assert_eq!(row.ranks, [1, 0, 0, 0, 0, 0, 1, 0, 0, 1]);
    }

    #[test]
    fn nothing_identifiable_has_no_figures() {
        let row = EstimateRow::of_all(&[image(false, 1.0)]).swap_remove(0);
        assert_eq!((row.median, row.within, row.over_bound), (None, None, None));
    }
}
