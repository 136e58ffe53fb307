//! Several ships: what their wakes do together.

use crate::{assert_sound, run, small};
use wake_physics::labels::labels_of;
use wake_physics::scene::{Scene, Ship};
use wake_physics::{Field, Simulation};

/// Two ships whose wakes cross in the image, and each alone.
fn scenes(assignments: &[&str]) -> [Scene; 3] {
    let both = small(
        96,
        80,
        &[
            &[
                "model.tolerance=1e-5",
                "ship.1.position=[60, 80]",
                "ship.2.position=[-70, 90]",
                "ship.2.heading=-30",
                "ship.2.speed=7",
                "ship.2.length=90",
                "ship.2.beam=14",
                "ship.2.draft=5",
            ],
            assignments,
        ]
        .concat(),
    );
    let alone = |n: usize| Scene {
        ships: vec![both.ships[n].clone()],
        ..both.clone()
    };
    [alone(0), alone(1), both]
}

/// Largest difference of `of(a, b)` and c over the root of the mean square of c.
fn largest(pair: [&Field; 2], both: &Field, of: fn(f64, f64) -> f64) -> f64 {
    let pixels = pair[0].values.iter().zip(&pair[1].values);
    let differences = pixels
        .zip(&both.values)
        .map(|((a, b), c)| (of(f64::from(*a), f64::from(*b)) - f64::from(*c)).abs());
    differences.fold(0.0, f64::max) / both.rms()
}

#[test]
fn waves_add() {
    let [a, b, both] = scenes(&["model.terms=[\"kelvin\"]"]).map(|scene| run(&scene));
    let linear = |s: &Simulation| s.named_fields().map(|(name, f)| (name, f.clone()));
    let [a, b, both] = [&a, &b, &both].map(linear);
    for n in 0..6 {
        assert!(a[n].1.rms() > 0.0 && b[n].1.rms() > 0.0, "{}", a[n].0);
        // Three fields at the tolerance of 1e-5 of their own root mean square each, of which none exceeds both by much.
        let far = largest([&a[n].1, &b[n].1], &both[n].1, |a, b| a + b);
        assert!(far < 5e-5, "{}: {far:e}", a[n].0);
    }
}

#[test]
fn dampings_multiply() {
    let [a, b, both] = scenes(&["model.terms=[\"turbulent\"]"]).map(|scene| run(&scene));
    let calm = f64::from(both.sigma0.values.iter().copied().fold(0.0, f32::max));
    let share = |s: &Simulation| Field {
        values: s.sigma0.values.iter().map(|v| v / calm as f32).collect(),
        ..s.sigma0.clone()
    };
    let [a, b, both] = [&a, &b, &both].map(share);
    // Where the bands cross both have taken something.
    assert!(a.values.iter().zip(&b.values).any(|(a, b)| a.max(*b) < 0.8));
    // A table of σ⁰ of one node, rounded to f32, as are four factors.
    assert!(largest([&a, &b], &both, |a, b| a * b) < 1e-6);
}

#[test]
fn edges_multiply_and_their_currents_add() {
    let edges = [
        "ship.1.edge=true",
        "ship.2.edge=true",
        "model.terms=[\"edge\"]",
    ];
    let [a, b, both] = scenes(&edges).map(|scene| run(&scene));
    assert!(a.velocity_x.rms() > 0.0 && b.velocity_x.rms() > 0.0);
    let sum = largest([&a.velocity_x, &b.velocity_x], &both.velocity_x, |a, b| {
        a + b
    });
    assert!(sum < 1e-6, "{sum:e}");
    let products = a.sigma0.values.iter().zip(&b.sigma0.values);
    let calm = f64::from(
        run(&scenes(&["model.terms=[\"speckle\"]"])[0])
            .sigma0
            .at(0, 0),
    );
    for ((a, b), both) in products.zip(&both.sigma0.values) {
        let product = f64::from(*a) * f64::from(*b) / calm;
        assert!((product / f64::from(*both) - 1.0).abs() < 1e-6);
    }
}

/// The same ships in another order: the same image but for rounding.
#[test]
fn the_order_of_ships_does_not_matter() {
    let [_, _, both] = scenes(&["ship.1.edge=true"]);
    let mut swapped = both.clone();
    swapped.ships.reverse();
    let [a, b] = [&both, &swapped].map(run);
    let (_, rms) = a.intensity.difference(&b.intensity);
    // Sums of f32 fields in another order: a few times 6e-8 of each field; a source is displaced by some 20 pixels, so
    // that its weights change by 20 × 6e-8 × a few.
    assert!(rms < 1e-5 * a.intensity.mean(), "{rms:e}");
    let mut labels = labels_of(&swapped);
    labels.ships.reverse();
    assert_eq!(labels, labels_of(&both));
}

#[test]
fn each_wake_has_the_label_that_it_has_alone() {
    let [a, b, both] = scenes(&["ship.1.echo=true", "radar.range_to_velocity=0"]);
    let labels = labels_of(&both);
    let alone = [a, b].map(|scene| labels_of(&scene).ships.remove(0));
    assert_eq!(labels.ships, alone);
    // Two wakes, and the one ship that is drawn.
    assert_eq!(labels.objects().len(), 3);
}

