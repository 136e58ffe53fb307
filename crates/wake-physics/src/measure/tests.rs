//! Measurements on images with known truth: analytic wakes, simulated scenes, and images without information.

use super::*;
use crate::constants::GRAVITY;
use crate::random::{Stream, generator};
use crate::raster::{Field, Raster};
use crate::scene::{Scene, Ship};
use crate::simulate;
use crate::track::Track;
use rand_distr::{Distribution, StandardNormal};

const SHIP: ShipPlace = ShipPlace {
    position: [0.0, 0.0],
    length: 195.0,
    depth: f64::INFINITY,
};

fn raster() -> Raster {
    Raster::image(256, 256, 4.0)
}

/// An image of mean 1 with independent normal noise of standard deviation `std`.
fn noise(std: f64, seed: u64) -> Field {
    let mut field = Field::constant(&raster(), 1.0);
    for (i, row) in field.values.chunks_mut(256).enumerate() {
        let mut random = generator(seed, Stream::Sea, i as u64);
        for v in row {
            let normal: f64 = StandardNormal.sample(&mut random);
            *v = (1.0 + std * normal).max(0.1) as f32;
        }
    }
    field
}

/// Phases of the transverse and the divergent wave at (ξ, η) astern of the ship by stationary phase: with q = η/ξ,
/// `t = (1 ∓ √(1 − 8q²))/(4q)` and phase `ν √(1 + t²)(ξ + ηt)`; none outside the wedge.
fn kelvin_phases([xi, eta]: [f64; 2], speed: f64) -> Option<[f64; 2]> {
    let q = eta / -xi;
    let root = 1.0 - 8.0 * q * q;
    if xi > -60.0 || root < 0.0 || q.abs() < 1e-3 {
        return None;
    }
    let nu = GRAVITY / (speed * speed);
    Some([-1.0, 1.0].map(|sign| {
        let t = (1.0 + sign * root.sqrt()) / (4.0 * q);
        nu * (1.0 + t * t).sqrt() * (xi + eta * t)
    }))
}

/// The pattern of Kelvin's waves on a rough sea.
fn analytic_wake(speed: f64, heading: f64) -> Field {
    let (raster, track) = (raster(), Track::new([0.0; 2], heading, 0.0));
    let mut field = noise(0.1, 11);
    for n in 0..field.values.len() {
        let (i, j) = (n / 256, n % 256);
        let seen = track.seen_from_ship([raster.x(j), raster.y(i)]);
        if let Some(phases) = kelvin_phases(seen, speed) {
            let waves: f64 = phases.iter().map(|phase| phase.cos()).sum();
            field.values[n] *= (1.0 + 0.3 * waves) as f32;
        }
    }
    field
}

/// Speed and heading are recovered from the closed form of the pattern, in every quarter of the compass: turning the scene turns
/// the heading and leaves the speed.
#[test]
fn an_analytic_wake_gives_its_speed_and_heading() {
    for (speed, heading) in [
        (8.0, 20.0),
        (8.0, 110.0),
        (8.0, 200.0),
        (8.0, 290.0),
        (11.0, 333.0),
    ] {
        let found = measure_wake(&analytic_wake(speed, heading), &raster(), &SHIP);
        assert!(found.speed.measurable && found.heading.measurable);
        // A step of the spectrum, 2π/1024 m, is 8 % of ν at 11 m/s, and so 4 % of the speed; the ridge is found to a fraction of
        // a step.
        let error = angle_between(found.heading.value, heading);
        assert!(error.abs() < 1.0, "{heading}: {found:?}");
        assert!(
            (found.speed.value / speed - 1.0).abs() < 0.01,
            "{speed}: {found:?}"
        );
    }
}

/// Nothing is measured in images without information.
#[test]
fn images_without_information_are_not_measurable() {
    let black = Field::constant(&raster(), 0.0);
    let mut broken = noise(0.1, 2);
    broken.values[77] = f32::NAN;
    let constant = Field::constant(&raster(), 0.03);
    for image in [
        &black,
        &constant,
        &broken,
        &noise(0.05, 1),
        &noise(0.4, 2),
        &noise(0.2, 3),
    ] {
        let found = measure_wake(image, &raster(), &SHIP);
        assert!(!found.speed.measurable, "{found:?}");
        assert!(!found.heading.measurable, "{found:?}");
    }
    assert!(open_sea(&black, &raster(), None).is_none());
    assert!(open_sea(&broken, &raster(), None).is_none());
    // A raster of another size.
    let small = Raster::image(64, 64, 4.0);
    assert_eq!(
        measure_wake(&constant, &small, &SHIP)
            .heading
            .measurable_value(),
        None
    );
}

