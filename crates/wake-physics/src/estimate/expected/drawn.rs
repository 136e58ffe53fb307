//! A scene drawn with frozen plan: the fields of its surface, and what each pixel returns.

use super::cross_section::{CrossSection, OUTER};
use super::surroundings::{FIELDS, Slopes, Surroundings};
use super::waves::{Change, LINEAR, Linear, Seen, WakeSums, difference, sums};
use super::{ExpectedImage, averaged, imaging, with_ships_of};
use crate::estimate::value::Value;
use crate::kelvin::{fade_at, fade_with_slope};
use crate::models::Models;
use crate::numeric::Dual;
use crate::sar::smooth::{Displacement, Source};
use crate::scattering::{Backscatter, SlopeCovariance};
use crate::scene::{Scene, Term};
use crate::workspace::Workspace;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Values of wind and radar, by which tables are differenced.
const OUTER_VALUES: [Value; OUTER] = [Value::WindSpeed, Value::WindToward, Value::Incidence];

/// A value with the models of the scene at −2, −1, 1 and 2 steps, or at −1 and 1.
struct Moved {
    value: Value,
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
    fn slope(&self, of: impl Fn(&Models) -> f64) -> f64 {
        let points = self.points.each_ref();
        difference(points.map(|p| p.as_ref().map(|(_, m)| of(m))), self.step)
    }
}

/// The surface of a scene, as sums of waves and fields of effects.
pub(super) struct Surface<'a> {
    models: &'a Models,
    moved: Vec<Moved>,
    wakes: Vec<WakeSums>,
    surroundings: Surroundings,
    slopes: Vec<Slopes>,
    fields: Vec<Linear>,
}

/// Largest values of a surface.
pub(super) struct Largest {
    pub(super) slope: f64,
    pub(super) elevation: f64,
    pub(super) acceleration: f64,
    /// Variance of slopes below the pixels.
    pub(super) roughness: f64,
}

impl<'a> Surface<'a> {
    pub(super) fn new(
        frozen: &ExpectedImage,
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
                let changes: Vec<Change<'_>> = match n {
                    0 => moved.iter().map(Moved::change).collect(),
                    _ => Vec::new(),
                };
                wakes.push(sums(
                    &mut workspace,
                    (seen, &frozen.plan.wakes[n]),
                    (&frozen.fields, &changes),
                    &frozen.raster,
                    (frozen.tolerance, &frozen.modulating[n]),
                ));
            }
        }
        let around = |scene: &Scene, models: &Models| {
            let memory = &mut Workspace::default();
            Surroundings::new(memory, (scene, models), &frozen.plan, &frozen.raster)
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

    /// Whether all pixels are alike: neither waves nor effects.
    pub(super) fn is_uniform(&self) -> bool {
        self.wakes.is_empty() && self.surroundings.each().iter().all(Option::is_none)
    }

    pub(super) fn noise(&self) -> f64 {
        self.surroundings.noise
    }

    /// Largest values.
    pub(super) fn largest(&self, raster: &crate::Raster) -> Largest {
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
        let rough = self.surroundings.roughness.as_ref();
        let most = |n: usize| {
            rough.map_or(0.0, |fields| {
                f64::from(fields[n].values.iter().copied().fold(0.0, f32::max))
            })
        };
        Largest {
            slope: of(Linear::SlopeX).max(of(Linear::SlopeY)),
            elevation: of(Linear::Elevation),
            acceleration: of(Linear::Acceleration).hypot(most(3)),
            roughness: most(0).max(most(2)),
        }
    }

    /// σ⁰ by the slope, with `nodes` nodes or as many as it needs.
    pub(super) fn cross_section(&self, frozen: &ExpectedImage, nodes: Option<usize>) -> CrossSection {
        let of = |models: &Models| {
            let uses = |term| frozen.plan.uses(term);
            models.backscatter(uses(Term::TiltAverage), uses(Term::Specular))
        };
        let outer: Vec<Option<([Backscatter; 2], f64)>> = OUTER_VALUES
            .iter()
            .map(|value| {
                let moved = self.moved.iter().find(|m| m.value == *value)?;
                let [_, Some((_, below)), Some((_, above)), _] = &moved.points else {
                    return None;
                };
                Some(([of(below), of(above)], 2.0 * moved.step))
            })
            .collect();
        let outer: [Option<([&Backscatter; 2], f64)>; OUTER] = std::array::from_fn(|n| {
            let (pair, width) = outer[n].as_ref()?;
            Some((pair.each_ref(), *width))
        });
        CrossSection::new(&of(self.models), &outer, frozen.reach, nodes)
    }
}

