//! Cases at the edge of what a scene may be: a right answer, never NaN, a hang or garbage.

use crate::{assert_sound, open_sea, run, small, wind_sea};
use proptest::prelude::*;
use wake_physics::scene::Term;
use wake_physics::{Error, Scene, simulate};

#[test]
fn every_corner_of_a_scene_is_sound() {
    let cases: [&[&str]; 34] = [
        &["sea.wind_speed=0"],
        &["sea.wind_speed=0", "radar.incidence=5"],
        &["sea.wind_speed=0.5"],
        &["sea.wind_speed=2.6"],
        &["sea.wind_speed=2.8"],
        &["sea.wind_speed=30"],
        &["sea.wind_speed=3", "sea.fetch=1e7", "sea.spectrum=jonswap"],
        &["sea.wind_speed=10", "sea.fetch=100"],
        &["sea.spectrum=pierson-moskowitz", "sea.spreading=elfouhaily"],
        &["sea.spreading=mitsuyasu", "sea.wind_toward=-1e9"],
        &["sea.depth=1"],
        &["sea.depth=1", "sea.wind_speed=20"],
        &["sea.time=1e5"],
        &["ship.speed=0"],
        &["ship.speed=0.05"],
        // Froude number 0.05 and 1.5 of a 20 m boat.
        &[
            "ship.length=20",
            "ship.beam=4",
            "ship.draft=1",
            "ship.speed=0.7",
        ],
        &[
            "ship.length=20",
            "ship.beam=4",
            "ship.draft=1",
            "ship.speed=21",
        ],
        &["ship.speed=40", "sea.depth=5"],
        &["ship.length=1", "ship.beam=0.2", "ship.draft=0.1"],
        &[
            "ship.length=500",
            "ship.beam=100",
            "ship.draft=40",
            "ship.hull=full",
        ],
        &["ship.hull=full", "ship.block_coefficient=0.45"],
        &["ship.hull=full", "ship.block_coefficient=0.9"],
        &["ship.position=[1e6, 0]"],
        &["ship.position=[-300, 400]", "ship.heading=1e7"],
        &["ship.filter_depth=20"],
        // Transverse waves of 5.1 m on pixels of 2.5 m.
        &["ship.speed=2.83"],
        &["radar.incidence=5"],
        &["radar.incidence=75", "radar.polarization=HH"],
        &["radar.range_to_velocity=0"],
        &["radar.range_to_velocity=150"],
        &["radar.frequency=1e9", "grid.spacing=100"],
        &[
            "radar.frequency=2e10",
            "grid.spacing=0.1",
            "radar.azimuth_resolution=0.5",
            "radar.range_to_velocity=2",
        ],
        &["radar.relaxation_rate=0.01", "radar.looks=1"],
        &["model.tolerance=1e-6", "ship.echo=true", "radar.looks=1000"],
    ];
    for case in cases {
        for terms in ["needed", "all"] {
            let scene = small(40, 36, case)
                .with_assignments(&[format!("model.terms={terms}")])
                .unwrap();
            let simulation = run(&scene);
            assert_sound(&simulation, &format!("{case:?} {terms}"));
            // A wind that makes short waves makes an image.
            let returns = scene.sea.wind_speed >= 5.0;
            assert!(!returns || simulation.speckled.mean() > 0.0, "{case:?}");
        }
    }
}

/// Even, odd, prime and of one pixel: sound, and without a sea the pixel at the origin shows the same wake. Two fields differ
/// by a quarter of the tolerance (nodes and sums) of the root mean square of each, over margins nearer to the ship as well:
/// twice that of the largest image is allowed for them.
#[test]
fn every_shape_of_a_grid_is_sound() {
    let wake = ["ship.position=[150, 200]", "model.terms=[\"kelvin\"]"];
    let [first, others @ ..] = [(127, 101), (1, 1), (1, 97), (97, 1), (2, 3), (31, 64)];
    let of = |(rows, columns): (usize, usize)| run(&small(rows, columns, &wake));
    let large = of(first);
    assert_sound(&run(&small(first.0, first.1, &[])), "127 x 101");
    for (rows, columns) in others {
        let simulation = run(&small(rows, columns, &[]));
        assert_sound(&simulation, &format!("{rows} x {columns}"));
        let simulation = of((rows, columns));
        let fields = large
            .named_fields()
            .into_iter()
            .zip(simulation.named_fields());
        for ((name, expected), (_, field)) in fields.take(6) {
            let value = field.at(rows / 2, columns / 2);
            let far = f64::from(value - expected.at(63, 50)).abs();
            assert!(
                far < 1e-3 * expected.rms(),
                "{rows} x {columns} {name}: {far}"
            );
        }
    }
}

