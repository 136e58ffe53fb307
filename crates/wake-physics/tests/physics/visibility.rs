//! How clearly labels say that a wake is seen, against images.

use crate::{open_sea, run};
use wake_physics::kelvin::half_angle;
use wake_physics::labels::{Visibility, WakeLabel};
use wake_physics::{Field, Raster, Scene, expected_intensity, labels_of};

/// 320 × 320 pixels of 4 m, the ship near a corner and its wake across the image.
fn scene(assignments: &[&str]) -> Scene {
    let grid = [
        "grid.rows=320",
        "grid.columns=320",
        "grid.spacing=4",
        "ship.heading=50",
        "ship.position=[380, 320]",
    ];
    Scene::default()
        .with_assignments(&[&grid[..], assignments].concat())
        .unwrap()
}

fn raster(scene: &Scene) -> Raster {
    Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing)
}

fn wake(scene: &Scene) -> WakeLabel {
    labels_of(scene).ships[0].wake.clone()
}

fn visibility(scene: &Scene) -> Visibility {
    wake(scene).visibility.unwrap()
}

/// Root mean square of the change that a visibility states.
fn change(visibility: Visibility) -> f64 {
    10f64.powf(0.1 * visibility.contrast_db) - 1.0
}

/// The relative change of the expected image by the wake.
fn expected_change(scene: &Scene) -> Vec<f64> {
    let level = expected_intensity(&open_sea(scene.clone())).unwrap().mean();
    let image = expected_intensity(scene).unwrap();
    image
        .values
        .iter()
        .map(|&v| f64::from(v) / level - 1.0)
        .collect()
}

/// Distance astern of the stern and off the track of every pixel.
fn places(scene: &Scene) -> Vec<[f64; 2]> {
    let (raster, ship) = (raster(scene), &scene.ships[0]);
    let (sin, cos) = ship.heading.to_radians().sin_cos();
    (0..raster.len())
        .map(|n| {
            let dx = raster.x(n % raster.columns) - ship.position[0];
            let dy = raster.y(n / raster.columns) - ship.position[1];
            [
                -(dx * sin + dy * cos) - 0.5 * ship.length,
                dx * cos - dy * sin,
            ]
        })
        .collect()
}

/// Pixels of the wedge astern of the stern, up to the end of what the label calls visible.
fn wedge(scene: &Scene, length: f64) -> Vec<bool> {
    let ship = &scene.ships[0];
    let tan = half_angle(ship.speed, scene.sea.depth).tan();
    let inside = |[astern, aside]: [f64; 2]| {
        let from_bow = astern + ship.length;
        astern > 0.0 && from_bow <= length && aside.abs() <= tan * from_bow
    };
    places(scene).into_iter().map(inside).collect()
}

fn rms(values: &[f64], inside: &[bool]) -> f64 {
    let squares = values.iter().zip(inside).filter(|(_, i)| **i);
    let (sum, count) = squares.fold((0.0, 0.0), |(s, n), (v, _)| (s + v * v, n + 1.0));
    (sum / f64::from(count as u32)).sqrt()
}

fn length_m(scene: &Scene) -> f64 {
    wake(scene).length_px * scene.grid.spacing
}

/// The linear image is good to a quarter at 5 and 7 m/s, and some more at headings where tilt and bunching are as strong
/// as each other; at 3 m/s, where the wake changes the image by half, its harmonics are missing.
#[test]
fn the_contrast_is_that_of_the_expected_image() {
    for heading in [50, 20, 80] {
        for wind in [3, 5, 7] {
            let scene = scene(&[
                &format!("sea.wind_speed={wind}"),
                &format!("ship.heading={heading}"),
            ]);
            let stated = change(visibility(&scene));
            let seen = rms(&expected_change(&scene), &wedge(&scene, length_m(&scene)));
            println!("heading {heading} wind {wind}: stated {stated:.4} seen {seen:.4}");
            let ratio = stated / seen;
            let limits = if wind > 3 { 0.7..1.3 } else { 0.5..1.5 };
            assert!(
                limits.contains(&ratio),
                "heading {heading} wind {wind}: stated {stated:.4} seen {seen:.4}"
            );
        }
    }
}

