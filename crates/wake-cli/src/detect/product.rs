//! `wake detect PRODUCT`: maps the wakes of a satellite product.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, RgbImage};
use indicatif::ProgressBar;
use serde_json::json;
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, GreyImage, Wake, angle_of};
use wake_geo::{Land, LandMask, Product, Values};
#[cfg(feature = "simulate")]
use wake_map::EstimatedShip;
use wake_map::{MappedWake, Search, csv, geojson, html, mapped, search};
use whole_files::{make_folder, write_atomically, write_json};

use super::arguments::{Arguments, ProductArguments};
use super::sure::how_sure;
use crate::exit::{self, Outcome};
use crate::{named, progress};

/// Longest side of the quick-look \[pixels\].
const LONGEST: usize = 1600;

/// Opens a `.SAFE` folder, a `.zip`, or a TIFF with places or of 32-bit numbers as a product; `None` for other images.
pub(crate) fn opened(path: &Path, arguments: &ProductArguments) -> Outcome<Option<Product>> {
    let has = |name: &str| path.join(name).exists();
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_tiff = matches!(ending.as_deref(), Some("tif" | "tiff"));
    let is_product = path.is_dir() && (has("annotation") || has("manifest.safe"))
        || path.file_name().is_some_and(|name| name == "manifest.safe")
        || matches!(ending.as_deref(), Some("zip" | "safe"));
    if is_tiff && path.is_file() {
        // TIFF files without places that the image reader accepts are images.
        let product = Product::open(path).ok();
        let is_map = |product: &Product| product.has_places() || GreyImage::read(path).is_err();
        return Ok(product.filter(is_map));
    }
    if !is_product {
        return Ok(None);
    }
    Ok(Some(match arguments.polarization {
        Some(polarization) => Product::open_polarization(path, polarization)?,
        None => Product::open(path)?,
    }))
}

/// Searches a product; writes `wakes.geojson`, `wakes.csv`, `wakes.json`, `quicklook.png` and `report.html` into the
/// folder. A stopped search continues from its state in `search.jsonl`.
pub(crate) fn run(product: &Product, arguments: &Arguments) -> Outcome<()> {
    let (out, options) = (&arguments.out, &arguments.product);
    let name = product.path().file_name().unwrap_or_default();
    let name = name.to_string_lossy().into_owned();
    let (lines, pixels) = product.size();
    let detector = named::network(
        arguments.weights.as_deref(),
        &arguments.device,
        arguments.least_score(),
    )?;
    let spacing = spacing(product, arguments.spacing)?;
    let detector = match spacing {
        Some(metres) => detector.with_spacing(metres)?,
        None => detector,
    };
    let land = land(product, options)?;
    // A product without pixels leaves no folder behind.
    product.read_window(0..1, 0..1)?;
    make_folder(out)?;
    let settings = json!({
        "spacing": spacing, "least_score": arguments.least_score(), "weights": arguments.weights, "land": options.land,
        "coast": options.coast(),
    });
    let state = out.join("search.jsonl");
    let bar = progress::bar(0, "tiles");
    let watched = |done: usize, of: usize| watch(&bar, done, of);
    let search_options = Search {
        land: land.as_ref(),
        state: Some(&state),
        settings: &settings.to_string(),
    };
    let found = search(product, &detector, search_options, &watched);
    bar.finish_and_clear();
    let found = found?;
    #[cfg_attr(
        not(feature = "simulate"),
        expect(unused_mut, reason = "nothing is estimated")
    )]
    let mut wakes = mapped(product, &found)?;
    #[cfg(feature = "simulate")]
    if options.estimate {
        estimate(product, &mut wakes)?;
    }
    let collection = geojson(&wakes, &name);
    let picture = quick_look(product, &wakes)?;
    let mut png = Cursor::new(Vec::new());
    picture.plain.write_to(&mut png, ImageFormat::Png)?;
    let told = |value: Option<f32>| value.map_or("unknown".to_owned(), |v| format!("{v:.1} m"));
    let shown = [
        ("image", format!("{name}, {lines} lines of {pixels} pixels")),
        ("pixel spacing", told(spacing)),
        (
            "weights",
            arguments
                .weights
                .as_ref()
                .map_or("the shipped weights".to_owned(), |w| {
                    w.display().to_string()
                }),
        ),
        ("least score", arguments.least_score().to_string()),
        (
            "land",
            match (&options.land, options.no_land) {
                (_, true) => "searched as well".to_owned(),
                (Some(file), _) => format!(
                    "left out: {}, with {} m of sea along it",
                    file.display(),
                    options.coast()
                ),
                (None, _) => format!(
                    "left out: Natural Earth 1:10 million, with {} m of sea along it",
                    options.coast()
                ),
            },
        ),
        ("program", format!("wake {}", env!("CARGO_PKG_VERSION"))),
    ];
    let page = html(&wakes, &name, [pixels, lines], &png.into_inner(), &shown);
    write_json(&out.join("wakes.geojson"), &collection)?;
    if let Some(file) = &options.geojson {
        write_json(file, &collection)?;
    }
    write_atomically(&out.join("wakes.csv"), csv(&wakes).as_bytes())?;
    write_json(&out.join("wakes.json"), &wakes)?;
    write_atomically(&out.join("report.html"), page.as_bytes())?;
    crate::picture::write(&picture.drawn, &out.join("quicklook.png"))?;
    std::fs::remove_file(&state).ok();
    match arguments.json {
        true => exit::say(&json!({"product": name, "wakes": wakes}).to_string())?,
        false => exit::say(&summary(&name, &wakes, out))?,
    }
    Ok(())
}

