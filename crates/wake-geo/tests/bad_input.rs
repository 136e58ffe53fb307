//! Products that cannot be: one sentence each.

mod common;

use std::path::Path;

use common::synthetic::{NAME, STEM, files};
use wake_geo::{Polarization, Product, limits};
use zip::CompressionMethod;

type Files = Vec<(String, Vec<u8>)>;

const MEASUREMENT: usize = 3;

/// What opening a product, and reading it whole, says.
fn sentence(path: &Path) -> String {
    let read = Product::open(path).and_then(|product| {
        let (lines, pixels) = product.size();
        product.read_window(0..lines, 0..pixels)
    });
    let sentence = read.expect_err("a bad product").to_string();
    assert!(
        !sentence.contains(char::is_control) && sentence.len() < 1000,
        "{sentence}"
    );
    sentence
}

fn sentence_of(change: impl Fn(&mut Files)) -> String {
    let mut files = files();
    change(&mut files);
    let (_kept, safe) = common::folder_of(NAME, &files);
    sentence(&safe)
}

fn replaced(file: usize, from: &str, to: &str) -> String {
    sentence_of(|files| {
        let text = String::from_utf8(files[file].1.clone()).expect("text");
        assert!(text.contains(from), "{from}");
        files[file].1 = text.replacen(from, to, 1).into_bytes();
    })
}

fn says(sentence: &str, parts: &[&str]) {
    for part in parts {
        assert!(sentence.contains(part), "{part:?} is not in: {sentence}");
    }
}

/// Opening a pipe would wait for somebody to write into it.
#[test]
fn pipes_are_no_products() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("scene.tif");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo").success());
    says(&sentence(&pipe), &["scene.tif", "not a regular file"]);
    let files = files();
    let (_kept, safe) = common::folder_of(NAME, &files);
    let measurement = safe.join(&files[MEASUREMENT].0);
    std::fs::remove_file(&measurement).expect("a measurement");
    let made = std::process::Command::new("mkfifo")
        .arg(&measurement)
        .status();
    assert!(made.expect("mkfifo").success());
    says(&sentence(&safe), &["not a regular file"]);
}

#[test]
fn missing_files_are_named() {
    says(
        &sentence_of(|files| drop(files.remove(3))),
        &["no measurement"],
    );
    for (file, name) in [(1, "calibration-s1a"), (2, "noise-s1a")] {
        says(
            &sentence_of(|files| drop(files.remove(file))),
            &["has no file", name, "download"],
        );
    }
    says(
        &sentence_of(|files| drop(files.remove(0))),
        &["has no file", "annotation"],
    );
    let folder = tempfile::tempdir().expect("a folder");
    says(
        &sentence(folder.path()),
        &["cannot be read as a product", "annotation/s1"],
    );
    says(
        &sentence(&folder.path().join("none.zip")),
        &["cannot access", "none.zip"],
    );
}

#[test]
fn other_products_are_named() {
    let renamed = |to: &str| {
        sentence_of(|files| {
            files
                .iter_mut()
                .for_each(|file| file.0 = file.0.replace("-grd-", to));
        })
    };
    says(&renamed("-slc-"), &["type SLC", "GRD"]);
    says(
        &replaced(0, "<productType>GRD", "<productType>SLC"),
        &["type SLC"],
    );
    let folder = tempfile::tempdir().expect("a folder");
    common::write(&folder.path().join("measurement/s1a-iw-ocn-vv.nc"), b"CDF");
    says(&sentence(folder.path()), &["type OCN"]);
    let raw = folder.path().join("S1A_IW_RAW__0SDV_20210101T000000.SAFE");
    common::write(&raw.join("manifest.safe"), b"<a/>");
    says(&sentence(&raw), &["type RAW"]);
}

#[test]
fn other_polarizations_are_named() {
    let (_kept, safe) = common::folder_of(NAME, &files());
    let opened = Product::open_polarization(&safe, Polarization::VH);
    says(
        &opened.expect_err("no VH").to_string(),
        &["no polarization VH", "choose one of VV"],
    );
    assert!(Product::open_polarization(&safe, Polarization::VV).is_ok());
    says(
        &replaced(0, "<polarisation>VV", "<polarisation>HH"),
        &["polarisation is HH", "says VV"],
    );
}

