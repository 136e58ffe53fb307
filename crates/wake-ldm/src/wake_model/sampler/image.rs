//! A generated image as a radar would deliver it, with its scene and labels.

use wake_physics::grey::GreyScale;
use wake_physics::labels::Labels;
use wake_physics::{Field, Scene, labels_of, unit_speckle};

use crate::error::Result;

/// Time in seconds of the stages of one call, for all images of its batch together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SampleSeconds {
    /// From words to numbers.
    pub text: f64,
    /// From numbers to the mean and spread of the latents, and to the noise.
    pub expect: f64,
    /// From noise to latents, over all steps.
    pub denoise: f64,
    /// From latents to grey.
    pub decode: f64,
    /// Sum of the four; labels and speckle are not included.
    pub total: f64,
}

/// Generated image with its scene and labels. Fields are `[rows, columns]`.
#[derive(Debug, Clone)]
pub struct WakeImage {
    /// Grey 0…1 from the model. Only a learnt sea contains speckle.
    pub grey: Field,
    /// Linear intensity of the same image, in the unit of σ⁰.
    pub intensity: Field,
    /// Intensity with speckle: multiplied by [`unit_speckle`], except for a learnt sea, which already has its own.
    pub speckled: Field,
    /// Labels of [`scene`](Self::scene).
    pub labels: Labels,
    /// The scene of the image: the given values, and defaults for those left open.
    pub scene: Scene,
    /// Mapping between intensity and grey.
    pub scale: GreyScale,
    /// Time in seconds by stage.
    pub seconds: SampleSeconds,
}

/// Multiplies an intensity by the speckle of its scene's radar.
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) for an invalid scene.
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

    /// Makes an image from an intensity that already has speckle.
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

    /// Speckled image as 8-bit grey levels, row by row.
    pub fn levels(&self) -> Vec<u8> {
        self.speckled
            .values
            .iter()
            .map(|&v| self.scale.level(f64::from(v)))
            .collect()
    }
}