/// Adds speed, heading and wind to the sure wakes; wakes at land or a border, which cannot be estimated, are noted.
#[cfg(feature = "simulate")]
fn estimate(product: &Product, wakes: &mut [MappedWake]) -> Outcome<()> {
    use wake_physics::estimate::{Parameter, Value};

    let sure = wakes.iter().filter(|wake| wake.sure).count();
    let bar = progress::bar(sure as u64, "wakes");
    for wake in wakes.iter_mut().filter(|wake| wake.sure) {
        let Some(heading) = wake.heading else {
            continue;
        };
        let found = match wake_product::estimate_wake(product, [wake.line, wake.pixel], heading) {
            Ok(found) => found,
            Err(error @ wake_product::Error::Product(_)) => return Err(error.into()),
            Err(error) => {
                bar.suspend(|| exit::note(&format!("not estimated: {error}")));
                bar.inc(1);
                continue;
            }
        };
        let of = |value| found.estimate.of(Parameter::Value(value));
        let (speed, wind) = (of(Value::Speed), of(Value::WindSpeed));
        wake.ship = Some(EstimatedShip {
            identifiable: found.estimate.identifiable,
            speed: speed[0],
            speed_deviation: speed[1],
            heading: found.heading,
            heading_deviation: of(Value::Heading)[1],
            wind_speed: wind[0],
            wind_speed_deviation: wind[1],
            wind_toward: found.wind_toward,
            wind_toward_deviation: of(Value::WindToward)[1],
            misfit: found.estimate.misfit(),
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

fn watch(bar: &ProgressBar, done: usize, of: usize) {
    bar.set_length(of as u64);
    bar.set_position(done as u64);
}

/// Pixel spacing \[m\]: as given, or the product's.
fn spacing(product: &Product, asked: Option<f32>) -> Outcome<Option<f32>> {
    if asked.is_some() || !product.has_places() {
        return Ok(asked);
    }
    let (lines, pixels) = product.size();
    let axes = product.axes(0.5 * lines as f64, 0.5 * pixels as f64)?;
    Ok(Some(
        (0.5 * (axes.line_spacing + axes.pixel_spacing)) as f32,
    ))
}

fn land(product: &Product, options: &ProductArguments) -> Outcome<Option<LandMask>> {
    if options.no_land || !product.has_places() {
        return Ok(None);
    }
    let land = match &options.land {
        Some(file) => Land::read(file)?,
        None => Land::natural_earth(),
    };
    let mask = land.mask(product, options.coast())?;
    Ok(Some(mask).filter(|mask| !mask.is_empty()))
}

/// A small picture of a product, without and with its wakes.
struct QuickLook {
    plain: image::GrayImage,
    drawn: RgbImage,
}

fn quick_look(product: &Product, wakes: &[MappedWake]) -> Outcome<QuickLook> {
    let (lines, pixels) = product.size();
    let step = lines.max(pixels).div_ceil(LONGEST);
    let (rows, columns) = (lines / step, pixels / step);
    let mut means = Vec::with_capacity(rows * columns);
    for row in 0..rows {
        let window = product.read_window(row * step..(row + 1) * step, 0..pixels)?;
        for column in 0..columns {
            let values =
                (0..step).flat_map(|l| &window.line(l)[column * step..(column + 1) * step]);
            let there = values.filter(|v| v.is_finite());
            let (sum, count) = there.fold((0.0f64, 0u32), |(s, n), &v| (s + f64::from(v), n + 1));
            let mean = sum / f64::from(count.max(1));
            means.push(match product.values() {
                Values::SigmaNought => mean.sqrt(),
                Values::Samples => mean,
            });
        }
    }
    // The median becomes mid-grey.
    let mut sorted: Vec<f64> = means.iter().copied().filter(|&m| m > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    let level = |mean: &f64| (110.0 * mean / median).round().clamp(0.0, 255.0) as u8;
    let levels: Vec<u8> = means.iter().map(level).collect();
    let small = GreyImage::eight_bits(rows, columns, levels.clone())?;
    let sure = wakes.iter().filter(|wake| wake.sure);
    let sure: Vec<Detection> = sure.map(|wake| scaled(wake, step)).collect();
    let mut drawing = Drawing::new(&small);
    drawing.found(sure.iter());
    let plain = image::GrayImage::from_raw(columns as u32, rows as u32, levels);
    Ok(QuickLook {
        plain: plain.ok_or("a picture of the wrong size")?,
        drawn: drawing.into_picture(),
    })
}

/// A wake in the pixels of a quick-look reduced by `step`.
fn scaled(wake: &MappedWake, step: usize) -> Detection {
    let small = |at: f64| ((at + 0.5) / step as f64 - 0.5) as f32;
    let (tip, end) = ([wake.pixel, wake.line].map(small), wake.end_px.map(small));
    let [right, down] = [end[0] - tip[0], end[1] - tip[1]];
    let drawn = Wake {
        tip,
        axis_deg: angle_of([right, down]),
        half_angle_deg: wake.half_angle as f32,
        length: right.hypot(down),
        snr: f32::INFINITY,
        contrast_db: None,
    };
    Detection {
        sure: wake.sure,
        ..Detection::new(wake.score as f32, drawn)
    }
}

/// The sure wakes, a line each.
fn summary(name: &str, wakes: &[MappedWake], out: &Path) -> String {
    let sure: Vec<&MappedWake> = wakes.iter().filter(|wake| wake.sure).collect();
    let mut text = format!("{name}: {} wakes", sure.len());
    for wake in sure {
        let place = wake.tip.map_or(
            format!("line {:.0}, pixel {:.0}", wake.line, wake.pixel),
            |[longitude, latitude]| format!("{latitude:.4}, {longitude:.4}"),
        );
        let number = |value: Option<f64>, unit: &str| {
            value.map_or("unknown".to_owned(), |v| format!("{v:.1}{unit}"))
        };
        let echo = wake.echo.and_then(|echo| echo.radial_velocity);
        text += &format!(
            "\n  {}, {place}, heading {}, {} long, radial velocity {}",
            how_sure(wake.probability, wake.score),
            number(wake.heading, " deg"),
            number(wake.length, " m"),
            number(echo, " m/s")
        );
        if let Some(ship) = wake.ship {
            text += &match ship.identifiable {
                true => format!(
                    ", speed {:.2} ± {:.2} m/s, heading {:.1} ± {:.1} deg by its waves",
                    ship.speed, ship.speed_deviation, ship.heading, ship.heading_deviation
                ),
                false => ", speed not identifiable".to_owned(),
            };
        }
    }
    text + &format!("\nwritten to {}", out.display())
}
