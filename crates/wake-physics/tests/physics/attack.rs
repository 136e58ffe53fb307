//! Random scenes at the ends of all ranges: finite, no negative power, labels, and the fast methods as near the oracles as
//! asked. `tests/cost` tells what such scenes cost beside what their plans say.

use crate::any_scene::{self, ends, terms};
use crate::{assert_sound, small};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use wake_physics::labels::Labels;
use wake_physics::scene::{Grid, HullForm, Polarization, Ship, SpectrumModel, SpreadingModel};
use wake_physics::{Method, Plan, Scene, simulate, simulate_with};

prop_compose! {
    fn grid()(rows in 1_usize..=9, columns in 1_usize..=9, spacing in ends(0.1, 100.0)) -> Grid {
        Grid { rows, columns, spacing, oversampling: None }
    }
}

prop_compose! {
    fn ship()(
        length in ends(1.0, 500.0),
        shape in (ends(0.2, 0.99), ends(0.1, 0.99)),
        speed in ends(0.0, 40.0),
        heading in ends(-720.0, 720.0),
        position in (ends(-500.0, 500.0), ends(-500.0, 500.0)),
        (full, echo, filter_depth) in (any::<bool>(), any::<bool>(), ends(0.0, 20.0)),
    ) -> Ship {
        Ship {
            length,
            beam: (shape.0 * length).clamp(0.2, 100.0),
            draft: (shape.1 * length).clamp(0.1, 40.0),
            speed,
            heading,
            position: position.into(),
            hull: if full { HullForm::Full } else { HullForm::Wigley },
            echo,
            filter_depth,
            ..Ship::default()
        }
    }
}

prop_compose! {
    fn scene()(
        seed in any::<u64>(),
        grid in grid(),
        ship in proptest::option::weighted(0.7, ship()),
        wind_speed in ends(0.0, 30.0),
        (wind_toward, fetch) in (ends(0.0, 360.0), ends(100.0, 1e7)),
        depth in prop_oneof![Just(1.0), Just(f64::INFINITY), 1.0..=100.0_f64],
        (time, temperature, salinity) in (ends(0.0, 1e5), ends(-2.0, 40.0), ends(0.0, 45.0)),
        (spectrum, spreading) in (0..3_usize, 0..3_usize),
        (frequency, incidence) in (ends(1e9, 2e10), ends(5.0, 75.0)),
        horizontal in any::<bool>(),
        (range_to_velocity, resolution) in (ends(0.0, 200.0), ends(0.5, 100.0)),
        looks in prop_oneof![Just(1_u32), Just(1000), 1..=1000_u32],
        terms in terms(),
        tolerance in prop_oneof![Just(0.1), Just(0.01), Just(1e-3)],
    ) -> Scene {
        let mut scene = Scene { seed, grid, ships: Vec::from_iter(ship), ..Scene::default() };
        let sea = &mut scene.sea;
        (sea.wind_speed, sea.wind_toward, sea.fetch) = (wind_speed, wind_toward, fetch);
        (sea.depth, sea.time) = (depth, time);
        (sea.temperature, sea.salinity) = (temperature, salinity);
        let spectra = [SpectrumModel::Elfouhaily, SpectrumModel::Jonswap, SpectrumModel::PiersonMoskowitz];
        let spreads = [SpreadingModel::Hasselmann, SpreadingModel::Mitsuyasu, SpreadingModel::Elfouhaily];
        (sea.spectrum, sea.spreading) = (spectra[spectrum], spreads[spreading]);
        let radar = &mut scene.radar;
        (radar.frequency, radar.incidence, radar.looks) = (frequency, incidence, looks);
        (radar.range_to_velocity, radar.azimuth_resolution) = (range_to_velocity, resolution);
        radar.polarization = if horizontal { Polarization::HH } else { Polarization::VV };
        (scene.model.terms, scene.model.tolerance) = (terms, tolerance);
        scene
    }
}

/// Pixels with margin of what is simulated here: more would be a test of patience.
const MOST_PIXELS: usize = 1 << 18;

/// Pixels with margin that the oracle, which sums every wave in every pixel, is asked for.
const MOST_SUMMED: usize = 1 << 10;

/// The same scenes each time; `PROPTEST_RNG_SEED` chooses others, `PROPTEST_CASES` more.
fn cases(count: u32) -> ProptestConfig {
    let mut config = ProptestConfig {
        failure_persistence: None,
        max_global_rejects: 1 << 20,
        ..ProptestConfig::default()
    };
    if config.rng_seed == RngSeed::Random {
        config.rng_seed = RngSeed::Fixed(1);
    }
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = count;
    }
    config
}

fn pixels(plan: &Plan) -> usize {
    plan.sizes.computed[0] * plan.sizes.computed[1]
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn no_scene_gives_what_is_no_power(scene in scene()) {
        prop_assert!(scene.validate().is_ok(), "{:?}", scene.validate());
        // Fields that do not fit in memory are refused, which another test looks at.
        let Ok(plan) = Plan::new(&scene) else { return Ok(()) };
        prop_assume!(pixels(&plan) <= MOST_PIXELS);
        let simulation = simulate(&scene).unwrap();
        assert_sound(&simulation, &scene.to_toml().unwrap());
    }
}

