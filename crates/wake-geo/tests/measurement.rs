//! σ⁰ of whole products with measurements.

mod common;

use std::path::Path;

use common::synthetic::{LINES, NAME, PIXELS, files, number};
use wake_geo::{Product, Values, locate};
use zip::CompressionMethod;

/// A window is what `locate` says of each of its pixels.
fn check(path: &Path) {
    let product = Product::open(path).expect("a product");
    assert!(product.has_pixels());
    assert_eq!(product.values(), Values::SigmaNought);
    for (lines, pixels) in [(0..LINES, 0..PIXELS), (5..60, 50..71), (89..90, 0..1)] {
        let window = product
            .read_window(lines.clone(), pixels.clone())
            .expect("a window");
        let (mut empty, mut dark) = (0, 0);
        for (i, line) in lines.enumerate() {
            for (&value, pixel) in window.line(i).iter().zip(pixels.clone()) {
                let located = locate(&product, line, pixel, None).expect("a place");
                let digital = f64::from(number(line, pixel));
                match located.sigma0 {
                    None => {
                        assert!(value.is_nan() && digital <= 0.0);
                        empty += 1;
                    }
                    Some(exact) => {
                        // The noise is subtracted from a power of at most 9e4, in 32 bits: a few 2⁻²⁴ of it.
                        let a = located.sigma_nought_lut.expect("known");
                        let rounding = 8.0 * f64::from(f32::EPSILON) * 9e4 / (a * a);
                        assert!(
                            (f64::from(value) - exact).abs() < rounding,
                            "{line} {pixel}"
                        );
                        assert!(exact >= 0.0);
                        dark += usize::from(digital * digital < located.noise.expect("known"));
                    }
                }
            }
        }
        assert_eq!((window.no_data, window.below_noise), (empty, dark));
    }
}

#[test]
fn windows_are_calibrated_in_folders_and_archives() {
    let (folder, safe) = common::folder_of(NAME, &files());
    check(&safe);
    check(&safe.join("manifest.safe"));
    let path = folder.path().join("product.zip");
    for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        common::zip_of(&path, &format!("{NAME}.SAFE"), &files(), method);
        check(&path);
    }
}

#[test]
fn intensity_keeps_the_noise_and_the_pixels_below_it() {
    let (_kept, safe) = common::folder_of(NAME, &files());
    let product = Product::open(&safe).expect("a product");
    let sentinel = product.sentinel1().expect("Sentinel-1");
    let (lines, pixels) = (5..60, 50..71);
    let window = sentinel
        .read_intensity(lines.clone(), pixels.clone())
        .expect("a window");
    let without = product
        .read_window(lines.clone(), pixels.clone())
        .expect("a window");
    assert_eq!((window.no_data, window.below_noise), (without.no_data, 0));
    assert!(without.below_noise > 0);
    for (i, line) in lines.enumerate() {
        for (&value, pixel) in window.line(i).iter().zip(pixels.clone()) {
            let digital = f64::from(number(line, pixel));
            let a = sentinel
                .calibration(line as f64, pixel as f64)
                .sigma_nought_lut;
            match digital > 0.0 {
                // The square, the table's 32 bits and the division: a few roundings.
                true => {
                    let exact = (digital / a).powi(2);
                    let rounding = 8.0 * f64::from(f32::EPSILON) * exact;
                    assert!(
                        (f64::from(value) - exact).abs() < rounding,
                        "{line} {pixel}"
                    );
                }
                false => assert!(value.is_nan()),
            }
        }
    }
    let error = sentinel.read_intensity(0..LINES + 1, 0..PIXELS);
    assert!(matches!(error, Err(wake_geo::Error::Window { .. })));
}

#[test]
fn noise_that_the_processor_removed_is_not_removed_again() {
    let mut files = files();
    let text = String::from_utf8(files[0].1.clone()).expect("text");
    let flag = "<thermalNoiseCorrectionPerformed>";
    files[0].1 = text
        .replace(&format!("{flag}false"), &format!("{flag}true"))
        .into_bytes();
    let (_kept, safe) = common::folder_of(NAME, &files);
    let product = Product::open(&safe).expect("a product");
    let located = locate(&product, 10, 20, Some(0.0)).expect("a place");
    assert_eq!((located.noise, located.sigma0), (Some(0.0), Some(0.0)));
    assert_eq!(
        product
            .read_window(0..LINES, 0..PIXELS)
            .expect("a window")
            .below_noise,
        0
    );
}

/// Threads read windows of one product at the same time.
#[test]
fn a_product_is_shared_by_threads() {
    let (_kept, safe) = common::folder_of(NAME, &files());
    let product = Product::open(&safe).expect("a product");
    let whole = product.read_window(0..LINES, 0..PIXELS).expect("a window");
    std::thread::scope(|scope| {
        for start in 0..4 {
            let (product, whole) = (&product, &whole);
            scope.spawn(move || {
                for line in (start..LINES).step_by(4) {
                    let row = product
                        .read_window(line..line + 1, 3..PIXELS)
                        .expect("a window");
                    let same = row
                        .values
                        .iter()
                        .zip(&whole.line(line)[3..])
                        .all(|(a, b)| a.to_bits() == b.to_bits());
                    assert!(same);
                }
            });
        }
    });
}
