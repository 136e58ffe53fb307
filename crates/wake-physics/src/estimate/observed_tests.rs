use super::*;
use crate::estimate::expected::ExpectedImage;
use crate::estimate::likelihood::Likelihood;
use crate::estimate::priors::values_of;
use crate::estimate::value::Value;
use crate::simulate::Simulator;

/// Number of images drawn.
const SEEDS: u64 = 200;

fn scene() -> Scene {
    let keys = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=4",
        "ship.heading=60",
        "sea.wind_speed=4",
        "model.tolerance=1e-2",
    ];
    Scene::default().with_assignments(&keys).unwrap()
}

/// For each score, the mean over its stated standard deviation and the mean square over its stated variance, over all seeds.
fn scores(scene: &Scene, mut image: impl FnMut(u64) -> Field) -> Vec<[f64; 2]> {
    let parameters = Parameter::OF_WAKE;
    let expected = ExpectedImage::new(scene, &values_of(&parameters)).unwrap();
    let expected = expected.at(scene).unwrap();
    let texture = Texture::new(scene, &parameters).unwrap();
    let mut observed = Observed::new(expected.intensity.clone(), scene, |_, _| 1.0);
    let mut sums = vec![[0.0; 2]; parameters.len()];
    let mut stated = Vec::new();
    for seed in 0..SEEDS {
        observed.image = image(seed);
        let near = observed.near(
            &parameters,
            &Factors::default(),
            &expected,
            &texture,
            seed == 0,
        );
        if seed == 0 {
            let variance = |n| near.information.variance.at(n, n);
            stated = (0..parameters.len()).map(variance).collect();
        }
        for (sums, score) in sums.iter_mut().zip(&near.score) {
            sums[0] += score;
            sums[1] += score * score;
        }
    }
    let of = |(sums, stated): (&[f64; 2], &f64)| {
        let seeds = SEEDS as f64;
        [sums[0] / seeds / stated.sqrt(), sums[1] / seeds / stated]
    };
    sums.iter().zip(&stated).map(of).collect()
}

/// Over images of the model (mean image, Gaussian sea and Gamma speckle with their spread), every score has mean 0 and the stated
/// variance.
#[test]
fn scores_have_mean_zero_and_the_stated_variance() {
    let scene = scene();
    let likelihood = Likelihood::new(&scene, &Parameter::OF_WAKE).unwrap();
    let found = scores(&scene, |seed| likelihood.draw(seed).unwrap());
    for (parameter, [mean, square]) in Parameter::OF_WAKE.iter().zip(found) {
        // The mean of 200 standard normal numbers has standard deviation 0.07, their mean square 0.1. The spectrum's score
        // ignores the kurtosis of speckle.
        let allowed = match parameter {
            Parameter::Value(Value::WindSpeed | Value::WindToward) | Parameter::Texture => 0.6,
            _ => 0.35,
        };
        println!("{parameter:?}: {mean:.3} {square:.3}");
        assert!(mean.abs() < 0.25, "{parameter:?}: {mean}");
        assert!((square - 1.0).abs() < allowed, "{parameter:?}: {square}");
    }
}

/// Over images of the simulator, whose sea is not Gaussian, the mean score of ship or wind is below half its standard deviation.
/// This is the bias of an estimate from such an image (docs/physics/estimate.md). The ship's waves add noise to the covariance
/// only through its spread.
#[test]
fn scores_of_simulated_images_are_off_by_less_than_their_deviation() {
    let scene = scene();
    let mut simulator = Simulator::default();
    let found = scores(&scene, |seed| {
        let mut scene = scene.clone();
        scene.seed = seed << 8;
        simulator.simulate(&scene).unwrap().speckled
    });
    for (parameter, [mean, square]) in Parameter::OF_WAKE.iter().zip(found) {
        println!("{parameter:?}: {mean:.3} {square:.3}");
        // The nuisance values absorb errors of mean and power.
        if parameter.is_nuisance() {
            continue;
        }
        let allowed = if parameter.is_of_ship() { 0.4 } else { 0.5 };
        assert!(mean.abs() < allowed, "{parameter:?}: {mean}");
        assert!((0.5..3.0).contains(&square), "{parameter:?}: {square}");
    }
}

