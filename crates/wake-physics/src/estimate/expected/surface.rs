//! The surface of a scene with a frozen plan: sums of waves, fields of effects, and σ⁰ as a function of slope.

use super::bright::BrightWaves;
use super::cross_section::{CrossSection, Facets, OUTER};
use super::frozen::{Frozen, averaged, with_ships_of};
use super::surroundings::{Slopes, Surroundings};
use super::waves::{Change, Linear, Nodes, Seen, WakeSums, difference, sums};
use crate::estimate::value::Value;
use crate::kelvin::fade_at;
use crate::models::Models;
use crate::scene::{Scene, Term};
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Values of wind and radar, by which tables are differenced.
pub(super) const OUTER_VALUES: [Value; OUTER] =
    [Value::WindSpeed, Value::WindToward, Value::Incidence];

/// A value with the models of the scene at −2, −1, 1 and 2 steps, or at −1 and 1.
pub(super) struct Moved {
    pub(super) value: Value,
    step: f64,
    points: [Option<(Scene, Models)>; 4],
}

impl Moved {
    fn new(value: Value, scene: &Scene, models: &Models) -> Self {
        let step = value.step(scene);
        let point = |steps: f64| {
            let outer = !value.is_of_ship();
            if outer && steps.abs() > 1.5 {
                return None;
            }
            let moved = value.moved(scene, steps * step);
            let models = match outer {
                true => averaged(&moved),
                false => with_ships_of(&moved, models),
            };
            Some((moved, models))
        };
        Self {
            value,
            step,
            points: [-2.0, -1.0, 1.0, 2.0].map(point),
        }
    }

    /// The derivative of a number of the models.
    pub(super) fn slope(&self, of: impl Fn(&Models) -> f64) -> f64 {
        let points = self.points.each_ref();
        difference(points.map(|p| p.as_ref().map(|(_, m)| of(m))), self.step)
    }
}

/// The surface of a scene, as sums of waves and fields of effects.
pub(super) struct Surface<'a> {
    pub(super) models: &'a Models,
    pub(super) moved: Vec<Moved>,
    pub(super) wakes: Vec<WakeSums>,
    pub(super) surroundings: Surroundings,
    pub(super) slopes: Vec<Slopes>,
    pub(super) fields: Vec<Linear>,
}

/// Largest values of a surface.
pub(super) struct Largest {
    pub(super) slope: f64,
    pub(super) elevation: f64,
    pub(super) acceleration: f64,
}

impl<'a> Surface<'a> {
    pub(super) fn new(
        frozen: &Frozen,
        scene: &Scene,
        models: &'a Models,
        values: &[Value],
    ) -> Self {
        let moved: Vec<Moved> = values
            .par_iter()
            .map(|&value| Moved::new(value, scene, models))
            .collect();
        let mut workspace = Workspace::default();
        let mut wakes = Vec::new();
        if frozen.plan.uses(Term::Kelvin) {
            for (n, wake) in models.wakes.iter().enumerate() {
                let seen = (wake, &models.transfer);
                let nodes = Nodes {
                    plan: &frozen.plan.wakes[n],
                    modulating: &frozen.modulating[n],
                    fields: &frozen.fields,
                    tolerance: frozen.tolerance,
                };
                let changes: Vec<Change<'_>> = match n {
                    0 => moved.iter().map(Moved::change).collect(),
                    _ => Vec::new(),
                };
                wakes.push(sums(&mut workspace, seen, &nodes, &changes, &frozen.raster));
            }
        }
        let around = |scene: &Scene, models: &Models| {
            let memory = &mut Workspace::default();
            Surroundings::new(memory, scene, models, &frozen.plan, &frozen.raster)
        };
        let surroundings = around(scene, models);
        let none = surroundings.each().iter().all(Option::is_none);
        let slopes = moved.par_iter().filter(|_| !none).map(|moved| {
            let points = moved.points.each_ref();
            let points = points.map(|p| p.as_ref().map(|(s, m)| around(s, m)));
            Slopes::new(moved.value, &points, moved.step)
        });
        Self {
            models,
            slopes: slopes.collect(),
            moved,
            wakes,
            surroundings,
            fields: frozen.fields.clone(),
        }
    }

    /// Whether all pixels are alike, without waves or effects.
    pub(super) fn is_uniform(&self) -> bool {
        self.wakes.is_empty() && self.surroundings.each().iter().all(Option::is_none)
    }

    pub(super) fn noise(&self) -> f64 {
        self.surroundings.noise
    }

    /// Largest values of the fields.
    pub(super) fn largest(&self, frozen: &Frozen) -> Largest {
        let raster = &frozen.raster;
        let of = |linear: Linear| {
            let at = self.fields.iter().position(|&f| f == linear);
            let pairs = self.wakes.iter().zip(&self.models.wakes);
            let largest = pairs.filter_map(|(sums, wake)| {
                let field = &sums.sums[at?].field;
                let value = |n: usize| {
                    let (i, j) = (n / raster.columns, n % raster.columns);
                    let place = [raster.x(j), raster.y(i)];
                    let shown = fade_at(&wake.track, wake.hull.length(), place);
                    shown * f64::from(field.values[n].abs())
                };
                Some((0..field.values.len()).map(value).fold(0.0, f64::max))
            });
            largest.sum::<f64>()
        };
        Largest {
            slope: of(Linear::SlopeX).max(of(Linear::SlopeY)),
            elevation: of(Linear::Elevation),
            acceleration: of(Linear::Acceleration),
        }
    }

    /// σ⁰ as a function of slope.
    pub(super) fn cross_section(&self, frozen: &Frozen) -> CrossSection {
        let of = |models: &Models| {
            let waves = match frozen.over_seas {
                true => BrightWaves::new(models, &frozen.plan),
                false => BrightWaves::default(),
            };
            (frozen.backscatter(models), waves)
        };
        let outer: Vec<Option<([Facets; 2], f64)>> = OUTER_VALUES
            .iter()
            .map(|value| {
                let moved = self.moved.iter().find(|m| m.value == *value)?;
                let [_, Some((_, below)), Some((_, above)), _] = &moved.points else {
                    return None;
                };
                Some(([of(below), of(above)], 2.0 * moved.step))
            })
            .collect();
        let outer: [Option<([&Facets; 2], f64)>; OUTER] = std::array::from_fn(|n| {
            let (pair, width) = outer[n].as_ref()?;
            Some((pair.each_ref(), *width))
        });
        CrossSection::new(&of(self.models), &outer, frozen.reach)
    }
}

impl Moved {
    /// Change of the first ship's waves with the value.
    fn change(&self) -> Change<'_> {
        let points = self.points.each_ref();
        Change {
            seen: points.map(|p| {
                p.as_ref()
                    .map(|(_, models)| -> Seen<'_> { (&models.wakes[0], &models.transfer) })
            }),
            step: self.step,
            value: self.value,
        }
    }
}
