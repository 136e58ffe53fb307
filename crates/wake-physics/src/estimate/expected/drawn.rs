//! Intensity of each pixel of a scene with a frozen plan, and its place in the image, with all derivatives.

use super::cross_section::CrossSection;
use super::frozen::{Frozen, imaging};
use super::surface::{Moved, OUTER_VALUES, Surface};
use super::surroundings::FIELDS;
use super::waves::{LINEAR, Linear};
use crate::estimate::value::Value;
use crate::kelvin::fade_with_slope;
use crate::models::Models;
use crate::numeric::Dual;
use crate::sar::smooth::{Displacement, SMALLEST_VARIANCE, Source};
use std::f64::consts::PI;

/// Position, direction and length of a ship, with derivatives by value.
struct Place<const N: usize> {
    position: [Dual<N>; 2],
    forward: [Dual<N>; 2],
    length: Dual<N>,
}

/// Inputs from which the pixels are computed.
pub(super) struct Drawn<'a, const N: usize> {
    surface: &'a Surface<'a>,
    cross_section: CrossSection,
    displacement: Displacement,
    raster: crate::Raster,
    /// Ships; only the first has derivatives.
    places: Vec<Place<N>>,
    columns_per_elevation: Dual<N>,
    variance: Dual<N>,
    sine: Dual<N>,
    effects: [Option<EffectField<'a, N>>; FIELDS],
    /// Index of each value among the derivatives; past the last where there is no derivative.
    slots: [usize; Value::ALL.len()],
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

/// Derivatives of scalars by one value.
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
    /// Derivatives of scalars by the value.
    fn slopes(&self, at: usize, displacement: impl Fn(&Models) -> Displacement) -> ValueSlopes {
        let ship = |of: fn(&crate::kelvin::KelvinWake) -> f64| {
            self.slope(|m| m.wakes.first().map_or(0.0, of))
        };
        ValueSlopes {
            at,
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
    pub(super) fn new(frozen: &Frozen, surface: &'a Surface<'a>) -> Self {
        let displacement =
            |models: &Models| Displacement::new(&imaging(models, &frozen.plan), &frozen.raster);
        let slopes: Vec<ValueSlopes> = surface
            .moved
            .iter()
            .enumerate()
            .map(|(at, moved)| moved.slopes(at, displacement))
            .collect();
        let mut slots = [N; Value::ALL.len()];
        for (n, moved) in surface.moved.iter().enumerate() {
            slots[moved.value as usize] = n;
        }
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
                Some((slots[slopes.value as usize], &slope.values[..]))
            });
            Some(EffectField {
                field,
                by: by.collect(),
            })
        };
        Self {
            cross_section: surface.cross_section(frozen),
            raster: frozen.raster,
            places: places.collect(),
            columns_per_elevation: dual(&slopes, here.columns_per_elevation, |s| {
                s.columns_per_elevation
            }),
            variance: dual(&slopes, here.variance, |s| s.variance),
            sine: dual(&slopes, surface.models.incidence.sin(), |s| s.sine),
            effects: std::array::from_fn(effect),
            displacement: here,
            slots,
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
                    let mut add = |value: Value, slope: f64| {
                        if let Some(by) = field.by.get_mut(self.slots[value as usize]) {
                            *by += slope;
                        }
                    };
                    add(Value::Speed, stretched);
                    add(Value::Heading, (away[0] * gy - away[1] * gx) * PI / 180.0);
                    for (value, slopes) in &sums.strength {
                        add(*value, f64::from(slopes.values[pixel]));
                    }
                }
                let slot = &mut out[linear as usize];
                *slot = *slot + field * fade;
            }
        }
        out
    }

    /// Power returned by a pixel, and where it is imaged.
    #[inline(always)]
    pub(super) fn source(&self, i: usize, j: usize) -> Source<N> {
        let pixel = i * self.raster.columns + j;
        let linear = self.linear((i, j));
        let of = |field: Linear| linear[field as usize];
        let [power, moving, spread] =
            self.returned([of(Linear::SlopeX), of(Linear::SlopeY)], || {
                let mut factor = of(Linear::Modulation).exp();
                if let Some(remaining) = self.effect(0, pixel) {
                    factor = factor * remaining;
                }
                factor
            });
        let [power, moving, spread] = match (self.effect(2, pixel), self.effect(3, pixel)) {
            (Some(factor), Some(added)) => {
                [power * factor + added, moving * factor, spread * factor]
            }
            _ => [power, moving, spread],
        };
        // Brightness-weighted mean velocity of the sea's waves, and their variance in excess of that of all waves.
        let inverse = match power.value > 0.0 {
            true => power.map(power.value.recip(), -power.value.powi(-2)),
            false => Dual::constant(0.0),
        };
        let by_waves = moving * inverse;
        let wider = spread * inverse - by_waves * by_waves;
        let mut radial = of(Linear::Radial) + by_waves;
        if let Some(current) = self.effect(1, pixel) {
            radial = radial - current * self.sine;
        }
        let d = &self.displacement;
        let acceleration = of(Linear::Acceleration);
        let square = acceleration * acceleration;
        let least = SMALLEST_VARIANCE;
        let variance = self.variance
            + square.times(d.variance_per_square)
            + wider.times(d.rows_per_velocity.powi(2));
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

    /// σ⁰ before the effects that change it as a whole, and its products with the velocity of the sea's waves, as in
    /// [`At`](super::cross_section::At).
    ///
    /// - `factor`: factor on the Bragg return
    #[inline(always)]
    fn returned(&self, slope: [Dual<N>; 2], factor: impl FnOnce() -> Dual<N>) -> [Dual<N>; 3] {
        let point = slope.map(|s| s.value);
        let at = match N {
            0 => self.cross_section.at::<false>(point),
            _ => self.cross_section.at::<true>(point),
        };
        let part = |n: usize| {
            let mut part = Dual::constant(at.value[n]);
            for (by, along) in at.slope[n].into_iter().zip(&slope) {
                part.chain(by, along);
            }
            for (value, slope) in OUTER_VALUES.iter().zip(&at.outer[n]) {
                if let Some(by) = part.by.get_mut(self.slots[*value as usize]) {
                    *by += slope;
                }
            }
            part
        };
        let factor = factor();
        [0, 2, 4].map(|n| part(n) * factor + part(n + 1))
    }
}
