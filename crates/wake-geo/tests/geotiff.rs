//! TIFF files that this crate writes, read back by windows, and files of other writers.

use std::path::Path;

use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression as Packed, Predictor, TiffEncoder, colortype};
use wake_geo::{
    Affine, Compression, GeoTiffLayout, GridPoint, Place, Placement, Product, SampleType,
    TiffSample, Values, write_geotiff,
};

const LINES: usize = 70;
const PIXELS: usize = 53;

fn level(line: usize, pixel: usize) -> u16 {
    (line * 131 + pixel * 7) as u16
}

fn layout(compression: Compression, placement: Placement) -> GeoTiffLayout {
    GeoTiffLayout {
        lines: LINES,
        pixels: PIXELS,
        compression,
        placement,
        no_data: None,
    }
}

fn write<T: TiffSample>(path: &Path, layout: &GeoTiffLayout, value: impl Fn(usize, usize) -> T) {
    write_geotiff(path, layout, |lines, out: &mut [T]| {
        for (line, row) in lines.zip(out.chunks_exact_mut(layout.pixels)) {
            for (pixel, out) in row.iter_mut().enumerate() {
                *out = value(line, pixel);
            }
        }
        Ok(())
    })
    .expect("a file");
}

/// Windows at the corners, inside, of one pixel, and the whole.
fn check_windows(path: &Path, value: impl Fn(usize, usize) -> f32) {
    let product = Product::open(path).expect("an image");
    assert_eq!(product.size(), (LINES, PIXELS));
    assert_eq!(product.values(), Values::Samples);
    for (lines, pixels) in [
        (0..LINES, 0..PIXELS),
        (3..41, 17..33),
        (69..70, 52..53),
        (0..1, 0..PIXELS),
        (30..LINES, 40..PIXELS),
    ] {
        let window = product
            .read_window(lines.clone(), pixels.clone())
            .expect("a window");
        for (i, line) in lines.clone().enumerate() {
            for (value_read, pixel) in window.line(i).iter().zip(pixels.clone()) {
                assert_eq!(
                    value_read.to_bits(),
                    value(line, pixel).to_bits(),
                    "{line} {pixel}"
                );
            }
        }
    }
}

#[test]
fn what_is_written_is_read_by_windows() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    for compression in [Compression::None, Compression::Deflate] {
        let layout = layout(compression, Placement::None);
        write::<u8>(&path, &layout, |l, p| level(l, p) as u8);
        check_windows(&path, |l, p| f32::from(level(l, p) as u8));
        write::<u16>(&path, &layout, level);
        check_windows(&path, |l, p| f32::from(level(l, p)));
        write::<i16>(&path, &layout, |l, p| level(l, p) as i16 - 3000);
        check_windows(&path, |l, p| f32::from(level(l, p) as i16 - 3000));
        write::<f32>(&path, &layout, |l, p| f32::from(level(l, p)).sqrt());
        check_windows(&path, |l, p| f32::from(level(l, p)).sqrt());
    }
    let missing = GeoTiffLayout {
        no_data: Some(0.0),
        ..layout(Compression::None, Placement::None)
    };
    write::<u16>(&path, &missing, |l, p| (l.min(p) > 2).into());
    let window = Product::open(&path)
        .expect("an image")
        .read_window(0..4, 0..4)
        .expect("a window");
    assert_eq!(
        (window.no_data, window.values[0].is_nan(), window.values[15]),
        (15, true, 1.0)
    );
}

/// Files of another writer: LZW, deflate and packbits, predictor, `BigTIFF`.
#[test]
fn compressed_files_of_others_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let levels: Vec<u16> = (0..LINES * PIXELS)
        .map(|i| level(i / PIXELS, i % PIXELS))
        .collect();
    for compression in [
        Packed::Lzw,
        Packed::Deflate(DeflateLevel::default()),
        Packed::Packbits,
        Packed::Uncompressed,
    ] {
        for predictor in [Predictor::None, Predictor::Horizontal] {
            for big in [false, true] {
                let file = std::fs::File::create(&path).expect("a file");
                let size = (PIXELS as u32, LINES as u32);
                let done = if big {
                    let encoder = TiffEncoder::new_big(file).expect("a TIFF");
                    let mut encoder = encoder
                        .with_compression(compression)
                        .with_predictor(predictor);
                    encoder.write_image::<colortype::Gray16>(size.0, size.1, &levels)
                } else {
                    let encoder = TiffEncoder::new(file).expect("a TIFF");
                    let mut encoder = encoder
                        .with_compression(compression)
                        .with_predictor(predictor);
                    encoder.write_image::<colortype::Gray16>(size.0, size.1, &levels)
                };
                done.expect("an image");
                let plain = matches!(compression, Packed::Packbits | Packed::Uncompressed);
                if plain && predictor != Predictor::None {
                    let why = Product::open(&path).expect_err("ambiguous").to_string();
                    assert!(why.contains("predictor"), "{why}");
                    continue;
                }
                check_windows(&path, |l, p| f32::from(level(l, p)));
            }
        }
    }
}

