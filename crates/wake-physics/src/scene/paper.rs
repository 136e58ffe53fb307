//! The parameter grid of the paper this project starts from.

use super::{Scene, Ship};

/// The 3,456 scenes of the parameter grid of Kamirul, Pappas and Achim: ship 195 × 26 m; speed 6, 8, 10,
/// 12 m/s; heading 0 to 315° by 45°; wind 3, 5, 7 m/s toward 0, 90, 180, 270°; fetch 10, 40, 70 km;
/// incidence 16, 24, 32°. All other values are defaults.
///
/// # References
///
/// *Physics-Informed Diffusion Models for SAR Ship Wake Generation from Text Prompts*.
pub fn paper_grid() -> impl Iterator<Item = Scene> {
    const SPEEDS: [f64; 4] = [6.0, 8.0, 10.0, 12.0];
    const WINDS: [f64; 3] = [3.0, 5.0, 7.0];
    const FETCHES: [f64; 3] = [10e3, 40e3, 70e3];
    const INCIDENCES: [f64; 3] = [16.0, 24.0, 32.0];
    (0..4 * 8 * 3 * 4 * 3 * 3).map(|index| {
        let mut rest = index;
        let mut pick = |n: usize| {
            let i = rest % n;
            rest /= n;
            i
        };
        let mut scene = Scene::default();
        scene.radar.incidence = INCIDENCES[pick(3)];
        scene.sea.fetch = FETCHES[pick(3)];
        scene.sea.wind_toward = 90.0 * pick(4) as f64;
        scene.sea.wind_speed = WINDS[pick(3)];
        scene.ships = vec![Ship {
            heading: 45.0 * pick(8) as f64,
            speed: SPEEDS[pick(4)],
            ..Ship::default()
        }];
        scene
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_valid_and_different() {
        let texts: std::collections::BTreeSet<String> = paper_grid()
            .map(|scene| {
                scene.validate().unwrap();
                scene.to_toml().unwrap()
            })
            .collect();
        assert_eq!(texts.len(), 3456);
    }
}
