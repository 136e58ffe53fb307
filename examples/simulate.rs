//! From a scene to a SAR image: every field, the labels and a report.
//!
//! ```text
//! cargo run --release --example simulate
//! cargo run --release --example simulate -- --set sea.wind_speed=3 --set ship.heading=90 --out out/light_wind
//! cargo run --release --example simulate -- --scene assets/scenes/satellite/sentinel_1.toml --compare REAL_IMAGES
//! ```
//!
//! Writes `image.png`, `fields.safetensors`, `labels.json` and `report.json`; with `--overlay` the picture with its labels drawn,
//! `overlay.png`; with `--export` every field as a NumPy array or a TIFF with the size of its pixels; with `--compare` the
//! texture of the open sea of the image beside that of real ones, `texture.json`.

#[path = "simulate/compare.rs"]
mod compare;
#[path = "common/exit.rs"]
mod exit;
#[path = "common/progress.rs"]
mod progress;

use clap::{Parser, ValueEnum};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use wake_physics::grey::GreyScale;
use wake_physics::picture::Picture;
use wake_physics::{Method, Plan, Scene, Simulation, export, output, simulate_with};

/// Simulate the SAR image of a ship wake from the numbers of a scene.
#[derive(Parser)]
#[command(
    version,
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                  grid.spacing is that of the image; the plan says which spacing is computed on (computed_spacing): docs/scene.md"
)]
struct Arguments {
    /// Scene file (TOML); without it, the default scene with its ship
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Change one value of the scene, such as ship.speed=8; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// How fields are computed: the fast methods, or the slow oracles they are checked against
    #[arg(long, value_enum, default_value = "fast")]
    method: MethodName,
    /// What the grey of the picture is linear in: decibels on one scale for all scenes, or amplitude as in quick-looks
    #[arg(long, value_enum, default_value = "decibel")]
    grey: GreyName,
    /// Also write the picture with boxes, arms and tips drawn on it
    #[arg(long)]
    overlay: bool,
    /// Also write every field as a file of its own, for NumPy or as TIFF
    #[arg(long, value_enum, value_delimiter = ',')]
    export: Vec<Export>,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/simulate")]
    out: PathBuf,
    /// Compare the open sea's texture with that of the PNG images of a folder (grey linear in amplitude)
    #[arg(long, value_name = "DIR")]
    compare: Option<PathBuf>,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodName {
    Fast,
    Direct,
}

#[derive(Clone, Copy, ValueEnum)]
enum GreyName {
    Decibel,
    Amplitude,
}

#[derive(Clone, Copy, ValueEnum)]
enum Export {
    Npy,
    Tiff,
}

fn main() -> ExitCode {
    exit::code(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = match &arguments.scene {
        Some(path) => Scene::read(path)?,
        None => Scene::default(),
    };
    let scene = scene.with_assignments(&arguments.set)?;
    // A scene that cannot be simulated leaves no folder behind.
    let plan = Plan::new(&scene)?;
    let cost = plan.cost();
    if cost.is_high() {
        exit::note(&format!("note: {cost}"));
    }
    output::make_folder(&arguments.out)?;
    let simulation = match arguments.method {
        MethodName::Fast => simulate_with(&scene, Method::Fast)?,
        MethodName::Direct => {
            let clock = progress::clock("summing wave by wave and pixel by pixel");
            let simulation = simulate_with(&scene, Method::Direct);
            clock.finish_and_clear();
            simulation?
        }
    };
    let grey = match arguments.grey {
        GreyName::Decibel => GreyScale::default(),
        GreyName::Amplitude => simulation.quick_look(),
    };
    let report = simulation.write_in(&arguments.out, &grey)?;
    if arguments.overlay {
        let levels: Vec<u8> = simulation.levels(&grey);
        let mut picture = Picture::from_levels(&levels, simulation.raster.columns);
        picture.draw_labels(&simulation.labels);
        picture.write(&arguments.out.join("overlay.png"))?;
    }
    for form in &arguments.export {
        write_fields(&simulation, *form, &arguments.out)?;
    }
    if let Some(folder) = &arguments.compare {
        let rows = compare::textures(&simulation.speckled, folder)?;
        output::write_json(&arguments.out.join("texture.json"), &rows)?;
        if !arguments.json {
            exit::say(&compare::table(&rows))?;
        }
    }
    if arguments.json {
        exit::say(&format!("{report:#}"))?;
    } else {
        exit::say(&summary(&simulation, &arguments.out))?;
    }
    Ok(())
}

fn write_fields(simulation: &Simulation, form: Export, out: &Path) -> wake_physics::Result<()> {
    for (name, field) in simulation.named_fields() {
        match form {
            Export::Npy => export::write_npy(&out.join(format!("{name}.npy")), field)?,
            Export::Tiff => {
                export::write_tiff(&out.join(format!("{name}.tif")), &simulation.raster, field)?;
            }
        }
    }
    Ok(())
}

fn summary(simulation: &Simulation, out: &Path) -> String {
    let notes = simulation.plan.notes.iter();
    let notes: String = notes.map(|note| format!("note: {note}\n")).collect();
    let (plan, seconds) = (&simulation.plan, &simulation.seconds);
    format!("{plan}\n{notes}{seconds}\nwritten to {}", out.display())
}
