//! Score and likelihood of many images near one state: mean, derivatives and spectra are computed once.

use super::matrix::Matrix;
use super::noise::Noise;
use super::observed::Observed;
use super::parameter::Parameter;
use super::state::State;
use super::torus::Spectrum;
use super::value::Value;
use crate::error::Result;
use crate::raster::Field;
use crate::scene::Scene;
use crate::simulate::Simulator;
use rayon::prelude::*;

/// Rings of wavenumbers that the fit is looked at in.
const RINGS: usize = 8;

/// Parameters that the spectrum of the sea depends on.
const OF_SPECTRUM: [Parameter; 2] = [
    Parameter::Value(Value::WindSpeed),
    Parameter::Value(Value::WindToward),
];

/// Covariances at a wind, and at winds next to it.
#[derive(Debug, Clone)]
pub(super) struct SeaNoise {
    wind: [f64; 2],
    here: Noise,
    next: Vec<(Parameter, f64, Noise)>,
}

impl SeaNoise {
    /// - `parameters`: those with derivatives
    pub(super) fn new(state: &State, parameters: &[Parameter]) -> Result<Self> {
        let moved = |p: &Parameter| -> Result<(Parameter, f64, Noise)> {
            // The spectrum is on an image's lattice, so steps are wider than those of the mean.
            let step = 2.0 * state.step(*p);
            Ok((*p, step, Noise::new(&state.moved(*p, step).scene)?))
        };
        let of_spectrum = OF_SPECTRUM.iter().filter(|p| parameters.contains(p));
        Ok(Self {
            wind: wind(&state.scene),
            here: Noise::new(&state.scene)?,
            next: of_spectrum.map(moved).collect::<Result<_>>()?,
        })
    }

    /// Whether the wind is still that of a scene.
    pub(super) fn holds(&self, scene: &Scene) -> bool {
        let [speed, toward] = wind(scene);
        (speed / self.wind[0] - 1.0).abs() < 1e-6 && (toward - self.wind[1]).abs() < 1e-4
    }

    fn power(&self, view: &Observed, factor: f64) -> Vec<f32> {
        floored(view.taper.power(&view.torus, &self.here.covariance(factor)))
    }
}

fn wind(scene: &Scene) -> [f64; 2] {
    [scene.sea.wind_speed, scene.sea.wind_toward]
}

fn floored(power: Vec<f32>) -> Vec<f32> {
    let floor = 1e-6 * power.iter().copied().fold(0.0, f32::max);
    power.into_iter().map(|p| p.max(floor)).collect()
}

/// The expected image of a state, times its gain.
pub(super) fn mean(simulator: &mut Simulator, state: &State) -> Result<Field> {
    let mut mean = simulator.expected_intensity(&state.scene)?;
    let gain = state.factors.gain as f32;
    mean.values.iter_mut().for_each(|v| *v *= gain);
    Ok(mean)
}

/// w ∂ln μ by each parameter: by differences, for the ship's place those of the image itself, which it moves.
fn directions(
    view: &Observed,
    (state, here): (&State, &Field),
    parameters: &[Parameter],
) -> Result<Vec<Field>> {
    let one = |simulator: &mut Simulator, parameter: &Parameter| -> Result<Field> {
        let spacing = state.scene.grid.spacing as f32;
        match parameter {
            Parameter::Gain => return Ok(view.taper.weights.clone()),
            Parameter::Texture => return Ok(view.taper.of(std::iter::repeat(0.0))),
            Parameter::Value(Value::X) => return Ok(view.taper.of(moving(here, [0, 1], -spacing))),
            Parameter::Value(Value::Y) => return Ok(view.taper.of(moving(here, [1, 0], spacing))),
            _ => {}
        }
        let step = state.step(*parameter);
        let there = mean(simulator, &state.moved(*parameter, step))?;
        let pairs = there.values.iter().zip(&here.values);
        let slope = pairs.map(|(a, b)| (a - b) / b / step as f32);
        Ok(view.taper.of(slope))
    };
    let parameters = parameters
        .par_iter()
        .with_min_len(parameters.len().div_ceil(2));
    parameters.map_init(Simulator::default, one).collect()
}

