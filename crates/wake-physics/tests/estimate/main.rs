//! Estimates of simulated images against the scenes they were simulated from.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed; reports are printed"
)]

mod derivatives;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::time::Instant;
use wake_physics::estimate::{
    Detection, Estimate, Options, Parameter, Priors, Value, bound, estimate,
};
use wake_physics::measure::angle_between;
use wake_physics::{Scene, simulate};

/// A scene of the ranges of the paper's grid, with whole numbers as prompts have them.
fn scene(index: u64) -> (Scene, [f64; 2]) {
    let mut random = StdRng::seed_from_u64(0xE57_0000 + index);
    let mut whole = |from: i32, to: i32| f64::from(random.random_range(from..=to));
    let mut scene = Scene {
        seed: 0xE57_0000 + (index << 16),
        ..Scene::default()
    };
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene.ships[0].speed = 0.1 * whole(60, 120);
    scene.ships[0].heading = whole(0, 359);
    scene.sea.wind_speed = 0.1 * whole(30, 70);
    scene.sea.wind_toward = whole(0, 359);
    scene.sea.fetch = 100.0 * whole(100, 700);
    scene.radar.incidence = whole(16, 32);
    (scene, [whole(-40, 40), whole(-40, 40)])
}

fn one(index: u64) -> (Scene, Estimate, f64) {
    let (scene, off) = scene(index);
    let image = simulate(&scene).unwrap().speckled;
    let options = Options {
        detection: Some(Detection {
            position: off,
            within: 80.0,
            heading: None,
        }),
        ..Options::default()
    };
    // What is estimated is not known.
    let mut known = scene.clone();
    known.ships[0].speed = 8.0;
    known.ships[0].heading = 0.0;
    known.sea.wind_speed = 5.0;
    known.sea.wind_toward = 90.0;
    let start = Instant::now();
    let found = estimate(&image, &known, &options).unwrap();
    (scene, found, start.elapsed().as_secs_f64())
}

/// Seconds of an image, and of an image with its derivatives.
#[test]
#[ignore = "a timing"]
fn timings() {
    let (scene, _) = scene(3);
    let time = |name: &str, work: &mut dyn FnMut()| {
        let start = Instant::now();
        (0..3).for_each(|_| work());
        println!(
            "{name}: {:.1} ms",
            start.elapsed().as_secs_f64() / 3.0 * 1e3
        );
    };
    let mut simulator = wake_physics::Simulator::default();
    time("expected_intensity, warm", &mut || {
        drop(simulator.expected_intensity(&scene));
    });
    time("expected_intensity", &mut || {
        drop(wake_physics::expected_intensity(&scene));
    });
    let values = &Value::ALL[..9];
    time("freeze", &mut || {
        drop(wake_physics::estimate::ExpectedImage::new(&scene, values));
    });
    let image = wake_physics::estimate::ExpectedImage::new(&scene, values).unwrap();
    time("image", &mut || drop(image.intensity(&scene)));
    time("image and 9 derivatives", &mut || drop(image.at(&scene)));
    time("linear sea", &mut || {
        drop(wake_physics::LinearSea::new(&scene));
    });
    time("simulate", &mut || drop(simulate(&scene)));
}

/// `SCENES=FIRST..LAST cargo test -p wake-physics --test estimate report -- --ignored --nocapture`
#[test]
#[ignore = "a report, minutes"]
fn report() {
    let range = std::env::var("SCENES").unwrap_or_else(|_| "0..10".into());
    let (first, last) = range.split_once("..").unwrap();
    let mut pulls: Vec<Vec<f64>> = vec![Vec::new(); 6];
    for index in first.parse::<u64>().unwrap()..last.parse().unwrap() {
        let (scene, found, seconds) = one(index);
        let limit = bound(&scene, &Parameter::OF_WAKE, &Priors::default()).unwrap();
        let limit = [Value::Speed, Value::Heading].map(|v| limit.of(Parameter::Value(v)));
        let ship = &scene.ships[0];
        print!(
            "{index}: {seconds:.1}s U {:.1} h {:.0} w {:.1} to {:.0} inc {:.0}: ",
            ship.speed,
            ship.heading,
            scene.sea.wind_speed,
            scene.sea.wind_toward,
            scene.radar.incidence
        );
        let Some(wake) = found.wakes.first() else {
            println!("none; bound {limit:.3?}");
            continue;
        };
        let errors = [
            (wake.speed.value - ship.speed, wake.speed.deviation),
            (
                angle_between(wake.heading.value, ship.heading),
                wake.heading.deviation,
            ),
            (wake.position[0].value, wake.position[0].deviation),
            (wake.position[1].value, wake.position[1].deviation),
            (
                wake.wind_speed.value - scene.sea.wind_speed,
                wake.wind_speed.deviation,
            ),
            (
                angle_between(wake.wind_toward.value, scene.sea.wind_toward),
                wake.wind_toward.deviation,
            ),
        ];
        for (n, (error, deviation)) in errors.iter().enumerate() {
            print!("{error:.3}±{deviation:.3} ");
            pulls[n].push(error / deviation);
        }
        println!(
            "L {:.0} above {:.0} {} gain {:.3} texture {:.2} bound {limit:.3?} rings {:.2?} alternatives {}",
            wake.length.value,
            wake.above_sea,
            if wake.identifiable { "ok" } else { "NOT" },
            wake.nuisance[0].value,
            wake.nuisance[1].value,
            wake.goodness_of_fit.power,
            wake.alternatives.len(),
        );
    }
    for pulls in pulls {
        let share =
            |k: f64| pulls.iter().filter(|p| p.abs() < k).count() as f64 / pulls.len() as f64;
        println!(
            "within 1, 2, 3 deviations: {:.2} {:.2} {:.2}",
            share(1.0),
            share(2.0),
            share(3.0)
        );
    }
}
