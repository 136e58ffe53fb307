//! What radar images of wakes show, over twenty seas, before speckle.

use crate::open_sea;
use std::f64::consts::PI;
use wake_physics::kelvin::half_angle;
use wake_physics::measure::{ShipPlace, kelvin_wedge};
use wake_physics::scene::{Ship, Term, Terms};
use wake_physics::{Scene, simulate};

const SEEDS: u64 = 20;

/// Standard deviation over mean of the intensity inside the Kelvin wedge one to three ship's lengths astern of midship,
/// mean over the seeds.
fn fluctuation(scene: &Scene, ship: &Ship) -> f64 {
    let place = ShipPlace {
        position: ship.position,
        length: ship.length,
        depth: scene.sea.depth,
    };
    let (sin, cos) = ship.heading.to_radians().sin_cos();
    let mut sum = 0.0;
    for seed in 1..=SEEDS {
        let mut scene = scene.clone();
        scene.seed = seed;
        let simulation = simulate(&scene).unwrap();
        let raster = simulation.raster;
        let inside = kelvin_wedge(&raster, &place, ship.heading, ship.speed);
        let (mut count, mut first, mut second) = (0.0, 0.0, 0.0);
        for (n, &value) in simulation.intensity.values.iter().enumerate() {
            let (x, y) = (raster.x(n % raster.columns), raster.y(n / raster.columns));
            let astern = -(x * sin + y * cos);
            if inside[n] && (ship.length..3.0 * ship.length).contains(&astern) {
                count += 1.0;
                first += f64::from(value);
                second += f64::from(value).powi(2);
            }
        }
        let mean = first / count;
        sum += (second / count - mean * mean).max(0.0).sqrt() / mean;
    }
    sum / SEEDS as f64
}

/// Fluctuation in the wedge with the ship over that of the same seas without it.
fn contrast(assignments: &[&str]) -> f64 {
    let scene = Scene::default().with_assignments(assignments).unwrap();
    let ship = scene.ships[0].clone();
    let with = fluctuation(&scene, &ship);
    with / fluctuation(&open_sea(scene), &ship)
}

#[test]
fn the_wake_of_the_default_scene_stands_out() {
    let contrast = contrast(&[]);
    println!("default contrast {contrast}");
    assert!(contrast > 2.0, "{contrast}");
}

#[test]
fn the_wake_drowns_in_wind() {
    let contrasts = ["3", "5", "7"].map(|wind| contrast(&[&format!("sea.wind_speed={wind}")]));
    println!("wind 3, 5, 7: {contrasts:?}");
    assert!(
        contrasts[0] > contrasts[1] && contrasts[1] > contrasts[2],
        "{contrasts:?}"
    );
}

#[test]
fn faster_ships_make_stronger_wakes() {
    let contrasts = ["8", "10", "12"].map(|speed| contrast(&[&format!("ship.speed={speed}")]));
    println!("speed 8, 10, 12: {contrasts:?}");
    assert!(
        contrasts[0] < contrasts[1] && contrasts[1] < contrasts[2],
        "{contrasts:?}"
    );
}

#[test]
fn azimuth_travelling_crests_are_fainter() {
    let contrasts = ["0", "90"].map(|heading| contrast(&[&format!("ship.heading={heading}")]));
    println!("heading 0, 90: {contrasts:?}");
    assert!(contrasts[0] < contrasts[1], "{contrasts:?}");
}

/// Angle of the port arm in an image without sea \[deg\].
///
/// At each distance astern the outermost column where the energy of the image along one wavelength is 0.03 of its largest,
/// for the long waves along a supercritical front are faint; then the slope of a line through these places. The arm is an Airy function some distance^⅓ wide, of which the
/// line takes the slope.
fn angle_of_the_arm(froude: f64) -> f64 {
    let speed = 10.0;
    let depth = (speed / froude).powi(2) / 9.80665;
    let mut scene = Scene::default()
        .with_assignments(&[
            "grid.rows=400",
            "grid.columns=620",
            "grid.spacing=4",
            "ship.heading=0",
            "ship.length=60",
            "ship.beam=8",
            "ship.draft=2",
            "ship.filter_depth=4",
            "ship.position=[1100, 700]",
            &format!("ship.speed={speed}"),
            &format!("sea.depth={depth}"),
        ])
        .unwrap();
    scene.model.terms = Terms::List(vec![Term::Kelvin, Term::TiltAverage]);
    let simulation = simulate(&scene).unwrap();
    let raster = simulation.raster;
    let mean = simulation.intensity.mean();
    let (mut places, window) = (Vec::new(), 16);
    for start in (90..350).step_by(4) {
        let energy = |j: usize| -> f64 {
            (start..start + window)
                .map(|i| (f64::from(simulation.intensity.at(i, j)) / mean - 1.0).powi(2))
                .sum()
        };
        let profile: Vec<f64> = (0..raster.columns).map(energy).collect();
        let peak = profile.iter().copied().fold(0.0, f64::max);
        let edge = profile.iter().position(|&p| p > 0.03 * peak).unwrap();
        places.push([
            700.0 - raster.y(start + window / 2),
            1100.0 - raster.x(edge),
        ]);
    }
    slope(&places).atan().to_degrees()
}