/// Seconds of a core and bytes, as told, of the scenes over all keys that are simulated here.
const MOST_SECONDS: f64 = 1.0;
const MOST_BYTES: u64 = 1 << 28;

proptest! {
    #![proptest_config(cases(150))]

    /// All keys at once, and ships as far away as numbers go: an image and labels without a number that is none, or a
    /// sentence; written and read again the same scene.
    #[test]
    fn any_scene_is_sound_or_refused(scene in any_scene::scene(600)) {
        prop_assert!(scene.validate().is_ok(), "{:?}", scene.validate());
        let toml = scene.to_toml().unwrap();
        prop_assert_eq!(&Scene::from_toml(&toml).unwrap(), &scene);
        let Ok(plan) = Plan::new(&scene) else { return Ok(()) };
        let cost = plan.cost();
        prop_assert!(cost.core_seconds.is_finite() && cost.core_seconds > 0.0 && cost.bytes > 0, "{}", cost);
        prop_assume!(cost.core_seconds <= MOST_SECONDS && cost.bytes <= MOST_BYTES);
        let simulation = simulate(&scene).unwrap();
        assert_sound(&simulation, &toml);
        let labels = serde_json::to_string(&simulation.labels).unwrap();
        let read: Labels = serde_json::from_str(&labels).unwrap();
        prop_assert_eq!(read.ships.len(), scene.ships.len());
    }
}

/// However far a ship is, its labels look at no more windows than the image has; at ends of the range of numbers as well.
#[test]
fn a_ship_at_any_distance_is_labelled() {
    for keys in [
        &["ship.position=[1e7, 1e7]"][..],
        &["ship.position=[1e13, 1e13]"],
        &["ship.position=[1e300, -1e300]"],
        &["ship.position=[1.7e308, 1.7e308]", "ship.edge=true"],
        &[
            "ship.position=[-1.7e308, 1e80]",
            "ship.turn_rate=0.5",
            "ship.edge=true",
        ],
        &["ship.position=[1e13, 1e13]", "ship.turn_rate=0.006"],
        &["sea.time=1e5", "ship.speed=40"],
        &["sea.time=1e5", "ship.speed=40", "ship.turn_rate=0.1"],
    ] {
        let scene = small(16, 16, keys);
        let simulation = simulate(&scene).unwrap();
        assert_sound(&simulation, &keys.join(" "));
        assert_eq!(simulation.labels.ships[0].wake.box_px, None, "{keys:?}");
    }
}

proptest! {
    #![proptest_config(cases(40))]

    /// rms of the difference against the mean, as the tolerance is defined; the same terms in both.
    #[test]
    fn images_are_those_of_the_oracles(scene in scene()) {
        let Ok(plan) = Plan::new(&scene) else { return Ok(()) };
        prop_assume!(pixels(&plan) <= MOST_SUMMED);
        let fast = simulate_with(&scene, Method::Fast).unwrap();
        let direct = simulate_with(&scene, Method::Direct).unwrap();
        let (_, rms) = fast.intensity.difference(&direct.intensity);
        let mean = direct.intensity.mean();
        let allowed = scene.model.tolerance * mean + 1e-30;
        prop_assert!(rms <= allowed, "{rms} of {mean}: {}", scene.to_toml().unwrap());
    }
}

/// Scenes that a search found: near nadir without the average over tilt, and a field so weak that it underflows.
#[test]
fn corners_that_were_found_stay_mended() {
    for assignments in [
        &[
            "grid.rows=32",
            "grid.columns=32",
            "grid.spacing=1.3",
            "radar.range_to_velocity=0",
            "sea.wind_speed=7.4",
            "radar.incidence=5.2",
            "radar.frequency=3.8e9",
            "model.terms=[\"sea\"]",
            "model.tolerance=0.01",
        ][..],
        &[
            "grid.rows=32",
            "grid.columns=32",
            "grid.spacing=1.3",
            "radar.range_to_velocity=0",
            "sea.wind_speed=7.4",
            "radar.incidence=5.2",
            "radar.frequency=3.8e9",
            "model.terms=[\"sea\", \"hydrodynamic\"]",
            "model.tolerance=0.01",
        ],
        &[
            "grid.rows=8",
            "grid.columns=8",
            "grid.spacing=100",
            "sea.wind_speed=0.5",
            "radar.frequency=1.2e9",
            "radar.range_to_velocity=0",
        ],
    ] {
        let scene = Scene {
            ships: Vec::new(),
            ..Scene::default()
        }
        .with_assignments(assignments)
        .unwrap();
        let fast = simulate_with(&scene, Method::Fast).unwrap();
        assert_sound(&fast, &assignments.join(" "));
        let direct = simulate_with(&scene, Method::Direct).unwrap();
        let (_, rms) = fast.intensity.difference(&direct.intensity);
        let allowed = scene.model.tolerance * direct.intensity.mean() + 1e-30;
        assert!(
            rms <= allowed,
            "{assignments:?}: {rms} of {}",
            direct.intensity.mean()
        );
    }
}