/// Still air: the sea is flat; without a ship nothing moves and nothing scatters but a mirror.
#[test]
fn no_wind_is_a_flat_sea() {
    let simulation = run(&open_sea(small(32, 32, &["sea.wind_speed=0"])));
    assert!(simulation.elevation.values.iter().all(|&v| v == 0.0));
    assert!(
        simulation
            .intensity
            .values
            .iter()
            .all(|&v| v == simulation.intensity.values[0])
    );
    assert!(!simulation.plan.uses(Term::Sea));
    assert!(!simulation.plan.notes.is_empty(), "the report says why");
    // With a ship its wake is there, on a flat sea.
    let wake = run(&small(32, 32, &["sea.wind_speed=0"]));
    assert!(wake.elevation.rms() > 0.01);
}

/// Ahead of the bow lies no wave.
#[test]
fn ahead_of_the_ship_there_is_no_wake() {
    let keys = [
        "sea.wind_speed=0",
        "ship.position=[-400, 0]",
        "ship.heading=90",
    ];
    let simulation = run(&small(48, 48, &keys));
    assert_sound(&simulation, "ahead of the bow");
    assert_eq!(simulation.elevation.rms(), 0.0);
}

/// 100 and 1,000 km astern on the track only the transverse waves are carried, of the frequency g/U: the square of their
/// amplitude, ζ² + (w U/g)², falls as 1/d. Bow and stern are 97 m nearer and farther, a thousandth of the distance, which
/// counts up to ten times where their waves nearly cancel.
#[test]
fn a_wake_far_astern_falls_by_stationary_phase() {
    let square = |distance: f64| {
        let keys = [
            "model.terms=[\"kelvin\"]",
            "ship.heading=90",
            &format!("ship.position=[{distance}, 0]"),
        ];
        let simulation = run(&small(48, 48, &keys));
        let pairs = simulation.elevation.values.iter();
        let pairs = pairs.zip(&simulation.velocity_z.values);
        let per_frequency = 10.0f32 / 9.80665;
        let square = |(z, w): (&f32, &f32)| z * z + (w * per_frequency).powi(2);
        pairs.map(|pair| f64::from(square(pair))).sum::<f64>()
    };
    let ratio = square(1e5) / square(1e6);
    assert!((ratio - 10.0).abs() < 0.1, "{ratio}");
}

#[test]
fn the_same_scene_twice_is_the_same_image() {
    let scene = small(50, 70, &["ship.echo=true"]);
    let (a, b) = (run(&scene), run(&scene));
    for ((name, x), (_, y)) in a.named_fields().into_iter().zip(b.named_fields()) {
        assert_eq!(x, y, "{name}");
    }
    let other = run(&scene.with_assignments(&["seed=8"]).unwrap());
    assert_ne!(other.speckled, a.speckled);
    assert_ne!(other.elevation, a.elevation);
}

/// One thread, two threads: the same bits.
#[test]
fn threads_change_nothing() {
    let scene = small(60, 52, &[]);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run(&scene))
    };
    let (one, two) = (on(1), on(3));
    for ((name, x), (_, y)) in one.named_fields().into_iter().zip(two.named_fields()) {
        assert_eq!(x, y, "{name}");
    }
}

/// 4096 × 4096 pixels: sound, and the sea has the variance of its spectrum, within four standard errors as 64 squares of
/// 1.28 km, each far longer than a wave, tell them; so small that half a hundredth of the variance would be missed.
#[test]
fn the_largest_common_grid_is_sound() {
    let scene = small(4096, 4096, &[]);
    let large = run(&scene);
    assert_sound(&large, "4096 x 4096");
    let sea = run(&open_sea(scene.clone())).elevation;
    assert!(large.elevation.rms() > sea.rms());
    let mut squares = [0.0; 64];
    for (n, value) in sea.values.iter().enumerate() {
        let (row, column) = (n / 4096 / 512, n % 4096 / 512);
        squares[8 * row + column] += f64::from(*value).powi(2) / f64::from(512 * 512);
    }
    let band = std::f64::consts::PI / scene.grid.spacing;
    let expected = wind_sea(&scene).moments(0.0, band, 0.5).elevation;
    assert_mean(&squares, expected, 0.005, "4096 x 4096");
}

/// The mean of independent values is the expected one within four of their standard errors, which are below a share of it.
fn assert_mean(values: &[f64], expected: f64, sharp: f64, what: &str) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let error = (spread / (count * (count - 1.0))).sqrt();
    println!("{what}: {mean} {expected} {error}");
    assert!(4.0 * error < sharp * expected, "{what}: {error}");
    assert!(
        (mean - expected).abs() < 4.0 * error,
        "{what}: {mean} {expected} {error}"
    );
}

