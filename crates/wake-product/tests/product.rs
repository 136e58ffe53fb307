//! Products simulated on the annotation of a real one, read back through `wake-geo`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ops::Range;
use std::path::{Path, PathBuf};

use wake_geo::{Product, destination};
use wake_product::{Options, ShipAt, Wind, simulate};

/// The product of 2021, annotation alone.
fn template() -> Product {
    let name = "S1A_IW_GRDH_1SDV_20210119T031653_20210119T031718_036201_043ED0_8255.zip";
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../wake-geo/tests/fixtures");
    Product::open(fixtures.join(name)).unwrap()
}

fn options(lines: Range<usize>, pixels: Range<usize>) -> Options {
    Options {
        lines: Some(lines),
        pixels: Some(pixels),
        wind: Wind {
            speed: 4.0,
            toward: 120.0,
        },
        seed: 5,
        changes: Vec::new(),
    }
}

fn ship_at(line: f64, pixel: f64, heading: f64, speed: f64) -> ShipAt {
    let place = template().place(line, pixel).unwrap();
    ShipAt {
        latitude: place.latitude,
        longitude: place.longitude,
        heading,
        speed,
        length: 180.0,
        beam: 26.0,
        draft: 9.0,
    }
}

fn made(ships: &[ShipAt], options: &Options) -> (tempfile::TempDir, Product, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut lines = 0;
    let written = simulate(&template(), ships, options, folder.path(), &mut |n| {
        lines += n;
    })
    .unwrap();
    assert_eq!(lines, options.lines.as_ref().unwrap().len());
    (
        folder,
        Product::open(&written.product).unwrap(),
        written.ships,
    )
}

/// The echo of a ship that sails away from the radar lies behind it along azimuth, by R/V times its radial velocity, and its
/// wake lies astern by true north.
#[test]
fn a_ship_has_its_wake_astern_and_its_echo_displaced() {
    let (lines, pixels) = (4000..4700, 12_000..12_600);
    let at = [4350.0, 12_350.0];
    let whole = template();
    let axes = whole.axes(at[0], at[1]).unwrap();
    let place = whole.place(at[0], at[1]).unwrap();
    let speed = 8.0;
    // Away from the radar, and 40 degrees toward the direction of flight.
    let heading = axes.pixel_azimuth - 40.0;
    let ship = ship_at(at[0], at[1], heading, speed);
    let (_folder, product, ships) = made(
        std::slice::from_ref(&ship),
        &options(lines.clone(), pixels.clone()),
    );
    let truth = wake_product::read_ships(&ships).unwrap();
    assert_eq!(truth.len(), 1);
    assert!((truth[0].heading - heading).abs() < 1e-9);
    let image = product
        .read_window(0..lines.len(), 0..pixels.len())
        .unwrap();
    let away = speed * 40f64.to_radians().cos() * place.incidence.unwrap().to_radians().sin();
    let ratio = whole.range_to_velocity(at[0], at[1]).unwrap().unwrap();
    let expected = at[0] - lines.start as f64 - ratio * away / axes.line_spacing;
    let brightest =
        (0..image.values.len()).max_by(|&a, &b| image.values[a].total_cmp(&image.values[b]));
    let (line, pixel) = (
        brightest.unwrap() / pixels.len(),
        brightest.unwrap() % pixels.len(),
    );
    // Half the ship's length, two cells of resolution.
    assert!(
        (line as f64 - expected).abs() < 14.0,
        "line {line}, expected {expected}"
    );
    assert!(
        (pixel as f64 - (at[1] - pixels.start as f64)).abs() < 14.0,
        "pixel {pixel}"
    );

    // Mean along lines astern, and along lines 12 degrees off to both sides.
    let along = |turn: f64| -> f64 {
        let mut sum = 0.0;
        for step in 0..160 {
            let distance = 400.0 + 10.0 * f64::from(step);
            let there = destination(
                (place.latitude, place.longitude),
                heading + 180.0 + turn,
                distance,
            );
            let (line, pixel) = product.pixel_of(there.0, there.1).unwrap();
            for across in -3..=3 {
                let at = (line.round() as i64 + across) as usize;
                sum += f64::from(image.line(at)[pixel.round() as usize]);
            }
        }
        sum / (160.0 * 7.0)
    };
    let (wake, beside) = (along(0.0), 0.5 * (along(-12.0) + along(12.0)));
    // The turbulent wake is at least a tenth darker; the means of 1,120 pixels of 4.4 looks are known to 2 %.
    assert!(wake < 0.9 * beside, "{wake} {beside}");
}

/// Over several blocks: the brightness of the sea falls along range as in one scene, and no border of a block can be seen.
#[test]
fn blocks_leave_no_seams() {
    let (lines, pixels) = (2000..3300, 16_000..17_400);
    let calm = Options {
        changes: vec!["sea.gust_strength=0".to_owned()],
        ..options(lines.clone(), pixels.clone())
    };
    let (_folder, product, _) = made(&[], &calm);
    let image = product
        .read_window(0..lines.len(), 0..pixels.len())
        .unwrap();
    assert_eq!(image.no_data, 0);
    let moments = |rows: Range<usize>, columns: Range<usize>| -> [f64; 2] {
        let values = rows.flat_map(|row| &image.line(row)[columns.clone()]);
        let values: Vec<f64> = values.map(|&v| f64::from(v)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v / mean - 1.0).powi(2)).sum::<f64>();
        [mean, variance / values.len() as f64]
    };
    // Overlaps lie at 896 to 1,024 both ways.
    let inside = moments(300..428, 0..896);
    let overlap = moments(896..1024, 0..896);
    // 115,000 pixels, four in a cell of resolution, 4.4 looks: means to 0.3 %, variances to 1 %; the sea's own waves add the same.
    assert!(
        (overlap[0] / inside[0] - 1.0).abs() < 0.02,
        "{inside:?} {overlap:?}"
    );
    assert!(
        (overlap[1] / inside[1] - 1.0).abs() < 0.06,
        "{inside:?} {overlap:?}"
    );
    let columns = |range: Range<usize>| moments(0..896, range)[0].ln();
    let left = columns(768..896) - columns(640..768);
    let across = columns(1024..1152) - columns(896..1024);
    assert!(
        left < 0.0 && (across - left).abs() < 0.02,
        "{left} {across}"
    );
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new");
    let refused = |options: &Options| {
        let result = simulate(&template(), &[], options, &out, &mut |_| ());
        result.unwrap_err().to_string()
    };
    assert!(refused(&options(0..20, 0..500)).contains("at least 64"));
    let mut windy = options(0..500, 0..500);
    windy.wind.speed = 99.0;
    assert!(refused(&windy).contains("wind_speed"));
    let unknown = Options {
        changes: vec!["sea.colour=3".to_owned()],
        ..options(0..500, 0..500)
    };
    assert!(refused(&unknown).contains("colour"));
    assert!(!out.exists());
    let picture = folder.path().join("a.png");
    std::fs::write(&picture, b"\x89PNG\r\n\x1a\n").unwrap();
    assert!(Product::open(&picture).is_err());
}
