//! Estimates of ship and wind.

use serde::Serialize;

/// Ship and wind estimated from the image of a wake, in directions of the map; the estimator is the caller's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EstimatedShip {
    /// True if the estimate passed its tests; otherwise do not use the other values.
    pub identifiable: bool,
    /// Speed through the water \[m/s\].
    pub speed: f64,
    /// Standard deviation of the speed \[m/s\].
    pub speed_deviation: f64,
    /// Heading, clockwise from true north \[degrees\].
    pub heading: f64,
    /// Standard deviation of the heading \[degrees\].
    pub heading_deviation: f64,
    /// Wind speed at 10 m \[m/s\].
    pub wind_speed: f64,
    /// Standard deviation of the wind speed \[m/s\].
    pub wind_speed_deviation: f64,
    /// Direction that the wind blows toward, clockwise from true north \[degrees\]; it may be reversed.
    pub wind_toward: f64,
    /// Standard deviation of the wind's axis \[degrees\].
    pub wind_toward_deviation: f64,
    /// Largest misfit of the residual spectrum, as a factor.
    pub misfit: f64,
}
