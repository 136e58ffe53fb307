//! `wake gallery`: the pictures of the documentation: the gallery, the stages from hull to image, and twenty seconds of a wake.

mod film;
mod levels;
mod stages;

use crate::sheet::Picture;
use clap::Args;
use std::path::PathBuf;
use wake_detector::drawing::Drawing;
use wake_detector::{Detector, GreyImage};
use wake_ldm::WakeSampler;
use wake_nn::device_named;
use wake_physics::{Scene, Simulation, simulate};

use crate::exit::{self, Outcome};
use crate::progress;
use levels::filling;

/// Draw the pictures of the documentation.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of the pictures, made if absent
    #[arg(long, value_name = "DIR", default_value = "docs/images")]
    out: PathBuf,
}

/// Sides of a picture of the gallery \[pixels\].
const SIDE: usize = 256;
/// Pictures in a row.
const ACROSS: usize = 3;

/// Scenes of the gallery: a file or the default, what is changed, and what is written above.
const SCENES: [(&str, &[&str], &str); 4] = [
    (
        "default",
        &["sea.wind_speed=3", "ship.position=[250, 250]"],
        "X band, 2.5 m pixels, 4 looks; wind 3 m/s",
    ),
    (
        "airborne",
        &[
            "ship.heading=250",
            "ship.position=[-130, -45]",
            "ship.speed=7",
            "sea.wind_speed=4",
        ],
        "Aircraft, 1.5 m pixels; a ship of 120 m, wind 4 m/s",
    ),
    (
        "satellite/terrasar_x",
        &["ship.position=[-90, -220]", "sea.wind_speed=3"],
        "TerraSAR-X, 2.5 m pixels, 5 looks; a ship of 60 m, its echo off its track",
    ),
    (
        "satellite/sentinel_1",
        &["ship.position=[350, 900]"],
        "Sentinel-1, 10 m pixels; the dark strip of turbulent water",
    ),
];

/// Writes `gallery.png`, `stages.png` and `wake.gif`.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    whole_files::make_folder(&arguments.out)?;
    let bar = progress::bar(3, "pictures");
    let out = |name: &str| arguments.out.join(name);
    gallery()?.write(&out("gallery.png"))?;
    bar.inc(1);
    stages::sheet()?.write(&out("stages.png"))?;
    bar.inc(1);
    whole_files::write_atomically(&out("wake.gif"), &film::film()?)?;
    bar.finish_and_clear();
    Ok(exit::say(&format!(
        "written to {}",
        arguments.out.display()
    ))?)
}

fn gallery() -> Outcome<Picture> {
    let size = [format!("grid.rows={SIDE}"), format!("grid.columns={SIDE}")];
    let mut pictures = Vec::new();
    for (file, changes, caption) in SCENES {
        let scene = Scene::read(&PathBuf::from(format!("assets/scenes/{file}.toml")))?;
        let scene = scene.with_assignments(&size)?.with_assignments(changes)?;
        pictures.push(labelled(&simulate(&scene)?).captioned(caption));
    }
    let sampler = WakeSampler::pretrained(&device_named("flex")?)?;
    let image = sampler.sample(
        "a ship at 10 m/s toward 120 degrees, wind 3 m/s toward 60 degrees",
        7,
    )?;
    let mut picture = Picture::from_levels(&filling(&image.speckled), SIDE);
    picture.draw_labels(&image.labels);
    pictures.push(picture.captioned("Generated from a sentence by the diffusion model"));
    pictures.push(found()?.captioned("Found by the detector in a simulated image"));
    Ok(Picture::sheet(&pictures, ACROSS))
}

/// The image with its labels.
fn labelled(simulation: &Simulation) -> Picture {
    let mut picture =
        Picture::from_levels(&filling(&simulation.speckled), simulation.raster.columns);
    picture.draw_labels(&simulation.labels);
    picture
}

/// What the detector finds in a simulated image.
fn found() -> Outcome<Picture> {
    let scene = Scene::default().with_assignments(&[
        "grid.rows=256",
        "grid.columns=256",
        "grid.spacing=4",
        "sea.wind_speed=4",
        "ship.heading=200",
        "ship.position=[-120, -250]",
    ])?;
    let simulation = simulate(&scene)?;
    let levels = simulation.levels(&simulation.quick_look());
    let image = GreyImage::eight_bits(SIDE, SIDE, levels)?;
    let detector = Detector::pretrained(&device_named("flex")?)?;
    let mut drawing = Drawing::new(&image);
    drawing.found(detector.find(&image).iter());
    let drawn = drawing.into_picture();
    Ok(Picture::from_rgb(drawn.as_raw(), drawn.width() as usize))
}
