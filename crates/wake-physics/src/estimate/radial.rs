//! Conditions an estimate on the ship's radial velocity, from the displacement of its echo.

use super::parameter::Parameter;
use super::refined::Estimate;
use super::value::Value;
use crate::scene::Scene;

/// Difference from the estimate, in standard deviations, above which the two contradict each other (chosen).
const CONTRADICTION: f64 = 4.0;

const SPEED: Parameter = Parameter::Value(Value::Speed);
const HEADING: Parameter = Parameter::Value(Value::Heading);

impl Estimate {
    /// Radial velocity of the estimated ship toward the radar [m/s], and its standard deviation.
    #[must_use]
    pub fn radial_velocity(&self) -> [f64; 2] {
        let velocity = toward_radar(&self.scene);
        let Some((slope, count)) = self.slope() else {
            return [velocity, f64::INFINITY];
        };
        let variance: f64 = (0..count).map(|n| slope[n] * self.spread(&slope, n)).sum();
        [velocity, variance.max(0.0).sqrt()]
    }

    /// Conditions the estimate on a measured radial velocity of the ship, from the displacement of its echo: R/V times the
    /// velocity.
    ///
    /// All values are updated by their covariance, to first order (Kalman 1960), and alternatives are reweighted by their own
    /// radial velocities. The estimate is not identifiable if estimated and measured velocity differ by more than 4 standard
    /// deviations. The echo moves over ground, the wake in the water: add the velocity of a possible current to the deviation.
    ///
    /// - `velocity`: velocity toward the radar [m/s]
    /// - `deviation`: standard deviation of the velocity [m/s], above 0
    ///
    /// # References
    ///
    /// Kalman (1960), J. Basic Eng. 82, 35.
    #[must_use]
    pub fn with_radial_velocity(mut self, velocity: f64, deviation: f64) -> Self {
        let [expected, spread] = self.radial_velocity();
        let Some((slope, count)) = self.slope().filter(|_| deviation > 0.0) else {
            return self;
        };
        let innovation = velocity - expected;
        let variance = spread * spread + deviation * deviation;
        self.identifiable &= innovation.abs() < CONTRADICTION * variance.sqrt();
        let away = |scene: &Scene| (velocity - toward_radar(scene)).powi(2) / variance;
        let here = away(&self.scene);
        let gains: Vec<f64> = (0..count)
            .map(|n| self.spread(&slope, n) / variance)
            .collect();
        for n in 0..count {
            for m in 0..count {
                self.covariance[n * count + m] -= gains[n] * gains[m] * variance;
            }
        }
        for (n, one) in self.values.iter_mut().enumerate() {
            let step = gains[n] * innovation;
            one.value += step;
            one.deviation = self.covariance[n * count + n].max(0.0).sqrt();
            for value in one.parameter.values() {
                let to = value.of(&self.scene) + step;
                value.set(&mut self.scene, to);
            }
        }
        let mut total = self.weight;
        for other in &mut self.alternatives {
            other.weight *= (0.5 * (here - away(&other.scene))).exp();
            total += other.weight;
        }
        self.weight /= total;
        self.alternatives.iter_mut().for_each(|a| a.weight /= total);
        self
    }

    /// Derivatives of the radial velocity by the values; `None` without a covariance.
    fn slope(&self) -> Option<(Vec<f64>, usize)> {
        let count = self.values.len();
        let ship = self.scene.ships.first()?;
        let (sin, cos) = ship.heading.to_radians().sin_cos();
        let across = self.scene.radar.incidence.to_radians().sin();
        let of = |parameter: Parameter| match parameter {
            SPEED => -sin * across,
            HEADING => -ship.speed * cos * across * 1f64.to_radians(),
            _ => 0.0,
        };
        let slope = self.values.iter().map(|one| of(one.parameter)).collect();
        (self.covariance.len() == count * count).then_some((slope, count))
    }

    /// Covariance of a value with the quantity that has the given slope.
    fn spread(&self, slope: &[f64], row: usize) -> f64 {
        let line = &self.covariance[row * slope.len()..][..slope.len()];
        line.iter().zip(slope).map(|(c, s)| c * s).sum()
    }
}

/// Velocity of the first ship toward the radar [m/s].
fn toward_radar(scene: &Scene) -> f64 {
    let incidence = scene.radar.incidence.to_radians();
    scene.ships.first().map_or(0.0, |ship| {
        -ship.speed * ship.heading.to_radians().sin() * incidence.sin()
    })
}

#[cfg(test)]
mod tests {
    use super::super::refined::{Alternative, Estimated};
    use super::*;
    use crate::raster::Field;

    /// A ship of 10 m/s along range, standard deviations of 0.2 m/s and 2 degrees, and an alternative of 7 m/s.
    fn estimate() -> Estimate {
        let mut scene = Scene::default();
        scene.radar.incidence = 30.0;
        scene.ships[0].speed = 10.0;
        scene.ships[0].heading = 90.0;
        let mut slow = scene.clone();
        slow.ships[0].speed = 7.0;
        let value = |parameter, value, deviation| Estimated {
            parameter,
            value,
            deviation,
        };
        Estimate {
            scene,
            mean: Field::default(),
            values: vec![value(SPEED, 10.0, 0.2), value(HEADING, 90.0, 2.0)],
            covariance: vec![0.04, 0.1, 0.1, 4.0],
            weight: 0.75,
            alternatives: vec![Alternative {
                scene: slow,
                weight: 0.25,
            }],
            log_likelihood: 0.0,
            over_open_sea: 100.0,
            power: vec![1.0],
            by_echo: None,
            identifiable: true,
        }
    }

    /// Along range, the radial velocity determines the speed: it becomes the mean of both speeds weighted by their precisions,
    /// and the heading follows by its covariance.
    #[test]
    fn speeds_are_weighed_by_their_precisions() {
        // −5.2 m/s toward the radar is 10.4 m/s along range at sin 30°; 0.1 m/s is 0.2 m/s.
        let found = estimate().with_radial_velocity(-5.2, 0.1);
        let [speed, deviation] = found.of(SPEED);
        assert!((speed - 10.2).abs() < 1e-9 && (deviation - 0.02f64.sqrt()).abs() < 1e-9);
        // Half of the innovation 0.4 times covariance over variance.
        assert!((found.of(HEADING)[0] - 90.5).abs() < 1e-9);
        assert!((found.scene.ships[0].heading - 90.5).abs() < 1e-9);
        assert!(found.identifiable && found.alternatives[0].weight < 1e-20);
    }

    #[test]
    fn an_uncertain_velocity_changes_nothing_and_a_contradiction_is_one() {
        let found = estimate().with_radial_velocity(3.0, 1e9);
        assert!((found.of(SPEED)[0] - 10.0).abs() < 1e-9 && found.identifiable);
        assert!((found.alternatives[0].weight - 0.25).abs() < 1e-9);
        // A ship that goes the other way.
        assert!(!estimate().with_radial_velocity(5.0, 0.2).identifiable);
    }

    /// A ship of 10 ± 0.2 m/s along range moves at −5 ± 0.1 m/s toward a radar at 30° incidence.
    #[test]
    fn the_radial_velocity_is_that_of_the_ship() {
        let [velocity, deviation] = estimate().radial_velocity();
        assert!((velocity + 5.0).abs() < 1e-9 && (deviation - 0.1).abs() < 1e-9);
    }
}
