//! Bright edges of turbulent wakes: the current of a wake displaces and concentrates echoes and modulates the waves that
//! scatter.

use super::effect::{Effect, NOT_ASKED_FOR, OUTSIDE, Site, Weight};
use crate::constants::SPEED_OF_LIGHT;
use crate::fields::Fields;
use crate::kelvin::KelvinWake;
use crate::linear::Amplitudes;
use crate::linear::amplitudes::rms_over;
use crate::models::Models;
use crate::raster::Field;
use crate::scattering::breaking;
use crate::scene::{Polarization, Radar, Recovery, Scene, Ship, Term};
use crate::track::direction;
use crate::turbulent::REFERENCE_WIND;
use crate::turbulent::current::{EdgeResponse, LONGEST_RESPONSE, WakeCurrent, WakeEdge};
use std::f64::consts::TAU;

#[derive(Debug)]
pub(crate) struct BrightEdges {
    /// The current behind each ship that has a bright edge.
    pub(crate) edges: Vec<Option<WakeEdge>>,
    absent: Option<&'static str>,
}

impl BrightEdges {
    pub(super) fn new(scene: &Scene, models: &Models) -> Self {
        let ships = scene.ships.iter().zip(&models.wakes);
        let edges: Vec<_> = ships
            .map(|(ship, wake)| edge(scene, models, ship, wake))
            .collect();
        let absent = if scene.ships.is_empty() {
            Some("there is no ship")
        } else if !scene.ships.iter().any(|ship| ship.edge) {
            Some(NOT_ASKED_FOR)
        } else if edges.iter().all(Option::is_none) {
            Some("the ship is at rest, or there is no wind")
        } else {
            None
        };
        Self { edges, absent }
    }

    fn drawn(&self) -> impl Iterator<Item = &WakeEdge> {
        self.edges.iter().flatten()
    }

    /// Root mean squares over the image: the relative change of σ⁰ and of its density in the image by the currents, and
    /// their velocity along the line of sight [m/s].
    fn strength(&self, models: &Models) -> [f64; 2] {
        let of = |edge: &WakeEdge| {
            let to_port = |seen: [f64; 2]| edge.track.at(seen[0]).port().map(f64::abs);
            let change = |place| {
                let seen = edge.track.seen_from_ship(place);
                let [port_x, port_y] = to_port(seen);
                let along_sight = port_x * models.incidence.sin();
                // Velocity bunching concentrates echoes by R/V times the azimuth slope of the velocity.
                let gathered = models.range_to_velocity * along_sight * port_y;
                (edge.factor(seen) - 1.0).abs() + gathered * edge.divergence(seen).abs()
            };
            let velocity = |place| {
                let seen = edge.track.seen_from_ship(place);
                to_port(seen)[0] * models.incidence.sin() * edge.velocity(seen)
            };
            [
                rms_over(&models.pixels.computed, change),
                rms_over(&models.pixels.computed, velocity),
            ]
        };
        // Where wakes cross, their changes add up at most.
        let each = self.drawn().map(of);
        each.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
    }
}

/// Estimated change of the intensity, relative.
///
/// - `strength`: root mean square of the relative change of σ⁰ and of the velocity along the line of sight [m/s]
pub(crate) fn estimate([change, velocity]: [f64; 2], amplitudes: &Amplitudes<'_>) -> f64 {
    let shift = amplitudes.first.modulation.range_to_velocity * velocity;
    change + shift / amplitudes.moving_width() * amplitudes.contrast
}

/// The current of a wake in the scene's wind; none behind a ship at rest or without wind.
fn edge(scene: &Scene, models: &Models, ship: &Ship, wake: &KelvinWake) -> Option<WakeEdge> {
    let wind = scene.sea.wind_speed;
    if !ship.edge || ship.speed <= 0.0 || wind <= 0.0 {
        return None;
    }
    let blowing = direction(scene.sea.wind_toward);
    let [port_x, port_y] = wake.track.port();
    let to_port = wind * (blowing[0] * port_x + blowing[1] * port_y);
    Some(WakeEdge {
        current: WakeCurrent::of_wind(ship.speed, ship.beam, ship.edge_outflow, to_port),
        wind: blowing.map(|component| wind * component),
        track: wake.track,
        length: ship.length,
        response: match ship.edge_time {
            Some(time) => EdgeResponse::Given(match ship.recovery {
                Recovery::Constant => time,
                Recovery::Wind => in_wind(time, &scene.radar, wind),
            }),
            None => edge_response(&scene.radar, wind, models),
        },
    })
}

