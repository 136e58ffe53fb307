//! The expected image and the spectrum of open sea against means over many simulated seas.

use crate::open_sea;
use wake_physics::measure::{ShipPlace, kelvin_wedge};
use wake_physics::scene::{Term, Terms};
use wake_physics::{Field, LinearSea, Scene, expected_intensity, simulate, unit_speckle};

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
        let ship = &scene.ships[0];
        let place = ShipPlace {
            position: ship.position,
            length: ship.length,
            depth: scene.sea.depth,
        };
        let raster = simulate(&scene).unwrap().raster;
        let inside = kelvin_wedge(&raster, &place, ship.heading, ship.speed);
        let between = Moments::new(&halves[0], &halves[1], &inside).correlation();
        // What of the variance of the mean over all seas drawn is not chance.
        let reliable = 2.0 * between / (1.0 + between);
        let found = Moments::new(&numbers(&expected), &whole, &inside);
        let correlation = found.correlation() / reliable.sqrt();
        let slope = found.covariance / found.variance[0];
        let level = found.mean[0] / found.mean[1];
        println!("{assignments:?}: correlation {correlation:.3} slope {slope:.3} level {level:.3}");
        // Neglected is what sea and wake do to each other: of second order in the sea's modulation, 0.1 to 0.2 here.
        assert!(
            correlation > 0.95 && (slope - 1.0).abs() < 0.05 && (level - 1.0).abs() < 0.03,
            "{assignments:?}: {correlation} {slope} {level}"
        );
        let mut faster = scene.clone();
        faster.ships[0].speed *= 1.1;
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
        Term::VelocityBunching,
    ]);
    let simulated = simulate(&scene).unwrap().intensity;
    assert_eq!(expected_intensity(&scene).unwrap(), simulated);
}

/// Gusts and slicks are no waves: the mean over the seas of one field of them is the expected image of its seed.
#[test]
fn gusts_and_slicks_are_those_of_the_seed() {
    let scene = open_sea(scene(&[
        "sea.wind_speed=3",
        "sea.gust_strength=0.2",
        "sea.gust_scale=600",
        "sea.slick_damping=0.7",
        "sea.slick_scale=400",
        // The sea's velocity does not smear what it carries.
        "radar.range_to_velocity=0",
    ]));
    let expected = expected_intensity(&scene).unwrap();
    let mut still = scene.clone();
    still.model.terms = Terms::List(vec![Term::Gusts, Term::Slicks, Term::TiltAverage]);
    let alone = simulate(&still).unwrap().intensity;
    let all = vec![true; alone.values.len()];
    let same = Moments::new(&numbers(&expected), &numbers(&alone), &all);
    // The mean σ⁰ differs by what waves add; gusts and slicks are the same factors.
    assert!(same.correlation() > 0.999, "{}", same.correlation());
    let other = expected_intensity(&Scene {
        seed: scene.seed + 1,
        ..scene
    });
    let other = Moments::new(&numbers(&expected), &numbers(&other.unwrap()), &all);
    assert!(other.correlation() < 0.8, "{}", other.correlation());
}

/// Deviation of the relative intensity of a sea to first order, and of the simulated ones.
fn deviations(scene: &Scene) -> [f64; 2] {
    let linear = LinearSea::new(scene).unwrap().covariance().values[0].sqrt();
    let relative = |seed: u64| {
        let image = simulate(&Scene {
            seed,
            ..scene.clone()
        });
        let image = image.unwrap().intensity;
        let mean = image.mean();
        let squares = image
            .values
            .iter()
            .map(|&v| (f64::from(v) / mean - 1.0).powi(2));
        squares.sum::<f64>() / image.values.len() as f64
    };
    let simulated = (0..SEAS).map(relative).sum::<f64>() / SEAS as f64;
    [f64::from(linear), simulated.sqrt()]
}

/// A low swell along range is seen to first order: through pixels alone, through a response and under noise.
#[test]
fn a_low_swell_is_seen_as_the_linear_sea_says() {
    let swell = [
        "sea.wind_speed=2",
        "sea.swell_height=0.4",
        "sea.swell_length=120",
        "sea.swell_toward=90",
        "sea.breaking=true",
        // Velocity bunching is not linear where R/V is that of a satellite.
        "radar.range_to_velocity=0",
    ];
    let seen = |more: &[&str]| deviations(&open_sea(scene(&[&swell[..], more].concat())));
    let [plain, ..] = seen(&[]);
    let response = ["radar.range_resolution=40", "radar.azimuth_resolution=40"];
    for more in [&[][..], &response, &["radar.nesz=-10"]] {
        let [linear, simulated] = seen(more);
        println!("{more:?} {linear:.4} {simulated:.4}");
        assert!(
            (linear / simulated - 1.0).abs() < 0.15,
            "{more:?} {linear} {simulated}"
        );
    }
    let [smeared, noisy] = [&response[..], &["radar.nesz=-10"]].map(|more| seen(more)[0]);
    assert!(
        smeared < 0.9 * plain && noisy < 0.8 * plain,
        "{plain} {smeared} {noisy}"
    );
}

