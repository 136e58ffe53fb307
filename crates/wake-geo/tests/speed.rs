//! Time of reading a whole product by windows.
//!
//! `cargo test --release -p wake-geo --test speed -- --ignored --nocapture`

mod common;

use std::time::Instant;

use wake_geo::{Compression, GeoTiffLayout, Placement, Product, Window, write_geotiff};

#[test]
#[ignore = "writes 0.9 GB and measures time"]
fn windows_of_a_whole_product() {
    const SIDE: usize = 1024;
    let name = common::PRODUCTS[1];
    let (_kept, safe) = common::folder_of(name, &common::files(name));
    let annotation = std::fs::read_dir(safe.join("annotation")).expect("a folder");
    let mut names = annotation.map(|entry| entry.expect("an entry").path());
    let stem = names
        .find(|path| path.extension().is_some_and(|e| e == "xml"))
        .expect("an annotation");
    let measurement = safe.join("measurement");
    std::fs::create_dir(&measurement).expect("a folder");
    let path = measurement
        .join(stem.file_name().expect("a name"))
        .with_extension("tiff");

    let start = Instant::now();
    let product = Product::open(&safe).expect("a product");
    println!("open: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    let (lines, pixels) = product.size();
    let megapixels = (lines * pixels) as f64 * 1e-6;
    let layout = GeoTiffLayout {
        lines,
        pixels,
        compression: Compression::None,
        placement: Placement::None,
        no_data: None,
    };
    let start = Instant::now();
    write_geotiff(&path, &layout, |lines, out: &mut [u16]| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = (lines.start * 31 + i) as u16 % 500;
        }
        Ok(())
    })
    .expect("a measurement");
    println!(
        "write: {:.0} Mpixel/s",
        megapixels / start.elapsed().as_secs_f64()
    );

    let product = Product::open(&safe).expect("a product");
    for round in ["first", "second"] {
        let start = Instant::now();
        let mut sum = 0.0;
        let mut window = Window::default();
        for line in (0..lines).step_by(SIDE) {
            for pixel in (0..pixels).step_by(SIDE) {
                let (lines, pixels) = (
                    line..lines.min(line + SIDE),
                    pixel..pixels.min(pixel + SIDE),
                );
                product
                    .read_window_into(lines, pixels, &mut window)
                    .expect("a window");
                sum += f64::from(window.values[0]);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "σ⁰, {round} reading: {:.0} Mpixel/s ({sum:e})",
            megapixels / seconds
        );
    }
    let tiff = wake_geo::GeoTiff::open(&path).expect("a TIFF");
    assert_eq!((tiff.lines(), tiff.pixels()), (lines, pixels));
    let plain = Product::open(&path).expect("a TIFF");
    let start = Instant::now();
    for pixel in (0..pixels).step_by(SIDE) {
        plain
            .read_window(0..SIDE, pixel..pixels.min(pixel + SIDE))
            .expect("a window");
    }
    println!(
        "samples: {:.0} Mpixel/s",
        (SIDE * pixels) as f64 * 1e-6 / start.elapsed().as_secs_f64()
    );
    let start = Instant::now();
    let mut found = 0;
    for i in 0..100_000 {
        let t = f64::from(i) * 1e-5;
        let place = product
            .place(t * (lines - 1) as f64, (1.0 - t) * (pixels - 1) as f64)
            .expect("a place");
        found += usize::from(product.pixel_of(place.latitude, place.longitude).is_some());
    }
    println!(
        "place and back: {:.2} µs ({found} found)",
        start.elapsed().as_secs_f64() * 10.0
    );
}