/// Response time \[s\] in the scene's wind, from `time` at the reference wind; it scales with wind as for breaking waves.
fn in_wind(time: f64, radar: &Radar, wind_speed: f64) -> f64 {
    let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
    let of = |wind| breaking::response_time(k_e, wind);
    (time * (of(wind_speed) / of(REFERENCE_WIND))).min(LONGEST_RESPONSE)
}

/// Response of σ⁰ to the convergence of a wake: of the Bragg waves `m_B`/μ, and of breaking waves.
fn edge_response(radar: &Radar, wind_speed: f64, models: &Models) -> EdgeResponse {
    let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
    let share = match radar.polarization {
        Polarization::VV => breaking::SHARE[0],
        Polarization::HH => breaking::SHARE[1],
    };
    EdgeResponse::Waves {
        bragg: models.transfer.action_slope / models.transfer.relaxation_rate,
        breaking: [share, breaking::response_time(k_e, wind_speed)],
    }
}

impl Effect for BrightEdges {
    fn term(&self) -> Term {
        Term::BrightEdge
    }

    fn weigh(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        let strength = self.strength(models);
        let unseen = strength.iter().all(|v| *v == 0.0);
        Weight {
            absent: self.absent.or(unseen.then_some(OUTSIDE)),
            estimate: estimate(strength, amplitudes),
        }
    }

    fn add_velocity(&self, site: &Site<'_>, fields: &mut Fields) {
        let along = [&mut fields.velocity_x, &mut fields.velocity_y];
        let [x, y] = along;
        for edge in self.drawn() {
            edge.add_velocity([&mut *x, &mut *y], &site.raster);
        }
    }

    fn change_sigma0(&self, site: &Site<'_>, sigma0: &mut Field, _: Option<&Field>) {
        for edge in self.drawn() {
            edge.modulate(sigma0, &site.raster);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waves::Transfer;

    /// The Bragg part of an edge's response equals the Bragg part of the hydrodynamic modulation: the slope of the Bragg waves'
    /// action spectrum, 4.93, 4.11 and 3.90 at L, C and X band for 5 m/s, 35° and a developed sea, over 0.04 (u*/c)² ω.
    /// With Wu's u* = 0.16771 m/s that rate is, by hand, 0.06041, 0.5020 and 1.0748 1/s.
    #[test]
    fn edges_answer_at_the_relaxation_rate_of_the_modulation() {
        for (gigahertz, slope, rate) in [
            (1.27, 4.93, 0.06041),
            (5.405, 4.11, 0.5020),
            (9.65, 3.90, 1.0748),
        ] {
            let keys = [
                "sea.wind_speed=5",
                "radar.incidence=35",
                "ship.edge=true",
                &format!("radar.frequency={}", gigahertz * 1e9),
            ];
            let mut scene = Scene::default().with_assignments(&keys).unwrap();
            scene.sea.fetch = 1e7;
            let bragg = |scene: &Scene| {
                let models = Models::new(scene);
                let edges = BrightEdges::new(scene, &models).edges;
                let EdgeResponse::Waves { bragg, .. } = edges[0].unwrap().response else {
                    panic!("a given response")
                };
                let Transfer {
                    action_slope,
                    relaxation_rate,
                    ..
                } = models.transfer;
                assert!((bragg * relaxation_rate / action_slope - 1.0).abs() < 1e-12);
                bragg
            };
            // Half a unit of the last digit of slope and rate.
            let rounding = 0.005 / slope + 1e-4;
            let found = bragg(&scene);
            assert!(
                (found * rate / slope - 1.0).abs() < rounding,
                "{gigahertz}: {found}"
            );
            // The scene's key sets the rate of both.
            scene.radar.relaxation_rate = Some(0.5);
            assert!((bragg(&scene) * 0.5 / slope - 1.0).abs() < rounding);
        }
    }
}
