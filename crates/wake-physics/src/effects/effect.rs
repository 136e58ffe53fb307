//! Interface of optional effects: what an effect changes, and the stages in which it takes part.

use crate::fields::Fields;
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::{Field, Raster};
use crate::scene::{Scene, Term};
use crate::waves::PlaneWaves;
use crate::workspace::Workspace;
use std::ops::Range;

/// Size of an effect's change to the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weight {
    /// Reason why the scene lacks the effect, if it does.
    pub(crate) absent: Option<&'static str>,
    /// Relative root mean square change of the intensity if the effect is left out.
    pub(crate) estimate: f64,
}

/// An optional effect: what it changes, and the stages in which it takes part.
pub(crate) trait Effect {
    /// The effect's name in scenes and plans.
    fn term(&self) -> Term;

    /// Estimates how much the effect changes the image of a scene.
    fn weigh(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> Weight;

    /// Waves that the effect adds to the surface.
    fn waves(&self, _site: &Site<'_>) -> Option<PlaneWaves> {
        None
    }

    /// Adds velocities to the surface, after all waves have been added.
    fn add_velocity(&self, _site: &Site<'_>, _fields: &mut Fields) {}

    /// Multiplies the remaining share of the Bragg waves; `None` means that all remain.
    fn damp(&self, _site: &Site<'_>, _memory: &mut Workspace, _remaining: &mut Option<Field>) {}

    /// Changes σ⁰.
    ///
    /// - `remaining`: share of the Bragg waves
    fn change_sigma0(&self, _site: &Site<'_>, _sigma0: &mut Field, _remaining: Option<&Field>) {}

    /// Adds to the intensity of the image before speckle.
    fn add_to_image(&self, _intensity: &mut Field) {}
}

/// The part of a scene that is computed in one go.
pub(crate) struct Site<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) models: &'a Models,
    /// All computed pixels, margin included.
    pub(crate) whole: Raster,
    /// The rows of `whole` to compute.
    pub(crate) raster: Raster,
    /// Index of the first of these rows.
    pub(crate) first_row: usize,
}

impl Site<'_> {
    /// Range of the computed rows in `whole`.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.raster.rows
    }
}

/// Reason given for an effect that the scene does not ask for.
pub(super) const NOT_ASKED_FOR: &str = "not requested";
/// Reason given for an effect that does not reach the image.
pub(super) const OUTSIDE: &str = "it does not reach the image";
