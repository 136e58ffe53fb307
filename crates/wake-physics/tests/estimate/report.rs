//! Errors and error bars of estimates on simulated scenes.

use wake_physics::estimate::{
    Estimate, Parameter, Priors, Sighting, Value, bound, estimate, refine,
};
use wake_physics::{Scene, simulate};

const HEADING: Parameter = Parameter::Value(Value::Heading);

/// A number of a stream, uniform between two bounds (`SplitMix64`).
fn uniform(state: &mut u64, low: f64, high: f64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A scene of 256 × 256 pixels of 4 m, a sighting, and a guess: speed within 1 %, heading within 1 degree, place within a tenth of the transverse waves,
/// wind within 15 % and 20 degrees.
fn drawn(number: u64) -> (Scene, Sighting, Scene) {
    let mut state = number << 32;
    let mut of = |low, high| uniform(&mut state, low, high);
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene.seed = number;
    scene.model.tolerance = 1e-2;
    scene.sea.wind_speed = of(3.0, 9.0);
    scene.sea.wind_toward = of(0.0, 360.0);
    scene.radar.incidence = of(20.0, 40.0);
    let ship = &mut scene.ships[0];
    ship.speed = of(5.0, 13.0);
    ship.heading = of(0.0, 360.0);
    let (sin, cos) = ship.heading.to_radians().sin_cos();
    let (ahead, aside) = (of(150.0, 300.0), of(-60.0, 60.0));
    ship.position = [ahead * sin + aside * cos, ahead * cos - aside * sin];
    let mut guess = scene.clone();
    let transverse = 0.64 * guess.ships[0].speed.powi(2);
    let ship = &mut guess.ships[0];
    ship.speed *= 1.0 + of(-0.01, 0.01);
    ship.heading += of(-1.0, 1.0);
    for axis in 0..2 {
        ship.position[axis] += transverse * of(-0.1, 0.1);
    }
    guess.sea.wind_speed *= 1.0 + of(-0.15, 0.15);
    guess.sea.wind_toward += of(-20.0, 20.0);
    let ship = &scene.ships[0];
    let [x, y] = ship.position.map(|at| at + of(-60.0, 60.0));
    let sighting = Sighting::new([x, y], ship.heading + of(-4.0, 4.0));
    (scene, sighting, guess)
}

/// Error of a value; of the wind's direction that of its axis.
pub(crate) fn off(found: &Estimate, scene: &Scene, parameter: Parameter) -> f64 {
    let truth = match parameter {
        Parameter::Size => Value::Size.of(scene),
        Parameter::Value(value) => value.of(scene),
        _ => 0.0,
    };
    let off = found.of(parameter)[0] - truth;
    match parameter {
        Parameter::Value(Value::WindToward) => (off + 90.0).rem_euclid(180.0) - 90.0,
        HEADING => (off + 180.0).rem_euclid(360.0) - 180.0,
        _ => off,
    }
}

/// Number of scenes, and the first, from the environment.
fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |v| v.parse().unwrap())
}

#[test]
#[ignore = "prints a report: SCENES scenes from FIRST on, half a minute each; GUESS=1 refines guesses"]
fn report() {
    let first = number("FIRST", 18);
    let from_guess = number("GUESS", 0) == 1;
    let mut pulls: Vec<[f64; 9]> = Vec::new();
    let mut errors: Vec<[f64; 9]> = Vec::new();
    let count = number("SCENES", 16);
    for n in first..first + count {
        let (scene, sighting, guess) = drawn(n);
        let image = simulate(&scene).unwrap().speckled;
        let begin = std::time::Instant::now();
        let found = match from_guess {
            true => refine(&image, &guess, &Priors::default()).unwrap(),
            false => estimate(&image, &guess, &sighting, &Priors::default()).unwrap(),
        };
        let seconds = begin.elapsed().as_secs_f64();
        let limit = bound(&scene, &Parameter::OF_WAKE, &Priors::default()).unwrap();
        let ship = &scene.ships[0];
        println!(
            "{n}: {:.1} m/s {:.0}° wind {:.1} m/s {:.0}° incidence {:.0}°: {}, {:.0} over open sea, misfit {:.2}, weight {:.2}, {seconds:.0} s",
            ship.speed,
            ship.heading,
            scene.sea.wind_speed,
            scene.sea.wind_toward,
            scene.radar.incidence,
            if found.identifiable {
                "identifiable"
            } else {
                "not identifiable"
            },
            found.over_open_sea,
            found.misfit(),
            found.weight,
        );
        let of = |parameter: Parameter| off(&found, &scene, parameter);
        for parameter in Parameter::OF_WAKE {
            let [value, deviation] = found.of(parameter);
            println!(
                "   {:<12} {value:9.3} off {:8.3} ± {deviation:.3} (bound {:.3})",
                parameter.name(),
                of(parameter),
                limit.of(parameter)
            );
        }
        if found.identifiable {
            pulls.push(Parameter::OF_WAKE.map(|p| of(p) / found.of(p)[1]));
            errors.push(Parameter::OF_WAKE.map(of));
        }
    }
    println!("identifiable: {} of {count}", pulls.len());
    for (n, parameter) in Parameter::OF_WAKE.iter().enumerate() {
        let within = |sd: f64| pulls.iter().filter(|p| p[n].abs() < sd).count();
        let square = pulls.iter().map(|p| p[n] * p[n]).sum::<f64>() / pulls.len() as f64;
        println!(
            "{:<12} within 1, 2, 3 deviations {} {} {}, root mean square {:.2}",
            parameter.name(),
            within(1.0),
            within(2.0),
            within(3.0),
            square.sqrt()
        );
    }
    for (n, parameter) in Parameter::OF_WAKE.iter().enumerate() {
        let mut values: Vec<f64> = errors.iter().map(|e| e[n].abs()).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
        println!(
            "{:<12} error {:.3} median, {:.3} of 90 %",
            parameter.name(),
            at(0.5),
            at(0.9)
        );
    }
}