#[test]
fn a_grid_too_large_for_memory_is_refused_with_what_it_needs() {
    let scene = small(16384, 16384, &["sea.wind_speed=30", "grid.oversampling=16"]);
    match simulate(&scene) {
        Err(Error::TooLarge { needed_gib, .. }) => assert!(needed_gib > 1000.0),
        // Only where the machine really has that much, or does not tell.
        other => assert!(other.is_ok(), "{other:?}"),
    }
}

fn scenes() -> impl Strategy<Value = Scene> {
    let sea = (
        0.0..=30.0f64,
        -720.0..720.0f64,
        2.0..7.0f64,
        0..3usize,
        0..3usize,
        0.0..4.0f64,
    );
    let ship = (
        1.0..400.0f64,
        0.05..0.3f64,
        0.03..0.1f64,
        0.0..25.0f64,
        -400.0..400.0f64,
    );
    let radar = (
        9.0..10.3f64,
        5.0..75.0f64,
        0.0..200.0f64,
        0.5..100.0f64,
        1..100u32,
    );
    let grid = (
        1..40usize,
        1..40usize,
        -1.0..2.0f64,
        any::<u64>(),
        1.0..6.0f64,
    );
    let shape = (
        any::<[bool; 4]>(),
        -600.0..600.0f64,
        -600.0..600.0f64,
        0.0..1e5f64,
    );
    (sea, ship, radar, grid, shape).prop_map(|(sea, ship, radar, grid, shape)| {
        let mut s = Scene::default();
        s.seed = grid.3;
        (s.grid.rows, s.grid.columns, s.grid.spacing) = (grid.0, grid.1, 10f64.powf(grid.2));
        (s.sea.wind_speed, s.sea.wind_toward) = (sea.0, sea.1);
        s.sea.fetch = 10f64.powf(sea.2);
        use wake_physics::scene::{HullForm, Polarization, SpectrumModel, SpreadingModel};
        s.sea.spectrum = [
            SpectrumModel::Elfouhaily,
            SpectrumModel::Jonswap,
            SpectrumModel::PiersonMoskowitz,
        ][sea.3];
        s.sea.spreading = [
            SpreadingModel::Hasselmann,
            SpreadingModel::Mitsuyasu,
            SpreadingModel::Elfouhaily,
        ][sea.4];
        s.sea.depth = if shape.0[3] {
            f64::INFINITY
        } else {
            10f64.powf(sea.5)
        };
        s.sea.time = shape.3;
        let vessel = &mut s.ships[0];
        vessel.length = ship.0;
        vessel.beam = (ship.0 * ship.1).clamp(0.2, 100.0).min(0.9 * ship.0);
        vessel.draft = (ship.0 * ship.2).clamp(0.1, 40.0).min(0.9 * ship.0);
        (vessel.speed, vessel.heading) = (ship.3, ship.4);
        vessel.position = [shape.1, shape.2];
        vessel.hull = if shape.0[0] {
            HullForm::Full
        } else {
            HullForm::Wigley
        };
        vessel.echo = shape.0[1];
        s.radar.frequency = 10f64.powf(radar.0);
        s.radar.polarization = if shape.0[2] {
            Polarization::HH
        } else {
            Polarization::VV
        };
        s.radar.incidence = radar.1;
        s.radar.range_to_velocity = radar.2;
        s.radar.azimuth_resolution = radar.3;
        s.radar.looks = radar.4;
        s.model.tolerance = 10f64.powf(-grid.4);
        s
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, max_shrink_iters: 10, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_are_sound_and_reproducible(scene in scenes()) {
        let a = run(&scene);
        assert_sound(&a, "random scene");
        let b = run(&scene);
        prop_assert_eq!(&a.speckled, &b.speckled);
        prop_assert!(a.plan.left_out() <= 0.5 * scene.model.tolerance);
    }
}

/// Mean square elevation and slopes over seeds against the integrals of the spectrum over the resolved band: a factor of 1.02
/// is seen.
#[test]
fn the_variance_is_what_the_spectrum_says() {
    for (wind, spacing, spectrum) in [
        (3.0, 1.0, "elfouhaily"),
        (7.0, 2.5, "jonswap"),
        (12.0, 5.0, "elfouhaily"),
    ] {
        let scene = open_sea(small(
            240,
            240,
            &[
                &format!("sea.wind_speed={wind}"),
                "sea.wind_toward=60",
                &format!("grid.spacing={spacing}"),
                &format!("sea.spectrum={spectrum}"),
                "model.terms=[\"sea\"]",
            ],
        ));
        let squares: Vec<[f64; 3]> = (0..24)
            .map(|seed| {
                let sea = run(&Scene {
                    seed,
                    ..scene.clone()
                });
                [&sea.elevation, &sea.slope_x, &sea.slope_y].map(|f| f.rms().powi(2))
            })
            .collect();
        let moments = wind_sea(&scene).moments(0.0, std::f64::consts::PI / spacing, 0.5);
        let expected = [moments.elevation, moments.slope_xx, moments.slope_yy];
        for (n, what) in ["elevation", "slope x", "slope y"].into_iter().enumerate() {
            let of_seeds: Vec<f64> = squares.iter().map(|s| s[n]).collect();
            assert_mean(&of_seeds, expected[n], 0.02, &format!("{wind} m/s {what}"));
        }
    }
}

/// The margin holds what moves into the image: 4.5 standard deviations of the displacement in azimuth and range, which
/// the largest of some 10⁵ pixels of a sea just about reach. A margin of half as many would be passed by a fortieth of
/// them. Near the stern a wake may displace farther: not one in ten thousand pixels. The sea here has at least a thousand
/// independent places, of which the largest is beyond 2.9 deviations in 39 draws of 40: a margin is at most 1.55 times as wide,
/// and two pixels, for it is whole and its edge is interpolated to.
#[test]
fn the_margin_holds_what_is_displaced() {
    for assignments in [
        &["sea.wind_speed=5"][..],
        &["sea.wind_speed=9", "sea.wind_toward=30"],
        &["sea.wind_speed=7", "radar.incidence=18"],
    ] {
        for ship in [false, true] {
            let mut scene = small(320, 320, assignments);
            if !ship {
                scene = open_sea(scene);
            }
            let simulation = run(&scene);
            let displaced = |f: &wake_physics::Field, factor: f64| -> Vec<f64> {
                let step = factor / scene.grid.spacing;
                f.values
                    .iter()
                    .map(|&v| step * f64::from(v.abs()))
                    .collect()
            };
            let cot = scene.radar.incidence.to_radians().tan().recip();
            let axes = [
                displaced(&simulation.radial_velocity, scene.radar.range_to_velocity),
                displaced(&simulation.elevation, cot),
            ];
            for (pixels, margin) in axes.iter().zip(simulation.plan.sizes.margin) {
                let margin = margin as f64;
                let largest = pixels.iter().copied().fold(0.0, f64::max);
                let beyond = pixels.iter().filter(|&&p| p > margin).count();
                println!(
                    "{assignments:?} {ship}: margin {margin}, displaced {largest}, beyond {beyond}"
                );
                let share = beyond as f64 / pixels.len() as f64;
                assert!(share < 1e-4, "{assignments:?} {ship}: {share}");
                if !ship {
                    assert!(largest <= margin, "{assignments:?}: {largest} {margin}");
                    assert!(
                        margin <= 1.55 * largest + 2.0,
                        "{assignments:?}: {largest} {margin}"
                    );
                }
            }
        }
    }
}

/// What was written is read by other readers: the picture by the `image` crate, level for level, the fields by the
/// `safetensors` crate, bit for bit, the labels as JSON.
#[test]
fn what_is_written_is_read_back() {
    use safetensors::{Dtype, SafeTensors};
    let simulation = run(&small(24, 37, &["ship.echo=true"]));
    let folder = tempfile::tempdir().unwrap();
    simulation.write(folder.path()).unwrap();
    let picture = image::open(folder.path().join("image.png")).unwrap();
    assert_eq!(picture.color(), image::ColorType::L8);
    let picture = picture.to_luma8();
    assert_eq!(picture.dimensions(), (37, 24));
    let scale = wake_physics::grey::GreyScale::default();
    for (column, row, pixel) in picture.enumerate_pixels() {
        let power = f64::from(simulation.speckled.at(row as usize, column as usize));
        assert_eq!(pixel.0[0], scale.level(power), "{row} {column}");
    }
    let bytes = std::fs::read(folder.path().join("fields.safetensors")).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(tensors.len(), simulation.named_fields().len());
    for (name, field) in simulation.named_fields() {
        let tensor = tensors.tensor(name).unwrap();
        assert_eq!(
            (tensor.dtype(), tensor.shape()),
            (Dtype::F32, &[24, 37][..])
        );
        let read: Vec<f32> = tensor
            .data()
            .chunks(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(read, field.values, "{name}");
    }
    let text = std::fs::read_to_string(folder.path().join("labels.json")).unwrap();
    let labels: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(labels, serde_json::to_value(&simulation.labels).unwrap());
}
