//! Ships on the map become a simulated product, and its wakes become ships on the map again.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use wake_detector::Detector;
use wake_detector::burn::tensor::Device;
use wake_geo::{Product, destination, track};
use wake_map::{MappedWake, Search, csv, geojson, html, mapped, search};
use wake_product::{Options, ShipAt, Wind, simulate};

fn template() -> Product {
    let name = "S1A_IW_GRDH_1SDV_20210119T031653_20210119T031718_036201_043ED0_8255.zip";
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../wake-geo/tests/fixtures");
    Product::open(fixtures.join(name)).unwrap()
}

/// Lines, pixels, headings from north, and speeds of three ships on 11 x 13 km of sea.
const SHIPS: [[f64; 4]; 3] = [
    [5300.0, 14_400.0, 125.0, 9.0],
    [5350.0, 15_100.0, 310.0, 7.0],
    [5850.0, 14_700.0, 250.0, 10.0],
];

/// Tolerances: 150 m, one degree (two steps of the fitted axis), and 0.5 m/s (twice the largest standard deviation of a reported radial velocity).
#[test]
fn ships_are_found_where_they_were_put() {
    let whole = template();
    let ships = SHIPS.map(|[line, pixel, heading, speed]| {
        let place = whole.place(line, pixel).unwrap();
        ShipAt {
            latitude: place.latitude,
            longitude: place.longitude,
            heading,
            speed,
            length: 200.0,
            beam: 28.0,
            draft: 10.0,
        }
    });
    let options = Options {
        lines: Some(5000..6100),
        pixels: Some(14_000..15_300),
        wind: Wind {
            speed: 4.5,
            toward: 60.0,
        },
        seed: 2,
        changes: Vec::new(),
    };
    let folder = tempfile::tempdir().unwrap();
    let written = simulate(&whole, &ships, &options, folder.path(), &mut |_| ()).unwrap();
    let product = Product::open(&written.product).unwrap();
    let detector = Detector::pretrained(&Device::default()).unwrap();
    let detector = detector.with_spacing(10.0).unwrap();
    let state = folder.path().join("search.jsonl");
    let how = Search {
        state: Some(&state),
        ..Search::default()
    };
    let found = search(&product, &detector, how, &|_, _| ()).unwrap();
    // What is noted is not searched again, and is the same.
    let again = search(&product, &detector, how, &|_, _| ()).unwrap();
    assert_eq!(found, again);
    let wakes = mapped(&product, &found).unwrap();
    for ship in &ships {
        let stern = destination(
            (ship.latitude, ship.longitude),
            ship.heading + 180.0,
            0.5 * ship.length,
        );
        let away = |wake: &MappedWake| {
            let [longitude, latitude] = wake.tip.unwrap();
            track(stern, (latitude, longitude)).distance
        };
        let near = wakes
            .iter()
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap();
        assert!(near.sure && away(near) < 150.0, "{ship:?} {near:?}");
        let turn = (near.heading.unwrap() - ship.heading + 180.0).rem_euclid(360.0) - 180.0;
        assert!(turn.abs() < 1.0, "{turn}: {near:?}");
        let (line, pixel) = product.pixel_of(ship.latitude, ship.longitude).unwrap();
        let axes = product.axes(line, pixel).unwrap();
        let along = (ship.heading - axes.pixel_azimuth).to_radians().cos();
        let toward = -ship.speed * along * near.incidence.unwrap().to_radians().sin();
        let read = near.echo.unwrap().radial_velocity.unwrap();
        assert!((read - toward).abs() < 0.5, "{read} {toward}");
    }
    let sure = wakes.iter().filter(|wake| wake.sure).count();
    assert!(sure <= 4, "{sure} wakes of three ships");
    let collection = geojson(&wakes, "a product");
    let lines = collection["features"].as_array().unwrap().iter();
    let lines = lines
        .filter(|f| f["geometry"]["type"] == "LineString")
        .count();
    assert_eq!(lines, wakes.len());
    assert_eq!(csv(&wakes).lines().count(), wakes.len() + 1);
    let page = html(&wakes, "a product", [1300, 1100], b"", &[]);
    assert!(page.contains("\"radial_velocity_m_s\""));
}
