//! Attack on the readers of satellite products, of ships and of land, which need no burn; as `main.rs`.
//!
//! ```text
//! cargo test -p wake --no-default-features --features checks --test fuzz_products
//! ```

mod attack;
mod mutation;

use std::path::Path;

use attack::{attack, said, said_harmlessly, with_file};
use wake_geo::{Land, Product, locate};
use wake_product::read_ships;

/// Opens a product, asks for places, and reads a window.
fn open(path: &Path) {
    let Some(product) = said_harmlessly(Product::open(path)) else {
        return;
    };
    let (lines, pixels) = product.size();
    let (line, pixel) = (lines - 1, pixels / 2);
    if let Some(located) = said_harmlessly(locate(&product, line, pixel, Some(100.0))) {
        product.pixel_of(located.latitude, located.longitude);
        said(product.axes(line as f64, pixel as f64));
    }
    let (first, left) = (lines.saturating_sub(64), pixels.saturating_sub(64));
    said_harmlessly(product.read_window(first..lines, left..pixels));
    // What can be read can be cut, or is refused.
    if let (Some(sentinel), 64..=512, 64..=512) = (product.sentinel1(), lines, pixels) {
        let out = tempfile::tempdir().expect("a folder");
        let cut = sentinel.write_part(out.path(), 0..lines, 0..pixels, |_, _| Ok(()));
        if let Some(path) = said(cut) {
            said(Product::open(path));
        }
    }
}

#[test]
fn ships_and_land() {
    let folder = tempfile::tempdir().expect("a folder");
    attack("ships", |input| {
        with_file(folder.path(), "ships.geojson", input, |path| {
            said(read_ships(path));
        });
    });
    attack("land", |input| {
        with_file(folder.path(), "land.geojson", input, |path| {
            said(Land::read(path));
        });
    });
}

#[test]
fn geotiffs() {
    let folder = tempfile::tempdir().expect("a folder");
    attack("geotiff", |input| {
        with_file(folder.path(), "image.tif", input, open);
    });
}

#[test]
fn archives() {
    let folder = tempfile::tempdir().expect("a folder");
    attack("archive", |input| {
        with_file(folder.path(), "product.zip", input, open);
    });
}

/// A `.SAFE` folder, of which the input is one file or the other.
#[test]
fn safe_folders() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/safe");
    let stem = "s1a-iw-grd-vv-20210101t000000-20210101t000025-036000-000001-001";
    let folder = tempfile::tempdir().expect("a folder");
    let calibration = folder.path().join("annotation/calibration");
    std::fs::create_dir_all(&calibration).expect("a folder");
    let files = [
        (
            "annotation.xml",
            folder.path().join("annotation"),
            format!("{stem}.xml"),
        ),
        (
            "calibration.xml",
            calibration.clone(),
            format!("calibration-{stem}.xml"),
        ),
        ("noise.xml", calibration, format!("noise-{stem}.xml")),
    ];
    let restore = |(name, folder, file): &(&str, std::path::PathBuf, String)| {
        std::fs::copy(corpus.join(name), folder.join(file)).expect("a file of the corpus");
    };
    files.iter().for_each(restore);
    said(Product::open(folder.path())).expect("the corpus is a product");
    attack("safe", |input| {
        for file in &files {
            with_file(&file.1, &file.2, input, |_| open(folder.path()));
            restore(file);
        }
    });
}
