//! The expected image and its derivatives, against the simulator's and against central differences.

use wake_physics::estimate::{ExpectedImage, Value};
use wake_physics::{Field, Scene, expected_intensity, simulate};

fn scene(keys: &[&str]) -> Scene {
    let small = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=4",
        "model.tolerance=1e-4",
        "ship.heading=60",
        "ship.position=[60, 40]",
    ];
    Scene::default()
        .with_assignments(&[&small[..], keys].concat())
        .unwrap()
}

/// Scenes that a derivative may fail on.
const HARD: [&[&str]; 7] = [
    &[],
    &["sea.depth=12", "ship.speed=8"],
    &["radar.range_to_velocity=0"],
    &["radar.range_to_velocity=150", "ship.heading=170"],
    &["radar.incidence=16", "sea.wind_speed=7"],
    &[
        "radar.incidence=45",
        "sea.wind_speed=3",
        "ship.position=[190, -180]",
    ],
    &[
        "radar.sensor=sentinel-1-iw",
        "grid.spacing=10",
        "grid.rows=48",
        "grid.columns=48",
        "radar.incidence=35",
        "ship.speed=7",
        "ship.edge=true",
        "model.terms=[\"kelvin\", \"turbulent\", \"tilt_average\", \"specular\", \"bright_edge\", \"hydrodynamic\", \"bunching\", \"coherence\", \"impulse_response\", \"noise\", \"sea\"]",
    ],
];

/// Without waves of the sea that a pixel carries, the smooth image is the expected image, but for the corners of the weights of range.
#[test]
fn it_is_the_expected_image() {
    for keys in HARD {
        let scene = scene(&[keys, &["sea.wind_speed=2", "sea.fetch=1000"]].concat());
        let expected = expected_intensity(&scene).unwrap();
        let smooth = ExpectedImage::new(&scene, &[]).unwrap();
        let found = smooth.intensity(&scene).unwrap();
        let (largest, rms) = expected.difference(&found);
        let deviation = {
            let mean = expected.mean();
            let square = expected
                .values
                .iter()
                .map(|v| (f64::from(*v) - mean).powi(2));
            (square.sum::<f64>() / expected.values.len() as f64).sqrt()
        };
        println!(
            "{keys:?}: {rms:.2e} {largest:.2e} mean {:.3e} deviation {deviation:.2e}",
            expected.mean()
        );
        assert!(rms < 0.02 * deviation, "{keys:?}");
    }
}

/// Mean of simulated images of an odd or even half of the seeds over a mean image, less 1.
fn residual(scene: &Scene, half: u64, mean: &Field) -> Vec<f64> {
    let seeds = 150;
    let mut sum = vec![0.0; mean.values.len()];
    for seed in 0..seeds {
        let mut one = scene.clone();
        one.seed = 2 * seed + half;
        let image = simulate(&one).unwrap().intensity;
        let pixels = image.values.iter().zip(&mean.values);
        for (sum, (image, mean)) in sum.iter_mut().zip(pixels) {
            *sum += f64::from(image / mean) - 1.0;
        }
    }
    sum.into_iter().map(|v| v / seeds as f64).collect()
}

/// The mean over many seas: bright waves shift and blur the wake as the expected image has it. `expected_intensity` does not.
#[test]
fn it_is_the_mean_over_many_seas() {
    let keys = [
        "radar.incidence=22",
        "sea.wind_speed=6.4",
        "sea.wind_toward=66",
        "ship.heading=72",
        "ship.echo=false",
        "model.tolerance=1e-2",
    ];
    let scene = scene(&keys);
    let smooth = ExpectedImage::new(&scene, &[]).unwrap();
    let smooth = smooth.intensity(&scene).unwrap();
    let simple = expected_intensity(&scene).unwrap();
    // Mean product of two halves: their noise is independent.
    let [off, without] = [smooth, simple].map(|mean| {
        let [a, b] = [0, 1].map(|half| residual(&scene, half, &mean));
        let products = a.iter().zip(&b).map(|(a, b)| a * b);
        (products.sum::<f64>() / a.len() as f64).max(0.0).sqrt()
    });
    println!("mean over seas: off by {off:.4}, without the shift {without:.4}");
    // What is left of the noise of 150 images, 0.02, in a mean over some 150 independent pixels, and what the mean image is off by.
    assert!(off < 0.012, "{off}");
    assert!(without > 4.0 * off, "{without}");
}

