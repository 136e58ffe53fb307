//! Results of a simulation, and their output files.

use super::record::{Accuracy, Seconds};
use super::speckling::Speckling;
#[cfg(feature = "png")]
use crate::error::Result;
use crate::grey::GreyScale;
use crate::labels::Labels;
#[cfg(feature = "png")]
use crate::output;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use num_complex::Complex32;
use serde::Serialize;
#[cfg(feature = "png")]
use serde_json::{Value, json};
#[cfg(feature = "png")]
use std::path::Path;

/// Methods to compute the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// FFT, non-uniform FFT, table, scattered kernels.
    Fast,
    /// Slow references: harmonic sums over the same waves, σ⁰ by quadrature at each pixel, the dense bunching integral. The
    /// cost grows with waves × pixels.
    Direct,
}

/// Complete result of a simulation. Fields are `[rows, columns]` of the image.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Positions of the pixels.
    pub raster: Raster,
    /// Elevation ζ \[m\].
    pub elevation: Field,
    /// Slope ∂ζ/∂x \[1\].
    pub slope_x: Field,
    /// Slope ∂ζ/∂y \[1\].
    pub slope_y: Field,
    /// Velocity of the water along x [m/s].
    pub velocity_x: Field,
    /// Velocity of the water along y [m/s].
    pub velocity_y: Field,
    /// Upward velocity of the water [m/s].
    pub velocity_z: Field,
    /// Velocity toward the radar [m/s].
    pub radial_velocity: Field,
    /// Cross-section σ⁰ per unit area, linear.
    pub sigma0: Field,
    /// Image intensity before speckle, linear, in units of σ⁰.
    pub intensity: Field,
    /// Image intensity with speckle.
    pub speckled: Field,
    /// Single-look complex image, `[rows, columns]` of the image, if the scene has an impulse response and one look; its
    /// squared modulus is [`Self::speckled`].
    pub slc: Option<Vec<Complex32>>,
    /// Labels of ships and wakes.
    pub labels: Labels,
    /// Computed terms, and estimates of the omitted ones.
    pub plan: Plan,
    /// Errors of the numerical methods.
    pub accuracy: Accuracy,
    /// Seconds by stage.
    pub seconds: Seconds,
    /// Method by which fields were computed.
    pub method: Method,
    /// The scene.
    pub scene: Scene,
}

/// The image of a scene, without the underlying fields.
#[derive(Debug, Clone)]
pub struct SarImage {
    /// Intensity before speckle, linear, in units of σ⁰, `[rows, columns]`; bit-identical to [`Simulation::intensity`].
    pub intensity: Field,
    /// Labels of ships and wakes.
    pub labels: Labels,
    /// Computed terms, and estimates of the omitted ones.
    pub plan: Plan,
    /// Errors of the numerical methods.
    pub accuracy: Accuracy,
    pub(super) speckling: Speckling,
}

impl SarImage {
    /// Intensity with speckle, if the plan has it; bit-identical to [`Simulation::speckled`].
    #[must_use]
    pub fn speckled(mut self) -> Field {
        self.speckling.apply(&mut self.intensity);
        self.intensity
    }
}

impl Simulation {
    /// The fields with their names in `fields.safetensors`.
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

    pub(super) fn fields_mut(&mut self) -> [&mut Field; 10] {
        [
            &mut self.elevation,
            &mut self.slope_x,
            &mut self.slope_y,
            &mut self.velocity_x,
            &mut self.velocity_y,
            &mut self.velocity_z,
            &mut self.sigma0,
            &mut self.radial_velocity,
            &mut self.intensity,
            &mut self.speckled,
        ]
    }

    /// Writes `image.png`, `fields.safetensors`, `labels.json` and `report.json` into a folder, each atomically, and
    /// returns the report.
    ///
    /// # Errors
    ///
    /// [`Error::File`](crate::Error::File) if the folder or a file cannot be written.
    #[cfg(feature = "png")]
    pub fn write(&self, folder: &Path) -> Result<Value> {
        self.write_in(folder, &GreyScale::default())
    }

    /// The amplitude scale of a quick-look, fixed by the scene's expected mean σ⁰, not by its pixels.
    #[must_use]
    pub fn quick_look(&self) -> GreyScale {
        let noise = self.scene.radar.nesz;
        let noise = noise.map_or(0.0, |db| 10f64.powf(0.1 * db));
        // A sea without any return is black on any scale.
        GreyScale::amplitude_around((self.plan.mean_sigma0 + noise).max(1e-5))
    }

    /// The image with speckle in 8-bit levels, `[rows, columns]`: the pixels of `image.png`.
    #[must_use]
    pub fn levels(&self, grey: &GreyScale) -> Vec<u8> {
        let level = |&power: &f32| grey.level(f64::from(power));
        self.speckled.values.iter().map(level).collect()
    }

    /// Writes only the image with speckle, as an 8-bit grey PNG.
    ///
    /// # Errors
    ///
    /// [`Error::File`](crate::Error::File) if the file cannot be written.
    #[cfg(feature = "png")]
    pub fn write_png(&self, path: &Path, grey: &GreyScale) -> Result<()> {
        let [rows, columns] = [self.raster.rows, self.raster.columns];
        output::write_png(path, &self.levels(grey), rows, columns)
    }

    /// As [`Self::write`], with the picture in the given grey scale.
    ///
    /// # Errors
    ///
    /// As [`Self::write`].
    #[cfg(feature = "png")]
    pub fn write_in(&self, folder: &Path, grey: &GreyScale) -> Result<Value> {
        whole_files::make_folder(folder)?;
        let path = |name: &str| folder.join(name);
        self.write_png(&path("image.png"), grey)?;
        let size = [self.raster.rows, self.raster.columns];
        let slc = self.slc.as_deref().map(|slc| (slc, size));
        output::write_fields(&path("fields.safetensors"), &self.named_fields(), slc)?;
        whole_files::write_json(&path("labels.json"), &self.labels)?;
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
            "accuracy": self.accuracy,
            "grey": grey,
            "files": names.map(|name| path(name).display().to_string()),
            "scene": self.scene,
        });
        whole_files::write_json(&path("report.json"), &report)?;
        Ok(report)
    }
}
