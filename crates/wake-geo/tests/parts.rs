//! Products written with the annotation of others.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use std::ops::Range;

use common::{PRODUCTS, packed};
use wake_geo::{Polarization, Product, Sentinel1};

fn number(line: usize, pixel: usize) -> u16 {
    (1 + (line * 7 + pixel * 3) % 900) as u16
}

fn write(product: &str, lines: Range<usize>, pixels: Range<usize>) -> (tempfile::TempDir, Product) {
    let folder = tempfile::tempdir().unwrap();
    let template = Sentinel1::open(&packed(product), Some(Polarization::VV)).unwrap();
    let count = pixels.len();
    let written = template.write_part(folder.path(), lines, pixels, |rows, out| {
        let first = rows.start;
        for (n, value) in out.iter_mut().enumerate() {
            *value = number(first + n / count, n % count);
        }
        Ok(())
    });
    let product = Product::open(written.unwrap()).unwrap();
    (folder, product)
}

/// A part and the whole product have the same places, times, incidence, calibration and noise, and σ⁰ follows from both.
#[test]
fn a_part_lies_where_it_lay() {
    for name in PRODUCTS {
        let whole = Product::open(packed(name)).unwrap();
        for (lines, pixels) in [
            (700..1200, 9000..9600),
            (0..400, 20_000..20_800),
            (15_800..16_500, 0..512),
        ] {
            let (_folder, part) = write(name, lines.clone(), pixels.clone());
            assert_eq!(part.size(), (lines.len(), pixels.len()));
            let window = part.read_window(0..lines.len(), 0..pixels.len()).unwrap();
            for (line, pixel) in [
                (0, 0),
                (lines.len() - 1, pixels.len() - 1),
                (137, 301),
                (399, 44),
                (5, 499),
            ] {
                let [l, p] = [lines.start + line, pixels.start + pixel];
                let there = whole.place(l as f64, p as f64).unwrap();
                let here = part.place(line as f64, pixel as f64).unwrap();
                // The grid of the whole is bilinear in cells of 1,000 pixels; a part that lies in several cells has a grid of
                // its own, whose points are on that of the whole: both differ by the bend inside a cell of the part.
                assert!(
                    (there.latitude - here.latitude).abs() < 2e-6,
                    "{there:?} {here:?}"
                );
                assert!(
                    (there.longitude - here.longitude).abs() < 2e-6,
                    "{there:?} {here:?}"
                );
                assert!((there.incidence.unwrap() - here.incidence.unwrap()).abs() < 2e-4);
                let [a, b] = [&whole, &part].map(|product| product.sentinel1().unwrap());
                let [x, y] = [
                    a.calibration(l as f64, p as f64),
                    b.calibration(line as f64, pixel as f64),
                ];
                // Ten digits are written of both tables, six of the azimuth profile.
                assert!((x.sigma_nought_lut / y.sigma_nought_lut - 1.0).abs() < 1e-8);
                // The noise of the older product is removed already: 0.
                assert!((x.noise - y.noise).abs() <= 2e-6 * x.noise, "{x:?} {y:?}");
                let [s, t] = [a, b].map(|s| s.annotation().clone());
                let seconds = t
                    .line_time(line as f64)
                    .seconds_since(s.line_time(l as f64));
                assert!(seconds.abs() < 2e-6, "{seconds}");
                let expected = y.sigma_nought(f64::from(number(line, pixel)));
                let found = f64::from(window.line(line)[pixel]);
                assert!(
                    (found - expected).abs() < 1e-5 * expected.max(1e-3),
                    "{found} {expected}"
                );
            }
        }
    }
}

/// A whole product has the geolocation grid that it was made from.
#[test]
fn a_cut_of_a_cut_is_a_cut() {
    let (_folder, part) = write(PRODUCTS[1], 100..1100, 3000..4000);
    let sentinel = part.sentinel1().unwrap();
    let again = tempfile::tempdir().unwrap();
    let path = sentinel
        .write_part(again.path(), 200..500, 300..700, |_, out| {
            out.fill(5);
            Ok(())
        })
        .unwrap();
    let again = Product::open(path).unwrap();
    let [a, b] = [part.place(250.0, 400.0), again.place(50.0, 100.0)].map(Result::unwrap);
    assert!((a.latitude - b.latitude).abs() < 1e-7 && (a.longitude - b.longitude).abs() < 1e-7);
    let name = again.path().file_name().unwrap().to_str().unwrap();
    assert!(name.starts_with("S1A_IW_GRDH_1SSV_20210119T0316"), "{name}");
}

#[test]
fn what_cannot_be_cut_is_refused_and_leaves_nothing() {
    let template = Sentinel1::open(&packed(PRODUCTS[1]), None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new");
    for (lines, pixels) in [(0..60, 0..500), (0..500, 25_500..26_500), (0..0, 0..0)] {
        let refused = template.write_part(&out, lines, pixels, |_, _| Ok(()));
        let sentence = refused.unwrap_err().to_string();
        assert!(sentence.contains("at least 64"), "{sentence}");
    }
    assert!(!out.exists());
    let fails = |_: Range<usize>, _: &mut [u16]| {
        Err(template
            .write_part(&out, 0..1, 0..1, |_, _| Ok(()))
            .unwrap_err())
    };
    template
        .write_part(&out, 0..300, 0..300, fails)
        .unwrap_err();
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
    let fine = || template.write_part(&out, 0..300, 0..300, |_, _| Ok(()));
    fine().unwrap();
    assert!(
        fine()
            .unwrap_err()
            .to_string()
            .contains("exists; choose another folder")
    );
}
