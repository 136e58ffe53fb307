//! The expected image of a scene with its derivatives by scene values.
//!
//! ```text
//! scene ─► wake: sums of waves ─┐
//!      └─► wind, sea ─► σ⁰(slope) ─► sources ─► bunching ─► response ─► intensity
//! ```
//!
//! Every stage passes its derivatives on by the chain rule. The choices of a plan (terms, pixels, margin, nodes of the wake,
//! steps of the kernel) are made once, for one scene, so the image is a smooth function of the values.

mod bright;
mod cross_section;
mod drawn;
mod frozen;
mod surface;
mod surroundings;
mod waves;

use super::value::Value;
use crate::error::{Error, Result};
use crate::models::Models;
use crate::pixels::means_over;
use crate::plan::Plan;
use crate::prepared::Prepared;
use crate::raster::{Field, Raster};
use crate::sar::impulse::Reflectivity;
use crate::sar::smooth::{Displacement, SmoothSum};
use crate::scene::{Scene, Term};
use drawn::Drawn;
use frozen::{Frozen, averaged, imaging};
use surface::Surface;
use waves::Linear;

/// The expected image of a scene, and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// Mean over all seas of the intensity before speckle. Unlike [`expected_intensity`](crate::expected_intensity), it includes
    /// the shift and blur by bright waves.
    pub intensity: Field,
    /// Derivative by each value, in units of σ⁰ per unit of the value.
    pub derivatives: Vec<(Value, Field)>,
    /// Contrast of the sources within the distance over which waves of the sea displace them \[1\]: variance of their intensity
    /// over the square of its mean.
    pub contrast: Field,
}

/// Expected images of scenes that differ by a few values, with the plan of one of them frozen.
///
/// ```
/// use wake_physics::Scene;
/// use wake_physics::estimate::{ExpectedImage, Value};
///
/// let mut scene = Scene::default();
/// (scene.grid.rows, scene.grid.columns) = (48, 48);
/// let image = ExpectedImage::new(&scene, &[Value::Speed])?;
/// let here = image.at(&scene)?;
/// let faster = image.at(&Value::Speed.moved(&scene, 0.01))?;
/// let (_, slope) = &here.derivatives[0];
/// let linear = here.intensity.at(20, 20) + 0.01 * slope.at(20, 20);
/// assert!((faster.intensity.at(20, 20) / linear - 1.0).abs() < 1e-2);
/// # Ok::<(), wake_physics::Error>(())
/// ```
///
/// # Approximations
///
/// - The weights of range have rounded corners: at most 0.012 of a pixel's power moves to its neighbour.
/// - σ⁰ is a spline of the slope, constant beyond 1.25 times the steepest slope of the frozen scene.
/// - Derivatives of effects (turbulent wake, edges, gusts) and of σ⁰ by wind and incidence are finite differences of single
///   stages, with relative errors of about 1e-5.
/// - The frozen band keeps its waves, and the waves that modulate stay the same.
///
/// # Limits
///
/// Ships on straight tracks only, and a sea with wind. Echoes of ships and waves below the pixels ([`Term::SubpixelWake`]) are
/// left out: these waves change within centimetres, and the derivative at the middle of a pixel is not the derivative of the pixel's mean.
#[derive(Debug)]
pub struct ExpectedImage {
    values: Vec<Value>,
    /// Pixels that are computed, and pixels of the image.
    computed: Raster,
    image: Raster,
    frozen: Frozen,
    sum: SmoothSum,
}

/// The expected image of a scene and its derivatives by some values, planned for this scene.
///
/// # Errors
///
/// As in [`ExpectedImage::new`].
pub fn expected_with_derivatives(scene: &Scene, values: &[Value]) -> Result<Expected> {
    ExpectedImage::new(scene, values)?.at(scene)
}

/// Share of the tolerance allowed for sums of waves.
const SUMS: f64 = 0.05;

/// Factor by which slopes may exceed the steepest slope of the frozen scene.
const STEEPER: f64 = 1.25;

impl ExpectedImage {
    /// Freezes the plan of a scene.
    ///
    /// # Errors
    ///
    /// A value of the scene out of its range, a grid that does not fit in memory, a ship that turns, a sea without wind, or
    /// the value of a ship without a ship.
    pub fn new(scene: &Scene, values: &[Value]) -> Result<Self> {
        scene.validate()?;
        let mut prepared = Prepared::new(scene);
        let mut plan = Plan::of(&prepared)?;
        let raster = plan.with_margin(&prepared.models.pixels.computed);
        let over_seas = plan.uses(Term::Sea) || plan.uses(Term::Swell);
        if over_seas {
            prepared = prepared.over_all_seas();
            plan = plan.over_all_seas();
        }
        let (models, plan) = (&prepared.models, &plan);
        check(scene, models, values)?;
        let tolerance = (SUMS * scene.model.tolerance).max(1e-6);
        let fields = Linear::needed(|term| plan.uses(term));
        let pairs = || models.wakes.iter().zip(&plan.wakes);
        let modulating = pairs()
            .map(|(wake, plan)| waves::modulating(wake, plan))
            .collect();
        let imaging = imaging(models, plan);
        let displacement = Displacement::new(&imaging, &raster);
        let mut frozen = Frozen {
            plan: plan.clone(),
            over_seas,
            ships: models.wakes.len(),
            raster,
            fields,
            modulating,
            reach: 0.0,
            tolerance,
        };
        let surface = Surface::new(&frozen, scene, models, &[]);
        let largest = surface.largest(&frozen);
        frozen.reach = (STEEPER * largest.slope).clamp(0.1, 1.5);
        let square = STEEPER * largest.acceleration.powi(2);
        let narrowest = displacement.variance;
        let widest = 1.3 * narrowest + displacement.variance_per_square * square;
        let lean = STEEPER * largest.elevation * displacement.columns_per_elevation;
        let computed = models.pixels.computed;
        Ok(Self {
            values: values.to_vec(),
            image: models.pixels.image,
            sum: SmoothSum::new([&raster, &computed], [0.8 * narrowest, widest], lean),
            computed,
            frozen,
        })
    }