/// What the label's image lacks, harmonics and the waves' displacement of each other, is to what it has as the change of the
/// image is to 1. So a wake of waves a tenth as high (a ship of a tenth of the beam is as long and as deep), which changes the
/// image by 0.04 to 0.13, is good to a tenth, rows and windows of 64 m included.
#[test]
fn the_contrast_of_a_weak_wake_is_that_of_the_expected_image() {
    for (heading, wind) in [(50, 3), (50, 5), (50, 7), (20, 3)] {
        let scene = scene(&[
            &format!("sea.wind_speed={wind}"),
            &format!("ship.heading={heading}"),
            "ship.beam=2.6",
            WITHOUT_DARK_LINE,
        ]);
        let stated = change(visibility(&scene));
        // What is not seen at all counts in all of the wedge.
        let length = match length_m(&scene) {
            0.0 => f64::INFINITY,
            length => length,
        };
        let seen = rms(&expected_change(&scene), &wedge(&scene, length));
        println!("heading {heading} wind {wind}: stated {stated:.4} seen {seen:.4}");
        assert!(
            (stated / seen - 1.0).abs() < 0.1,
            "heading {heading} wind {wind}: stated {stated:.4} seen {seen:.4}"
        );
    }
}

#[test]
fn the_noise_is_that_of_the_simulated_image() {
    for (wind, looks) in [(3, 4), (5, 4), (7, 4), (5, 1), (5, 100)] {
        let scene = scene(&[
            &format!("sea.wind_speed={wind}"),
            &format!("radar.looks={looks}"),
        ]);
        let visibility = visibility(&scene);
        let stated = change(visibility) / visibility.snr;
        let mut sum = 0.0;
        for seed in 0..4 {
            let image = run(&open_sea(Scene {
                seed,
                ..scene.clone()
            }))
            .speckled;
            let mean = image.mean();
            let square = |f: &Field| {
                f.values
                    .iter()
                    .map(|&v| (f64::from(v) / mean - 1.0).powi(2))
                    .sum::<f64>()
            };
            sum += square(&image) / image.values.len() as f64 / 4.0;
        }
        let seen = sum.sqrt();
        println!("wind {wind} looks {looks}: stated {stated:.4} seen {seen:.4}");
        // Speckle alone is exact; where there is little of it, the linear image of the sea is left, good to a tenth.
        let limit = if looks > 10 { 0.1 } else { 0.03 };
        assert!(
            (stated / seen - 1.0).abs() < limit,
            "wind {wind} looks {looks}: stated {stated:.4} seen {seen:.4}"
        );
    }
}

#[test]
fn visibility_falls_with_wind_and_rises_with_looks() {
    let snr = |assignments: &[&str]| visibility(&scene(assignments)).snr;
    let winds = ["3", "5", "7"].map(|wind| snr(&[&format!("sea.wind_speed={wind}")]));
    assert!(winds[0] > winds[1] && winds[1] > winds[2], "{winds:?}");
    let looks = ["1", "4", "16"].map(|looks| snr(&[&format!("radar.looks={looks}")]));
    assert!(looks[0] < looks[1] && looks[1] < looks[2], "{looks:?}");
}

/// Terms of a sea without the dark line.
const WITHOUT_DARK_LINE: &str = "model.terms=[\"sea\", \"kelvin\", \"tilt_average\", \"specular\", \"range_bunching\", \"hydrodynamic\", \"bunching\", \"coherence\", \"speckle\"]";

/// Waves of 4 m on pixels of 4 m that are computed as they are: none is carried. With a dark line the box holds that alone, without it there is none.
#[test]
fn no_wave_and_no_dark_line_have_no_box() {
    let slow = scene(&["ship.speed=2.5", "grid.oversampling=1"]);
    let line = wake(&slow);
    assert!(line.arms_px.is_empty() && line.box_px.is_some());
    let across = line.oriented_box_px.unwrap();
    let width = (across[0][0] - across[1][0]).hypot(across[0][1] - across[1][1]);
    // Two standard deviations to each side of at most 50 m: the wake's 26 m of beam after a kilometre, and the smear.
    assert!(width * 4.0 < 200.0, "{width}");
    let nothing = wake(&slow.with_assignments(&[WITHOUT_DARK_LINE]).unwrap());
    assert_eq!(
        (nothing.box_px, nothing.oriented_box_px, nothing.length_px),
        (None, None, 0.0)
    );
    assert!(nothing.arms_px.is_empty() && nothing.centreline_px.is_empty());
    assert_eq!(
        nothing.visibility,
        Some(Visibility {
            contrast_db: 0.0,
            snr: 0.0
        })
    );
}

