//! Places and calibration of two real products, beside an independent program.

mod common;

use serde_json::Value;
use wake_geo::{Product, locate};

fn number(value: &Value, key: &str) -> f64 {
    value[key]
        .as_f64()
        .unwrap_or_else(|| panic!("a number {key}"))
}

/// Every field of every golden point, through a `.zip` and through a folder.
#[test]
fn places_and_calibration_are_the_golden_ones() {
    let text = std::fs::read_to_string(common::fixtures().join("golden.json")).expect("the file");
    let golden: Value = serde_json::from_str(&text).expect("JSON");
    let mut count = 0;
    for name in common::PRODUCTS {
        let (_kept, safe) = common::folder_of(name, &common::files(name));
        let expected = &golden[format!("{name}.SAFE")];
        for path in [common::packed(name), safe] {
            let product = Product::open(&path).expect("a product");
            let annotation = product.sentinel1().expect("of Sentinel-1").annotation();
            assert_eq!(expected["lines"], annotation.lines);
            assert_eq!(expected["samples"], annotation.pixels);
            assert!((annotation.range_spacing - number(expected, "range_spacing_m")).abs() < 1e-12);
            assert!(
                (annotation.azimuth_spacing - number(expected, "azimuth_spacing_m")).abs() < 1e-12
            );
            assert!((annotation.platform_heading - number(expected, "heading_deg")).abs() < 1e-12);
            assert_eq!(
                format!("{:?}", annotation.pass),
                expected["pass"].as_str().expect("a pass")
            );
            for point in expected["points"].as_array().expect("points") {
                check(&product, point);
                count += 1;
            }
        }
    }
    assert_eq!(count, 240);
}

fn check(product: &Product, point: &Value) {
    let (line, pixel) = (number(point, "line"), number(point, "pixel"));
    let located = locate(product, line as usize, pixel as usize, Some(100.0)).expect("a place");
    let place = product.place(line, pixel).expect("a place");
    let near = |name: &str, value: f64, tolerance: f64| {
        let error = (value - number(point, name)).abs();
        assert!(error <= tolerance, "{name} at {line},{pixel}: {error:e}");
    };
    // Rounding of a bilinear form of numbers given to 16 digits: a few units in the last place.
    near("latitude", located.latitude, 1e-13);
    near("longitude", located.longitude, 1e-13);
    near("incidenceAngle", located.incidence.expect("known"), 1e-13);
    near(
        "slantRangeTime",
        located.slant_range_time.expect("known"),
        1e-17,
    );
    near("height", place.height.expect("known"), 1e-11);
    near(
        "sigma_nought_lut",
        located.sigma_nought_lut.expect("known"),
        1e-12,
    );
    near("noise", located.noise.expect("known"), 1e-11);
    near("sigma0_of_dn_100", located.sigma0.expect("known"), 1e-16);
    let (l, p) = product
        .pixel_of(located.latitude, located.longitude)
        .expect("inside");
    assert!(
        (l - line).abs() < 1e-6 && (p - pixel).abs() < 1e-6,
        "{line},{pixel}: {l},{p}"
    );
}

/// The lines and pixels of an image run as the platform flies and the radar looks.
#[test]
fn axes_agree_with_heading_and_spacing() {
    for name in common::PRODUCTS {
        let product = Product::open(common::packed(name)).expect("a product");
        let annotation = product.sentinel1().expect("of Sentinel-1").annotation();
        let (lines, pixels) = product.size();
        for (line, pixel) in [
            (0, 0),
            (lines / 2, pixels / 2),
            (lines - 1, pixels - 1),
            (0, pixels - 1),
        ] {
            let axes = product.axes(line as f64, pixel as f64).expect("axes");
            // The heading is the platform's own; between its track and the swath lie up to 9° of longitude, over which
            // meridians at 52° north converge by 7°.
            let turn =
                (axes.line_azimuth - annotation.platform_heading + 180.0).rem_euclid(360.0) - 180.0;
            assert!(turn.abs() < 7.0, "{turn}");
            let right = (axes.pixel_azimuth - axes.line_azimuth).rem_euclid(360.0);
            assert!((right - 90.0).abs() < 1.0, "{right}");
            // Lines follow each other at the speed of the radar's footprint, about 6.8 km/s; the annotation's spacing of
            // lines is nominal, up to 2 % less. Slopes of the terrain stretch pixels by as much.
            let speed = axes.line_spacing / annotation.line_interval;
            assert!((6700.0..6900.0).contains(&speed), "{axes:?}");
            assert!(
                (axes.line_spacing / annotation.azimuth_spacing - 1.0).abs() < 0.02,
                "{axes:?}"
            );
            assert!(
                (axes.pixel_spacing / annotation.range_spacing - 1.0).abs() < 0.02,
                "{axes:?}"
            );
            let ratio = product
                .range_to_velocity(line as f64, pixel as f64)
                .expect("inside")
                .expect("known");
            assert!((105.0..130.0).contains(&ratio), "{ratio}");
        }
    }
}

#[test]
fn the_annotation_is_read() {
    let product = Product::open(common::packed(common::PRODUCTS[1])).expect("a product");
    let sentinel1 = product.sentinel1().expect("of Sentinel-1");
    let annotation = sentinel1.annotation();
    assert_eq!(
        (annotation.mission.as_str(), annotation.mode.as_str()),
        ("S1A", "IW")
    );
    assert_eq!(annotation.absolute_orbit, 36201);
    assert_eq!(
        annotation.first_line_time.to_string(),
        "2021-01-19T03:16:53.799379"
    );
    // The last line's time follows from the first's and the interval.
    let last = annotation.line_time(annotation.lines as f64 - 1.0);
    assert!(last.seconds_since(annotation.last_line_time).abs() < 2e-6);
    assert_eq!(annotation.looks.len(), 3);
    assert_eq!(
        (
            annotation.looks[0].range_looks,
            annotation.looks[0].azimuth_looks
        ),
        (5, 1)
    );
    assert_eq!(annotation.equivalent_looks(), Some(4.4));
    assert!((7400.0..7700.0).contains(&annotation.platform_speed(0.0)));
    assert!(!annotation.noise_removed && !product.has_pixels() && product.has_places());
    let nesz = 10.0
        * sentinel1
            .noise_equivalent_sigma_nought(8000.0, 13000.0)
            .log10();
    assert!((-30.0..-20.0).contains(&nesz), "{nesz} dB");
}

#[test]
fn a_record_has_the_names_that_are_promised() {
    let product = Product::open(common::packed(common::PRODUCTS[0])).expect("a product");
    let record = |number| {
        let located = locate(&product, 7894, 12983, number).expect("a place");
        serde_json::to_value(located).expect("JSON")
    };
    let names = |record: &Value| -> Vec<String> {
        let mut names: Vec<String> = record
            .as_object()
            .expect("a record")
            .keys()
            .cloned()
            .collect();
        names.sort();
        names
    };
    let mut expected = [
        "line",
        "pixel",
        "latitude",
        "longitude",
        "incidence",
        "slant_range_time",
        "sigma_nought_lut",
        "noise",
        "sigma0",
    ];
    expected.sort_unstable();
    assert_eq!(names(&record(Some(100.0))), expected);
    assert!(!names(&record(None)).contains(&"sigma0".to_owned()));
    assert_eq!(record(None)["line"], 7894);
    assert!(
        locate(&product, 16685, 0, None)
            .expect_err("outside")
            .to_string()
            .contains("16685")
    );
    assert!(locate(&product, 0, 0, Some(f64::NAN)).is_err());
}
