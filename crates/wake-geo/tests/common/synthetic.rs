//! A small product of our own, whose every number is known.

use std::fmt::Write;

use wake_geo::{Compression, GeoTiffLayout, Placement, write_geotiff};

pub(crate) const LINES: usize = 90;
pub(crate) const PIXELS: usize = 140;
pub(crate) const STEM: &str = "s1a-iw-grd-vv-20210101t000000-20210101t000025-036000-000001-001";
pub(crate) const NAME: &str = "S1A_IW_GRDH_1SDV_20210101T000000_20210101T000025_036000_000001_0000";

/// Digital number of a pixel: 0 at the left border, some below the noise.
pub(crate) fn number(line: usize, pixel: usize) -> u16 {
    match pixel {
        0..3 => 0,
        _ => (line * 37 + pixel * 11) as u16 % 300 + 1,
    }
}

/// Files of the product, with measurement.
pub(crate) fn files() -> Vec<(String, Vec<u8>)> {
    vec![
        (format!("annotation/{STEM}.xml"), annotation().into_bytes()),
        (
            format!("annotation/calibration/calibration-{STEM}.xml"),
            calibration().into_bytes(),
        ),
        (
            format!("annotation/calibration/noise-{STEM}.xml"),
            noise().into_bytes(),
        ),
        (format!("measurement/{STEM}.tiff"), measurement()),
    ]
}

pub(crate) fn measurement() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.tiff");
    let layout = GeoTiffLayout {
        lines: LINES,
        pixels: PIXELS,
        compression: Compression::None,
        placement: Placement::None,
        no_data: None,
    };
    write_geotiff(&path, &layout, |lines, out: &mut [u16]| {
        for (line, row) in lines.zip(out.chunks_exact_mut(PIXELS)) {
            for (pixel, out) in row.iter_mut().enumerate() {
                *out = number(line, pixel);
            }
        }
        Ok(())
    })
    .expect("a measurement");
    std::fs::read(path).expect("a file")
}

fn header() -> &'static str {
    "<adsHeader><missionId>S1A</missionId><productType>GRD</productType><polarisation>VV</polarisation><mode>IW</mode>\
     <absoluteOrbitNumber>36000</absoluteOrbitNumber></adsHeader>"
}

fn annotation() -> String {
    let mut points = String::new();
    for line in [0, 40, 89] {
        for pixel in [0, 70, 139] {
            let latitude = 54.0 + 9e-5 * f64::from(line) + 2e-5 * f64::from(pixel);
            let longitude = 7.0 + 1.5e-4 * f64::from(pixel) - 3e-5 * f64::from(line);
            write!(
                points,
                "<geolocationGridPoint><slantRangeTime>{}</slantRangeTime><line>{line}</line><pixel>{pixel}</pixel>\
                 <latitude>{latitude}</latitude><longitude>{longitude}</longitude><height>0</height>\
                 <incidenceAngle>{}</incidenceAngle></geolocationGridPoint>",
                5.3e-3 + 4e-8 * f64::from(pixel),
                30.0 + 1e-3 * f64::from(pixel)
            )
            .expect("a string");
        }
    }
    let orbit = |second| {
        format!(
            "<orbit><time>2021-01-01T00:00:{second}</time><frame>Earth Fixed</frame>\
             <velocity><x>-1000</x><y>2000</y><z>7200</z></velocity></orbit>"
        )
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<product>{}<generalAnnotation><productInformation>\
         <pass>Ascending</pass><platformHeading>-13.5</platformHeading><radarFrequency>5.405e9</radarFrequency>\
         </productInformation><orbitList>{}{}</orbitList></generalAnnotation><imageAnnotation><imageInformation>\
         <productFirstLineUtcTime>2021-01-01T00:00:00.000000</productFirstLineUtcTime>\
         <productLastLineUtcTime>2021-01-01T00:00:00.131922</productLastLineUtcTime>\
         <slantRangeTime>5.3e-3</slantRangeTime><rangePixelSpacing>1.0e+01</rangePixelSpacing>\
         <azimuthPixelSpacing>1.0e+01</azimuthPixelSpacing><azimuthTimeInterval>1.483e-03</azimuthTimeInterval>\
         <numberOfSamples>{PIXELS}</numberOfSamples><numberOfLines>{LINES}</numberOfLines>\
         <incidenceAngleMidSwath>30.07</incidenceAngleMidSwath></imageInformation><processingInformation>\
         <thermalNoiseCorrectionPerformed>false</thermalNoiseCorrectionPerformed></processingInformation>\
         </imageAnnotation><geolocationGrid><geolocationGridPointList>{points}</geolocationGridPointList>\
         </geolocationGrid></product>",
        header(),
        orbit("00"),
        orbit("10")
    )
}

fn vectors(list: &str, item: &str, values: &str, value: impl Fn(usize, usize) -> f64) -> String {
    let mut text = format!("<{list}>");
    for line in [0, 33, 66, 99] {
        let pixels: Vec<usize> = (0..PIXELS).step_by(40).chain([PIXELS - 1]).collect();
        let words = |of: &dyn Fn(usize) -> String| -> String {
            let words: Vec<String> = pixels.iter().map(|&p| of(p)).collect();
            words.join(" ")
        };
        write!(
            text,
            "<{item}><line>{line}</line><pixel>{}</pixel><{values}>{}</{values}></{item}>",
            words(&|p| p.to_string()),
            words(&|p| value(line, p).to_string())
        )
        .expect("a string");
    }
    text + &format!("</{list}>")
}

fn calibration() -> String {
    let list = vectors(
        "calibrationVectorList",
        "calibrationVector",
        "sigmaNought",
        |line, pixel| 600.0 - 0.3 * pixel as f64 + 0.1 * line as f64,
    );
    format!("<calibration>{}{list}</calibration>", header())
}

fn noise() -> String {
    let range = vectors(
        "noiseRangeVectorList",
        "noiseRangeVector",
        "noiseRangeLut",
        |line, pixel| 900.0 - 2.0 * pixel as f64 + line as f64,
    );
    let block = |first, last, factors| {
        format!(
            "<noiseAzimuthVector><swath>IW1</swath><firstAzimuthLine>0</firstAzimuthLine>\
             <firstRangeSample>{first}</firstRangeSample><lastAzimuthLine>{}</lastAzimuthLine>\
             <lastRangeSample>{last}</lastRangeSample><line>0 10 50</line><noiseAzimuthLut>{factors}</noiseAzimuthLut>\
             </noiseAzimuthVector>",
            LINES - 1
        )
    };
    format!(
        "<noise>{}{range}<noiseAzimuthVectorList>{}{}</noiseAzimuthVectorList></noise>",
        header(),
        block(0, 59, "1.1 0.9 1.3"),
        block(60, PIXELS - 1, "1 1.2 1")
    )
}
