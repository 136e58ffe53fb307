//! From images back to ship and sea.

use wake_physics::estimate::{Detection, Estimate, Options, Value, estimate};
use wake_physics::{Field, Scene, simulate};

/// A wake of 10 m/s, 128 × 128 pixels of 4 m.
fn scene() -> Scene {
    let keys = [
        "grid.rows=128",
        "grid.columns=128",
        "grid.spacing=4",
        "radar.incidence=28",
        "sea.wind_speed=5",
        "sea.wind_toward=140",
        "ship.heading=70",
        "ship.speed=9",
        "ship.position=[90, 30]",
    ];
    Scene::default().with_assignments(&keys).unwrap()
}

/// The scene without what is estimated.
fn known(scene: &Scene) -> Scene {
    let mut known = scene.clone();
    for value in [
        Value::Speed,
        Value::Heading,
        Value::X,
        Value::Y,
        Value::WindSpeed,
        Value::WindToward,
    ] {
        value.set(&mut known, value.of(&Scene::default()));
    }
    known.seed = 11;
    known
}

fn read(image: &Field, scene: &Scene) -> Estimate {
    let detection = Detection {
        position: [70.0, 50.0],
        within: 60.0,
        heading: Some(75.0),
    };
    let options = Options {
        detection: Some(detection),
        ..Options::default()
    };
    estimate(image, &known(scene), &options).unwrap()
}

/// The truth lies within five stated deviations of every value of an identifiable ship (one in a million of normal numbers, some
/// thousandths of Student's t of 15 degrees), and the deviations tell more than the range.
#[test]
fn a_simulated_wake_is_found_again() {
    let scene = scene();
    let image = simulate(&scene).unwrap().speckled;
    let found = read(&image, &scene);
    let wake = found.wake.unwrap();
    println!("{wake:#?}");
    assert!(wake.identifiable);
    let ship = &scene.ships[0];
    for (found, truth, least) in [
        (wake.speed, ship.speed, 0.5),
        (wake.heading, ship.heading, 3.0),
        (wake.position[0], ship.position[0], 15.0),
        (wake.position[1], ship.position[1], 30.0),
    ] {
        assert!(found.deviation < least, "{found:?} {truth}");
        assert!(
            (found.value - truth).abs() < 5.0 * found.deviation,
            "{found:?} {truth}"
        );
    }
    assert_eq!(wake.covariance.len(), wake.names.len().pow(2));
}

/// A sea without a ship gives no wake.
#[test]
fn an_open_sea_gives_no_wake() {
    let scene = scene();
    let mut open = scene.clone();
    open.ships.clear();
    let image = simulate(&open).unwrap().speckled;
    let found = read(&image, &scene);
    println!("{} {:?}", found.above_sea, found.wake);
    assert!(found.wake.is_none());
}

/// Looks that are half of the stated ones double the power of the residual: nothing is identified.
#[test]
fn wrong_looks_are_not_consistent() {
    let scene = scene();
    let mut rough = scene.clone();
    rough.radar.looks = 2;
    let image = simulate(&rough).unwrap().speckled;
    let found = read(&image, &scene);
    let wake = found.wake.unwrap();
    println!("{:?}", wake.goodness_of_fit);
    assert!(!wake.goodness_of_fit.consistent && !wake.identifiable);
}

#[test]
fn what_cannot_be_read_is_refused() {
    let scene = scene();
    let dark = Field {
        rows: 128,
        columns: 128,
        values: vec![0.0; 128 * 128],
    };
    let mut open = scene.clone();
    open.ships.clear();
    let mut turning = scene.clone();
    turning.ships[0].turn_rate = 0.5;
    let mut small = scene.clone();
    small.grid.rows = 64;
    let lit = Field {
        values: vec![0.1; 128 * 128],
        ..dark
    };
    for (image, known, named) in [
        (&dark, &scene, "image"),
        (&lit, &open, "ship"),
        (&lit, &turning, "ship.turn_rate"),
        (&lit, &small, "64 x 128"),
    ] {
        let error = estimate(image, known, &Options::default()).unwrap_err();
        assert!(error.to_string().contains(named), "{error}");
    }
}
