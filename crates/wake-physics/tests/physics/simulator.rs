//! A simulator that is called again and again.

use crate::small;
use wake_physics::scene::{Term, Terms};
use wake_physics::{Scene, Simulation, Simulator, expected_intensity, labels_of, simulate};

/// Scenes that ask for blocks of other sizes, other precisions and other tables, in an order that mixes them.
fn scenes() -> Vec<Scene> {
    let mut scenes = vec![
        small(64, 80, &[]),
        small(40, 36, &["sea.wind_speed=8", "seed=4"]),
        small(64, 80, &["seed=9"]),
        small(64, 80, &["radar.polarization=HH", "model.terms=all"]),
        small(48, 48, &["model.tolerance=1e-5"]),
        small(96, 30, &["sea.wind_speed=0"]),
        small(64, 80, &["radar.range_to_velocity=0"]),
        small(64, 80, &["model.terms=[\"sea\"]"]),
    ];
    scenes[2].ships.clear();
    scenes
}

fn assert_same(a: &Simulation, b: &Simulation) {
    for ((name, a), (_, b)) in a.named_fields().into_iter().zip(b.named_fields()) {
        assert_eq!(a, b, "{name}");
    }
    assert_eq!(a.plan, b.plan);
    assert_eq!(a.accuracy, b.accuracy);
}

/// Whatever was drawn before, and whether or not its blocks came back: the same bits.
#[test]
fn results_do_not_depend_on_what_was_drawn_before() {
    let mut simulator = Simulator::default();
    let scenes = scenes();
    for round in 0..2 {
        for scene in scenes.iter().chain(scenes.iter().rev()) {
            let again = simulator.simulate(scene).unwrap();
            assert_same(&again, &simulate(scene).unwrap());
            let expected = simulator.expected_intensity(scene).unwrap();
            assert_eq!(expected, expected_intensity(scene).unwrap());
            if round == 0 {
                simulator.reclaim(again);
            }
        }
    }
}

/// Labels of a run are those of its scene alone, bit for bit: what a run computes changes none of what labels come from.
#[test]
fn labels_of_a_run_are_those_of_its_scene() {
    let mut simulator = Simulator::default();
    for keys in [
        &[][..],
        &["ship.turn_rate=0.3", "ship.echo=true"],
        &["radar.sensor=sentinel-1-iw", "ship.edge=true"],
        &["grid.spacing=10", "ship.speed=6.5"],
        &["sea.wind_speed=0"],
    ] {
        let scene = small(96, 80, keys);
        let run = simulator.simulate(&scene).unwrap();
        assert_eq!(run.labels, labels_of(&scene), "{keys:?}");
    }
}

/// The image alone has the bits of the image among all fields, for every list of terms that leaves fields out.
#[test]
fn image_only_has_the_same_bits() {
    let mut simulator = Simulator::default();
    let mut scenes = scenes();
    let moving = [
        Term::VelocityBunching,
        Term::RangeBunching,
        Term::Hydrodynamic,
        Term::AzimuthSmear,
    ];
    for chosen in 0..1 << moving.len() {
        let also = moving
            .iter()
            .enumerate()
            .filter(|(n, _)| chosen >> n & 1 == 1);
        let also = also.map(|(_, term)| *term);
        let mut scene = small(40, 36, &[]);
        let always = [Term::Sea, Term::Kelvin, Term::Turbulent, Term::Speckle];
        scene.model.terms = Terms::List(always.into_iter().chain(also).collect());
        scenes.push(scene);
    }
    for scene in &scenes {
        let all = simulator.simulate(scene).unwrap();
        let image = simulator.image(scene).unwrap();
        assert_eq!(image.intensity, all.intensity, "{:?}", scene.model.terms);
        assert_eq!(image.labels, all.labels);
        assert_eq!(image.plan, all.plan);
        assert_eq!(image.speckled(), all.speckled);
    }
}

/// The plan that is made without simulating is the one that a simulation follows.
#[test]
fn the_plan_is_complete_when_it_is_returned() {
    for scene in scenes() {
        let plan = wake_physics::Plan::new(&scene).unwrap();
        let followed = simulate(&scene).unwrap().plan;
        assert_eq!(plan, followed);
        assert_eq!(plan.to_string(), followed.to_string());
        let drawn = plan.uses(Term::Sea);
        assert_eq!(drawn, plan.sizes.sea_lattice != [0, 0]);
    }
}

/// What was asked for and reached is told; a tolerance that no method meets is told as missed.
#[test]
fn accuracy_is_told() {
    for scene in scenes() {
        let simulation = simulate(&scene).unwrap();
        let accuracy = simulation.accuracy;
        assert!(accuracy.missed().is_empty(), "{:?}", accuracy.missed());
        let table = accuracy.table.unwrap();
        assert!(table.reached <= table.asked && table.asked <= scene.model.tolerance);
        assert_eq!(accuracy.wake.is_some(), simulation.plan.uses(Term::Kelvin));
    }
    // Means over the slopes of breaking waves do not keep a millionth.
    let keys = [
        "radar.range_resolution=10",
        "radar.azimuth_resolution=10",
        "grid.spacing=10",
        "ship.position=[40, 40]",
        "model.tolerance=1e-6",
    ];
    let accuracy = simulate(&small(8, 8, &keys)).unwrap().accuracy;
    let missed = accuracy.missed();
    assert!(missed.iter().any(|m| m.contains("table")), "{accuracy:?}");
}