#[test]
fn impossible_numbers_are_named() {
    for (file, from, to, parts) in [
        (
            0,
            "<numberOfLines>90",
            "<numberOfLines>99999999",
            ["numberOfLines", "1000000"],
        ),
        (
            0,
            "<numberOfLines>90",
            "<numberOfLines>-1",
            ["numberOfLines", "-1"],
        ),
        (
            0,
            "<numberOfLines>90",
            "<numberOfLines>900",
            ["grid reaches", "900"],
        ),
        (
            0,
            "<latitude>54",
            "<latitude>NaN",
            ["latitude", "expected a finite number"],
        ),
        (
            0,
            "<latitude>54",
            "<latitude>154",
            ["latitude 154", "[-90, 90]"],
        ),
        (0, "<line>40", "<line>41", ["grid point", "grid"]),
        (0, "<pass>Ascending", "<pass>Sideways", ["pass", "Sideways"]),
        (0, "<x>-1000", "<x>1e9", ["velocity/x", "1000000000"]),
        (
            0,
            "2021-01-01T00:00:10",
            "2021-01-01T00:00:00",
            ["orbit", "increase"],
        ),
        (
            0,
            "radarFrequency>5",
            "radarFrequency>x",
            ["radarFrequency", "expected a finite number"],
        ),
        (1, "<line>33", "<line>99999", ["line", "99999"]),
        (
            1,
            "<line>33",
            "<line>0",
            ["line 0", "after the previous line"],
        ),
        (
            1,
            "<pixel>0 40",
            "<pixel>40 0",
            ["pixels", "do not increase"],
        ),
        (1, "<pixel>0 40", "<pixel>0 99999", ["line 0", "increase"]),
        (1, "<pixel>0 40", "<pixel>0", ["4 pixels", "5 values"]),
        (
            1,
            "<sigmaNought>600",
            "<sigmaNought>-600",
            ["sigmaNought", "-600"],
        ),
        (
            1,
            "<sigmaNought>600",
            "<sigmaNought>0",
            ["sigmaNought", "outside"],
        ),
        (
            2,
            "<noiseRangeLut>900",
            "<noiseRangeLut>inf",
            ["noiseRangeLut", "inf"],
        ),
        (
            2,
            "<lastRangeSample>139",
            "<lastRangeSample>140",
            ["lastRangeSample", "139"],
        ),
        (
            2,
            "noiseRangeVectorList>",
            "otherList>",
            ["not valid XML", "otherList"],
        ),
    ] {
        says(&replaced(file, from, to), &parts);
    }
}

/// A table that ends far from the border is cut off, and not continued silently.
#[test]
fn tables_that_end_early_are_refused() {
    let text = String::from_utf8(files()[1].1.clone()).expect("text");
    let parts: Vec<&str> = text.split_inclusive("</calibrationVector>").collect();
    let short = format!(
        "{}{}",
        parts[..1].concat(),
        "<calibrationVector><line>5</line><pixel>0 139</pixel><sigmaNought>1 1</sigmaNought></calibrationVector></calibrationVectorList></calibration>"
    );
    let said = sentence_of(|files| files[1].1 = short.clone().into_bytes());
    says(&said, &["from line 0 to 5", "90 lines"]);
}

#[test]
fn hostile_xml_is_refused() {
    let bomb = "<!DOCTYPE a [<!ENTITY b \"bb\"><!ENTITY c \"&b;&b;\">]><product>&c;</product>";
    says(
        &sentence_of(|files| files[0].1 = bomb.into()),
        &["document type"],
    );
    let deep = "<a>".repeat(1_000_000);
    says(
        &sentence_of(|files| files[0].1 = deep.clone().into()),
        &["depth", "limit 32"],
    );
    let large = vec![b' '; limits::XML_BYTES as usize + 1];
    says(
        &sentence_of(|files| files[1].1 = large.clone()),
        &["size in bytes", "limit"],
    );
    says(
        &sentence_of(|files| files[1].1 = vec![0xff; 10]),
        &["UTF-8"],
    );
    let long = format!("<pixel>{}", "1 ".repeat(limits::NUMBERS + 1));
    says(&replaced(1, "<pixel>", &long), &["length of a list"]);
}

