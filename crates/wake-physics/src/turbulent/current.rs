//! The current across a turbulent wake, and its bright edges. A phenomenological model.
//!
//! ```text
//! v(d, η) = [V_o z e^{½ − z²/2} − V_d e^{−z²/2}] e^{−t/T},     z = η/W(d), t = d/U
//! σ⁰ → σ⁰ exp(clip(−T_e ∂v/∂η, ±1.2))
//! ```
//!
//! η is to port. The first term is the outflow of the vortex pair and of the bubble plume: a dark middle between two bright
//! edges. The second is the wind drift that the wake mixes away: water at its sides drifts on, converges on the windward edge,
//! which is bright, and leaves the other, which is darker. Fujimura, Soloviev and Kudryavtsev (2010), IEEE Geosci. Remote Sens.
//! Lett. 7, computed and observed that the convergence is stronger on the windward side. The form and every constant here are
//! chosen, some to resemble measured images.

use super::width;
use crate::kelvin::fade;
use crate::raster::{Field, Raster};
use crate::track::Track;
use rayon::prelude::*;

/// Widths W off the track beyond which the current is below 2e-8 of its largest value.
const REACH: f64 = 6.0;

/// Surface drift over wind speed, wholly lost in the wake: chosen.
pub const DRIFT_OF_WIND: f64 = 0.03;

/// Time T in which the current falls to 1/e \[s\]: chosen within the 150 to 500 s in which edges fade in images.
pub const CURRENT_DECAY: f64 = 400.0;

/// Largest |ln| of the factor on σ⁰: chosen, as near the stern the wake is narrow and the model too strong.
pub const LARGEST_CHANGE: f64 = 1.2;

/// Longest response time \[s\]: chosen. Waves that respond more slowly leave the wake first.
pub const LONGEST_RESPONSE: f64 = 1000.0;

/// The current across the wake of a ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeCurrent {
    /// Speed of the ship U [m/s], above 0.
    pub speed: f64,
    /// Beam of the ship B \[m\], above 0.
    pub beam: f64,
    /// Outflow `V_o` at the stern [m/s], at z = ±1.
    pub outflow: f64,
    /// Drift `V_d` that the wake has lost at the stern [m/s], positive to port.
    pub drift: f64,
}

impl WakeCurrent {
    /// Current in a wind.
    ///
    /// - `wind_to_port`: component to port of the wind at 10 m [m/s]
    #[must_use]
    pub fn of_wind(speed: f64, beam: f64, outflow: f64, wind_to_port: f64) -> Self {
        Self {
            speed,
            beam,
            outflow,
            drift: DRIFT_OF_WIND * wind_to_port,
        }
    }

    /// Velocity to port [m/s] at `distance` d astern of the stern and η to port \[m\].
    #[must_use]
    pub fn velocity(&self, distance: f64, port: f64) -> f64 {
        let z = port / width(self.beam, distance);
        let bell = (-0.5 * z * z).exp();
        self.left(distance) * bell * (self.outflow * z * 0.5f64.exp() - self.drift)
    }

    /// Divergence ∂v/∂η [1/s] at the same place; the change of the current along the wake is negligible.
    ///
    /// ```text
    /// [V_o/W e^{½ − z²/2} (1 − z²) + V_d/W z e^{−z²/2}] e^{−t/T}
    /// ```
    #[must_use]
    pub fn divergence(&self, distance: f64, port: f64) -> f64 {
        let width = width(self.beam, distance);
        let z = port / width;
        let bell = (-0.5 * z * z).exp() / width;
        let outflow = self.outflow * 0.5f64.exp() * (1.0 - z * z);
        self.left(distance) * bell * (outflow + self.drift * z)
    }

    /// Share of the current left after the time since the ship passed.
    fn left(&self, distance: f64) -> f64 {
        (-distance.max(0.0) / (self.speed * CURRENT_DECAY)).exp()
    }
}

/// The current behind a ship on its track, and its factor on σ⁰.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeEdge {
    /// The current at the stern.
    pub current: WakeCurrent,
    /// Wind at 10 m (x, y) [m/s]; where the track turns, its component to port sets the drift.
    pub wind: [f64; 2],
    /// Place and direction of the ship.
    pub track: Track,
    /// Length of the hull L \[m\].
    pub length: f64,
    /// Response of σ⁰ to a divergence.
    pub response: EdgeResponse,
}