/// What a value is moved by at a step of 1: the image changes by about as much as it is bright.
fn unit(value: Value) -> f64 {
    match value {
        Value::Speed => 1.0,
        Value::Heading => 10.0,
        Value::X | Value::Y => 10.0,
        Value::Size | Value::Length | Value::Beam | Value::Draft => 10.0,
        Value::WindSpeed => 3.0,
        Value::WindToward => 50.0,
        Value::Incidence => 10.0,
    }
}

/// Relative rounding of the pixels of an image in single precision: sums of waves and two Fourier transforms.
const ROUNDING: f64 = 5e-7;

/// Root mean square of what rounding makes of a central difference, over that of the derivative.
fn rounding_of(image: &Field, value: Value, slope: &Field, step: f64) -> f64 {
    ROUNDING * image.rms() / (2f64.sqrt() * step * unit(value) * slope.rms())
}

/// Root mean square of a central difference less the derivative, over that of the derivative.
fn error_of(image: &ExpectedImage, scene: &Scene, value: Value, slope: &Field, step: f64) -> f64 {
    let step = step * unit(value);
    let [below, above] = [-step, step].map(|by| image.intensity(&value.moved(scene, by)).unwrap());
    let pixels = below.values.iter().zip(&above.values).zip(&slope.values);
    let (mut error, mut square) = (0.0, 0.0);
    for ((a, b), slope) in pixels {
        let difference = (f64::from(*b) - f64::from(*a)) / (2.0 * step);
        error += (difference - f64::from(*slope)).powi(2);
        square += f64::from(*slope).powi(2);
    }
    (error / square).sqrt()
}

/// Derivatives that are differences of small stages are off by this much of their root mean square: what the stages are rough by.
const ROUGH: f64 = 3e-3;

/// The error of a central difference falls with the square of the step as far as single precision allows.
#[test]
fn derivatives_are_those_of_central_differences() {
    for keys in HARD {
        let scene = scene(keys);
        let image = ExpectedImage::new(&scene, &Value::ALL).unwrap();
        let here = image.at(&scene).unwrap();
        for (value, slope) in &here.derivatives {
            let of = |step| error_of(&image, &scene, *value, slope, step);
            let [wide, narrow, rounded] = [1e-2, 1e-3, 1e-4].map(of);
            let rounding = rounding_of(&here.intensity, *value, slope, 1e-4);
            println!("{keys:?} {value:?}: {wide:.1e} {narrow:.1e} {rounded:.1e} ({rounding:.1e})");
            // A hundredth, less what rounding adds.
            assert!(
                narrow < (wide / 50.0).max(ROUGH),
                "{keys:?} {value:?}: {wide:e} {narrow:e}"
            );
            assert!(wide < 0.1, "{keys:?} {value:?}: {wide:e}");
            // Below the truncation of the wider step, or what rounding adds.
            assert!(
                rounded < narrow.max(ROUGH).max(rounding),
                "{keys:?} {value:?}: {rounded:e} {rounding:e}"
            );
        }
    }
}

/// A ship's value without a ship, a ship that turns, a sea without wind, another number of ships: refused in one sentence.
#[test]
fn what_has_no_smooth_image_is_refused() {
    for (keys, named) in [
        (&["ship.turn_rate=0.5"][..], "ship.turn_rate"),
        (&["sea.wind_speed=0"], "sea.wind_speed"),
    ] {
        let error = ExpectedImage::new(&scene(keys), &[Value::Speed]).unwrap_err();
        assert!(error.to_string().contains(named), "{error}");
    }
    let mut open = scene(&[]);
    open.ships.clear();
    let error = ExpectedImage::new(&open, &[Value::Heading]).unwrap_err();
    assert!(error.to_string().contains("ship.heading"), "{error}");
    let image = ExpectedImage::new(&scene(&[]), &[]).unwrap();
    assert!(image.intensity(&open).is_err());
}