/// The turbulent wake with its edges, without waves: the same, over the windows on the track. It is no linear image; along a
/// row of windows of 64 m the edges change by some 64 m over the kilometre they have come from, 5 %.
#[test]
fn the_contrast_of_edges_is_that_of_the_expected_image() {
    let terms = "model.terms=[\"sea\", \"turbulent\", \"edge\", \"tilt_average\", \"specular\", \"bunching\", \"coherence\", \"speckle\"]";
    for (heading, wind_toward) in [(20, 100), (60, 150), (50, 320)] {
        let place = [
            terms,
            "ship.edge=true",
            "ship.edge_time=900",
            &format!("ship.heading={heading}"),
            &format!("sea.wind_toward={wind_toward}"),
        ];
        let with = scene(&place);
        let mut without = with.clone();
        (without.ships[0].edge, without.ships[0].edge_time) = (false, None);
        let stated = change(visibility(&with));
        assert!(stated > 1.2 * change(visibility(&without)), "{heading}");
        // Windows of 64 m on the track and beside it reach 96 m.
        let length = length_m(&with);
        let inside: Vec<bool> = places(&with)
            .into_iter()
            .map(|[astern, aside]| astern > 0.0 && astern + 195.0 <= length && aside.abs() <= 96.0)
            .collect();
        let seen = rms(&expected_change(&with), &inside);
        println!("heading {heading} wind toward {wind_toward}: stated {stated:.4} seen {seen:.4}");
        assert!(
            (0.95..1.05).contains(&(stated / seen)),
            "heading {heading}: stated {stated:.4} seen {seen:.4}"
        );
    }
}

/// Waves that the pixels do not carry roughen the wedge: it is the brighter the nearer to the track, and the label says so: to the two digits of
/// its means over slopes, the 5 % of its table, and what its windows of 64 m blur of a wedge some 100 m wide.
#[test]
fn the_contrast_of_short_waves_is_that_of_the_expected_image() {
    let terms = "model.terms=[\"sea\", \"unresolved\", \"tilt_average\", \"specular\", \"bunching\", \"coherence\", \"speckle\", \"response\"]";
    for (sensor, heading, incidence) in [
        ("alos-2-sm10", 40, 35),
        ("sentinel-1-iw", 20, 35),
        ("novasar-1", 356, 28),
    ] {
        let with = scene(&[
            terms,
            &format!("radar.sensor=\"{sensor}\""),
            &format!("radar.incidence={incidence}"),
            "ship.position=[300, 560]",
            &format!("ship.heading={heading}"),
            "sea.wind_speed=5",
        ]);
        let stated = change(visibility(&with));
        let without = with
            .with_assignments(&[&terms.replace("\"unresolved\", ", "")])
            .unwrap();
        assert!(change(visibility(&without)) < 1e-9, "{sensor}");
        let seen = rms(&expected_change(&with), &wedge(&with, length_m(&with)));
        println!("{sensor} heading {heading}: stated {stated:.4} seen {seen:.4}");
        assert!(
            (0.9..1.1).contains(&(stated / seen)),
            "{sensor} heading {heading}: stated {stated:.4} seen {seen:.4}"
        );
    }
}

/// A wake across 4 km, its waves alone.
fn across_the_image(wind: u32, heading: u32) -> Scene {
    scene(&[
        WITHOUT_DARK_LINE,
        "grid.rows=1024",
        "grid.columns=1024",
        "radar.looks=1",
        &format!(
            "ship.position=[{}, 1500]",
            if heading < 180 { 1500 } else { -1500 }
        ),
        &format!("ship.heading={heading}"),
        &format!("sea.wind_speed={wind}"),
    ])
}