/// Response time `T_e` of σ⁰ to a divergence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EdgeResponse {
    /// The same in all directions of the track \[s\].
    Given(f64),
    /// By [`response_time`], from the direction across the track.
    Waves {
        /// Response time of Bragg waves that run across the track \[s\].
        bragg: f64,
        /// Share of σ⁰ from breaking waves, and their response time \[s\].
        breaking: [f64; 2],
    },
}

impl EdgeResponse {
    /// `T_e` \[s\] for a unit vector to port with the component `across` along the look direction.
    #[must_use]
    pub fn at(&self, across: f64) -> f64 {
        match *self {
            Self::Given(response) => response,
            Self::Waves {
                bragg,
                breaking: [share, time],
            } => response_time(bragg, across, share, time),
        }
    }
}

impl WakeEdge {
    /// Factor on σ⁰ at ξ forward of midship and η to port \[m\]; 1 ahead of the bow, setting in along the hull like the Kelvin
    /// wake ([`fade`]).
    #[must_use]
    pub fn factor(&self, seen: [f64; 2]) -> f64 {
        let [forward, port] = seen;
        let (current, across) = self.there(forward);
        let divergence = current.divergence(self.astern(forward), port);
        edge_factor(divergence, self.response.at(across)).powf(fade(forward, self.length))
    }

    /// Current at ξ of the track, and the component of the unit vector to port along the look direction there.
    fn there(&self, forward: f64) -> (WakeCurrent, f64) {
        if self.track.turn().is_none() {
            return (self.current, self.track.port()[0]);
        }
        let [x, y] = self.track.at(forward).port();
        let to_port = self.wind[0] * x + self.wind[1] * y;
        let current = WakeCurrent {
            drift: DRIFT_OF_WIND * to_port,
            ..self.current
        };
        (current, x)
    }

    /// Velocity to port at a place seen from the ship [m/s].
    pub(crate) fn velocity(&self, [forward, port]: [f64; 2]) -> f64 {
        let (current, _) = self.there(forward);
        current.velocity(self.astern(forward), port) * fade(forward, self.length)
    }

    /// Divergence of the current at a place seen from the ship [1/s].
    pub(crate) fn divergence(&self, [forward, port]: [f64; 2]) -> f64 {
        let (current, _) = self.there(forward);
        current.divergence(self.astern(forward), port) * fade(forward, self.length)
    }

    /// Distance astern of the stern \[m\].
    fn astern(&self, forward: f64) -> f64 {
        (-forward - 0.5 * self.length).max(0.0)
    }

    /// Multiplies σ⁰ by the factor wherever [`Self::factor`] differs from 1 by more than 2e-8 of its largest change.
    ///
    /// # Panics
    ///
    /// If the field is smaller than the raster.
    pub fn modulate(&self, sigma0: &mut Field, raster: &Raster) {
        self.change(sigma0, raster, |value, seen| {
            *value *= self.factor(seen) as f32;
        });
    }

    /// Adds the current to the velocities of the water along x and y [m/s]; a field without pixels is left as it is.
    pub(crate) fn add_velocity(&self, along: [&mut Field; 2], raster: &Raster) {
        for (axis, field) in along.into_iter().enumerate() {
            if field.values.is_empty() {
                continue;
            }
            let port = |seen: [f64; 2]| match self.track.turn() {
                None => self.track.port()[axis],
                Some(_) => self.track.at(seen[0]).port()[axis],
            };
            self.change(field, raster, |value, seen| {
                *value += (port(seen) * self.velocity(seen)) as f32;
            });
        }
    }

    /// Changes the pixels near the track, by their places as seen from the ship.
    fn change(
        &self,
        field: &mut Field,
        raster: &Raster,
        change: impl Fn(&mut f32, [f64; 2]) + Sync,
    ) {
        let farthest = self.track.farthest_astern(raster);
        let reach = REACH * width(self.current.beam, farthest);
        let rows = field.values.par_chunks_mut(raster.columns.max(1));
        rows.enumerate().for_each(|(i, row)| {
            let seen = |j: usize| self.track.seen_from_ship([raster.x(j), raster.y(i)]);
            let columns = self.track.columns_within(raster, i, reach);
            for (j, value) in columns.clone().zip(&mut row[columns]) {
                change(value, seen(j));
            }
        });
    }
}

