//! Similarity of images to simulated ones over all scenes of a recipe, before speckle and with it.

use std::time::Instant;

use burn::tensor::Device;
use rayon::prelude::*;
use serde::Serialize;
use wake_physics::{Field, Scene};

use super::judge::told_apart;
use super::source::{ImageSource, Told};
use super::view::View;
use crate::TwoSample;
use crate::error::Result;
use wake_ldm::sampler::speckled;

/// One kind of image against simulated ones of the same scenes.
#[derive(Debug, Clone, Serialize)]
pub struct DomainRow {
    /// Kind of image.
    pub image: &'static str,
    /// Two-sample test of grey before speckle; `None` for fewer than four scenes.
    pub before_speckle: Option<TwoSample>,
    /// The same with the speckle of each scene's radar.
    pub with_speckle: Option<TwoSample>,
    /// Seconds per image on all cores, without speckle.
    pub seconds: f64,
}

/// Grey of a source's images, before speckle and with it, in the order of the scenes.
#[derive(Debug, Clone)]
pub struct Views {
    /// Before speckle.
    pub plain: Vec<Field>,
    /// With the speckle of each scene's radar, as a user of a data set sees them.
    pub speckled: Vec<Field>,
    /// Seconds per image on all cores, without speckle.
    pub seconds: f64,
}

impl Views {
    /// Draws images of scenes, conditioned on the whole scene.
    ///
    /// - `step`: called with the number of images after each batch
    ///
    /// # Errors
    ///
    /// As [`ImageSource::draw`].
    pub fn draw(source: &dyn ImageSource, scenes: &[Scene], step: impl FnMut(u64)) -> Result<Self> {
        let start = Instant::now();
        let view = View::default();
        let images = view.draw_all(source, scenes, Told::Scene, step)?;
        let seconds = start.elapsed().as_secs_f64() / scenes.len().max(1) as f64;
        Ok(Self {
            speckled: greys_with_speckle(scenes, &images)?,
            plain: images.iter().map(|image| view.grey(image)).collect(),
            seconds,
        })
    }

    /// Two-sample tests of these images against simulated ones of the same scenes and other seas.
    ///
    /// - `device`: device of the classifier, without autodiff
    ///
    /// # Errors
    ///
    /// As [`classifier_two_sample_test`](crate::classifier_two_sample_test).
    pub fn row(&self, image: &'static str, simulated: &Self, device: &Device) -> Result<DomainRow> {
        Ok(DomainRow {
            image,
            before_speckle: told_apart(&simulated.plain, &self.plain, device)?,
            with_speckle: told_apart(&simulated.speckled, &self.speckled, device)?,
            seconds: self.seconds,
        })
    }
}

/// Grey of images with the speckle of their scenes.
fn greys_with_speckle(scenes: &[Scene], images: &[Field]) -> Result<Vec<Field>> {
    let pairs: Vec<_> = scenes.iter().zip(images).collect();
    let greys = pairs
        .par_iter()
        .map(|(scene, image)| Ok(View::default().grey(&speckled(image, scene)?)));
    greys.collect()
}
