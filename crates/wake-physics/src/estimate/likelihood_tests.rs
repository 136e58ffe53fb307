use super::*;
use crate::estimate::expected::ExpectedImage;
use crate::estimate::value::Value;
use crate::sar::speckle::speckle;
use crate::scene::Scene;
use crate::simulate::LinearSea;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};

/// Images that are drawn.
const SEEDS: u64 = 200;

/// Over images of the model (mean image, Gaussian sea, Gamma speckle) every score has the mean 0, and the variance that is stated.
#[test]
fn scores_have_mean_zero_and_the_stated_variance() {
    let keys = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=4",
        "ship.heading=60",
        "sea.wind_speed=4",
        "model.tolerance=1e-2",
    ];
    let scene = Scene::default().with_assignments(&keys).unwrap();
    let parameters = Parameter::OF_WAKE;
    let state = State::of(&scene);
    let image = ExpectedImage::new(&scene, &Value::ALL[..9]).unwrap();
    let expected = image.at(&scene).unwrap();
    let texture = Texture::new(&scene, &parameters).unwrap();
    let sea = LinearSea::new(&scene).unwrap();
    let mut observed = Observed::new(expected.intensity.clone(), texture.noise.size, |_, _| 1.0);
    let count = parameters.len();
    let (mut sums, mut squares) = (vec![0.0; count], vec![0.0; count]);
    let mut stated = Vec::new();
    for seed in 0..SEEDS {
        let mut random = StdRng::seed_from_u64(seed);
        let normals: Vec<f32> = (0..sea.normals())
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        let waves = sea.field(&normals);
        observed.image = expected.intensity.clone();
        for (value, wave) in observed.image.values.iter_mut().zip(&waves.values) {
            *value *= (1.0 + wave).max(0.0);
        }
        speckle(&mut observed.image, scene.radar.looks, seed);
        let near = observed.near(&parameters, (&state, &expected), &texture, seed == 0);
        if seed == 0 {
            stated = (0..count)
                .map(|n| near.information.variance.at(n, n))
                .collect();
        }
        for (n, score) in near.score.iter().enumerate() {
            sums[n] += score;
            squares[n] += score * score;
        }
    }
    for (n, parameter) in parameters.iter().enumerate() {
        let seeds = SEEDS as f64;
        let mean = sums[n] / seeds / (stated[n] / seeds).sqrt();
        let ratio = squares[n] / seeds / stated[n];
        // A standard normal number, and a mean of 200 squares: deviation 0.1. The spectrum's score knows no kurtosis of speckle.
        let allowed = match parameter {
            Parameter::Value(Value::WindSpeed | Value::WindToward) | Parameter::Texture => 0.6,
            _ => 0.35,
        };
        assert!(mean.abs() < 3.5, "{parameter:?}: {mean}");
        assert!((ratio - 1.0).abs() < allowed, "{parameter:?}: {ratio}");
    }
}