impl Moved {
    /// How the value changes the waves of the first ship.
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

/// Numbers of the first ship's place, with their derivatives by value.
struct Place<const N: usize> {
    position: [Dual<N>; 2],
    forward: [Dual<N>; 2],
    length: Dual<N>,
}

/// Everything that pixels are computed from.
pub(super) struct Drawn<'a, const N: usize> {
    surface: &'a Surface<'a>,
    cross_section: CrossSection,
    displacement: Displacement,
    raster: crate::Raster,
    /// Ships, of which the first has derivatives.
    places: Vec<Place<N>>,
    columns_per_elevation: Dual<N>,
    variance: Dual<N>,
    sine: Dual<N>,
    effects: [Option<EffectField<'a, N>>; FIELDS],
}

/// A field of an effect and its derivatives by value.
struct EffectField<'a, const N: usize> {
    field: &'a [f32],
    by: Vec<(usize, &'a [f32])>,
}

impl<const N: usize> EffectField<'_, N> {
    #[inline(always)]
    fn at(&self, pixel: usize) -> Dual<N> {
        let mut dual = Dual::constant(f64::from(self.field[pixel]));
        for (n, slopes) in &self.by {
            if let Some(by) = dual.by.get_mut(*n) {
                *by = f64::from(slopes[pixel]);
            }
        }
        dual
    }
}

/// What one value changes besides fields.
#[derive(Clone, Copy, Default)]
struct ValueSlopes {
    at: usize,
    position: [f64; 2],
    forward: [f64; 2],
    length: f64,
    columns_per_elevation: f64,
    variance: f64,
    sine: f64,
}

/// A number with its derivatives.
fn dual<const N: usize>(
    slopes: &[ValueSlopes],
    value: f64,
    slope: impl Fn(&ValueSlopes) -> f64,
) -> Dual<N> {
    let mut dual = Dual::constant(value);
    for one in slopes {
        if let Some(by) = dual.by.get_mut(one.at) {
            *by = slope(one);
        }
    }
    dual
}

impl Moved {
    /// What the value changes besides fields.
    fn slopes(&self, displacement: impl Fn(&Models) -> Displacement) -> ValueSlopes {
        let ship = |of: fn(&crate::kelvin::KelvinWake) -> f64| {
            self.slope(|m| m.wakes.first().map_or(0.0, of))
        };
        ValueSlopes {
            at: self.value as usize,
            position: [ship(|w| w.track.position[0]), ship(|w| w.track.position[1])],
            forward: [ship(|w| w.track.forward[0]), ship(|w| w.track.forward[1])],
            length: ship(|w| w.hull.length()),
            columns_per_elevation: self.slope(|m| displacement(m).columns_per_elevation),
            variance: self.slope(|m| displacement(m).variance),
            sine: self.slope(|m| m.incidence.sin()),
        }
    }
}

impl<'a, const N: usize> Drawn<'a, N> {
    pub(super) fn new(frozen: &ExpectedImage, surface: &'a Surface<'a>) -> Self {
        let displacement = |models: &Models| {
            Displacement::new(&imaging(models, &frozen.plan), &frozen.raster)
        };
        let slopes: Vec<ValueSlopes> =
            surface.moved.iter().map(|moved| moved.slopes(displacement)).collect();
        let here = displacement(surface.models);
        let wakes = surface.models.wakes.iter().enumerate();
        let places = wakes.map(|(n, wake)| {
            let slopes = if n == 0 { &slopes[..] } else { &[] };
            Place {
                position: [0, 1].map(|a| dual(slopes, wake.track.position[a], |s| s.position[a])),
                forward: [0, 1].map(|a| dual(slopes, wake.track.forward[a], |s| s.forward[a])),
                length: dual(slopes, wake.hull.length(), |s| s.length),
            }
        });
        let each = surface.surroundings.each();
        let effect = |n: usize| {
            let field = &each[n]?.values[..];
            let by = surface.slopes.iter().filter_map(|slopes| {
                let slope = slopes.fields[n].as_ref()?;
                Some((slopes.value as usize, &slope.values[..]))
            });
            Some(EffectField {
                field,
                by: by.collect(),
            })
        };
        Self {
            cross_section: surface.cross_section(frozen, Some(frozen.nodes)),
            raster: frozen.raster,
            places: places.collect(),
            columns_per_elevation: dual(&slopes, here.columns_per_elevation, |s| {
                s.columns_per_elevation
            }),
            variance: dual(&slopes, here.variance, |s| s.variance),
            sine: dual(&slopes, surface.models.incidence.sin(), |s| s.sine),
            effects: std::array::from_fn(effect),
            displacement: here,
            surface,
        }
    }

    /// A field of an effect with its derivatives.
    #[inline(always)]
    fn effect(&self, number: usize, pixel: usize) -> Option<Dual<N>> {
        self.effects[number].as_ref().map(|field| field.at(pixel))
    }

