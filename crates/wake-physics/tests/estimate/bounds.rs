//! Bounds and likelihoods of small scenes.

use wake_physics::estimate::{Factors, Likelihood, Parameter, Priors, Value, bound};
use wake_physics::{Scene, simulate};

fn scene(keys: &[&str]) -> Scene {
    let small = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=4",
        "ship.heading=60",
        "model.tolerance=1e-2",
    ];
    Scene::default()
        .with_assignments(&[&small[..], keys].concat())
        .unwrap()
}

/// More looks tell more; a parameter that is unknown, too, makes the others worse; without priors nothing is gained.
#[test]
fn bounds_follow_what_is_known() {
    let speed = Parameter::Value(Value::Speed);
    let all =
        |keys: &[&str], priors: &Priors| bound(&scene(keys), &Parameter::OF_WAKE, priors).unwrap();
    let here = all(&[], &Priors::default());
    let more_looks = all(&["radar.looks=16"], &Priors::default());
    let uncalibrated = Priors {
        gain: f64::INFINITY,
        ..Priors::default()
    };
    let uncalibrated = all(&[], &uncalibrated);
    let alone = bound(&scene(&[]), &[speed], &Priors::default()).unwrap();
    println!("{here:?}\n{more_looks:?}\n{uncalibrated:?}\n{alone:?}");
    assert!(alone.of(speed) < here.of(speed));
    for (parameter, deviation) in &here.deviations {
        assert!(deviation.is_finite() && *deviation > 0.0, "{parameter:?}");
        if !matches!(parameter, Parameter::Texture) {
            assert!(more_looks.of(*parameter) < *deviation, "{parameter:?}");
        }
        // Rounding of single precision.
        assert!(
            uncalibrated.of(*parameter) > 0.999 * deviation,
            "{parameter:?}"
        );
    }
    assert!(here.of(Parameter::Value(Value::Incidence)).is_infinite());
}

/// The rings of an image of half the looks have twice the power of speckle.
#[test]
fn wrong_looks_show() {
    let likelihood = Likelihood::new(&scene(&[]), &[Parameter::Gain]).unwrap();
    for (looks, expected) in [(4, 1.0), (2, 2.0)] {
        let image = simulate(&scene(&[&format!("radar.looks={looks}")]))
            .unwrap()
            .speckled;
        let score = likelihood.of(&image, &Factors::default()).unwrap();
        // The shortest waves are speckle alone; some 3,000 wavenumbers.
        let last = score.power[7];
        assert!((last / expected - 1.0).abs() < 0.1, "{looks} looks: {last}");
    }
}

#[test]
fn what_is_no_image_of_the_grid_is_refused() {
    let likelihood = Likelihood::new(&scene(&[]), &[Parameter::Gain]).unwrap();
    let mut image = simulate(&scene(&[])).unwrap().speckled;
    let factors = Factors {
        gain: 0.0,
        ..Factors::default()
    };
    assert!(likelihood.of(&image, &factors).is_err());
    image.values[5] = f32::NAN;
    let error = likelihood.of(&image, &Factors::default()).unwrap_err();
    assert!(error.to_string().contains("not finite"), "{error}");
    image.rows = 5;
    let error = likelihood.of(&image, &Factors::default()).unwrap_err();
    assert!(error.to_string().contains("96 x 96"), "{error}");
}