/// Files of GDAL: tiles and strips, both byte orders, predictors, bands, control points.
#[test]
fn files_of_gdal_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/gdal");
    type Value = fn(u16) -> f32;
    let files: [(&str, Value); 9] = [
        ("tiles_lzw_float", |v| f32::from(v) / 4.0),
        ("strips_lzw_bands", |v| v.into()),
        ("tiles_deflate_float", |v| f32::from(v) / 4.0),
        ("tiles_lzw_big_endian", |v| v.into()),
        ("strips_packbits", |v| (v % 251).into()),
        ("strips_signed_big", |v| f32::from(v) - 3000.0),
        ("bands_pixel", |v| v.into()),
        ("bands_line", |v| v.into()),
        ("points", |v| v.into()),
    ];
    for (name, value) in files {
        let path = folder.join(name).with_extension("tif");
        check_windows(&path, |l, p| value(level(l, p)));
        let place = Product::open(&path)
            .expect("an image")
            .place(0.0, 0.0)
            .expect("a place");
        // pyproj 3.7: 500005, 5999995 of EPSG:32632.
        let (latitude, longitude) = match name {
            "points" => (50.0, 7.0),
            _ => (54.14805916537192, 9.000076550075905),
        };
        assert!(
            (place.latitude - latitude).abs() < 1e-9,
            "{name}: {place:?}"
        );
        assert!(
            (place.longitude - longitude).abs() < 1e-9,
            "{name}: {place:?}"
        );
    }
}

fn affine(x: [f64; 3], y: [f64; 3], epsg: u16) -> Placement {
    Placement::Affine {
        affine: Affine { x, y },
        epsg,
    }
}

/// Places, and back to pixels, in all kinds of reference systems; coordinates from pyproj 3.7 (PROJ 9).
#[test]
fn affine_maps_lead_to_places_and_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    for (placement, latitude, longitude) in references() {
        write::<u8>(
            &path,
            &layout(Compression::None, placement.clone()),
            |_, _| 1,
        );
        let product = Product::open(&path).expect("an image");
        let place = product.place(0.0, 0.0).expect("a place");
        // 1 mm: proj4rs computes equal-area latitudes by a shorter series than PROJ does.
        assert!(
            (place.latitude - latitude).abs() < 1e-8,
            "{placement:?}: {place:?}"
        );
        assert!(
            (place.longitude - longitude).abs() < 1e-8,
            "{placement:?}: {place:?}"
        );
        for (line, pixel) in [(0.0, 0.0), (69.5, 52.5), (-0.5, -0.5), (33.3, 7.7)] {
            let place = product.place(line, pixel).expect("a place");
            let (l, p) = product
                .pixel_of(place.latitude, place.longitude)
                .expect("inside");
            assert!(
                (l - line).abs() < 1e-5 && (p - pixel).abs() < 1e-5,
                "{placement:?}: {l} {p}"
            );
        }
        assert_eq!(product.pixel_of(-latitude, longitude), None);
    }
}