fn scene(speed: f64, heading: f64, wind: f64, toward: f64, incidence: f64) -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene.seed = 4_000_000 + heading as u64;
    scene.ships = vec![Ship {
        speed,
        heading,
        ..Ship::default()
    }];
    (scene.sea.wind_speed, scene.sea.wind_toward) = (wind, toward);
    scene.radar.incidence = incidence;
    scene
}

/// Simulated scenes with known truth. The limits for the wake are the goals of the project for a generated image, 3° and 0.5 m/s;
/// for the sea, the error that 0.3 dB of brightness causes at the smallest measurable slopes.
#[test]
fn simulated_scenes_give_their_values_back() {
    let (mut axes, mut winds) = (0, 0);
    for (speed, heading, wind, toward, incidence) in [
        (7.0, 100.0, 4.0, 120.0, 28.0),
        (9.3, 247.0, 6.2, 40.0, 30.0),
        (11.0, 305.0, 5.0, 290.0, 25.0),
    ] {
        let truth = scene(speed, heading, wind, toward, incidence);
        let image = simulate(&truth).unwrap().intensity;
        let found = measure_wake(&image, &raster(), &SHIP);
        assert!(
            found.heading.measurable && found.speed.measurable,
            "{found:?}"
        );
        assert!(
            angle_between(found.heading.value, heading).abs() < 3.0,
            "{found:?}"
        );
        assert!((found.speed.value - speed).abs() < 0.5, "{found:?}");
        let sea = open_sea(&image, &raster(), Some(([0.0; 2], found.heading.value))).unwrap();
        let expected = mean_sigma0(&truth).unwrap();
        // The mean over slopes is accurate to some per cent: 0.2 dB at 25°, where few facets near nadir count.
        assert!((10.0 * (sea.mean / expected).log10()).abs() < 0.3);
        // Two winds may be equally bright; then neither is reported.
        if let Some(found) = wind_speed(&sea, &truth).unwrap().measurable_value() {
            assert!((found - wind).abs() < 0.4, "{found}");
            winds += 1;
        }
        let measured = super::incidence(&sea, &truth).unwrap();
        assert!(
            measured.measurable && (measured.value - incidence).abs() < 1.3,
            "{measured:?}"
        );
        // A sea with little skew does not determine the diagonal.
        if let Some(axis) = wind_axis(&sea, &truth).unwrap().measurable_value() {
            assert!(axis_between(axis, toward).abs() < 10.0, "{axis}");
            axes += 1;
        }
    }
    assert!(
        axes >= 2 && winds >= 2,
        "{axes} axes, {winds} winds measurable"
    );
}

/// A sea without a ship shows no speed.
#[test]
fn open_sea_has_no_speed() {
    for seed in 0..3 {
        let mut scene = scene(10.0, 45.0, 4.0 + seed as f64, 30.0, 30.0);
        scene.ships.clear();
        scene.seed = 77 + seed;
        let image = simulate(&scene).unwrap().intensity;
        let found = measure_wake(&image, &raster(), &SHIP);
        assert!(!found.speed.measurable, "{found:?}");
        assert!(!found.heading.measurable, "{found:?}");
    }
}

