//! The wakes of a scene's ships: Kelvin waves, turbulent wake and edges, with the scene's numbers.

use crate::constants::SPEED_OF_LIGHT;
use crate::hull::Hull;
use crate::kelvin::KelvinWake;
use crate::scattering::breaking;
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
    /// - `bragg`: response of the Bragg waves to a divergence \[s\], their action slope over their relaxation rate, `m_B`/μ
    pub(crate) fn of(scene: &Scene, bragg: f64) -> Vec<Self> {
        let one = |ship: &Ship| {
            let kelvin = kelvin(ship, scene.sea.depth, scene.sea.time);
            Self {
                turbulent: TurbulentWake {
                    track: kelvin.track,
                    speed: kelvin.speed,
                    length: kelvin.hull.length(),
                    beam: kelvin.hull.beam(),
                },
                edge: edge(scene, ship, kelvin.track, bragg),
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
fn edge(scene: &Scene, ship: &Ship, track: Track, bragg: f64) -> Option<WakeEdge> {
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
            None => edge_response(&scene.radar, wind, bragg),
        },
    })
}

/// Response of σ⁰ to the convergence of a wake.
fn edge_response(radar: &Radar, wind_speed: f64, bragg: f64) -> EdgeResponse {
    let k_e = TAU * radar.frequency / SPEED_OF_LIGHT;
    let share = match radar.polarization {
        Polarization::VV => breaking::SHARE[0],
        Polarization::HH => breaking::SHARE[1],
    };
    EdgeResponse::Waves {
        bragg,
        breaking: [share, breaking::response_time(k_e, wind_speed)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::Models;
    use crate::waves::Transfer;

    /// The Bragg waves' part of an edge's response is that of the hydrodynamic modulation: the action slope of their own
    /// spectrum, 4.93, 4.11 and 3.90 at L, C and X band for 5 m/s, 35° and a developed sea, over 0.04 (u*/c)² ω with Wu's
    /// u* = 0.16771 m/s, by hand 0.06041, 0.5020 and 1.0748 1/s.
    #[test]
    fn edges_answer_at_the_relaxation_rate_of_the_modulation() {
        for (gigahertz, action_slope, rate) in [
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
                let EdgeResponse::Waves { bragg, .. } = models.wakes[0].edge.unwrap().response
                else {
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
            // Half a unit of the last digit of the action slope and rate.
            let rounding = 0.005 / action_slope + 1e-4;
            let found = bragg(&scene);
            assert!(
                (found * rate / action_slope - 1.0).abs() < rounding,
                "{gigahertz}: {found}"
            );
            // The key of a scene is the rate of both.
            scene.radar.relaxation_rate = Some(0.5);
            assert!((bragg(&scene) * 0.5 / action_slope - 1.0).abs() < rounding);
        }
    }
}
