//! Scheduler options that programs set; all others come from configuration files.

use serde_json::Value;

use super::prediction::Prediction;
use super::spacing::Spacing;

/// Option of a scheduler; methods that do not have it ignore it, as in diffusers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SchedulerOption {
    /// Quantity that the model predicts (`prediction_type`).
    Prediction(Prediction),
    /// Spacing of the visited steps (`timestep_spacing`).
    Spacing(Spacing),
    /// Number added to steps with leading spacing (`steps_offset`).
    StepsOffset(usize),
    /// Noise levels of Karras et al. (2022), Eq. 5 (`use_karras_sigmas`).
    KarrasSigmas(bool),
    /// A schedule without signal in its last step (`rescale_betas_zero_snr`).
    ZeroTerminalSnr(bool),
    /// Whether clean images are clipped to [−1, 1] (`clip_sample`).
    ClipSample(bool),
    /// Order of DPM-Solver++ and UniPC (`solver_order`).
    SolverOrder(usize),
    /// Order of LMS (`order`, an argument of diffusers' steps).
    LmsOrder(usize),
    /// Amount of noise that DDIM adds, 0 to 1 (`eta`, an argument of diffusers' steps).
    Eta(f64),
}

impl SchedulerOption {
    /// Key and value of the option in diffusers.
    pub(super) fn entry(self) -> (&'static str, Value) {
        match self {
            Self::Prediction(kind) => ("prediction_type", kind.name().into()),
            Self::Spacing(spacing) => ("timestep_spacing", spacing.name().into()),
            Self::StepsOffset(steps) => ("steps_offset", steps.into()),
            Self::KarrasSigmas(on) => ("use_karras_sigmas", on.into()),
            Self::ZeroTerminalSnr(on) => ("rescale_betas_zero_snr", on.into()),
            Self::ClipSample(on) => ("clip_sample", on.into()),
            Self::SolverOrder(order) => ("solver_order", order.into()),
            Self::LmsOrder(order) => ("order", order.into()),
            Self::Eta(eta) => ("eta", eta.into()),
        }
    }
}