/// Brighter images give more wind and a smaller incidence.
#[test]
fn brightness_moves_the_measurements_the_right_way() {
    let truth = scene(10.0, 90.0, 5.0, 90.0, 30.0);
    let expected = mean_sigma0(&truth).unwrap();
    let sea = |factor: f64| OpenSea {
        mean: factor * expected,
        contrast: 0.2,
        skew: 0.1,
    };
    let winds = [0.8, 1.0, 1.25].map(|f| wind_speed(&sea(f), &truth).unwrap().value);
    let incidences = [0.8, 1.0, 1.25].map(|f| incidence(&sea(f), &truth).unwrap().value);
    assert!(winds[0] < winds[1] && winds[1] < winds[2], "{winds:?}");
    assert!(incidences[0] > incidences[1] && incidences[1] > incidences[2]);
    // The lattice is interpolated linearly in decibel: half a step of it at worst.
    assert!((winds[1] - 5.0).abs() < 0.05 && (incidences[1] - 30.0).abs() < 0.05);
    // Noise as strong as the sea brightens the image, not the wind.
    let mut noisy = truth.clone();
    noisy.radar.nesz = Some(10.0 * expected.log10());
    let [wind, incidence] = [wind_speed, incidence].map(|of| of(&sea(2.0), &noisy).unwrap().value);
    assert!((wind - 5.0).abs() < 0.05 && (incidence - 30.0).abs() < 0.05);
    // A sea ten times too bright has no such wind.
    assert!(!wind_speed(&sea(10.0), &truth).unwrap().measurable);
}

#[test]
fn a_scene_out_of_range_is_an_error() {
    let mut wrong = scene(10.0, 90.0, 5.0, 90.0, 30.0);
    wrong.radar.incidence = 2.0;
    assert!(mean_sigma0(&wrong).is_err());
}

#[test]
fn differences_of_directions_go_the_short_way() {
    for (one, other, turn, axis) in [
        (10.0, 350.0, 20.0, 20.0),
        (350.0, 10.0, -20.0, -20.0),
        (0.0, 180.0, -180.0, 0.0),
        (100.0, 0.0, 100.0, -80.0),
    ] {
        assert!((angle_between(one, other) - turn).abs() < 1e-12);
        assert!((axis_between(one, other) - axis).abs() < 1e-12);
    }
}

/// In water where the ship is twice as fast as the longest waves, the wedge is Mach's: sin 30° = ½. Half of a disc of large
/// radius about the bow would be 180° wide.
#[test]
fn a_supercritical_wedge_is_machs() {
    let raster = Raster::image(401, 401, 5.0);
    let depth = (10.0f64 / 2.0).powi(2) / GRAVITY;
    let ship = ShipPlace { depth, ..SHIP };
    let inside = kelvin_wedge(&raster, &ship, 0.0, 10.0);
    for astern in [100usize, 300, 600] {
        let row = 200 + astern / 5;
        let count = inside[row * 401..(row + 1) * 401]
            .iter()
            .filter(|&&v| v)
            .count() as f64;
        let half = (astern as f64 + 97.5) / 3f64.sqrt();
        assert!((count - (1.0 + 2.0 * (half / 5.0).floor())).abs() < 0.5);
    }
}

/// Where the arms may open wider than in deep water, no heading is measured: a single arm of unknown opening has none.
#[test]
fn a_wake_in_shallow_water_is_not_measurable() {
    let image = analytic_wake(8.0, 110.0);
    for (depth, measurable) in [(5.0, false), (30.0, false), (100.0, true)] {
        let ship = ShipPlace { depth, ..SHIP };
        let found = measure_wake(&image, &raster(), &ship);
        assert_eq!(found.heading.measurable, measurable, "{depth}: {found:?}");
        assert_eq!(found.speed.measurable, measurable, "{depth}: {found:?}");
    }
}

/// The wedge by trigonometry: its width astern of the bow, nothing ahead, and the same after a quarter turn.
#[test]
fn the_wedge_opens_astern_at_the_kelvin_angle() {
    let raster = Raster::image(201, 201, 5.0);
    let wedge = |heading| kelvin_wedge(&raster, &SHIP, heading, 10.0);
    let (north, east) = (wedge(0.0), wedge(90.0));
    for i in 0..201 {
        // Heading 0: row i is 5·(i − 100) m astern of midship.
        let astern = 5.0 * (i as f64 - 100.0);
        let half = (astern + 97.5) * 19.4712f64.to_radians().tan();
        let expected = if astern > 0.0 {
            1.0 + 2.0 * (half / 5.0).floor()
        } else {
            0.0
        };
        let count = north[i * 201..(i + 1) * 201].iter().filter(|&&v| v).count() as f64;
        assert!((count - expected).abs() < 0.5, "{i}: {count} {expected}");
        for j in 0..201 {
            // A quarter turn clockwise moves (row, column) to (column, 200 − row).
            assert_eq!(north[i * 201 + j], east[j * 201 + 200 - i]);
        }
    }
}
