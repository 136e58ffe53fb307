//! An image as a radar would deliver it, with what is known about it.

use wake_physics::grey::GreyScale;
use wake_physics::labels::Labels;
use wake_physics::{Field, Scene, labels_of, unit_speckle};

use crate::error::Result;

/// Seconds of the stages of one call, for all images of its batch together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SampleSeconds {
    /// Words to numbers.
    pub text: f64,
    /// Numbers to the mean and spread of the latents, and to the noise.
    pub expect: f64,
    /// Steps from noise to latents.
    pub denoise: f64,
    /// Latents to grey.
    pub decode: f64,
    /// The four together; labels and speckle are not in it.
    pub total: f64,
}

/// A generated image. Fields are `[rows, columns]`.
#[derive(Debug, Clone)]
pub struct WakeImage {
    /// Grey 0…1 as the model draws it: without speckle, but with that of a learnt sea.
    pub grey: Field,
    /// Intensity of the same, linear, in the unit of σ⁰.
    pub intensity: Field,
    /// Intensity with speckle: times [`unit_speckle`], or of the learnt sea, which gets no second one.
    pub speckled: Field,
    /// Labels of [`scene`](Self::scene).
    pub labels: Labels,
    /// The scene of the image: the given values, and defaults for those left open.
    pub scene: Scene,
    /// The mapping between intensity and grey.
    pub scale: GreyScale,
    /// Seconds by stage.
    pub seconds: SampleSeconds,
}

/// An intensity times the speckle of its scene's radar.
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) for a scene that is not valid.
pub fn speckled(intensity: &Field, scene: &Scene) -> Result<Field> {
    let mut speckled = unit_speckle(scene)?;
    let pixels = speckled.values.iter_mut().zip(&intensity.values);
    pixels.for_each(|(speckle, value)| *speckle *= value);
    Ok(speckled)
}

impl WakeImage {
    pub(super) fn new(
        grey: Field,
        scale: GreyScale,
        scene: Scene,
        seconds: SampleSeconds,
    ) -> Result<Self> {
        let intensity = Field {
            values: grey
                .values
                .iter()
                .map(|&g| scale.sigma0(f64::from(g)) as f32)
                .collect(),
            ..grey.clone()
        };
        Ok(Self {
            grey,
            speckled: speckled(&intensity, &scene)?,
            intensity,
            labels: labels_of(&scene),
            scene,
            scale,
            seconds,
        })
    }

    /// An image whose intensity has its speckle already.
    pub(super) fn with_speckle(
        intensity: Field,
        scale: GreyScale,
        scene: Scene,
        seconds: SampleSeconds,
    ) -> Self {
        let grey = |&v: &f32| scale.grey(f64::from(v)) as f32;
        Self {
            grey: Field {
                values: intensity.values.iter().map(grey).collect(),
                ..intensity
            },
            speckled: intensity.clone(),
            intensity,
            labels: labels_of(&scene),
            scene,
            scale,
            seconds,
        }
    }

    /// The speckled image as 8-bit levels of grey, row after row.
    pub fn levels(&self) -> Vec<u8> {
        self.speckled
            .values
            .iter()
            .map(|&v| self.scale.level(f64::from(v)))
            .collect()
    }
}