    /// The linear fields at a pixel, faded along the hulls.
    #[inline(always)]
    fn linear(&self, (i, j): (usize, usize)) -> [Dual<N>; LINEAR] {
        let mut out = [Dual::constant(0.0); LINEAR];
        let pixel = i * self.raster.columns + j;
        let at = [self.raster.x(j), self.raster.y(i)];
        for (n, wake) in self.surface.wakes.iter().enumerate() {
            let place = &self.places[n];
            let from = [0, 1].map(|a| Dual::constant(at[a]) - place.position[a]);
            let ahead = from[0] * place.forward[0] + from[1] * place.forward[1];
            let [shown, by_ahead, by_length] = fade_with_slope(ahead.value, place.length.value);
            if shown == 0.0 {
                continue;
            }
            let mut fade = ahead.map(shown, by_ahead);
            fade.chain(by_length, &place.length);
            for (&linear, sums) in self.surface.fields.iter().zip(&wake.sums) {
                let mut field = Dual::constant(f64::from(sums.field.values[pixel]));
                if N > 0 && n == 0 && !sums.gradient[0].values.is_empty() {
                    let [gx, gy] = sums.gradient.each_ref().map(|f| f64::from(f.values[pixel]));
                    let away = from.map(|d| d.value);
                    field.chain(gx, &from[0]);
                    field.chain(gy, &from[1]);
                    let stretched = match &sums.stretched {
                        Some(fields) => {
                            let [hx, hy] = fields.each_ref().map(|f| f64::from(f.values[pixel]));
                            away[0] * hx + away[1] * hy
                        }
                        None => wake.stretch * (away[0] * gx + away[1] * gy),
                    };
                    field.by[Value::Speed as usize] += stretched;
                    field.by[Value::Heading as usize] +=
                        (away[0] * gy - away[1] * gx) * PI / 180.0;
                    for (value, slopes) in &sums.strength {
                        field.by[*value as usize] += f64::from(slopes.values[pixel]);
                    }
                }
                let slot = &mut out[linear as usize];
                *slot = *slot + field * fade;
            }
        }
        out
    }

    /// What a pixel returns, and where that is imaged.
    #[inline(always)]
    pub(super) fn source(&self, i: usize, j: usize) -> Source<N> {
        let pixel = i * self.raster.columns + j;
        let linear = self.linear((i, j));
        let of = |field: Linear| linear[field as usize];
        let rough = [2, 3, 4].map(|n| self.effect(n, pixel));
        let power = self.returned([of(Linear::SlopeX), of(Linear::SlopeY)], rough, || {
            let mut factor = of(Linear::Modulation).exp();
            if let Some(remaining) = self.effect(0, pixel) {
                factor = factor * remaining;
            }
            factor
        });
        let power = match (self.effect(6, pixel), self.effect(7, pixel)) {
            (Some(factor), Some(added)) => power * factor + added,
            _ => power,
        };
        let mut radial = of(Linear::Radial);
        if let Some(current) = self.effect(1, pixel) {
            radial = radial - current * self.sine;
        }
        let d = &self.displacement;
        let acceleration = of(Linear::Acceleration);
        let mut square = acceleration * acceleration;
        if let Some(rough) = self.effect(5, pixel) {
            square = square + rough * rough;
        }
        let least = crate::sar::smooth::SMALLEST_VARIANCE;
        let variance = self.variance + square.times(d.variance_per_square);
        Source {
            power,
            up: radial.times(d.rows_per_velocity),
            left: of(Linear::Elevation) * self.columns_per_elevation,
            variance: match variance.value > least {
                true => variance,
                false => Dual::constant(least),
            },
        }
    }

    /// σ⁰ without effects that change it as a whole.
    ///
    /// - `rough`: slope variances xx, xy, yy below the pixels; `factor` on the Bragg return
    #[inline(always)]
    fn returned(
        &self,
        slope: [Dual<N>; 2],
        rough: [Option<Dual<N>>; 3],
        factor: impl FnOnce() -> Dual<N>,
    ) -> Dual<N> {
        let point = slope.map(|s| s.value);
        let more = match rough {
            [Some(xx), Some(xy), Some(yy)] if xx.value + yy.value > 0.0 => Some([xx, xy, yy]),
            _ => None,
        };
        let at = match &more {
            None => self.cross_section.at(point),
            Some([xx, xy, yy]) => {
                let [xx, xy, yy] = [xx.value, xy.value, yy.value];
                self.cross_section.over(point, &SlopeCovariance { xx, xy, yy })
            }
        };
        let part = |n: usize| {
            let mut part = Dual::constant(at.value[n]);
            for axis in 0..2 {
                part.chain(at.slope[n][axis], &slope[axis]);
            }
            if let Some(more) = &more {
                // The heat equation: ∂σ/∂C = ½ ∇∇σ, twice where C_xy stands for C_yx.
                for (k, weight) in [0.5, 1.0, 0.5].into_iter().enumerate() {
                    part.chain(weight * at.curvature[n][k], &more[k]);
                }
            }
            for (value, slope) in OUTER_VALUES.iter().zip(&at.outer[n]) {
                if let Some(by) = part.by.get_mut(*value as usize) {
                    *by += slope;
                }
            }
            part
        };
        part(0) * factor() + part(1)
    }
}
