//! Contributions of optional effects to a mean image, as fields that each effect changes affinely.

use crate::effects::{Effects, Site};
use crate::estimate::value::Value;
use crate::fields::Fields;
use crate::models::Models;
use crate::plan::Plan;
use crate::raster::{Field, Raster};
use crate::scene::{Scene, Term};
use crate::workspace::Workspace;

/// Fields of a scene's effects; `None` where no effect contributes.
#[derive(Default)]
pub(super) struct Surroundings {
    /// Share of the Bragg waves that remains \[1\].
    pub(super) remaining: Option<Field>,
    /// Velocity of the water along x [m/s].
    pub(super) velocity_x: Option<Field>,
    /// Factor on σ⁰, and term added to it: effects change σ⁰ affinely.
    pub(super) factor: Option<Field>,
    pub(super) added: Option<Field>,
    /// Noise added to the intensity.
    pub(super) noise: f64,
}

/// Number of the fields.
pub(super) const FIELDS: usize = 4;

impl Surroundings {
    pub(super) fn new(
        workspace: &mut Workspace,
        scene: &Scene,
        models: &Models,
        plan: &Plan,
        raster: &Raster,
    ) -> Self {
        let effects = Effects::new(scene, models);
        let site = Site {
            scene,
            models,
            whole: *raster,
            raster: *raster,
            first_row: 0,
        };
        let mut out = Self::default();
        let drawn = || effects.each().filter(|e| plan.uses(e.term()));
        let flat = || Field::constant(raster, 0.0);
        for effect in drawn() {
            effect.damp(&site, workspace, &mut out.remaining);
        }
        if plan.uses(Term::BrightEdge) {
            let mut fields = Fields {
                velocity_x: flat(),
                velocity_y: flat(),
                ..Fields::default()
            };
            drawn().for_each(|effect| effect.add_velocity(&site, &mut fields));
            out.velocity_x = Some(fields.velocity_x);
        }
        let changing = [Term::Slicks, Term::Breaking, Term::BrightEdge, Term::Gusts];
        if changing.iter().any(|&term| plan.uses(term)) {
            let probe = |sigma0: f32| {
                let mut field = Field::constant(raster, sigma0);
                let remaining = out.remaining.as_ref();
                drawn().for_each(|e| e.change_sigma0(&site, &mut field, remaining));
                field
            };
            let (nothing, mut one) = (probe(0.0), probe(1.0));
            for (one, nothing) in one.values.iter_mut().zip(&nothing.values) {
                *one -= nothing;
            }
            (out.factor, out.added) = (Some(one), Some(nothing));
        }
        let mut pixel = Field {
            rows: 1,
            columns: 1,
            values: vec![0.0],
        };
        drawn().for_each(|effect| effect.add_to_image(&mut pixel));
        out.noise = f64::from(pixel.values[0]);
        out
    }

    /// All fields, in a fixed order.
    pub(super) fn each(&self) -> [Option<&Field>; FIELDS] {
        [
            self.remaining.as_ref(),
            self.velocity_x.as_ref(),
            self.factor.as_ref(),
            self.added.as_ref(),
        ]
    }
}

/// Derivatives of the fields by one value.
pub(super) struct Slopes {
    pub(super) value: Value,
    pub(super) fields: [Option<Field>; FIELDS],
}

impl Slopes {
    /// - `points`: surroundings at −2, −1, 1 and 2 steps, or at the middle two only
    pub(super) fn new(value: Value, points: &[Option<Surroundings>; 4], step: f64) -> Self {
        let field = |n: usize| {
            let each = points
                .each_ref()
                .map(|p| p.as_ref().and_then(|p| p.each()[n]));
            let (below, above) = (each[1]?, each[2]?);
            if below.values == above.values {
                return None;
            }
            let at = |i: usize| each.map(|f| f.map(|f| f64::from(f.values[i])));
            let slope = |i| super::waves::difference(at(i), step) as f32;
            Some(Field {
                values: (0..below.values.len()).map(slope).collect(),
                ..*below
            })
        };
        Self {
            value,
            fields: std::array::from_fn(field),
        }
    }
}
