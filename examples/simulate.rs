//! From a scene to a SAR image: every field, the labels and a report.
//!
//! ```text
//! cargo run --release --example simulate
//! cargo run --release --example simulate -- --set sea.wind_speed=3 --set ship.heading=90 --out out/light_wind
//! cargo run --release --example simulate -- --scene assets/scenes/satellite/*.toml --compare REAL_IMAGES
//! ```
//!
//! Writes `image.png`, `fields.safetensors`, `labels.json` and `report.json`, of several scenes into a folder each; with
//! `--overlay` the picture with its labels drawn, `overlay.png`; with `--export` every field as a NumPy array or a TIFF with
//! the size of its pixels; with `--compare` open sea and wakes beside those of real images, `comparison.md` and
//! `comparison.json`, and quick-looks of what was simulated, `sheet.png`.

#[path = "simulate/compare.rs"]
mod compare;
#[path = "common/exit.rs"]
mod exit;
#[path = "common/progress.rs"]
mod progress;
#[path = "simulate/real.rs"]
mod real;

use clap::{Parser, ValueEnum};
use serde_json::Value;
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
    /// Scene file (TOML), or several; without it, the default scene with its ship
    #[arg(long, value_name = "FILE", num_args = 1..)]
    scene: Vec<PathBuf>,
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
    /// Folder of the results, made if absent; of several scenes each has a folder of its name in it
    #[arg(long, value_name = "DIR", default_value = "out/simulate")]
    out: PathBuf,
    /// Compare open sea and wakes with those of the PNG images of a folder (grey linear in amplitude; the axes of wakes in
    /// its labels.json, if there is one)
    #[arg(long, value_name = "DIR")]
    compare: Option<PathBuf>,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

/// Pixels of a quick-look along its longer side, and quick-looks in a row of the sheet.
const SIDE: usize = 334;
const ACROSS: usize = 3;

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
    let scenes = scenes(arguments)?;
    // A scene that cannot be simulated leaves no folder behind.
    let plans = scenes.iter().map(|(_, scene)| Plan::new(scene));
    for plan in plans.collect::<wake_physics::Result<Vec<_>>>()? {
        let cost = plan.cost();
        if cost.is_high() {
            exit::note(&format!("note: {cost}"));
        }
    }
    let real = arguments.compare.as_deref().map(compare::real_rows);
    let real = real.transpose()?;
    output::make_folder(&arguments.out)?;
    let (mut reports, mut rows, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for (name, scene) in &scenes {
        let out = match scenes.len() {
            1 => arguments.out.clone(),
            _ => arguments.out.join(name),
        };
        let simulation = simulated(scene, arguments.method)?;
        reports.push(write(&simulation, arguments, &out)?);
        if !arguments.json {
            exit::say(&summary(&simulation, &out))?;
        }
        if arguments.compare.is_some() {
            rows.push(compare::Row::simulated(name, &simulation));
            pictures.push(quick_look(&simulation).captioned(name));
        }
    }
    if let Some(real) = real {
        let page = compare::page(&rows, &real);
        let out = |name: &str| arguments.out.join(name);
        output::write_atomically(&out("comparison.md"), page.as_bytes())?;
        rows.extend(real);
        output::write_json(&out("comparison.json"), &rows)?;
        Picture::sheet(&pictures, ACROSS).write(&out("sheet.png"))?;
        if !arguments.json {
            exit::say(&page)?;
        }
    }
    match (arguments.json, &reports[..]) {
        (true, [report]) => exit::say(&format!("{report:#}"))?,
        (true, reports) => exit::say(&format!("{:#}", Value::from(reports)))?,
        (false, _) => {}
    }
    Ok(())
}

/// The scenes by the names of their files.
fn scenes(arguments: &Arguments) -> Result<Vec<(String, Scene)>, Box<dyn Error>> {
    let changed = |scene: Scene| scene.with_assignments(&arguments.set);
    if arguments.scene.is_empty() {
        return Ok(vec![("default".to_owned(), changed(Scene::default())?)]);
    }
    let mut scenes: Vec<(String, Scene)> = Vec::new();
    for path in &arguments.scene {
        let name = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if scenes.iter().any(|(other, _)| *other == name) {
            let path = path.display();
            return Err(format!("{path}: another scene file is called {name} too, and each has a folder of its name; rename one").into());
        }
        scenes.push((name, changed(Scene::read(path)?)?));
    }
    Ok(scenes)
}

fn simulated(scene: &Scene, method: MethodName) -> wake_physics::Result<Simulation> {
    match method {
        MethodName::Fast => simulate_with(scene, Method::Fast),
        MethodName::Direct => {
            let clock = progress::clock("summing wave by wave and pixel by pixel");
            let simulation = simulate_with(scene, Method::Direct);
            clock.finish_and_clear();
            simulation
        }
    }
}

fn write(
    simulation: &Simulation,
    arguments: &Arguments,
    out: &Path,
) -> wake_physics::Result<Value> {
    let grey = match arguments.grey {
        GreyName::Decibel => GreyScale::default(),
        GreyName::Amplitude => simulation.quick_look(),
    };
    let report = simulation.write_in(out, &grey)?;
    if arguments.overlay {
        let levels: Vec<u8> = simulation.levels(&grey);
        let mut picture = Picture::from_levels(&levels, simulation.raster.columns);
        picture.draw_labels(&simulation.labels);
        picture.write(&out.join("overlay.png"))?;
    }
    for form in &arguments.export {
        write_fields(simulation, *form, out)?;
    }
    Ok(report)
}

/// A picture of at most some 330 pixels a side, each the mean of square blocks of a quick-look.
fn quick_look(simulation: &Simulation) -> Picture {
    let levels = simulation.levels(&simulation.quick_look());
    let [rows, columns] = [simulation.raster.rows, simulation.raster.columns];
    let block = rows.max(columns).div_ceil(SIDE);
    let [down, right] = [rows / block, columns / block];
    let mean = |n: usize| {
        let first = n / right * block * columns + n % right * block;
        let lines = (0..block).map(|line| &levels[first + line * columns..][..block]);
        let sum: usize = lines.flatten().map(|&level| usize::from(level)).sum();
        (sum / (block * block)) as u8
    };
    let levels: Vec<u8> = (0..down * right).map(mean).collect();
    Picture::from_levels(&levels, right)
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
