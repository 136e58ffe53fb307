//! What the score of an image is, when the image is one of the fitted scene: mean and covariance by simulation.
//!
//! The simulator is the truth that mean image and spectrum approximate. Images of the scene of a fit give the mean b of the score
//! and its covariance V, so that
//!
//! ```text
//! θ = θ̂ − (J + Π)⁻¹ b,     cov θ = (J + Π)⁻¹ (V + Π) (J + Π)⁻¹ · (1 + 1/M) (M − 1)/(M − 3)
//! ```
//!
//! are right to first order however good the approximations are. The last two factors are what b and V of M images are
//! uncertain by: a deviation from M numbers makes Student's t of M − 1 degrees of freedom of a normal number.
//!
//! # References
//!
//! Gourieroux, Monfort and Renault (1993), J. Appl. Econom. 8, S85; White (1982), Econometrica 50, 1.

use super::matrix::Matrix;
use super::scorer::{Scorer, Told};
use super::state::State;
use crate::error::Result;
use crate::raster::Field;
use crate::simulate::Simulator;
use rayon::prelude::*;

/// Scores of simulated images.
#[derive(Debug, Clone)]
pub(super) struct Calibration {
    /// b.
    pub(super) mean: Vec<f64>,
    /// V.
    pub(super) variance: Matrix,
    /// Mean and deviation of the residual's power by ring.
    pub(super) rings: Vec<[f64; 2]>,
    pub(super) count: usize,
}

impl Calibration {
    /// Scores of images of a state.
    pub(super) fn new(
        scorer: &Scorer<'_>,
        state: &State,
        (seed, count): (u64, usize),
    ) -> Result<Self> {
        let one = |simulator: &mut Simulator, n: usize| -> Result<Told> {
            Ok(scorer.of(&drawn(
                simulator,
                state,
                scorer,
                seed + ((n as u64 + 1) << 20),
            )?))
        };
        let told: Vec<Told> = (0..count)
            .into_par_iter()
            .with_min_len(count.div_ceil(4))
            .map_init(Simulator::default, one)
            .collect::<Result<_>>()?;
        let size = scorer.slope.size;
        let average = |of: &dyn Fn(&Told) -> f64| told.iter().map(of).sum::<f64>() / count as f64;
        let mean: Vec<f64> = (0..size).map(|p| average(&|t| t.score[p])).collect();
        let mut variance = Matrix::zero(size);
        let degrees = count as f64 / (count as f64 - 1.0);
        for p in 0..size {
            for q in 0..size {
                let product = |t: &Told| (t.score[p] - mean[p]) * (t.score[q] - mean[q]);
                variance.add(p, q, degrees * average(&product));
            }
        }
        let rings = told[0].rings.len();
        let ring = |n: usize| {
            let mean = average(&|t| t.rings[n]);
            let square = average(&|t| (t.rings[n] - mean).powi(2));
            [mean, (degrees * square).sqrt()]
        };
        Ok(Self {
            rings: (0..rings).map(ring).collect(),
            mean,
            variance,
            count,
        })
    }

    /// Covariance of the corrected values.
    pub(super) fn covariance(&self, inverse: &Matrix, priors: &Matrix) -> Matrix {
        let variance = self.variance.clone().plus(priors);
        let mut out = inverse.times(&variance).times(inverse);
        let count = self.count as f64;
        let factor = (1.0 + 1.0 / count) * (count - 1.0) / (count - 3.0);
        out.values.iter_mut().for_each(|v| *v *= factor);
        out
    }

    /// How far each ring of an image is from what it is on average, in deviations.
    pub(super) fn off(&self, told: &Told) -> Vec<f64> {
        let pairs = self.rings.iter().zip(&told.rings);
        let more = (1.0 + 1.0 / self.count as f64).sqrt();
        pairs
            .map(|([mean, deviation], ring)| (ring - mean) / (deviation * more).max(1e-12))
            .collect()
    }
}

/// A simulated image of a state: the sea around the mean image as strong as the factor of its texture says.
fn drawn(
    simulator: &mut Simulator,
    state: &State,
    scorer: &Scorer<'_>,
    seed: u64,
) -> Result<Field> {
    let mut scene = state.scene.clone();
    scene.seed = seed;
    let mut image = simulator.image(&scene)?;
    let gain = state.factors.gain as f32;
    let strength = state.factors.texture.sqrt() as f32;
    for (value, mean) in image.intensity.values.iter_mut().zip(&scorer.mean.values) {
        let mean = mean / gain;
        *value = (mean + strength * (*value - mean)).max(0.0);
    }
    let mut field = image.speckled();
    field.values.iter_mut().for_each(|v| *v *= gain);
    Ok(field)
}

#[cfg(test)]
#[allow(clippy::print_stdout, reason = "what was measured is printed")]
mod tests {
    use super::*;
    use crate::estimate::observed::Observed;
    use crate::estimate::parameter::Parameter;
    use crate::estimate::scorer::{SeaNoise, mean};
    use crate::scene::Scene;

    /// Scores of other images of the scene have the mean and the variance of the calibration: 9 correlated scores of 10 images, whose
    /// mean square is that of Student's t of 15 degrees, 1.15, within some 0.4.
    #[test]
    fn scores_of_other_images_are_those_of_the_calibration() {
        let keys = [
            "grid.rows=96",
            "grid.columns=96",
            "grid.spacing=4",
            "radar.incidence=20",
            "sea.wind_speed=6.5",
            "ship.heading=60",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let state = State::of(scene.clone());
        let parameters = &Parameter::OF_WAKE;
        let mut simulator = Simulator::default();
        let expected = mean(&mut simulator, &state).unwrap();
        let view = Observed::new(expected.clone(), &scene, |_, _| 1.0);
        let noise = SeaNoise::new(&state, parameters).unwrap();
        let scorer = Scorer::new(&view, (&state, expected), (parameters, &noise)).unwrap();
        let count = 16;
        let calibration = Calibration::new(&scorer, &state, (3, count)).unwrap();
        let (mut square, mut plain, images) = (0.0, 0.0, 10);
        for seed in 0..images {
            let mut other = scene.clone();
            other.seed = 900 + seed;
            let image = simulator.image(&other).unwrap().speckled();
            let told = scorer.of(&image);
            for (n, score) in told.score.iter().enumerate() {
                let variance = calibration.variance.at(n, n) * (1.0 + 1.0 / count as f64);
                square += (score - calibration.mean[n]).powi(2) / variance;
                plain += score.powi(2) / variance;
            }
        }
        let number = (images as usize * parameters.len()) as f64;
        println!(
            "{:.2}, without the mean {:.2}",
            square / number,
            plain / number
        );
        assert!(
            (0.5..2.2).contains(&(square / number)),
            "{}",
            square / number
        );
    }
}