/// Images, and where pyproj puts their first pixel.
fn references() -> Vec<(Placement, f64, f64)> {
    vec![
        (
            affine([10.5, 0.001, 0.0], [54.25, 0.0, -0.001], 4326),
            54.25,
            10.5,
        ),
        (
            affine([561234.5, 10.000, 0.0], [6012345.50, 0.0, -10.000], 32632),
            54.25539660866415,
            9.93994736383158,
        ),
        (
            affine([420000.0, 20.000, 0.0], [7500000.00, 0.0, -20.000], 32733),
            -22.604969814094602,
            14.221635079251303,
        ),
        (
            affine([1168854.5, 10.000, 0.0], [7206789.25, 0.0, -10.000], 3857),
            54.192978981377664,
            10.499998622618811,
        ),
        (
            affine([1168854.5, 10.000, 0.0], [7206789.25, 0.0, -10.000], 3395),
            54.37525212980686,
            10.499998622618811,
        ),
        (
            affine([400123.0, 10.000, 0.0], [5900456.00, 0.0, -10.000], 25832),
            53.243969672690774,
            7.503251544071776,
        ),
        (
            affine([600000.0, 10.000, 0.0], [4500000.00, 0.0, -10.000], 26917),
            40.6447996505625,
            -79.81730037733321,
        ),
        (
            affine([2100000.0, 40.000, 0.0], [1500000.00, 0.0, -40.000], 32661),
            85.40963177968833,
            11.309932474020215,
        ),
        (
            affine([2100000.0, 40.000, 0.0], [2500000.00, 0.0, -40.000], 32761),
            -85.40963177968833,
            11.309932474020215,
        ),
        (
            affine([500000.0, 40.000, 0.0], [-1500000.00, 0.0, -40.000], 3413),
            75.47914589440461,
            -26.56505117707799,
        ),
        (
            affine([500000.0, 40.000, 0.0], [-1500000.00, 0.0, -40.000], 3995),
            75.52215327006769,
            18.43494882292201,
        ),
        (
            affine([500000.0, 40.000, 0.0], [-1500000.00, 0.0, -40.000], 3996),
            75.67084582685885,
            18.43494882292201,
        ),
        (
            affine([-1500000.0, 40.000, 0.0], [800000.00, 0.0, -40.000], 3031),
            -74.4461466855041,
            -61.92751306414704,
        ),
        (
            affine([-1500000.0, 40.000, 0.0], [800000.00, 0.0, -40.000], 3976),
            -74.40001645555333,
            -61.92751306414704,
        ),
        (
            affine([4321500.0, 25.000, 0.0], [3310000.00, 0.0, -25.000], 3035),
            52.89868407892432,
            10.007429696710007,
        ),
        (
            affine([300000.0, 25.000, 0.0], [900000.00, 0.0, -25.000], 3571),
            81.49798129334296,
            -18.434948822922006,
        ),
        (
            affine([300000.0, 25.000, 0.0], [900000.00, 0.0, -25.000], 3575),
            81.49798129334296,
            171.56505117707798,
        ),
        (
            affine([300000.0, 25.000, 0.0], [900000.00, 0.0, -25.000], 6931),
            81.49798129334296,
            161.565051177078,
        ),
        (
            affine([300000.0, 25.000, 0.0], [900000.00, 0.0, -25.000], 6932),
            -81.49798129334296,
            18.43494882292201,
        ),
        (
            affine([3000000.0, 25.000, 0.0], [5000000.00, 0.0, -25.000], 6933),
            43.04919349973857,
            31.092503433638434,
        ),
        (
            affine([4100000.0, 25.000, 0.0], [2700000.00, 0.0, -25.000], 3034),
            51.05996714550053,
            11.47725697832125,
        ),
        (
            affine([652000.0, 10.000, 0.0], [6862000.00, 0.0, -10.000], 2154),
            48.85624814096273,
            2.345811958680679,
        ),
    ]
}

#[test]
fn axes_of_a_map_are_north_and_east_up_to_convergence() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let placement = affine([500_000.0, 10.0, 0.0], [6_000_000.0, 0.0, -10.0], 32632);
    write::<u8>(&path, &layout(Compression::None, placement), |_, _| 1);
    let axes = Product::open(&path)
        .expect("an image")
        .axes(0.0, 0.0)
        .expect("axes");
    // On the central meridian of UTM: no convergence, scale 0.9996.
    assert!((axes.line_azimuth - 180.0).abs() < 1e-4 && (axes.pixel_azimuth - 90.0).abs() < 1e-4);
    assert!((axes.line_spacing * 0.9996 - 10.0).abs() < 1e-6, "{axes:?}");
    assert!(
        (axes.pixel_spacing * 0.9996 - 10.0).abs() < 1e-6,
        "{axes:?}"
    );
}