    /// Values by which the image is differentiated, in order.
    #[must_use]
    pub fn values(&self) -> &[Value] {
        &self.values
    }

    /// The image of a scene and its derivatives.
    ///
    /// - `scene`: differs from the frozen scene by [`Value`]s only, and too little to change its plan
    ///
    /// # Errors
    ///
    /// A value of the scene out of its range, or another number of ships.
    pub fn at(&self, scene: &Scene) -> Result<Expected> {
        let fields = match self.values.len() {
            0 => self.draw::<0>(scene, &[], false),
            1..=5 => self.draw::<5>(scene, &self.values, false),
            6..=7 => self.draw::<7>(scene, &self.values, false),
            _ => self.draw::<{ Value::ALL.len() }>(scene, &self.values, false),
        }?;
        let mut fields = fields.into_iter();
        let intensity = fields.next().unwrap_or_default();
        let mut contrast = self.draw::<0>(scene, &[], true)?.swap_remove(0);
        for (square, mean) in contrast.values.iter_mut().zip(&intensity.values) {
            *square = (*square / (mean * mean) - 1.0).max(0.0);
        }
        Ok(Expected {
            derivatives: self.values.iter().copied().zip(fields).collect(),
            intensity,
            contrast,
        })
    }

    /// The image of a scene alone.
    ///
    /// # Errors
    ///
    /// As in [`Self::at`].
    pub fn intensity(&self, scene: &Scene) -> Result<Field> {
        Ok(self.draw::<0>(scene, &[], false)?.swap_remove(0))
    }

    /// The image and its derivatives.
    ///
    /// - `squared`: compute the mean of the squared sources instead
    fn draw<const N: usize>(
        &self,
        scene: &Scene,
        values: &[Value],
        squared: bool,
    ) -> Result<Vec<Field>> {
        scene.validate()?;
        let models = averaged(scene);
        check(scene, &models, values)?;
        if models.wakes.len() != self.frozen.ships {
            return Err(Error::Conflict {
                name: "number of ships".to_owned(),
                value: models.wakes.len().to_string(),
                requirement: format!("but the plan was made for {}", self.frozen.ships),
            });
        }
        let surface = Surface::new(&self.frozen, scene, &models, values);
        let drawn = Drawn::<N>::new(&self.frozen, &surface);
        let by: Vec<usize> = (0..values.len()).collect();
        let mut fields = match surface.is_uniform() {
            true => {
                let power = drawn.source(0, 0).power;
                let power = if squared { power * power } else { power };
                let values = std::iter::once(power.value).chain(by.iter().map(|&n| power.by[n]));
                values
                    .map(|v| Field::constant(&self.computed, v as f32))
                    .collect()
            }
            false => self.sum.image(&by, |i, j| {
                let mut source = drawn.source(i, j);
                if squared {
                    source.power = source.power * source.power;
                }
                source
            }),
        };
        let noise = if squared { 0.0 } else { surface.noise() as f32 };
        fields[0].values.iter_mut().for_each(|v| *v += noise);
        let finish = |field: Field| match &models.response {
            Some(response) => response.filtered(
                &Reflectivity {
                    raster: &self.computed,
                    intensity: &field,
                    points: &[],
                },
                &self.image,
            ),
            None if self.computed == self.image => field,
            None => means_over(&field, &self.computed, &self.image),
        };
        Ok(fields.into_iter().map(finish).collect())
    }
}

/// Checks that a scene meets the requirements of a smooth image.
fn check(scene: &Scene, models: &Models, values: &[Value]) -> Result<()> {
    let conflict = |name: &str, value: String, requirement: &str| {
        Err(Error::Conflict {
            name: name.to_owned(),
            value,
            requirement: requirement.to_owned(),
        })
    };
    if models.wakes.iter().any(|wake| wake.track.turn().is_some()) {
        let requirement = "but derivatives need ships on straight tracks: set it to 0";
        return conflict("ship.turn_rate", "not 0".to_owned(), requirement);
    }
    if models.short_waves_vanish() {
        let requirement = "but derivatives need a wind that raises short waves: raise it";
        return conflict(
            "sea.wind_speed",
            scene.sea.wind_speed.to_string(),
            requirement,
        );
    }
    if let Some(value) = values.iter().find(|v| v.is_of_ship())
        && scene.ships.is_empty()
    {
        let requirement = "but the scene has no ship: add one";
        return conflict(value.key(), "to be estimated".to_owned(), requirement);
    }
    Ok(())
}
