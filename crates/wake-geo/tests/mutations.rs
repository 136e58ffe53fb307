//! Files changed at random give a value or a sentence: no panic, no hang, no memory beyond the limits.
//!
//! `TMPDIR=/dev/shm MUTATIONS=1000000 cargo test --release -p wake-geo --test mutations` tries more.

mod common;

use std::path::Path;

use common::synthetic::{NAME, files};
use wake_geo::{
    Affine, Compression, GeoTiffLayout, GridPoint, Place, Placement, Product, locate, write_geotiff,
};
use zip::CompressionMethod;

/// Numbers of xorshift64*, from a fixed seed.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % end.max(1)
    }
}

const PIECES: [&[u8]; 18] = [
    b"nan",
    b"inf",
    b"-1",
    b"0",
    b"1e308",
    b"99999999999999999999",
    b"<a>",
    b"</a>",
    b"<!DOCTYPE",
    b"&x;",
    b"<![CDATA[",
    b" ",
    b"\0",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x00",
    b"\x01\x00\x00\x00",
    b"\xff\xff\xff\x7f",
    b".",
];

fn mutate(random: &mut Random, bytes: &mut Vec<u8>) {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let length = random.below(24).min(bytes.len() - at);
        let piece = PIECES[random.below(PIECES.len())];
        match random.below(7) {
            0 => drop(bytes.drain(at..at + length)),
            1 => {
                let copy = bytes[at..at + length].to_vec();
                drop(bytes.splice(at..at, copy));
            }
            2 => drop(bytes.splice(at..at, piece.iter().copied())),
            3 | 4 => {
                let end = (at + piece.len()).min(bytes.len());
                drop(bytes.splice(at..end, piece.iter().copied()));
            }
            5 => bytes.truncate(at),
            _ if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            _ => {}
        }
    }
}

fn count() -> usize {
    let count = std::env::var("MUTATIONS").ok();
    count.map_or(1000, |text| text.parse().expect("MUTATIONS is a number"))
}

/// Opens, locates and reads whatever there is.
fn attack(path: &Path) -> bool {
    let quiet = |sentence: String| {
        assert!(
            !sentence.contains(char::is_control) && sentence.len() < 3000,
            "{sentence:?}"
        );
    };
    let product = match Product::open(path) {
        Ok(product) => product,
        Err(error) => {
            quiet(error.to_string());
            return false;
        }
    };
    let (lines, pixels) = product.size();
    for (line, pixel) in [(0, 0), (lines - 1, pixels - 1), (lines / 2, pixels / 3)] {
        match locate(&product, line, pixel, Some(100.0)) {
            Ok(located) => {
                assert!(located.latitude.abs() < 1e3 && located.longitude.abs() < 1e3);
                product.pixel_of(located.latitude, located.longitude);
                let _ = product.axes(line as f64, pixel as f64);
            }
            Err(error) => quiet(error.to_string()),
        }
    }
    let (first, left) = (lines.saturating_sub(99), pixels.saturating_sub(150));
    match product.read_window(first..lines, left..pixels) {
        Ok(window) => assert_eq!(window.values.len(), (lines - first) * (pixels - left)),
        Err(error) => quiet(error.to_string()),
    }
    true
}

#[test]
fn changed_products() {
    let mut random = Random(7);
    let whole = files();
    let (_kept, safe) = common::folder_of(NAME, &whole);
    assert!(attack(&safe));
    let mut opened = 0;
    for _ in 0..count() {
        let file = random.below(whole.len());
        let mut bytes = whole[file].1.clone();
        mutate(&mut random, &mut bytes);
        let path = safe.join(&whole[file].0);
        std::fs::write(&path, &bytes).expect("a file");
        opened += usize::from(attack(&safe));
        std::fs::write(&path, &whole[file].1).expect("a file");
    }
    assert!(opened > count() / 20 && opened < count(), "{opened}");
}

#[test]
fn changed_archives() {
    let mut random = Random(11);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.zip");
    for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        common::zip_of(&path, "a.SAFE", &files(), method);
        let whole = std::fs::read(&path).expect("a file");
        for _ in 0..count() / 4 {
            let mut bytes = whole.clone();
            mutate(&mut random, &mut bytes);
            std::fs::write(&path, bytes).expect("a file");
            attack(&path);
        }
    }
}

#[test]
fn changed_tiffs() {
    let mut random = Random(13);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let points = [(0.0, 0.0), (0.0, 30.0), (20.0, 0.0), (20.0, 30.0)];
    let points = points.map(|(line, pixel)| GridPoint {
        line,
        pixel,
        place: Place {
            latitude: 50.0 + line,
            longitude: pixel,
            height: None,
            incidence: None,
            slant_range_time: None,
        },
    });
    let affine = |x, y, epsg| Placement::Affine {
        affine: Affine { x, y },
        epsg,
    };
    let placements = [
        Placement::None,
        Placement::ControlPoints(points.to_vec()),
        affine([10.0, 0.1, 0.0], [50.0, 0.0, -0.1], 4326),
        affine([5e5, 10.0, 2.0], [6e6, 2.0, -10.0], 32632),
    ];
    for placement in placements {
        for compression in [Compression::None, Compression::Deflate] {
            let layout = GeoTiffLayout {
                lines: 21,
                pixels: 31,
                compression,
                placement: placement.clone(),
                no_data: Some(0.0),
            };
            write_geotiff(&path, &layout, |_, out: &mut [i16]| {
                out.iter_mut().zip(0..).for_each(|(out, i)| *out = i);
                Ok(())
            })
            .expect("a file");
            attack_near(&mut random, &path, &std::fs::read(&path).expect("a file"));
        }
    }
    for entry in std::fs::read_dir(common::fixtures().join("gdal")).expect("a folder") {
        let whole = std::fs::read(entry.expect("an entry").path()).expect("a file");
        attack_near(&mut random, &path, &whole);
    }
}

/// Attacks with files near one, whose directory lies at an end.
fn attack_near(random: &mut Random, path: &Path, whole: &[u8]) {
    const DIRECTORY: usize = 400;
    for _ in 0..count() / 4 {
        let mut bytes = whole.to_vec();
        let length = bytes.len();
        match random.below(4) {
            0 => mutate(random, &mut bytes),
            1 => {
                let mut start = bytes.drain(..DIRECTORY.min(length)).collect();
                mutate(random, &mut start);
                bytes.splice(..0, start);
            }
            _ => {
                let mut end = bytes.split_off(length.saturating_sub(DIRECTORY));
                mutate(random, &mut end);
                bytes.extend(end);
            }
        }
        std::fs::write(path, bytes).expect("a file");
        attack(path);
    }
}