/// Power of speckled images of simulated seas without ships over its expectation, in rings of wavenumbers: low to high wind,
/// incidences with specular return, and a small R/V.
#[test]
fn power_of_simulated_seas_is_that_of_the_nonlinear_transform() {
    for keys in [
        &["sea.wind_speed=7", "sea.wind_toward=0"][..],
        &["sea.wind_speed=5", "sea.wind_toward=120"],
        &[
            "sea.wind_speed=6.8",
            "sea.wind_toward=241",
            "radar.incidence=22",
            "sea.fetch=40800",
        ],
        &[
            "sea.wind_speed=4.1",
            "sea.wind_toward=234",
            "radar.incidence=17",
            "sea.fetch=69400",
        ],
        &[
            "sea.wind_speed=7",
            "sea.wind_toward=20",
            "radar.range_to_velocity=5",
        ],
    ] {
        let grid = ["grid.rows=128", "grid.columns=128", "grid.spacing=4"];
        let mut scene = Scene::default()
            .with_assignments(&[&grid[..], keys].concat())
            .unwrap();
        scene.ships.clear();
        let mean = crate::simulate::expected_intensity(&scene).unwrap();
        let noise = Noise::new(&scene).unwrap();
        let mut simulator = Simulator::default();
        let seeds = 24;
        let mut rings = vec![[0.0; 2]; RINGS];
        for seed in 0..seeds {
            scene.seed = 1000 + (seed << 8);
            let image = simulator.simulate(&scene).unwrap().speckled;
            let observed = Observed::new(image, &scene, |_, _| 1.0);
            let left = observed.torus.spectrum(&observed.residual(1.0, &mean));
            let power = observed.power(&noise.covariance(1.0));
            let scale = observed.taper.energy / (observed.torus.size.pow(2)) as f64;
            for (sum, ring) in rings
                .iter_mut()
                .zip(observed.rings(scale, &left, &power, 0.0))
            {
                sum[0] += ring[0] / seeds as f64;
                sum[1] += ring[1];
            }
        }
        println!("{keys:?} {rings:.3?}");
        for [ratio, count] in rings {
            // Scatter of squared normal numbers, and modulation beyond the first order.
            assert!(
                (ratio - 1.0).abs() < 3.0 * (2.0 / count).sqrt() + 0.08,
                "{keys:?}: {ratio}"
            );
        }
    }
}

/// Speckle of two pixels has almost no power at the shortest wavelengths, where rounding to digital numbers shows: 1/(3·70²) of
/// white noise is at most 3 % of the power that counts.
#[test]
fn rounding_to_digital_numbers_is_no_misfit() {
    let keys = [
        "radar.sensor=sentinel-1-iw",
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=10",
        "model.tolerance=1e-2",
    ];
    let scene = Scene::default().with_assignments(&keys).unwrap();
    let image = Simulator::default().simulate(&scene).unwrap().speckled;
    let scale = 70.0 / image.mean().sqrt() as f32;
    let mut rounded = image.clone();
    for value in &mut rounded.values {
        *value = ((value.sqrt() * scale).round() / scale).powi(2);
    }
    let likelihood = Likelihood::new(&scene, &[Parameter::Gain]).unwrap();
    let power = |image| likelihood.of(image, &Factors::default()).unwrap().power;
    let (exact, rounded) = (power(&image), power(&rounded));
    for (exact, rounded) in exact.iter().zip(&rounded) {
        assert!((exact - rounded).abs() < 0.05, "{exact} {rounded}");
        assert!((0.7..1.4).contains(rounded), "{rounded}");
    }
}
