//! Files and printed summary of one simulation.

use serde_json::{Value, json};
use std::path::Path;
use wake_physics::grey::GreyScale;
use wake_physics::{Simulation, export};

use super::arguments::{Arguments, Export, GreyName};
use crate::sheet::Picture;

/// Writes the files of one scene and returns its report.
pub(crate) fn write(
    simulation: &Simulation,
    arguments: &Arguments,
    out: &Path,
) -> wake_physics::Result<Value> {
    let grey = match arguments.grey {
        GreyName::Decibel => GreyScale::default(),
        GreyName::Amplitude => simulation.quick_look(),
    };
    if arguments.only_image {
        let path = out.join("image.png");
        whole_files::make_folder(out)?;
        simulation.write_png(&path, &grey)?;
        return Ok(json!({ "files": [path.display().to_string()] }));
    }
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

/// Printed summary of a simulation.
pub(crate) fn summary(simulation: &Simulation, out: &Path) -> String {
    let notes = simulation.plan.notes.iter();
    let notes: String = notes.map(|note| format!("note: {note}\n")).collect();
    let (plan, seconds) = (&simulation.plan, &simulation.seconds);
    format!("{plan}\n{notes}{seconds}\nwritten to {}", out.display())
}