/// Slope of ln μ along rows or columns, by differences of sixth order.
fn moving(mean: &Field, [down, right]: [usize; 2], spacing: f32) -> impl Iterator<Item = f32> {
    let (rows, columns) = (mean.rows, mean.columns);
    (0..rows * columns).map(move |n| {
        let at = |d: usize, forward: bool| {
            let moved = |i: usize, step: usize, count: usize| match forward {
                true => (i + step).min(count - 1),
                false => i.saturating_sub(step),
            };
            mean.at(
                moved(n / columns, d * down, rows),
                moved(n % columns, d * right, columns),
            )
        };
        let part = |d: usize| at(d, true) - at(d, false);
        (45.0 * part(1) - 9.0 * part(2) + part(3)) / 60.0 / spacing / mean.values[n]
    })
}

/// What an image tells near a state.
#[derive(Debug, Clone)]
pub(super) struct Told {
    pub(super) score: Vec<f64>,
    /// Power of the residual over its expectation by rings of wavenumbers, the longest waves first.
    pub(super) rings: Vec<f64>,
}

/// Mean, derivatives and spectra at a state.
pub(super) struct Scorer<'a> {
    view: &'a Observed,
    scale: f64,
    power: Vec<f32>,
    pub(super) mean: Field,
    /// D/S.
    directions: Vec<Spectrum>,
    /// ∂ln S.
    slopes: Vec<Option<Vec<f32>>>,
    /// Expected slope J of the score.
    pub(super) slope: Matrix,
}

impl<'a> Scorer<'a> {
    pub(super) fn new(
        view: &'a Observed,
        (state, mean): (&State, Field),
        (parameters, texture): (&[Parameter], &SeaNoise),
    ) -> Result<Self> {
        let factor = state.factors.texture;
        let power = texture.power(view, factor);
        let fields = directions(view, (state, &mean), parameters)?;
        let mut spectra: Vec<Spectrum> = Vec::new();
        for pair in fields.chunks(2) {
            let [a, b] = view
                .torus
                .spectra([&pair[0], pair.last().unwrap_or(&pair[0])]);
            spectra.push(a);
            if pair.len() > 1 {
                spectra.push(b);
            }
        }
        let slope_of = |parameter: &Parameter| -> Option<Vec<f32>> {
            let (step, next) = if *parameter == Parameter::Texture {
                (
                    1.0,
                    view.taper
                        .power(&view.torus, &texture.here.by_factor(factor)),
                )
            } else {
                let (_, step, noise) = texture.next.iter().find(|next| next.0 == *parameter)?;
                let next = floored(view.taper.power(&view.torus, &noise.covariance(factor)));
                let change = next.iter().zip(&power).map(|(n, p)| n - p);
                (*step, change.collect())
            };
            let relative = next.iter().zip(&power).map(|(n, p)| n / p / step as f32);
            Some(relative.collect())
        };
        let slopes: Vec<_> = parameters.iter().map(slope_of).collect();
        let area = (view.torus.size * view.torus.size) as f64;
        let mut scorer = Self {
            view,
            scale: view.taper.energy / area,
            slope: Matrix::zero(parameters.len()),
            power,
            mean,
            directions: spectra,
            slopes,
        };
        scorer.slope = scorer.expected_slope();
        for spectrum in &mut scorer.directions {
            for (value, power) in spectrum.iter_mut().zip(&scorer.power) {
                *value /= *power;
            }
        }
        Ok(scorer)
    }

    /// J of directions that are not yet divided by the power.
    fn expected_slope(&self) -> Matrix {
        let size = self.directions.len();
        let pairs: Vec<[usize; 2]> = (0..size)
            .flat_map(|p| (0..=p).map(move |q| [p, q]))
            .collect();
        let sum = |&[p, q]: &[usize; 2]| -> f64 {
            let (a, b) = (&self.directions[p], &self.directions[q]);
            let mean = (0..self.power.len()).map(|n| {
                self.view.torus.weight(n) * f64::from((a[n].conj() * b[n]).re / self.power[n])
            });
            let mut sum: f64 = mean.sum();
            if let (Some(a), Some(b)) = (&self.slopes[p], &self.slopes[q]) {
                let power = (0..self.power.len())
                    .map(|n| 0.5 * self.view.torus.weight(n) * f64::from(a[n] * b[n]));
                sum += power.sum::<f64>();
            }
            self.scale * sum
        };
        let sums: Vec<f64> = pairs.par_iter().map(sum).collect();
        let mut slope = Matrix::zero(size);
        for (&[p, q], sum) in pairs.iter().zip(sums) {
            slope.add(p, q, sum);
            if p != q {
                slope.add(q, p, sum);
            }
        }
        slope
    }