/// Factor of a divergence [1/s] on σ⁰ \[1\].
///
/// ```text
/// exp(clip(−T_e div, ±1.2))
/// ```
///
/// This is the steady response to a current of waves that relax in a time much shorter than that in which the wake changes.
///
/// - `response` `T_e` \[s\], see [`response_time`]
#[must_use]
pub fn edge_factor(divergence: f64, response: f64) -> f64 {
    (-response * divergence)
        .clamp(-LARGEST_CHANGE, LARGEST_CHANGE)
        .exp()
}

/// Response time `T_e` \[s\] of σ⁰ to a divergence: Bragg waves respond along the look direction, breaking waves in any
/// direction.
///
/// ```text
/// T_e = (1 − p) m_B cos²χ/μ_B + p T_b,     at most 1000 s
/// ```
///
/// - `bragg`: `m_B`/`μ_B` \[s\], strength of the modulation over the relaxation rate
/// - `across`: cos χ, χ the angle from the look direction to the direction across the track
/// - `breaking`: p, share of σ⁰ from breaking waves; `breaking_response`: `T_b` \[s\], see
///   [`crate::scattering::breaking::response_time`]
#[must_use]
pub fn response_time(bragg: f64, across: f64, breaking: f64, breaking_response: f64) -> f64 {
    let response = (1.0 - breaking) * bragg * across * across + breaking * breaking_response;
    response.min(LONGEST_RESPONSE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wake() -> WakeCurrent {
        WakeCurrent {
            speed: 8.0,
            beam: 26.0,
            outflow: 0.03,
            drift: 0.12,
        }
    }

    #[test]
    fn divergence_is_the_slope_of_the_velocity() {
        let (wake, step) = (wake(), 1e-3);
        for distance in [0.0, 50.0, 700.0, 5000.0] {
            for port in [-150.0, -40.0, 0.0, 3.0, 60.0, 133.0] {
                let slope = (wake.velocity(distance, port + step)
                    - wake.velocity(distance, port - step))
                    / (2.0 * step);
                // Central difference: step²/6 of the third derivative, below V/W³.
                assert!((wake.divergence(distance, port) - slope).abs() < 1e-10);
            }
        }
    }

    /// `V_o/W` = 1: 1.6487 at z = 0, −0.7358 at √3. `V_d/W` = 1: ±e^{−½} = 0.6065 at z = ±1.
    #[test]
    fn extremes_in_closed_form() {
        let beam = 20.0;
        let of = |outflow: f64, drift: f64, z: f64| {
            let current = WakeCurrent {
                speed: 1e9,
                beam,
                outflow: beam * outflow,
                drift: beam * drift,
            };
            current.divergence(0.0, z * beam)
        };
        assert!((of(1.0, 0.0, 0.0) - 1.6487).abs() < 1e-4);
        assert!((of(1.0, 0.0, 3f64.sqrt()) + 0.7358).abs() < 1e-4);
        assert!((of(0.0, 1.0, 1.0) - 0.6065).abs() < 1e-4);
        assert!((of(0.0, 1.0, -1.0) + 0.6065).abs() < 1e-4);
        for z in [0.99, 1.01] {
            assert!(of(0.0, 1.0, z) < of(0.0, 1.0, 1.0));
        }
    }

    /// 1 km behind a ship of 7.2 m/s, with 4 m/s of wind across and a response of 950 s, the edge is twice as bright as the sea.
    #[test]
    fn the_windward_edge_is_bright() {
        let current = WakeCurrent::of_wind(7.2, 26.0, 0.0, -4.0);
        let across = width(26.0, 1000.0);
        assert!((current.drift + 0.12).abs() < 1e-12);
        // Wind to starboard comes from port: port converges.
        let [port, starboard] =
            [across, -across].map(|at| edge_factor(current.divergence(1000.0, at), 950.0));
        assert!(port > 1.0 && starboard < 1.0, "{port} {starboard}");
        // ln = T V_d e^{−½}/W · e^{−t/T} by hand: 950·0.12·0.60653/71.30·e^{−138.9/400} = 0.6853.
        assert!((port.ln() - 0.6853).abs() < 1e-3, "{}", port.ln());
        assert!((port.ln() + starboard.ln()).abs() < 1e-12);
    }

    #[test]
    fn width_where_it_was_tabulated() {
        for (distance, expected) in [
            (200.0, 51.9),
            (500.0, 62.1),
            (1000.0, 71.3),
            (2000.0, 81.8),
            (5000.0, 98.2),
        ] {
            assert!((width(26.0, distance) - expected).abs() < 0.06);
        }
    }

    /// Waves carried along with the wake relax as n' = −μ n − m div(t); the factor uses the steady n = −m div/μ. Compared with
    /// the integral over the age t by quadrature, the lag is (d ln div/dt)/μ to first order.
    #[test]
    fn the_steady_response_is_that_of_the_relaxation() {
        let current = WakeCurrent {
            outflow: 0.0,
            ..wake()
        };
        // At the place z = 1 of a wake that widens.
        let divergence = |age: f64| {
            let distance = current.speed * age;
            current.divergence(distance, width(current.beam, distance))
        };
        let rule = crate::numeric::GaussLegendre::new(64);
        for (rate, age) in [(0.6f64, 100.0f64), (0.2, 200.0), (0.1, 300.0)] {
            let lag = 1.0 / rate;
            let integral = rule.integrate([(age - 30.0 * lag).max(0.0), age], |t| {
                divergence(t) * (-rate * (age - t)).exp()
            });
            let steady = divergence(age) / rate;
            // a = −d ln div/dt = 1/T + (1/5)/(t + B/4U) at most; the second order is a² + (1/5)/t², the rest smaller.
            let change = 1.0 / CURRENT_DECAY + 0.2 / age;
            let second = (change * change + 0.2 / (age * age)) * lag * lag;
            let first_order = steady * (1.0 + change * lag);
            assert!(
                (integral / first_order - 1.0).abs() < 1.5 * second + (-rate * age).exp(),
                "{rate} {age}: {}",
                integral / steady
            );
        }
    }

    /// Water is conserved: the divergence sums to zero across the wake.
    #[test]
    fn water_is_conserved() {
        let wake = wake();
        let across = width(wake.beam, 400.0);
        let rule = crate::numeric::GaussLegendre::new(60);
        let sum = rule.integrate([-9.0 * across, 9.0 * across], |y| wake.divergence(400.0, y));
        assert!(sum.abs() < 1e-9, "{sum}");
    }

    fn edge() -> WakeEdge {
        WakeEdge {
            current: wake(),
            track: Track::new([200.0, -100.0], 70.0, 0.0),
            wind: [0.0; 2],
            length: 150.0,
            response: EdgeResponse::Given(300.0),
        }
    }

    #[test]
    fn fields_are_the_functions() {
        let edge = edge();
        let raster = Raster::image(70, 90, 20.0);
        let mut sigma0 = Field::constant(&raster, 0.5);
        edge.modulate(&mut sigma0, &raster);
        let [mut vx, mut vy] = [(); 2].map(|()| Field::constant(&raster, 0.0));
        edge.add_velocity([&mut vx, &mut vy], &raster);
        let mut changed = 0;
        for i in 0..raster.rows {
            for j in 0..raster.columns {
                let seen = edge.track.seen_from_ship([raster.x(j), raster.y(i)]);
                let expected = 0.5 * edge.factor(seen);
                assert!((f64::from(sigma0.at(i, j)) / expected - 1.0).abs() < 2e-7);
                changed += usize::from((expected - 0.5).abs() > 0.05);
                let distance = (-seen[0] - 75.0).max(0.0);
                let speed = edge.current.velocity(distance, seen[1]) * fade(seen[0], 150.0);
                let [px, py] = edge.track.port();
                assert!((f64::from(vx.at(i, j)) - px * speed).abs() < 1e-8);
                assert!((f64::from(vy.at(i, j)) - py * speed).abs() < 1e-8);
            }
        }
        assert!(changed > 100, "{changed}");
        // Nothing ahead of the bow.
        assert!((edge.factor([80.0, 20.0]) - 1.0).abs() < 1e-12);
        let mut none = Field::default();
        let mut other = Field::default();
        edge.add_velocity([&mut none, &mut other], &raster);
        assert!(none.values.is_empty() && other.values.is_empty());
    }

    #[test]
    fn the_change_is_limited() {
        assert!((edge_factor(-1.0, 400.0).ln() - 1.2).abs() < 1e-12);
        assert!((edge_factor(1.0, 400.0).ln() + 1.2).abs() < 1e-12);
        assert!((edge_factor(1e-4, 400.0).ln() + 0.04).abs() < 1e-12);
        assert!((response_time(7.0, 1.0, 0.2, 711.0) - 147.8).abs() < 1e-9);
        assert!((response_time(61.0, 0.0, 0.2, 4000.0) - 800.0).abs() < 1e-9);
        assert!((response_time(61.0, 1.0, 0.4, 4000.0) - LONGEST_RESPONSE).abs() < 1e-9);
    }
}