/// Speckle of mean 1 has the looks and the correlation of a simulated image's.
#[test]
fn unit_speckle_is_that_of_the_image() {
    for more in [
        &["radar.looks=4"][..],
        &[
            "radar.looks=3",
            "radar.range_resolution=9",
            "radar.azimuth_resolution=12",
        ],
    ] {
        let mut scene = open_sea(scene(more));
        scene.sea.wind_speed = 5.0;
        scene.model.terms = Terms::List(vec![
            Term::TiltAverage,
            Term::ImpulseResponse,
            Term::Speckle,
        ]);
        let image = simulate(&scene).unwrap();
        let shape = |field: &Field| {
            let (mean, n) = (field.mean(), field.columns);
            let at = |i: usize| f64::from(field.values[i]) / mean - 1.0;
            let sum = |lag: usize| -> f64 {
                (0..field.values.len() - lag)
                    .map(|i| at(i) * at(i + lag))
                    .sum()
            };
            [
                sum(0) / field.values.len() as f64,
                sum(1) / sum(0),
                sum(n) / sum(0),
            ]
        };
        let (unit, drawn) = (unit_speckle(&scene).unwrap(), shape(&image.speckled));
        // 25,600 pixels, a tenth of them independent: 2 % of the mean, 3 % of variance and correlations, 4 times.
        assert!((unit.mean() - 1.0).abs() < 0.08, "{}", unit.mean());
        for (unit, drawn) in shape(&unit).into_iter().zip(drawn) {
            assert!(
                (unit - drawn).abs() < 0.12 * drawn.abs().max(0.2),
                "{more:?}: {unit} {drawn}"
            );
        }
        assert_eq!((unit.rows, unit.columns), (160, 160));
    }
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

/// Mean products of pixels some rows and columns apart.
fn products(values: &[f64], size: usize, lags: &[[usize; 2]]) -> Vec<f64> {
    let at = |i: usize, j: usize| values[i * size + j];
    let of_lag = |&[down, right]: &[usize; 2]| {
        let count = (size - down) * (size - right);
        let pairs = (0..size - down).flat_map(|i| (0..size - right).map(move |j| (i, j)));
        pairs
            .map(|(i, j)| at(i, j) * at(i + down, j + right))
            .sum::<f64>()
            / count as f64
    };
    lags.iter().map(of_lag).collect()
}

const LAGS: [[usize; 2]; 7] = [[0, 0], [0, 1], [1, 0], [0, 3], [2, 2], [4, 1], [0, 8]];

#[test]
fn a_linear_sea_has_the_covariance_it_states() {
    let sea = LinearSea::new(&scene(&["sea.wind_speed=5", "sea.wind_toward=30"])).unwrap();
    let stated = sea.covariance();
    let seas = 24;
    let mut sums = [0.0; LAGS.len()];
    for seed in 0..seas {
        // Uniform numbers of variance 1: a sum of many waves is Gaussian all the same.
        let mut state = seed as u64 + 1;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / (1u64 << 23) as f32 - 1.0) * 3f32.sqrt()
        };
        let normals: Vec<f32> = (0..sea.normals()).map(|_| uniform()).collect();
        let field = numbers(&sea.field(&normals));
        for (sum, product) in sums.iter_mut().zip(products(&field, 160, &LAGS)) {
            *sum += product / f64::from(seas);
        }
    }
    let variance = f64::from(stated.values[0]);
    for (found, [down, right]) in sums.iter().zip(LAGS) {
        let expected = f64::from(stated.at(down, right));
        // 600,000 pixels, of which some thousand are independent: 2 % of the variance, four times.
        assert!(
            (found - expected).abs() < 0.08 * variance,
            "{found} {expected} {variance}"
        );
    }
}

#[test]
fn simulated_seas_of_small_modulation_have_the_covariance_of_the_linear_sea() {
    for assignments in [
        [
            "sea.wind_speed=4",
            "sea.wind_toward=90",
            "radar.range_to_velocity=10",
        ],
        [
            "sea.wind_speed=4",
            "sea.wind_toward=20",
            "radar.range_to_velocity=25",
        ],
        [
            "sea.wind_speed=3",
            "sea.wind_toward=60",
            "radar.range_to_velocity=100",
        ],
    ] {
        let scene = open_sea(scene(&assignments));
        let stated = LinearSea::new(&scene).unwrap().covariance();
        let mut sums = [0.0; LAGS.len()];
        for seed in 0..SEAS {
            let image = simulate(&Scene {
                seed,
                ..scene.clone()
            })
            .unwrap()
            .intensity;
            let mean = image.mean();
            let relative: Vec<f64> = numbers(&image).iter().map(|v| v / mean - 1.0).collect();
            for (sum, product) in sums.iter_mut().zip(products(&relative, 160, &LAGS)) {
                *sum += product / SEAS as f64;
            }
        }
        let likeness = |stated: &Field| {
            let stated = LAGS.map(|[down, right]| f64::from(stated.at(down, right)));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            dot(&sums, &stated) / (dot(&sums, &sums) * dot(&stated, &stated)).sqrt()
        };
        // Modulations of 0.05 to 0.25, so that the second order has up to a quarter of the first; imaging spreads a
        // source over two columns and at least a pixel of rows, which takes from the shortest waves.
        let (like, level) = (likeness(&stated), sums[0] / f64::from(stated.values[0]));
        println!("{assignments:?}: likeness {like:.3} variance {level:.3}");
        assert!(
            like > 0.97 && (level - 1.0).abs() < 0.25,
            "{assignments:?}: {like} {level}"
        );
        // Where R/V is large, waves along range are all that is left, wherever the wind blows.
        if scene.radar.range_to_velocity < 50.0 {
            let mut turned = scene.clone();
            turned.sea.wind_toward += 70.0;
            let other = likeness(&LinearSea::new(&turned).unwrap().covariance());
            assert!(other < like - 0.05, "{assignments:?}: {other} {like}");
        }
    }
}
