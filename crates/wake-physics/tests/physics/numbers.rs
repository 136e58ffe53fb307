//! Numbers keep their bits through the texts of scenes and labels.

use proptest::prelude::*;
use wake_physics::labels::{LabelledShip, Labels, ShipLabel, WakeLabel};

use super::*;

/// Any finite number.
fn finite() -> impl Strategy<Value = f64> {
    let numbers = any::<u64>().prop_map(f64::from_bits);
    numbers.prop_filter("finite", |number| number.is_finite())
}

proptest! {
    /// Equal texts are equal bits: a number has one shortest text, and −0 has its sign.
    #[test]
    fn scenes(numbers in prop::array::uniform8(finite())) {
        let mut scene = Scene::default();
        let [a, b, c, d, e, f, g, h] = numbers;
        [scene.sea.wind_speed, scene.sea.time, scene.grid.spacing] = [a, b, c];
        [scene.radar.incidence, scene.model.tolerance] = [d, e];
        scene.radar.nesz = Some(f);
        scene.ships[0].position = [g, h];
        let bits = |scene: &Scene| {
            let Scene { sea, grid, radar, model, ships, .. } = scene;
            let [x, y] = ships[0].position;
            let noise = radar.nesz.unwrap_or_default();
            [sea.wind_speed, sea.time, grid.spacing, radar.incidence, model.tolerance, noise, x, y].map(f64::to_bits)
        };
        let json = serde_json::to_string(&scene).unwrap();
        prop_assert_eq!(bits(&serde_json::from_str(&json).unwrap()), bits(&scene));
        prop_assert_eq!(bits(&toml::from_str(&scene.to_toml().unwrap()).unwrap()), bits(&scene));
    }

    #[test]
    fn labels(numbers in prop::array::uniform8(finite())) {
        let [a, b, c, d, e, f, g, h] = numbers;
        let labels = Labels {
            ships: vec![LabelledShip {
                ship: ShipLabel { position_m: [a, b], echo_px: Some([c, d]), heading: e, ..ShipLabel::default() },
                wake: WakeLabel { axis_deg: Some(f), box_px: Some([a, b, c, g]), ..WakeLabel::default() },
            }],
            sea_displacement_m: h,
        };
        let text = serde_json::to_string(&labels).unwrap();
        let read: Labels = serde_json::from_str(&text).unwrap();
        prop_assert_eq!(serde_json::to_string(&read).unwrap(), text);
        prop_assert_eq!(read.sea_displacement_m.to_bits(), h.to_bits());
    }
}
