//! Ship and wind of simulated images, found again from a sighting and from a guess.

use super::report::off;
use wake_physics::estimate::{Parameter, Priors, Sighting, Value, estimate, refine};
use wake_physics::{Scene, simulate};

const HEADING: Parameter = Parameter::Value(Value::Heading);

fn small(keys: &[&str]) -> Scene {
    let small = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=4",
        "ship.heading=60",
        "ship.position=[100, 60]",
        "sea.wind_speed=5",
        "model.tolerance=1e-2",
    ];
    Scene::default()
        .with_assignments(&[&small[..], keys].concat())
        .unwrap()
}

/// Errors are below four standard deviations; a sea without the ship and an image with half the looks are not identifiable.
#[test]
fn a_ship_is_found_from_a_guess_and_only_where_there_is_one() {
    let scene = small(&[]);
    let mut guess = scene.clone();
    guess.ships[0].speed *= 1.005;
    guess.ships[0].heading -= 0.6;
    guess.sea.wind_toward += 15.0;
    let image = simulate(&scene).unwrap().speckled;
    let found = refine(&image, &guess, &Priors::default()).unwrap();
    for one in &found.values {
        let off = off(&found, &scene, one.parameter);
        println!("{:?}: {off:.3} ± {:.3}", one.parameter, one.deviation);
        assert!(off.abs() < 4.0 * one.deviation, "{one:?}");
    }
    assert!(found.identifiable, "{:?}", found.values);
    assert_eq!(found.covariance.len(), 81);
    let mut open = scene;
    open.ships.clear();
    let image = simulate(&open).unwrap().speckled;
    let none = refine(&image, &guess, &Priors::default()).unwrap();
    assert!(
        !none.identifiable && none.over_open_sea < 20.0,
        "{:?}",
        none.values
    );
    let image = simulate(&small(&["radar.looks=2"])).unwrap().speckled;
    let other = refine(&image, &guess, &Priors::default()).unwrap();
    // Half the looks have twice the speckle, most of the power of short waves; a part of it is fitted as texture.
    assert!(
        !other.identifiable && other.misfit() > 1.25,
        "{:?}",
        other.power
    );
}

/// From a sighting 50 m and 3 degrees off, with any speed, the right maximum is found; also under an echo, and in units of the image's own.
#[test]
fn a_ship_is_found_from_a_sighting_at_any_speed() {
    let scene = small(&["grid.rows=128", "grid.columns=128", "ship.speed=7.5"]);
    let mut image = simulate(&scene).unwrap().speckled;
    // An echo, where the ship's velocity toward the radar shifts it to.
    let [x, y] = scene.ships[0].position;
    let incidence = scene.radar.incidence.to_radians();
    let toward_radar = -7.5 * 60f64.to_radians().sin() * incidence.sin();
    let shift = scene.radar.range_to_velocity * toward_radar;
    let column = (64.0 + x / 4.0).round() as usize;
    let row = (64.0 - (y + shift) / 4.0).round() as usize;
    for n in [0, 1, 128, 129] {
        image.values[row * 128 + column + n] = 300.0;
    }
    let mut known = scene.clone();
    (known.ships[0].speed, known.ships[0].heading) = (12.0, 200.0);
    known.sea.wind_toward += 140.0;
    let sighting = Sighting::new([x + 40.0, y - 30.0], scene.ships[0].heading + 3.0);
    let found = estimate(&image, &known, &sighting, &Priors::default()).unwrap();
    let ship = [
        Parameter::Value(Value::Speed),
        HEADING,
        Parameter::Value(Value::X),
    ];
    for parameter in ship {
        let [_, deviation] = found.of(parameter);
        let off = off(&found, &scene, parameter);
        println!("{parameter:?}: {off:.3} ± {deviation:.3}");
        assert!(
            off.abs() < 4.0 * deviation && deviation < 2.0,
            "{parameter:?}"
        );
    }
    assert!(found.identifiable, "{:?}", found.values);
    let [velocity, deviation] = found.by_echo.unwrap();
    let off_velocity = velocity - toward_radar;
    assert!(
        off_velocity.abs() < 3.0 * deviation && deviation < 0.5,
        "{velocity} ± {deviation}"
    );
    let raw = image.values.iter().map(|v| 7.0 * v).collect();
    let raw = wake_physics::Field {
        values: raw,
        ..image
    };
    known.sea.wind_speed = 6.0;
    let priors = Priors {
        gain: f64::INFINITY,
        ..Priors::default()
    };
    let found = estimate(&raw, &known, &sighting, &priors).unwrap();
    let off = off(&found, &scene, HEADING);
    assert!(off.abs() < 4.0 * found.of(HEADING)[1], "{off} {found:?}");
    let gain = found.of(Parameter::Gain);
    assert!((gain[0] - 7.0f64.ln()).abs() < 4.0 * gain[1], "{gain:?}");
}

#[test]
fn what_cannot_be_refined_is_refused() {
    let scene = small(&[]);
    let image = simulate(&scene).unwrap().intensity;
    let mut open = scene.clone();
    open.ships.clear();
    let error = refine(&image, &open, &Priors::default()).unwrap_err();
    assert!(error.to_string().contains("one ship"), "{error}");
    let mut nowhere = Sighting::new([f64::NAN, 0.0], 0.0);
    let error = estimate(&image, &scene, &nowhere, &Priors::default()).unwrap_err();
    assert!(error.to_string().contains("sighting"), "{error}");
    nowhere.place = [0.0; 2];
    nowhere.heading_sd = 0.0;
    assert!(estimate(&image, &scene, &nowhere, &Priors::default()).is_err());
    let mut wide = scene;
    wide.grid.columns = 97;
    let error = refine(&image, &wide, &Priors::default()).unwrap_err();
    assert!(error.to_string().contains("96 x 97"), "{error}");
}
