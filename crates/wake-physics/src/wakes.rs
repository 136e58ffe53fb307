//! The wakes of a scene's ships: Kelvin waves, turbulent wake and edges, with the scene's numbers.

use crate::constants::SPEED_OF_LIGHT;
use crate::hull::Hull;
use crate::kelvin::KelvinWake;
use crate::scattering::{bragg, breaking};
use crate::scene::{HullForm, Polarization, Radar, Scene, Ship};
use crate::track::{Track, direction};
use crate::turbulent::TurbulentWake;
use crate::turbulent::current::{EdgeResponse, WakeCurrent, WakeEdge};
use std::f64::consts::TAU;

/// Block coefficient of the full hull where the scene names none: a laden tanker.
const TANKER_BLOCK_COEFFICIENT: f64 = 0.8;

/// Farthest coordinate of a ship \[m\]: squares and areas of what lies farther overflow. No image is anywhere near.
const FARTHEST: f64 = 1e100;

/// What one ship leaves on the water.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wake {
    /// Its waves.
    pub(crate) kelvin: KelvinWake,
    /// The dark band along its track.
    pub(crate) turbulent: TurbulentWake,
    /// The current of that band, if it is asked for.
    pub(crate) edge: Option<WakeEdge>,
}

impl Wake {
    /// The wakes of all ships, in their order.
    ///
    /// - `steepness` `m_B` of the action spectrum of the Bragg waves \[1\]
    pub(crate) fn of(scene: &Scene, steepness: f64) -> Vec<Self> {
        let one = |ship: &Ship| {
            let kelvin = kelvin(ship, scene.sea.depth, scene.sea.time);
            Self {
                turbulent: TurbulentWake {
                    track: kelvin.track,
                    speed: kelvin.speed,
                    length: kelvin.hull.length(),
                    beam: kelvin.hull.beam(),
                },
                edge: edge(scene, ship, kelvin.track, steepness),
                kelvin,
            }
        };
        scene.ships.iter().map(one).collect()
    }
}

fn kelvin(ship: &Ship, depth: f64, time: f64) -> KelvinWake {
    let (length, beam, draft) = (ship.length, ship.beam, ship.draft);
    KelvinWake {
        hull: match ship.hull {
            HullForm::Wigley => Hull::wigley(length, beam, draft),
            HullForm::Full => {
                let block = ship.block_coefficient.unwrap_or(TANKER_BLOCK_COEFFICIENT);
                Hull::full(length, beam, draft, block)
            }
        },
        speed: ship.speed,
        track: Track::turning(
            ship.position.map(|at| at.clamp(-FARTHEST, FARTHEST)),
            ship.heading,
            ship.speed * time,
            ship.curvature(),
        ),
        depth,
        filter_depth: ship.filter_depth,
    }
}

/// The current of the wake in the scene's wind; none behind a ship at rest or without wind.
fn edge(scene: &Scene, ship: &Ship, track: Track, steepness: f64) -> Option<WakeEdge> {
    let wind = scene.sea.wind_speed;
    if !ship.edge || ship.speed <= 0.0 || wind <= 0.0 {
        return None;
    }
    let blowing = direction(scene.sea.wind_toward);
    let [port_x, port_y] = track.port();
    let to_port = wind * (blowing[0] * port_x + blowing[1] * port_y);
    Some(WakeEdge {
        current: WakeCurrent::of_wind(ship.speed, ship.beam, ship.edge_outflow, to_port),
        wind: blowing.map(|component| wind * component),
        track,
        length: ship.length,
        response: match ship.edge_time {
            Some(time) => EdgeResponse::Given(time),
            None => edge_response(&scene.radar, wind, steepness),
        },
    })
}

/// Response of σ⁰ to the convergence of a wake.
fn edge_response(radar: &Radar, wind_speed: f64, steepness: f64) -> EdgeResponse {
    let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
    let share = match radar.polarization {
        Polarization::VV => breaking::SHARE[0],
        Polarization::HH => breaking::SHARE[1],
    };
    let bragg = bragg::wavenumber(k_e, radar.incidence.to_radians());
    EdgeResponse::Waves {
        bragg: breaking::bragg_response(bragg, wind_speed, steepness),
        breaking: [share, breaking::response_time(k_e, wind_speed)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::Models;

    /// The Bragg waves' part of an edge's response, in the sea and at the radar of a scene: steepness over rate of growth,
    /// computed elsewhere for a fully developed sea at 5 m/s, 35°, to the digits printed (half a second of 61) and 4 % for a
    /// density of air that is not stated. With a steepness of 4.5 it would be 9 % less at L, 10 and 15 % more at C and X band.
    #[test]
    fn edges_answer_with_the_steepness_of_their_own_short_waves() {
        for (gigahertz, seconds, rounding) in
            [(1.27, 61.0, 0.5), (5.405, 7.0, 0.05), (9.65, 3.4, 0.05)]
        {
            let frequency = format!("radar.frequency={}", gigahertz * 1e9);
            let keys = [
                "sea.wind_speed=5",
                "radar.incidence=35",
                "ship.edge=true",
                &frequency,
            ];
            let mut scene = Scene::default().with_assignments(&keys).unwrap();
            scene.sea.fetch = 5e5;
            let models = Models::new(&scene);
            let edge = models.wakes[0].edge.unwrap();
            let EdgeResponse::Waves { bragg, .. } = edge.response else {
                panic!("{:?}", edge.response)
            };
            assert!(
                (bragg - seconds).abs() < 0.04 * seconds + rounding,
                "{gigahertz}: {bragg}"
            );
        }
    }
}
