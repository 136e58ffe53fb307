//! The numbers of a scene, as far as they are known.

use wake_physics::Scene;
use wake_physics::scene::Ship;
use wake_text::PartialScene;

/// What is known of a scene; `None` is left open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Conditions {
    /// Whether there is a ship.
    pub ship: Option<bool>,
    /// Ship speed [m/s].
    pub ship_speed: Option<f64>,
    /// Where the ship moves to [deg clockwise from azimuth].
    pub ship_heading: Option<f64>,
    /// Midship (x, y) \[m\].
    pub ship_position: Option<[f64; 2]>,
    /// Ship length \[m\]; no prompt states it.
    pub ship_length: Option<f64>,
    /// Wind speed at 10 m height [m/s].
    pub wind_speed: Option<f64>,
    /// Where the wind blows to [deg clockwise from azimuth].
    pub wind_toward: Option<f64>,
    /// Fetch \[m\].
    pub fetch: Option<f64>,
    /// Water depth \[m\], may be infinite; no prompt states it.
    pub depth: Option<f64>,
    /// Incidence angle \[deg\].
    pub incidence: Option<f64>,
}

impl Conditions {
    /// What a prompt states; its ship, if any, is in the middle of the image. A stated speed or heading is one of a ship.
    pub fn of_prompt(said: &PartialScene) -> Self {
        let moves = said.ship_speed.or(said.ship_heading).is_some();
        Self {
            ship: said.ship.or(moves.then_some(true)),
            ship_speed: said.ship_speed,
            ship_heading: said.ship_heading,
            ship_position: said.ship_speed.and(Some([0.0, 0.0])),
            wind_speed: said.wind_speed,
            wind_toward: said.wind_toward,
            fetch: said.fetch,
            incidence: said.incidence,
            ..Self::default()
        }
    }

    /// All numbers of a scene that the model knows.
    pub fn of_scene(scene: &Scene) -> Self {
        let ship = scene.ships.first();
        let windy = scene.sea.wind_speed > 0.0;
        Self {
            ship: Some(ship.is_some()),
            ship_speed: ship.map(|ship| ship.speed),
            ship_heading: ship.map(|ship| ship.heading),
            ship_position: ship.map(|ship| ship.position),
            ship_length: ship.map(|ship| ship.length),
            depth: Some(scene.sea.depth),
            wind_speed: Some(scene.sea.wind_speed),
            wind_toward: windy.then_some(scene.sea.wind_toward),
            fetch: windy.then_some(scene.sea.fetch),
            incidence: Some(scene.radar.incidence),
        }
    }

    /// A scene with these numbers in the place of its own; what is open, and all else, stays.
    #[must_use]
    pub fn onto(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        match self.ship {
            Some(false) => scene.ships.clear(),
            Some(true) if scene.ships.is_empty() => scene.ships.push(Ship::default()),
            _ => {}
        }
        if let Some(Ship {
            speed,
            heading,
            position,
            length,
            ..
        }) = scene.ships.first_mut()
        {
            *speed = self.ship_speed.unwrap_or(*speed);
            *heading = self.ship_heading.unwrap_or(*heading);
            *position = self.ship_position.unwrap_or(*position);
            *length = self.ship_length.unwrap_or(*length);
        }
        let sea = &mut scene.sea;
        sea.wind_speed = self.wind_speed.unwrap_or(sea.wind_speed);
        sea.wind_toward = self.wind_toward.unwrap_or(sea.wind_toward);
        sea.fetch = self.fetch.unwrap_or(sea.fetch);
        sea.depth = self.depth.unwrap_or(sea.depth);
        scene.radar.incidence = self.incidence.unwrap_or(scene.radar.incidence);
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_of_a_scene_make_the_scene_again() {
        let mut scene = Scene::default();
        for with_ship in [true, false] {
            scene.ships.retain(|_| with_ship);
            scene.sea.wind_speed = 4.5;
            let again = Conditions::of_scene(&scene).onto(&Scene::default());
            assert_eq!(again, scene);
        }
        let open = Conditions::default();
        assert_eq!(open.onto(&scene), scene);
        let ship = Conditions {
            ship: Some(true),
            ship_speed: Some(7.0),
            ..open
        };
        let speeds: Vec<f64> = ship.onto(&scene).ships.iter().map(|s| s.speed).collect();
        assert_eq!(speeds, [7.0]);
    }
}
