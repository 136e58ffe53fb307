//! The first part: the patch transform, fitted in closed form.

use serde_json::json;

use super::super::latents::fit_patches;
use super::super::progress::counted;
use super::WakeTraining;
use crate::error::Result;
use wake_ldm::network::{Part, PatchTransform};
use wake_nn::weights::{Layout, Precision, save_as};

/// Images that the patch transform is fitted to.
const FITTED: u64 = 400;
/// Largest number of channels, which loses nothing.
const CHANNELS: usize = 64;

impl WakeTraining<'_> {
    /// Fits the patch transform to the first 400 pairs, and writes it with the explained variance of every number of channels
    /// (`explained_variance.json`).
    pub(super) fn fit_patches(&self) -> Result<()> {
        let (pairs, device) = (self.pairs()?, self.options.device());
        let (source, count) = (pairs.source(), pairs.len().min(FITTED));
        let fitted = counted(
            "images for the patch transform",
            count,
            self.progress,
            |done| fit_patches(source, count, &self.config, &device, done),
        );
        let (transform, explained) = fitted?;
        let path = self.out(Part::Patches.file());
        save_as(&transform, Layout::Diffusers, &path, Precision::F32)?;
        let row = |channels| {
            json!({
                "channels": channels, "variance": explained.kept(channels), "psnr_db": finite(explained.psnr(channels)),
            })
        };
        let rows: Vec<_> = (1..=CHANNELS).map(row).collect();
        Ok(whole_files::write_json(
            &self.out("explained_variance.json"),
            &rows,
        )?)
    }

    /// The patch transform of an earlier run, or a new one.
    pub(super) fn patches(&self) -> Result<PatchTransform> {
        if !self.out(Part::Patches.file()).exists() {
            self.fit_patches()?;
        }
        let empty = PatchTransform::zeros(self.config.latent_channels, &self.options.device());
        self.trained(empty, Part::Patches)
    }
}

/// `None` for the infinite PSNR of all channels, since JSON has no infinity.
fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}