#[test]
fn truncated_measurements_are_refused() {
    for length in [0, 3, 8, 200, 5000, 25_000] {
        let said = sentence_of(|files| files[MEASUREMENT].1.truncate(length));
        says(&said, &["measurement/s1a", "damaged"]);
    }
    let other = sentence_of(|files| {
        let text = String::from_utf8(files[0].1.clone()).expect("text");
        files[0].1 = text
            .replace("numberOfSamples>140", "numberOfSamples>141")
            .into_bytes();
        let text = String::from_utf8(files[2].1.clone()).expect("text");
        files[2].1 = text.into_bytes();
    });
    says(
        &other,
        &["90 lines of 140 pixels", "90 lines of 141 pixels"],
    );
}

/// A gigabyte of blanks in a megabyte of zip, and a measurement larger than its image.
#[test]
fn zip_bombs_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.zip");
    let mut bomb = files();
    bomb[1].1 = vec![b' '; 3 * limits::XML_BYTES as usize];
    common::zip_of(&path, "a.SAFE", &bomb, CompressionMethod::Deflated);
    says(
        &sentence(&path),
        &["calibration-s1a", "size in bytes", "limit"],
    );
    let mut bomb = files();
    bomb[MEASUREMENT].1 = vec![0; limits::MEASUREMENT_EXTRA_BYTES as usize + 30_000];
    common::zip_of(&path, "a.SAFE", &bomb, CompressionMethod::Deflated);
    says(
        &sentence(&path),
        &[&format!("{STEM}.tiff"), "size in bytes", "limit"],
    );
    let many: Files = (0..=limits::ARCHIVE_FILES)
        .map(|i| (i.to_string(), Vec::new()))
        .collect();
    common::zip_of(&path, "a.SAFE", &many, CompressionMethod::Stored);
    says(&sentence(&path), &["number of files", "10000"]);
    std::fs::write(&path, b"PK\x03\x04 no more").expect("a file");
    says(&sentence(&path), &["not a readable zip archive"]);
}

#[test]
fn hostile_tiffs_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tif");
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        let mut bytes = tag.to_le_bytes().to_vec();
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
        bytes
    };
    let tiff = |entries: &[Vec<u8>], next: u32| {
        let mut bytes = b"II*\0\x08\0\0\0".to_vec();
        bytes.extend((entries.len() as u16).to_le_bytes());
        entries.iter().for_each(|e| bytes.extend(e));
        bytes.extend(next.to_le_bytes());
        bytes.resize(400, 0);
        bytes
    };
    let usual = |width, height| {
        vec![
            entry(256, 4, 1, width),
            entry(257, 4, 1, height),
            entry(258, 3, 1, 16),
            entry(259, 3, 1, 1),
            entry(262, 3, 1, 1),
            entry(273, 4, 1, 200),
            entry(277, 3, 1, 1),
            entry(278, 4, 1, height),
            entry(279, 4, 1, 32),
        ]
    };
    let said = |bytes: Vec<u8>| {
        std::fs::write(&path, bytes).expect("a file");
        sentence(&path)
    };
    said(tiff(&usual(4, 4), 8));
    says(
        &said(tiff(&usual(4_000_000_000, 4), 0)),
        &["pixels of a line", "limit"],
    );
    says(
        &said(tiff(&usual(900_000, 900_000), 0)),
        &["number of pixels", "limit"],
    );
    says(&said(tiff(&usual(90_000, 90_000), 0)), &["truncated"]);
    let mut huge = usual(4, 4);
    huge[5] = entry(273, 4, u32::MAX, 200);
    said(tiff(&huge, 0));
    let mut none = usual(4, 4);
    none[7] = entry(278, 4, 1, 0);
    said(tiff(&none, 0));
    let mut packed = usual(40_000, 40_000);
    packed[3] = entry(259, 3, 1, 8);
    says(&said(tiff(&packed, 0)), &["compressed strip", "limit"]);
    let mut jpeg = usual(4, 4);
    jpeg[3] = entry(259, 3, 1, 7);
    says(&said(tiff(&jpeg, 0)), &["compression", "gdal_translate"]);
    let mut double = usual(4, 4);
    double[2] = entry(258, 3, 1, 64);
    says(&said(tiff(&double, 0)), &["64 bits", "gdal_translate"]);
    says(&said(b"GIF89a".to_vec()), &["no known format"]);
    says(&said(Vec::new()), &["no known format"]);
}