/// Distance from the bow to the middle of the farthest window of 16 × 16 pixels of the expected image that differs from
/// the sea by some multiples of a pixel's noise \[m\].
fn farthest_seen<const N: usize>(scene: &Scene, multiples: [f64; N]) -> [f64; N] {
    let noise = change(visibility(scene)) / visibility(scene).snr;
    let (seen, places) = (expected_change(scene), places(scene));
    let mut farthest = [0.0f64; N];
    for block in 0..64 * 64 {
        let [top, left] = [block / 64 * 16, block % 64 * 16];
        let pixels = (0..256).map(|n| (top + n / 16) * 1024 + left + n % 16);
        let change = pixels.map(|n| seen[n] * seen[n]).sum::<f64>().sqrt();
        let [astern, _] = places[(top + 8) * 1024 + left + 8];
        for (farthest, multiple) in farthest.iter_mut().zip(multiples) {
            if change >= multiple * noise && astern > 0.0 {
                *farthest = farthest.max(astern + 195.0);
            }
        }
    }
    farthest
}

/// Where the expected image differs from the sea by five times the noise of a pixel in windows of 16 × 16 pixels all across
/// the image, the label does not end before: a wake of 195 m ship's length, 4 km long. Windows of the image count to their
/// middle, up to 45 m from the next one's along the track; the label's end is half a window of 64 m beyond its last middle.
#[test]
fn a_wake_seen_to_the_edge_is_not_cut_short() {
    for (wind, heading) in [(5, 50), (7, 50), (7, 300)] {
        let scene = across_the_image(wind, heading);
        let [farthest] = farthest_seen(&scene, [5.0]);
        let stated = length_m(&scene);
        println!("wind {wind} heading {heading}: stated {stated} seen {farthest}");
        assert!(
            (stated - farthest).abs() <= 77.0,
            "wind {wind} heading {heading}: stated {stated} seen {farthest}"
        );
    }
}

/// The contrast is good to three tenths, as above, and that of arms falls by
/// the cube root of the distance: the end of a faint wake lies between those at so much more and so much less contrast, and
/// the 77 m of windows.
#[test]
fn a_faint_wake_ends_where_the_error_of_its_contrast_can_move_it() {
    for wind in [8, 10] {
        for heading in [50, 80, 300] {
            let scene = across_the_image(wind, heading);
            let [far, near] = farthest_seen(&scene, [5.0 * 0.7, 5.0 * 1.3]);
            let stated = length_m(&scene);
            println!("wind {wind} heading {heading}: stated {stated} seen {near} to {far}");
            assert!(near > 195.0 && (near - 77.0..far + 77.0).contains(&stated));
        }
    }
}

/// Pixels of 8, 4 and 2 m that sample one impulse response show the same wake: visible as far to half a window of 16 resolutions,
/// which the borders of the image cut elsewhere, and with the same contrast and noise to the share of a window in its length. In a
/// window of 16 of the finest pixels, which has two independent ones, the wake would not be visible.
#[test]
fn visibility_does_not_depend_on_how_finely_an_image_is_sampled() {
    let of = |pixels: u32, spacing: u32| {
        let scene = Scene::default()
            .with_assignments(&[
                &format!("grid.rows={pixels}"),
                &format!("grid.columns={pixels}"),
                &format!("grid.spacing={spacing}"),
                "ship.heading=50",
                "ship.position=[900, 800]",
                "sea.wind_speed=9",
                "radar.looks=4",
                "radar.resolution=12",
                "radar.range_resolution=12",
                "model.terms=all",
            ])
            .unwrap();
        let Visibility { contrast_db, snr } = visibility(&scene);
        println!(
            "{spacing} m: {:.0} m, {contrast_db:.3} dB, {snr:.3}",
            length_m(&scene)
        );
        (length_m(&scene), contrast_db, snr)
    };
    let (length, contrast, snr) = of(300, 8);
    let window = 16.0 * 12.0;
    assert!(length > 2.0 * window, "{length}");
    for (pixels, spacing) in [(600, 4), (1200, 2)] {
        let finer = of(pixels, spacing);
        assert!(
            (finer.0 - length).abs() <= 0.5 * window,
            "{length} {finer:?}"
        );
        let share = window / length;
        assert!(
            (finer.1 / contrast - 1.0).abs() < share,
            "{contrast} {finer:?}"
        );
        assert!((finer.2 / snr - 1.0).abs() < share, "{snr} {finer:?}");
    }
}
