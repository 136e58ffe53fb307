//! What a simulation writes.

use super::Simulation;
use crate::error::Result;
use crate::grey::GreyScale;
use crate::output;
use crate::raster::Field;
use serde_json::{Value, json};
use std::path::Path;

impl Simulation {
    /// The fields by their names in `fields.safetensors`.
    #[must_use]
    pub fn named_fields(&self) -> [(&'static str, &Field); 10] {
        [
            ("elevation", &self.elevation),
            ("slope_x", &self.slope_x),
            ("slope_y", &self.slope_y),
            ("velocity_x", &self.velocity_x),
            ("velocity_y", &self.velocity_y),
            ("velocity_z", &self.velocity_z),
            ("sigma0", &self.sigma0),
            ("radial_velocity", &self.radial_velocity),
            ("intensity", &self.intensity),
            ("speckled", &self.speckled),
        ]
    }

    /// Writes `image.png`, `fields.safetensors`, `labels.json` and `report.json` into a folder, each whole or
    /// not at all, and returns the report.
    ///
    /// # Errors
    ///
    /// [`Error::File`](crate::Error::File) if the folder cannot be made or a file not be written.
    pub fn write(&self, folder: &Path) -> Result<Value> {
        output::make_folder(folder)?;
        let path = |name: &str| folder.join(name);
        let grey = GreyScale::default();
        let level = |&power: &f32| grey.level(f64::from(power));
        let pixels: Vec<u8> = self.speckled.values.iter().map(level).collect();
        output::write_png(
            &path("image.png"),
            &pixels,
            self.raster.rows,
            self.raster.columns,
        )?;
        output::write_fields(&path("fields.safetensors"), &self.named_fields())?;
        output::write_json(&path("labels.json"), &self.labels)?;
        let names = [
            "image.png",
            "fields.safetensors",
            "labels.json",
            "report.json",
        ];
        let report = json!({
            "method": self.method,
            "seconds": self.seconds,
            "plan": self.plan.terms,
            "sizes": self.plan.sizes,
            "notes": self.plan.notes,
            "grey": grey,
            "files": names.map(|name| path(name).display().to_string()),
            "scene": self.scene,
        });
        output::write_json(&path("report.json"), &report)?;
        Ok(report)
    }
}
