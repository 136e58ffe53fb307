//! What every optional effect has: what it changes, and the stages that it takes part in.

use crate::fields::Fields;
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::{Field, Raster};
use crate::scene::{Scene, Term};
use crate::waves::PlaneWaves;
use crate::workspace::Workspace;
use std::ops::Range;

/// What an effect changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weight {
    /// Why the scene has nothing of it.
    pub(crate) absent: Option<&'static str>,
    /// Relative root mean square change of the intensity without it.
    pub(crate) estimate: f64,
}

/// One optional effect: what it changes, and the stages that it takes part in.
pub(crate) trait Effect {
    /// Its name in scenes and plans.
    fn term(&self) -> Term;

    /// What it changes in a scene.
    fn weigh(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> Weight;

    /// Waves that it adds to the surface.
    fn waves(&self, _site: &Site<'_>) -> Option<PlaneWaves> {
        None
    }

    /// Adds velocities to the surface, once all waves are in.
    fn add_velocity(&self, _site: &Site<'_>, _fields: &mut Fields) {}

    /// Multiplies the share of the Bragg waves that remains; `None` is all of them.
    fn damp(&self, _site: &Site<'_>, _memory: &mut Workspace, _remaining: &mut Option<Field>) {}

    /// Changes σ⁰.
    ///
    /// - `remaining`: share of the Bragg waves
    fn change_sigma0(&self, _site: &Site<'_>, _sigma0: &mut Field, _remaining: Option<&Field>) {}

    /// Adds to the intensity of the image before speckle.
    fn add_to_image(&self, _intensity: &mut Field) {}
}

/// The part of a scene that is drawn at once.
pub(crate) struct Site<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) models: &'a Models,
    /// All computed pixels with their margin.
    pub(crate) whole: Raster,
    /// The rows of them that are drawn.
    pub(crate) raster: Raster,
    /// Number of the first of these rows.
    pub(crate) first_row: usize,
}

impl Site<'_> {
    /// The rows that are drawn, of all.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.raster.rows
    }
}

/// Why an effect that a scene must ask for is absent.
pub(super) const NOT_ASKED_FOR: &str = "not asked for";
/// Why an effect that lies beside the image is absent.
pub(super) const OUTSIDE: &str = "it does not reach the image";