#[test]
fn control_points_are_read_as_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let mut points = Vec::new();
    for line in [0.0, 30.0, 69.0] {
        for pixel in [0.0, 52.0] {
            points.push(GridPoint {
                line,
                pixel,
                place: Place {
                    latitude: 50.0 - 1e-4 * line,
                    longitude: 179.999 + 1e-4 * pixel,
                    height: Some(line),
                    incidence: None,
                    slant_range_time: None,
                },
            });
        }
    }
    write::<u16>(
        &path,
        &layout(
            Compression::Deflate,
            Placement::ControlPoints(points.clone()),
        ),
        level,
    );
    let product = Product::open(&path).expect("an image");
    let place = product.place(15.0, 26.0).expect("a place");
    assert!(
        (place.latitude - 49.9985).abs() < 1e-12 && (place.longitude + 179.9984).abs() < 1e-9,
        "{place:?}"
    );
    assert!((place.height.expect("known") - 15.0).abs() < 1e-12);
    let (line, pixel) = product
        .pixel_of(place.latitude, place.longitude)
        .expect("inside");
    assert!((line - 15.0).abs() < 1e-6 && (pixel - 26.0).abs() < 1e-6);
    points.pop();
    write::<u16>(
        &path,
        &layout(Compression::None, Placement::ControlPoints(points)),
        level,
    );
    let product = Product::open(&path).expect("an image without places");
    let why = product.place(0.0, 0.0).expect_err("no places").to_string();
    assert!(why.contains("control points"), "{why}");
    assert!(!product.has_places() && product.pixel_of(50.0, 180.0).is_none());
}

#[test]
fn images_without_places_have_pixels() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.dat");
    let levels: Vec<u8> = (0..LINES * PIXELS)
        .map(|i| level(i / PIXELS, i % PIXELS) as u8)
        .collect();
    image::save_buffer_with_format(
        &path,
        &levels,
        PIXELS as u32,
        LINES as u32,
        image::ColorType::L8,
        image::ImageFormat::Png,
    )
    .expect("a PNG");
    check_windows(&path, |l, p| f32::from(level(l, p) as u8));
    let product = Product::open(&path).expect("an image");
    assert!(
        product
            .place(0.0, 0.0)
            .expect_err("no places")
            .to_string()
            .contains("PNG and JPEG files have no geolocation")
    );
    let outside = product
        .read_window(0..71, 0..1)
        .expect_err("outside")
        .to_string();
    assert!(outside.contains("70 lines and 53 pixels"), "{outside}");
    assert!(product.read_window(1..1, 0..1).is_err());
    assert_eq!(SampleType::F32.bytes(), 4);
}

#[test]
fn files_appear_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let layout = layout(Compression::None, Placement::None);
    let failed = write_geotiff(&path, &layout, |_, _: &mut [u16]| {
        Product::open("/nowhere").map(drop)
    });
    assert!(failed.is_err());
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        0
    );
    let empty = GeoTiffLayout { lines: 0, ..layout };
    assert!(write_geotiff(&path, &empty, |_, _: &mut [u16]| Ok(())).is_err());
}

/// Files for `tests/foreign/read_geotiff.py`: u16 and f32, plain and deflated, with a map and with control points.
#[test]
#[ignore = "writes files for another program into the folder WAKE_GEO_OUT"]
fn files_for_others() {
    let folder = std::env::var_os("WAKE_GEO_OUT").expect("WAKE_GEO_OUT is a folder");
    let folder = Path::new(&folder);
    let upright = affine([500_000.0, 10.0, 0.0], [6_000_000.0, 0.0, -10.0], 32632);
    let turned = affine([500_000.0, 9.0, 1.0], [6_000_000.0, 1.0, -9.0], 32632);
    let points = [(0.0, 0.0), (0.0, 52.0), (69.0, 0.0), (69.0, 52.0)];
    let points = points.map(|(line, pixel)| GridPoint {
        line,
        pixel,
        place: Place {
            latitude: 50.0 - 1e-4 * line,
            longitude: 7.0 + 1e-4 * pixel,
            height: Some(12.5),
            incidence: None,
            slant_range_time: None,
        },
    });
    let points = Placement::ControlPoints(points.to_vec());
    for (name, placement) in [("upright", upright), ("turned", turned), ("points", points)] {
        for (kind, compression) in [
            ("plain", Compression::None),
            ("deflate", Compression::Deflate),
        ] {
            let layout = GeoTiffLayout {
                no_data: Some(0.0),
                ..layout(compression, placement.clone())
            };
            write::<u16>(
                &folder.join(format!("{name}_{kind}_u16.tif")),
                &layout,
                level,
            );
            write::<f32>(
                &folder.join(format!("{name}_{kind}_f32.tif")),
                &layout,
                |l, p| f32::from(level(l, p)) / 4.0,
            );
        }
    }
    let big = GeoTiffLayout {
        lines: 45_000,
        pixels: 25_000,
        compression: Compression::None,
        placement: Placement::None,
        no_data: None,
    };
    write::<f32>(&folder.join("big.tif"), &big, |l, p| {
        l as f32 + p as f32 / 32_768.0
    });
}