/// Wakes that cross, ships on the same place, ships at rest and out of the image.
#[test]
fn crowded_scenes_are_sound() {
    let [_, _, crossing] = scenes(&["ship.1.echo=true", "ship.2.echo=true", "ship.2.edge=true"]);
    let mut crowded = crossing.clone();
    crowded.model.tolerance = 1e-3;
    crowded.ships.extend([
        crossing.ships[0].clone(),
        Ship {
            speed: 0.0,
            ..Ship::default()
        },
        Ship {
            position: [1e5, -1e5],
            ..Ship::default()
        },
    ]);
    for scene in [crossing, crowded] {
        let simulation = run(&scene);
        assert_sound(&simulation, &format!("{} ships", scene.ships.len()));
        assert_eq!(simulation.labels.ships.len(), scene.ships.len());
    }
}

/// No ship is no table, whichever way it is said.
#[test]
fn without_a_ship_there_is_the_sea() {
    let open = Scene::from_toml("[grid]\nrows = 40\ncolumns = 40").unwrap();
    let mut cleared = small(40, 40, &["ship.2.speed=3"]);
    cleared.ships.clear();
    assert_eq!(open, cleared);
    assert!(run(&open).labels.ships.is_empty());
}

/// Echoes add, each where its ship is seen.
#[test]
fn every_ship_has_its_echo() {
    let still = [
        "radar.range_to_velocity=0",
        "ship.1.echo=true",
        "ship.2.echo=true",
        "model.terms=[\"noise\"]",
    ];
    let [_, _, both] = scenes(&still);
    // The points of a ship belong to its place in the list.
    let [a, b] = [1, 0].map(|silent: usize| {
        let mut one = both.clone();
        one.ships[silent].echo = false;
        run(&one)
    });
    let both = run(&both);
    let calm = f64::from(a.intensity.at(95, 79));
    for ((a, b), both) in a
        .intensity
        .values
        .iter()
        .zip(&b.intensity.values)
        .zip(&both.intensity.values)
    {
        let sum = f64::from(*a) + f64::from(*b) - calm;
        assert!((sum / f64::from(*both) - 1.0).abs() < 1e-6);
    }
    for ship in &both.labels.ships {
        let corners = ship.ship.echo_oriented_box_px.unwrap();
        let [left, top] = [0, 1].map(|a| corners.iter().map(|c| c[a]).fold(f64::MAX, f64::min));
        let [right, bottom] = [0, 1].map(|a| corners.iter().map(|c| c[a]).fold(0.0, f64::max));
        let inside = |from: f64, to: f64| from.max(0.0) as usize..=to as usize;
        let rows = inside(top, bottom.min(95.0));
        let pixels = rows.flat_map(|i| inside(left, right.min(79.0)).map(move |j| (i, j)));
        let brightest = pixels.map(|(i, j)| both.intensity.at(i, j));
        assert!(f64::from(brightest.fold(0.0, f32::max)) > 100.0 * calm);
    }
}

/// A ship that turns and one that does not: sound images, and the edge that is bright changes sides with the wind.
#[test]
fn a_turning_ship_has_a_sound_image() {
    let keys = [
        "ship.1.turn_rate=-1",
        "ship.1.echo=true",
        "ship.1.edge=true",
        "ship.2.turn_rate=0.01",
        "grid.spacing=10",
        "model.tolerance=1e-3",
    ];
    for more in [
        "sea.time=0",
        "sea.time=50",
        "sea.depth=15",
        "model.terms=all",
    ] {
        let [_, _, both] = scenes(&[&keys[..], &[more]].concat());
        let simulation = run(&both);
        assert_sound(&simulation, more);
        let [turning, wide] = &simulation.labels.ships[..] else {
            panic!("{} ships", simulation.labels.ships.len());
        };
        assert!(turning.wake.centreline_px.len() > 2, "{more}");
        assert!(wide.wake.visibility.is_some(), "{more}");
    }
    // In 50 s it has turned to port by 50 degrees from 45.
    let [later, ..] = scenes(&[&keys[..], &["sea.time=50"]].concat());
    let label = labels_of(&later).ships.remove(0);
    assert!((label.ship.heading + 5.0).abs() < 1e-9);
    assert!((label.wake.axis_deg.unwrap() - 175.0).abs() < 1e-9);
}

/// The whole image of a wide turn is that of a straight track, but for 1,000²/2R of metres.
#[test]
fn a_wide_turn_is_a_straight_track() {
    let keys = [
        "model.terms=[\"turbulent\", \"edge\"]",
        "ship.edge=true",
        "grid.spacing=5",
    ];
    let straight = small(96, 80, &[&keys[..], &["ship.position=[100, 100]"]].concat());
    let mut wide = straight.clone();
    wide.ships[0].turn_rate = 0.006;
    let [straight, wide] = [straight, wide].map(|scene| run(&scene));
    // 500²/2R = 1.3 m on 95 km, over a width of 50 m, of a change of 0.6 at most.
    let far = largest([&straight.sigma0, &straight.sigma0], &wide.sigma0, |a, _| a);
    assert!(far < 0.6 * 1.3 / 25.0, "{far:e}");
    assert!(far > 1e-6);
}
