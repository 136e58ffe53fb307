//! What radar images of wakes show, over twenty seas, before speckle.

use crate::open_sea;
use wake_physics::{Scene, simulate};

const SEEDS: u64 = 20;

/// Standard deviation over mean of the intensity inside the Kelvin wedge astern, mean over the seeds.
fn fluctuation(scene: &Scene, heading: f64) -> f64 {
    let (sin, cos) = heading.to_radians().sin_cos();
    let mut sum = 0.0;
    for seed in 1..=SEEDS {
        let mut scene = scene.clone();
        scene.seed = seed;
        let simulation = simulate(&scene).unwrap();
        let raster = simulation.raster;
        let (mut count, mut first, mut second) = (0.0, 0.0, 0.0);
        for i in 0..raster.rows {
            for j in 0..raster.columns {
                let (x, y) = (raster.x(j), raster.y(i));
                let (astern, aside) = (-(x * sin + y * cos), (x * cos - y * sin).abs());
                // Between one and three ship's lengths astern of midship, inside 19.47°.
                if (195.0..585.0).contains(&astern) && aside < astern * 19.47f64.to_radians().tan()
                {
                    let value = f64::from(simulation.intensity.at(i, j));
                    count += 1.0;
                    first += value;
                    second += value * value;
                }
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
    let heading = scene.ship.as_ref().unwrap().heading;
    let with = fluctuation(&scene, heading);
    with / fluctuation(&open_sea(scene), heading)
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