/// Slope of the straight line through places (x, y), by least squares.
fn slope(places: &[[f64; 2]]) -> f64 {
    let count = places.len() as f64;
    let mean = [0, 1].map(|axis| places.iter().map(|p| p[axis]).sum::<f64>() / count);
    let product = |a: usize| -> f64 {
        places
            .iter()
            .map(|p| (p[0] - mean[0]) * (p[a] - mean[a]))
            .sum()
    };
    product(1) / product(0)
}

#[test]
fn arms_open_by_the_depth_froude_number() {
    for froude in [0.2, 0.5, 0.9, 1.2, 1.5] {
        let expected = half_angle(10.0, (10.0f64 / froude).powi(2) / 9.80665).to_degrees();
        let found = angle_of_the_arm(froude);
        println!("F {froude}: {found} {expected}");
        // The Airy function leans the line by up to 1.5° here; arms of another of these speeds are 15° away.
        assert!(
            (found - expected).abs() < 2.0,
            "{froude}: {found} {expected}"
        );
    }
}

/// What hydrodynamic modulation does to the mean and the contrast of a sea of (640 m)² without motion, averaged down to
/// pixels of 5 m: the factor on each with its standard error, over some seeds.
fn factors_of_the_modulation(spacing: f64, wind: f64) -> [[f64; 2]; 2] {
    let size = (640.0 / spacing) as usize;
    let mut scene = open_sea(crate::small(
        size,
        size,
        &[
            &format!("grid.spacing={spacing}"),
            &format!("sea.wind_speed={wind}"),
        ],
    ));
    let block = (5.0 / spacing) as usize;
    let mut mean_and_contrast = |seed: u32, terms: &[Term]| -> [f64; 2] {
        scene.seed = seed.into();
        scene.model.terms = Terms::List(terms.to_vec());
        let image = simulate(&scene).unwrap().intensity;
        let mut blocks = vec![0.0; 128 * 128];
        for (n, &v) in image.values.iter().enumerate() {
            let (i, j) = (n / size / block, n % size / block);
            blocks[i * 128 + j] += f64::from(v) / (block * block) as f64;
        }
        let mean = blocks.iter().sum::<f64>() / 16384.0;
        let square = blocks.iter().map(|v| (v / mean - 1.0).powi(2));
        [mean, (square.sum::<f64>() / 16384.0).sqrt()]
    };
    let seeds = 8u32;
    let factors: Vec<[f64; 2]> = (0..seeds)
        .map(|seed| {
            let tilted = [Term::Sea, Term::TiltAverage];
            let without = mean_and_contrast(seed, &tilted);
            let with = mean_and_contrast(seed, &[tilted[0], tilted[1], Term::Hydrodynamic]);
            [with[0] / without[0], with[1] / without[1]]
        })
        .collect();
    [0, 1].map(|q| {
        let mean = factors.iter().map(|s| s[q]).sum::<f64>() / f64::from(seeds);
        let square = factors.iter().map(|s| (s[q] - mean).powi(2)).sum::<f64>();
        [mean, (square / f64::from(seeds * (seeds - 1))).sqrt()]
    })
}

/// A finer grid is the same sea: with every refinement modulation adds neither brightness nor contrast. Grids of 1.25 and
/// 2.5 m carry the same modulating waves, so that only chance differs, four standard errors. A grid of 5 m lacks those of
/// 5 to 10 m: their modulation is at most `m_B` times their slope and the tilt at most 5 times it (∂ln σ⁰/∂s at 32°), so that
/// the mean changes by at most 5 `m_B` times the variance of these slopes.
#[test]
fn refinement_changes_neither_mean_nor_contrast() {
    for wind in [5.0, 9.0] {
        let [fine, middle, coarse] =
            [1.25, 2.5, 5.0].map(|spacing| factors_of_the_modulation(spacing, wind));
        println!("wind {wind}: {fine:?} {middle:?} {coarse:?}");
        for q in 0..2 {
            let error = fine[q][1].hypot(middle[q][1]);
            // Waves of 2.5 to 5 m, which the second grid lacks, leave up to 3 % of contrast without modulation, on which it
            // does not act.
            let lacking = [0.0, 0.03 * (1.0 - fine[1][0])][q];
            assert!(
                (fine[q][0] - middle[q][0]).abs() < 4.0 * error + lacking,
                "wind {wind}: {fine:?} {middle:?}"
            );
            // A change of the mean by a thousandth is seen, and of the contrast by a fiftieth.
            let sharp = [0.001, 0.02][q];
            assert!(4.0 * error < sharp, "wind {wind}: {error}");
        }
        let mut scene = Scene::default();
        scene.sea.wind_speed = wind;
        let left_out = crate::wind_sea(&scene)
            .moments(PI / 5.0, PI / 2.5, 0.5)
            .slope_xx;
        assert!(
            (coarse[0][0] - fine[0][0]).abs() < 5.0 * 4.0 * left_out,
            "wind {wind}: {fine:?} {coarse:?} {left_out}"
        );
    }
}
