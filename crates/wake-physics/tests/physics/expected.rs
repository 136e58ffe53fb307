//! The expected image against means over many seas.

use crate::open_sea;
use wake_physics::measure::{ShipPlace, kelvin_wedge};
use wake_physics::scene::{Term, Terms};
use wake_physics::{Field, Scene, expected_intensity, simulate};

/// Seas of each half.
const SEAS: u64 = 16;

fn scene(assignments: &[&str]) -> Scene {
    let small = ["grid.rows=160", "grid.columns=160", "grid.spacing=4"];
    Scene::default()
        .with_assignments(&[&small[..], assignments].concat())
        .unwrap()
}

/// Mean intensity over the seas of some seeds.
fn mean_over_seas(scene: &Scene, seeds: std::ops::Range<u64>) -> Vec<f64> {
    let mut sum = vec![0.0; scene.grid.rows * scene.grid.columns];
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let image = simulate(&Scene {
            seed,
            ..scene.clone()
        });
        for (sum, value) in sum.iter_mut().zip(image.unwrap().intensity.values) {
            *sum += f64::from(value) / count as f64;
        }
    }
    sum
}

fn numbers(field: &Field) -> Vec<f64> {
    field.values.iter().map(|&v| f64::from(v)).collect()
}

/// Means, variances and covariance of two images over some pixels.
struct Moments {
    mean: [f64; 2],
    variance: [f64; 2],
    covariance: f64,
}

impl Moments {
    fn new(a: &[f64], b: &[f64], inside: &[bool]) -> Self {
        let count = inside.iter().filter(|x| **x).count() as f64;
        let mean_of = |f: &dyn Fn(usize) -> f64| {
            let chosen = (0..inside.len()).filter(|&i| inside[i]);
            chosen.map(f).sum::<f64>() / count
        };
        let mean = [mean_of(&|i| a[i]), mean_of(&|i| b[i])];
        let product =
            |x: [&[f64]; 2], m: [f64; 2]| mean_of(&|i| (x[0][i] - m[0]) * (x[1][i] - m[1]));
        Self {
            mean,
            variance: [product([a, a], [mean[0]; 2]), product([b, b], [mean[1]; 2])],
            covariance: product([a, b], mean),
        }
    }

    fn correlation(&self) -> f64 {
        self.covariance / (self.variance[0] * self.variance[1]).sqrt()
    }
}

#[test]
fn the_mean_over_seas_is_the_expected_image() {
    for assignments in [
        ["sea.wind_speed=3", "ship.heading=45", "radar.incidence=24"],
        ["sea.wind_speed=4", "ship.heading=290", "radar.incidence=32"],
        ["sea.wind_speed=5", "ship.heading=120", "radar.incidence=20"],
        ["sea.wind_speed=7", "ship.heading=200", "radar.incidence=28"],
    ] {
        let scene = scene(&assignments);
        let halves = [0, SEAS].map(|first| mean_over_seas(&scene, first..first + SEAS));
        let whole: Vec<f64> = (0..halves[0].len())
            .map(|i| 0.5 * (halves[0][i] + halves[1][i]))
            .collect();
        let expected = expected_intensity(&scene).unwrap();
        let ship = scene.ship.as_ref().unwrap();
        let place = ShipPlace {
            position: ship.position,
            length: ship.length,
        };
        let raster = simulate(&scene).unwrap().raster;
        let inside = kelvin_wedge(&raster, &place, ship.heading);
        let between = Moments::new(&halves[0], &halves[1], &inside).correlation();
        // What of the variance of the mean over all seas drawn is not chance.
        let reliable = 2.0 * between / (1.0 + between);
        let found = Moments::new(&numbers(&expected), &whole, &inside);
        let correlation = found.correlation() / reliable.sqrt();
        let slope = found.covariance / found.variance[0];
        let level = found.mean[0] / found.mean[1];
        // Neglected is what sea and wake do to each other: of second order in the sea's modulation, 0.1 to 0.2 here.
        assert!(
            correlation > 0.95 && (slope - 1.0).abs() < 0.05 && (level - 1.0).abs() < 0.03,
            "{assignments:?}: {correlation} {slope} {level}"
        );
        let mut faster = scene.clone();
        faster.ship.as_mut().unwrap().speed *= 1.1;
        let other = numbers(&expected_intensity(&faster).unwrap());
        let other = Moments::new(&other, &whole, &inside).correlation();
        assert!(other < 0.8 * correlation, "{assignments:?}: {other}");
    }
}

#[test]
fn without_a_sea_it_is_the_simulated_image() {
    let mut scene = scene(&["ship.heading=60"]);
    scene.model.terms = Terms::List(vec![
        Term::Kelvin,
        Term::Turbulent,
        Term::TiltAverage,
        Term::Specular,
        Term::RangeBunching,
        Term::Bunching,
    ]);
    let simulated = simulate(&scene).unwrap().intensity;
    assert_eq!(expected_intensity(&scene).unwrap(), simulated);
}

#[test]
fn open_sea_is_expected_to_be_even() {
    for wind in ["sea.wind_speed=3", "sea.wind_speed=6"] {
        let scene = open_sea(scene(&[wind]));
        let expected = expected_intensity(&scene).unwrap();
        let mean = expected.mean();
        // Rounding of the imaging kernels.
        assert!(
            expected
                .values
                .iter()
                .all(|&v| (f64::from(v) / mean - 1.0).abs() < 1e-4)
        );
        let seas = mean_over_seas(&scene, 0..SEAS);
        let level = mean * seas.len() as f64 / seas.iter().sum::<f64>();
        assert!((level - 1.0).abs() < 0.03, "{wind}: {level}");
    }
}