    /// What an image tells.
    pub(super) fn of(&self, image: &Field) -> Told {
        let left = residual(self.view, image, &self.mean);
        let torus = &self.view.torus;
        let mut score = vec![0.0; self.directions.len()];
        for ((sum, direction), slope) in score.iter_mut().zip(&self.directions).zip(&self.slopes) {
            for n in 0..left.len() {
                let mut term = (direction[n].conj() * left[n]).re;
                if let Some(slope) = slope {
                    term += 0.5 * slope[n] * (left[n].norm_sqr() / self.power[n] - 1.0);
                }
                *sum += torus.weight(n) * f64::from(term);
            }
            *sum *= self.scale;
        }
        let size = torus.size;
        let mut rings = vec![[0.0; 2]; RINGS];
        for n in 0..left.len() {
            let (i, j) = (n / size, n % size);
            let radius = (i as f64).hypot(j.min(size - j) as f64) / (0.5 * size as f64);
            let ring = &mut rings[((radius * RINGS as f64) as usize).min(RINGS - 1)];
            ring[0] += torus.weight(n) * f64::from(left[n].norm_sqr() / self.power[n]);
            ring[1] += torus.weight(n);
        }
        Told {
            score,
            rings: rings.iter().map(|r| r[0] / r[1].max(1.0)).collect(),
        }
    }
}

/// F[w (I/μ − 1)].
fn residual(view: &Observed, image: &Field, mean: &Field) -> Spectrum {
    let pairs = image.values.iter().zip(&mean.values);
    let left = view.taper.of(pairs.map(|(i, m)| i / m - 1.0));
    view.torus.spectrum(&left)
}

/// ln likelihood of an image, but for a constant.
pub(super) fn log_likelihood(
    view: &Observed,
    (image, mean): (&Field, &Field),
    (texture, factor): (&SeaNoise, f64),
) -> f64 {
    let power = texture.power(view, factor);
    let left = residual(view, image, mean);
    let energy = view.taper.energy;
    let term = |n: usize| {
        let power = f64::from(power[n]);
        view.torus.weight(n) * (f64::from(left[n].norm_sqr()) / power + (power / energy).ln())
    };
    let spectrum: f64 = (0..left.len()).map(term).sum();
    let weights = view.taper.weights.values.iter();
    let jacobian = mean.values.iter().zip(weights);
    let jacobian: f64 = jacobian
        .map(|(m, w)| f64::from(w * w) * f64::from(*m).ln())
        .sum();
    let area = (view.torus.size * view.torus.size) as f64;
    -0.5 * energy / area * spectrum - jacobian
}

#[cfg(test)]
#[allow(clippy::print_stdout, reason = "what was measured is printed")]
mod tests {
    use super::*;

    /// A moved ship moves its wake: slopes between pixels are those of images of moved ships. Waves of 30 m on pixels of 4 m have the
    /// relative error (2π 4/30)⁶/140 < 1e-2 by differences of sixth order; mean images are within their tolerance.
    #[test]
    fn slopes_by_the_place_are_those_of_moved_ships() {
        let keys = [
            "grid.rows=96",
            "grid.columns=96",
            "grid.spacing=4",
            "ship.heading=60",
            "ship.speed=9",
            "model.tolerance=1e-4",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let state = State::of(scene.clone());
        let mut simulator = Simulator::default();
        let here = mean(&mut simulator, &state).unwrap();
        let view = Observed::new(here.clone(), &scene, |_, _| 1.0);
        let places = [Value::X, Value::Y].map(Parameter::Value);
        let found = directions(&view, (&state, &here), &places).unwrap();
        for (place, found) in places.iter().zip(&found) {
            let [below, above] =
                [-1.0, 1.0].map(|by| mean(&mut simulator, &state.moved(*place, by)).unwrap());
            let pairs = above.values.iter().zip(&below.values).zip(&here.values);
            let expected = view.taper.of(pairs.map(|((a, b), m)| 0.5 * (a - b) / m));
            let (_, error) = found.difference(&expected);
            println!("{place:?}: {:.3}", error / expected.rms());
            assert!(error < 0.05 * expected.rms(), "{place:?}");
        }
    }
}
