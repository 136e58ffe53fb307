//! `wake simulate`: simulates a SAR image from a scene, with all fields, labels and a report.

mod across;
mod arguments;
mod compare;
mod figures;
mod product;
mod profile;
mod real;
mod results;

pub(crate) use arguments::Arguments;

use crate::exit::{self, Outcome};
use crate::progress;
use crate::sheet::Picture;
use arguments::MethodName;
use figures::ImageFigures;
use serde_json::Value;
use wake_physics::{Method, Plan, Scene, Simulation, simulate_with};

/// Pixels of a quick-look along its longer side, and quick-looks in a row of the sheet.
const SIDE: usize = 334;
const ACROSS: usize = 3;

/// Writes `image.png`, `fields.safetensors`, `labels.json` and `report.json`, in one folder for each of several scenes.
/// `--only-image` writes only the image. `--overlay` adds the picture with its labels, `overlay.png`; `--export` adds
/// every field as a NumPy array or a TIFF with the pixel size; `--compare` adds tables of open sea and wakes beside
/// real images, `comparison.md` and `comparison.json`, and quick-looks of the simulated images, `sheet.png`.
/// `--product` writes a Sentinel-1 product of a real place instead.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    if let Some(template) = &arguments.product.product {
        let (changes, out) = (&arguments.set, &arguments.out);
        return product::run(&arguments.product, template, changes, out, arguments.json);
    }
    let scenes = scenes(arguments)?;
    // Fails before creating a folder if a scene cannot be simulated.
    let plans = scenes.iter().map(|(_, scene)| Plan::new(scene));
    for plan in plans.collect::<wake_physics::Result<Vec<_>>>()? {
        let cost = plan.cost();
        if cost.is_high() {
            exit::note(&format!("note: {cost}"));
        }
    }
    let real = arguments.compare.as_deref().map(real::figures);
    let real = real.transpose()?;
    whole_files::make_folder(&arguments.out)?;
    let (mut reports, mut rows, mut pictures) = (Vec::new(), Vec::new(), Vec::new());
    for (name, scene) in &scenes {
        let out = match scenes.len() {
            1 => arguments.out.clone(),
            _ => arguments.out.join(name),
        };
        let simulation = simulated(scene, arguments.method)?;
        reports.push(results::write(&simulation, arguments, &out)?);
        if !arguments.json {
            exit::say(&results::summary(&simulation, &out))?;
        }
        if arguments.compare.is_some() {
            rows.push(ImageFigures::of_simulation(name, &simulation));
            let levels = simulation.levels(&simulation.quick_look());
            let picture = Picture::reduced(&levels, simulation.raster.columns, SIDE);
            pictures.push(picture.captioned(name));
        }
    }
    if let Some(real) = real {
        let page = compare::page(&rows, &real);
        let out = |name: &str| arguments.out.join(name);
        whole_files::write_atomically(&out("comparison.md"), page.as_bytes())?;
        rows.extend(real);
        whole_files::write_json(&out("comparison.json"), &rows)?;
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

/// Scenes and the names of their files.
fn scenes(arguments: &Arguments) -> Outcome<Vec<(String, Scene)>> {
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
            return Err(format!("{path}: another scene file has the name {name}, which is also the name of its folder; rename one").into());
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
