//! From the mean intensity to the image with speckle.

use crate::models::Models;
use crate::raster::{Field, Raster};
use crate::sar::ImpulseResponse;
use crate::sar::impulse::{Looks, PointTarget, Reflectivity};
use crate::sar::speckle::speckle;
use crate::scene::Scene;
use num_complex::Complex32;

/// What the radar looks at before its impulse response.
#[derive(Debug, Clone)]
pub(super) struct Exposure {
    pub(super) response: ImpulseResponse,
    /// Places of the sources.
    pub(super) sources: Raster,
    /// Their intensity, noise included.
    pub(super) intensity: Field,
    /// Ships and their ghosts.
    pub(super) points: Vec<PointTarget>,
    /// Pixels of the image.
    pub(super) image: Raster,
}

impl Exposure {
    fn reflectivity(&self) -> Reflectivity<'_> {
        Reflectivity {
            raster: &self.sources,
            intensity: &self.intensity,
            points: &self.points,
        }
    }

    /// Intensity of the image before speckle.
    pub(super) fn mean(&self) -> Field {
        self.response.mean(&self.reflectivity(), &self.image)
    }
}

/// How the image gets its speckle.
#[derive(Debug, Clone)]
pub(super) enum Speckling {
    /// It has none.
    Without,
    /// Each pixel by itself: looks, seed.
    Pixels(u32, u64),
    /// Through the impulse response.
    Looks(Box<Exposure>, Looks),
}

impl Speckling {
    /// What a scene asks for; `exposure` where its image has an impulse response.
    pub(super) fn of(scene: &Scene, models: &Models, exposure: Option<Exposure>) -> Self {
        let (count, seed) = (scene.radar.looks, scene.seed);
        match (exposure, models.response) {
            (Some(exposure), Some(response)) => {
                let overlap = scene.radar.look_overlap.unwrap_or(0.0);
                // The looks of the products modelled lie in range; elsewhere the windows are alike.
                let equivalent = response.range.window.overlapping_looks(count, overlap);
                Self::Looks(Box::new(exposure), Looks { equivalent, seed })
            }
            _ => Self::Pixels(count, seed),
        }
    }

    /// Gives an intensity its speckle, and returns the complex image where there is one look of one.
    pub(super) fn apply(&self, intensity: &mut Field) -> Option<Vec<Complex32>> {
        match self {
            Self::Without => None,
            Self::Pixels(looks, seed) => {
                speckle(intensity, *looks, *seed);
                None
            }
            Self::Looks(exposure, looks) if looks.equivalent <= 1.0 => {
                let source = exposure.reflectivity();
                let slc = exposure
                    .response
                    .single_look(&source, &exposure.image, looks.seed);
                for (value, s) in intensity.values.iter_mut().zip(&slc) {
                    *value = s.norm_sqr();
                }
                Some(slc)
            }
            Self::Looks(exposure, looks) => {
                let source = exposure.reflectivity();
                *intensity = exposure.response.multilook(&source, &exposure.image, looks);
                None
            }
        }
    }

    /// The block of the sources' intensity, where there is one.
    pub(super) fn into_sources(self) -> Option<Field> {
        match self {
            Self::Looks(exposure, _) => Some(exposure.intensity),
            Self::Without | Self::Pixels(..) => None,
        }
    }
}
