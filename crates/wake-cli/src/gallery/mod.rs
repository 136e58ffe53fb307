//! `wake gallery`: draws the pictures of the documentation: the gallery, the stages from hull to image, σ⁰ against
//! incidence, and twenty seconds of a wake.

mod film;
mod found;
mod levels;
mod panel;
mod sigma0;
mod stages;

use crate::sheet::Picture;
use clap::Args;
use std::path::PathBuf;
use wake_ldm::WakeSampler;
use wake_nn::device_named;
use wake_physics::{Scene, simulate};

use crate::exit::{self, Outcome};
use crate::progress;
use panel::{SIDE, enlarged, labelled};

/// Draw the pictures of the documentation.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder for the pictures, created if absent
    #[arg(long, value_name = "DIR", default_value = "docs/images")]
    out: PathBuf,
}

/// Pictures in a row.
const ACROSS: usize = 3;

/// Scenes of the gallery: file, changes and caption.
const SCENES: [(&str, &[&str], &str); 4] = [
    (
        "airborne",
        &[
            "grid.spacing=2",
            "ship.heading=240",
            "ship.position=[-230, -120]",
            "ship.speed=8",
            "ship.echo=true",
            "sea.wind_speed=3.5",
            "radar.azimuth_resolution=2",
        ],
        "Airborne, X band VV, 2 m pixels, wind 3.5 m/s: Kelvin wake of a ship of 120 m",
    ),
    (
        "satellite/alos_2",
        &["ship.position=[1400, 650]"],
        "ALOS-2, L band HH, 10 m pixels, wind 4 m/s: dark line with a bright edge, both arms",
    ),
    (
        "satellite/sentinel_1",
        &[
            "ship.position=[1250, 1250]",
            "ship.heading=50",
            "ship.length=250",
            "ship.beam=36",
            "ship.draft=12",
            "ship.recovery=wind",
            "ship.damping=0.85",
        ],
        "Sentinel-1 IW, C band VV, 10 m pixels, wind 5 m/s: dark strip, displaced echo",
    ),
    (
        "satellite/terrasar_x",
        &[
            "grid.spacing=3",
            "ship.length=150",
            "ship.beam=24",
            "ship.draft=8",
            "ship.speed=9",
            "ship.heading=25",
            "ship.position=[190, 460]",
        ],
        "TerraSAR-X stripmap, X band VV, 3 m pixels, wind 4 m/s: dark line, displaced echo",
    ),
];
/// Prompt and caption of the generated image.
const PROMPT: &str = "a ship at 10 m/s toward 120 degrees, wind 3 m/s toward 60 degrees";
const GENERATED: &str =
    "Generated from a sentence by the diffusion model, X band VV, 4 m pixels, wind 3 m/s";
const FOUND: &str =
    "Found by the detector, with probabilities: Sentinel-1 IW, wind 4.5 m/s, four ships, slicks";

/// Writes `gallery.png`, `stages.png`, `sigma0.svg` and `wake.gif`.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    whole_files::make_folder(&arguments.out)?;
    let bar = progress::bar(4, "pictures");
    let out = |name: &str| arguments.out.join(name);
    gallery()?.write(&out("gallery.png"))?;
    bar.inc(1);
    stages::sheet()?.write(&out("stages.png"))?;
    bar.inc(1);
    sigma0::draw(&out("sigma0.svg"))?;
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
        let simulation = simulate(&scene)?;
        let levels = simulation.levels(&simulation.quick_look());
        let panel = labelled(&levels, scene.grid.spacing, &simulation.labels);
        pictures.push(panel.captioned(caption));
    }
    pictures.push(generated()?.captioned(GENERATED));
    pictures.push(found::panel()?.captioned(FOUND));
    Ok(Picture::sheet(&pictures, ACROSS))
}

/// An image of the wake model, scaled to the size of the others.
fn generated() -> Outcome<Picture> {
    let sampler = WakeSampler::pretrained(&device_named("flex")?)?;
    let image = sampler.sample(PROMPT, 7)?;
    let side = image.speckled.columns;
    let levels = levels::amplitude(&image.speckled);
    let spacing = image.scene.grid.spacing * side as f64 / SIDE as f64;
    Ok(panel::marked(&enlarged(&levels, side), spacing))
}
