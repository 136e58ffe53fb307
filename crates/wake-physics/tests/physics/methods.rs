//! The fast methods against the oracles, whole scenes, at the tolerance asked for.

use crate::small;
use wake_physics::scene::Term;
use wake_physics::{Method, Scene, simulate_with};

/// Every field and the image, at several tolerances, on a small grid with ship, sea and all terms.
#[test]
fn the_tolerance_is_met_at_every_level() {
    for (tolerance, assignments) in [
        (
            1e-1,
            &["ship.position=[15, 30]", "radar.range_to_velocity=50"][..],
        ),
        (
            1e-2,
            &["ship.position=[15, 30]", "radar.range_to_velocity=30"],
        ),
        (1e-3, &["ship.position=[15, 30]", "sea.wind_toward=20"]),
        (
            1e-3,
            &[
                "ship.position=[30, 0]",
                "ship.heading=90",
                "radar.incidence=20",
            ],
        ),
        (
            1e-4,
            &[
                "ship.position=[15, 30]",
                "radar.range_to_velocity=40",
                "radar.polarization=HH",
            ],
        ),
        (
            1e-4,
            &[
                "ship.position=[15, 30]",
                "ship.2.position=[-10, 30]",
                "ship.2.heading=350",
                "ship.2.speed=6",
                "ship.2.edge=true",
                "radar.range_to_velocity=30",
            ],
        ),
        (
            1e-5,
            &["ship.position=[15, 30]", "radar.range_to_velocity=20"],
        ),
        (
            1e-6,
            &["ship.position=[15, 30]", "radar.range_to_velocity=20"],
        ),
    ] {
        assert_tolerance(&small(28, 12, assignments), tolerance);
    }
}

/// A ship that turns beside one that does not, no sea that hides them, and few pixels, since the oracle sums the rings of all
/// wavelengths: no other error than that of a straight wake, since the waves are summed by the same methods.
#[test]
fn turning_ships_keep_the_tolerance() {
    let keys = [
        "ship.position=[15, 15]",
        "ship.turn_rate=1.4",
        "ship.edge=true",
        "ship.2.position=[-20, 30]",
        "ship.2.heading=350",
        "radar.range_to_velocity=5",
        "model.terms=[\"kelvin\", \"turbulent\", \"edge\", \"tilt_average\", \"bunching\"]",
    ];
    assert_tolerance(&small(12, 10, &keys), 1e-3);
}

/// A scene under an impulse response with all that a satellite's has: swell, waves of the ship that no pixel carries, edges,
/// gusts, slicks, breaking waves, noise. 2.5 m are computed of pixels of 5 m, and 80 m around them.
#[test]
fn satellite_scenes_keep_the_tolerance() {
    let keys = [
        "grid.spacing=5",
        "radar.frequency=5.405e9",
        "radar.range_resolution=10",
        "radar.azimuth_resolution=10",
        "radar.range_to_velocity=10",
        "radar.nesz=-25",
        "sea.wind_speed=4",
        "sea.swell_height=1",
        "sea.gust_strength=0.1",
        "sea.slick_damping=0.5",
        "sea.breaking=true",
        "ship.position=[60, 150]",
        "ship.heading=20",
        "ship.edge=true",
    ];
    let scene = small(7, 6, &keys);
    let plan = wake_physics::Plan::new(&scene).unwrap();
    let drawn = [
        Term::Swell,
        Term::SubpixelWake,
        Term::BrightEdge,
        Term::Slicks,
    ];
    for term in drawn
        .into_iter()
        .chain([Term::Gusts, Term::ImpulseResponse])
    {
        assert!(plan.uses(term), "{plan}");
    }
    assert_tolerance(&scene, 1e-3);
}

fn assert_tolerance(scene: &Scene, tolerance: f64) {
    let mut scene = scene.clone();
    scene.model.tolerance = tolerance;
    let fast = simulate_with(&scene, Method::Fast).unwrap();
    let direct = simulate_with(&scene, Method::Direct).unwrap();
    assert_eq!(fast.plan.terms, direct.plan.terms);
    for ((name, a), (_, b)) in fast.named_fields().into_iter().zip(direct.named_fields()) {
        let (max, rms) = a.difference(b);
        match name {
            "speckled" => {}
            "intensity" => {
                assert!(
                    rms <= tolerance * b.mean(),
                    "{tolerance} {name}: {rms} of {}",
                    b.mean()
                );
            }
            // A field's own rounding to f32 is part of the tolerance: 6e-8 of its largest value.
            _ => assert!(
                max <= tolerance * b.rms(),
                "{tolerance} {name}: {max} of {}",
                b.rms()
            ),
        }
    }
}
