use super::*;
use crate::sar::AzimuthResolution;
use crate::sar::coherence::cutoff_transfer;
use crate::sar::dense::DirectImage;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use std::f64::consts::{PI, SQRT_2};

const DEFAULT: Imaging = Imaging {
    range_to_velocity: 78.0,
    incidence: 0.5585,
    resolution: AzimuthResolution {
        nominal: 12.0,
        coherence: 60.0,
        defocus: 50.0,
    },
};

/// σ⁰, velocity, acceleration and elevation of independent Gaussian pixels with given standard deviations.
struct Scene {
    raster: Raster,
    sigma0: Field,
    velocity: Field,
    acceleration: Field,
    elevation: Field,
}

impl Scene {
    fn random(raster: Raster, [velocity, acceleration, elevation]: [f64; 3]) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut normal = |deviation: f64| {
            let mut field = Field::constant(&raster, 0.0);
            for v in &mut field.values {
                *v = deviation as f32 * random.sample::<f32, _>(StandardNormal);
            }
            field
        };
        let mut sigma0 = normal(0.7);
        for v in &mut sigma0.values {
            *v = 0.03 * v.exp();
        }
        Self {
            raster,
            sigma0,
            velocity: normal(velocity),
            acceleration: normal(acceleration),
            elevation: normal(elevation),
        }
    }

    fn sources(&self) -> Sources<'_> {
        Sources {
            raster: self.raster,
            sigma0: &self.sigma0,
            radial_velocity: Some(&self.velocity),
            radial_acceleration: Some(&self.acceleration),
            elevation: Some(&self.elevation),
        }
    }
}

fn still(raster: Raster, sigma0: &Field) -> Sources<'_> {
    Sources {
        raster,
        sigma0,
        radial_velocity: None,
        radial_acceleration: None,
        elevation: None,
    }
}

/// The tolerance holds at all levels, for widths from half a pixel to many, and even, odd, prime and unit sizes.
#[test]
fn fast_sum_is_the_dense_sum() {
    let widths = [
        (0.0, 0.0, 0.0),
        (6.0, 0.0, 9.0),
        (12.0, 60.0, 50.0),
        (30.0, 150.0, 9.0),
    ];
    for (rows, columns) in [(61, 40), (128, 37), (1, 1), (7, 90)] {
        let image = Raster::image(rows, columns, 2.5);
        let scene = Scene::random(image.with_margin(20, 3), [0.3, 0.8, 0.7]);
        for (nominal, coherence, defocus) in widths {
            let resolution = AzimuthResolution {
                nominal,
                coherence,
                defocus,
            };
            let imaging = Imaging {
                resolution,
                ..DEFAULT
            };
            let exact = DirectImage::new(&imaging, &scene.sources(), &image).image();
            for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
                let fast = imaging.image(&scene.sources(), &image, tolerance);
                let (_, rms) = fast.difference(&exact);
                // Rounding to f32: positions to 1e-6 of a pixel, and sums of some hundred taps.
                let allowed = (tolerance + 2e-6) * exact.mean();
                assert!(
                    rms <= allowed,
                    "{rows}x{columns} {nominal} {tolerance}: {rms} {allowed}"
                );
            }
        }
    }
}

/// Errors fall with the tolerance, so the tolerance determines them.
#[test]
fn error_follows_the_tolerance() {
    let image = Raster::image(90, 60, 2.5);
    let scene = Scene::random(image.with_margin(40, 2), [0.3, 0.8, 0.7]);
    let exact = DirectImage::new(&DEFAULT, &scene.sources(), &image).image();
    let error = |tolerance| {
        let fast = DEFAULT.image(&scene.sources(), &image, tolerance);
        fast.difference(&exact).1 / exact.mean()
    };
    // Four decades of tolerance give at least two of error.
    assert!(error(1e-1) > 100.0 * error(1e-5));
}

/// Power is conserved, fast and dense, as long as nothing leaves the image.
#[test]
fn power_is_conserved() {
    let inner = Raster::image(30, 24, 2.5);
    let scene = Scene::random(inner, [0.2, 0.8, 0.5]);
    let image = inner.with_margin(140, 8);
    let power = scene.sigma0.mean() * inner.len() as f64;
    for resolution in [AzimuthResolution::at_rest(1.0, 1), DEFAULT.resolution] {
        let imaging = Imaging {
            resolution,
            ..DEFAULT
        };
        let fast = imaging.image(&scene.sources(), &image, 1e-3);
        // Sums in f32: every source keeps its power within a few roundings, whatever the tolerance.
        assert!((fast.mean() * image.len() as f64 / power - 1.0).abs() < 3e-6);
        let dense = DirectImage::new(&imaging, &scene.sources(), &image).image();
        assert!((dense.mean() * image.len() as f64 / power - 1.0).abs() < 1e-6);
        assert!(fast.values.iter().all(|&v| v >= 0.0));
    }
}

/// Centre (x, y) of an image.
fn centre(image: &Field, raster: &Raster) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for i in 0..raster.rows {
        for j in 0..raster.columns {
            let v = f64::from(image.at(i, j));
            sums[0] += v * raster.x(j);
            sums[1] += v * raster.y(i);
            sums[2] += v;
        }
    }
    [sums[0] / sums[2], sums[1] / sums[2]]
}

/// A patch that approaches is imaged (R/V)·`u_r` further along the flight: larger y, smaller row. A raised patch is imaged
/// ζ cot θ nearer to the radar.
#[test]
fn a_moving_patch_is_displaced() {
    let raster = Raster::image(201, 61, 2.5);
    let patch = Field::from_fn(&raster, |i, j| {
        f32::from(u8::from(i.abs_diff(100) <= 3 && j.abs_diff(30) <= 3))
    });
    for velocity in [0.7, -0.7, 0.011, 0.0] {
        for elevation in [-4.0, 0.0, 1.3] {
            let u = Field::constant(&raster, velocity);
            let z = Field::constant(&raster, elevation);
            let sources = Sources {
                radial_velocity: Some(&u),
                elevation: Some(&z),
                ..still(raster, &patch)
            };
            let image = DEFAULT.image(&sources, &raster, 1e-4);
            let [x, y] = centre(&image, &raster);
            let moved = 78.0 * f64::from(velocity);
            let leaned = -f64::from(elevation) / 0.5585f64.tan();
            // Power omitted by the tolerance lies at most a few standard deviations (14 m) away.
            assert!(
                (y - moved).abs() < 1e-2 && (x - leaned).abs() < 1e-3,
                "{x} {y}"
            );
        }
    }
}

/// One bright pixel becomes the Gaussian of the resolution: variance ρ'²/2π².
#[test]
fn a_point_is_as_wide_as_the_resolution() {
    let raster = Raster::image(301, 3, 2.5);
    let mut point = Field::constant(&raster, 0.0);
    point.values[150 * 3 + 1] = 1.0;
    let acceleration = Field::constant(&raster, 1.5);
    let sources = Sources {
        radial_acceleration: Some(&acceleration),
        ..still(raster, &point)
    };
    let image = DEFAULT.image(&sources, &raster, 1e-6);
    let variance: f64 = (0..301)
        .map(|i| f64::from(image.at(i, 1)) * raster.y(i).powi(2))
        .sum();
    let rho = (12f64.powi(2) + 60f64.powi(2) + 75f64.powi(2)).sqrt();
    assert!((variance / (rho * rho / (2.0 * PI * PI)) - 1.0).abs() < 1e-4);
}

/// With R/V = 0 and no motion, σ⁰ is imaged at the nominal resolution, and a uniform sea is unchanged.
#[test]
fn without_a_synthetic_aperture_nothing_moves() {
    let image = Raster::image(40, 30, 2.5);
    let scene = Scene::random(image.with_margin(6, 0), [0.5, 1.0, 0.0]);
    let imaging = Imaging {
        range_to_velocity: 0.0,
        resolution: AzimuthResolution::of_moving_sea(0.0312, 0.0, 1.0, 1, 0.3),
        ..DEFAULT
    };
    let moving = imaging.image(&scene.sources(), &image, 1e-5);
    let absent = imaging.image(&still(scene.raster, &scene.sigma0), &image, 1e-5);
    assert_eq!(moving, absent);
    // Half a pixel of standard deviation: weights e^{−2d²} of the neighbours over their sum.
    let sum = 1.0 + 2.0 * (-2f64).exp() + 2.0 * (-8f64).exp();
    for (i, j) in [(0, 0), (11, 7), (39, 29)] {
        let at = |d: usize| f64::from(scene.sigma0.at(i + 6 + d - 2, j));
        let near = (at(1) + at(3)) * (-2f64).exp() + (at(0) + at(4)) * (-8f64).exp();
        let expected = (at(2) + near) / sum;
        assert!((f64::from(moving.at(i, j)) / expected - 1.0).abs() < 2e-5);
    }
    let uniform = Field::constant(&scene.raster, 0.04);
    let image = imaging.image(&still(scene.raster, &uniform), &image, 1e-5);
    assert!(image.values.iter().all(|v| (v / 0.04 - 1.0).abs() < 2e-5));
}

/// Sources displaced out of the image leave it empty; nothing wraps around.
#[test]
fn nothing_wraps() {
    let image = Raster::image(50, 40, 2.5);
    let wide = image.with_margin(150, 40);
    let scene = Scene::random(wide, [0.25, 0.5, 0.6]);
    let away = Field::from_fn(&wide, |i, _| if wide.y(i) > 0.0 { 1e3 } else { -1e3 });
    let sources = Sources {
        radial_velocity: Some(&away),
        ..still(wide, &scene.sigma0)
    };
    let empty = DEFAULT.image(&sources, &image, 1e-4);
    assert!(empty.values.iter().all(|v| v.abs() < f32::MIN_POSITIVE));
}

#[test]
fn threads_do_not_change_the_image() {
    let image = Raster::image(70, 130, 2.5);
    let scene = Scene::random(image.with_margin(40, 3), [0.3, 0.8, 0.7]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| DEFAULT.image(&scene.sources(), &image, 1e-3))
    };
    assert_eq!(with(1), with(3));
}

/// Amplitude of a wave with `waves` periods over the rows of an image, averaged over columns, relative to the mean.
fn amplitude(image: &Field, waves: f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for i in 0..image.rows {
        let phase = 2.0 * PI * waves * i as f64 / image.rows as f64;
        for j in 0..image.columns {
            sums[0] += f64::from(image.at(i, j)) * phase.cos();
            sums[1] += f64::from(image.at(i, j)) * phase.sin();
        }
    }
    let count = (image.rows * image.columns) as f64;
    sums.map(|v| 2.0 * v / (count * image.mean()))
}

/// The azimuth cut-off from displaced pixels alone: a pattern of σ⁰ over a sea of random velocities, and the crests that
/// velocity bunching makes of a weak swell, keep exp(−k²β²σ²) of their power, apart from the resolution.
#[test]
fn monte_carlo_meets_the_quasi_linear_cutoff() {
    let image = Raster::image(256, 256, 5.0);
    let raster = image.with_margin(50, 0);
    let deviation = 0.25;
    let noise = Scene::random(raster, [deviation, 0.0, 0.0]).velocity;
    let imaging = Imaging {
        resolution: AzimuthResolution::at_rest(5.0, 3),
        ..DEFAULT
    };
    for waves in [4.0, 8.0, 16.0, 24.0] {
        let k = 2.0 * PI * waves / (256.0 * 5.0);
        let response = (-0.5 * (k * 15.0 / (SQRT_2 * PI)).powi(2)).exp();
        let expected = cutoff_transfer(k, 78.0, deviation).sqrt() * response;
        // Row 0 of the image has phase 0.
        let crest = |i: usize| k * 5.0 * (i as f64 - 50.0);
        let pattern = Field::from_fn(&raster, |i, _| (1.0 + crest(i).cos()) as f32);
        let sources = Sources {
            radial_velocity: Some(&noise),
            ..still(raster, &pattern)
        };
        let seen = amplitude(&imaging.image(&sources, &image, 1e-4), waves);
        // Each of the 65,536 sources has a random phase: standard error √(2·1.5/65,536) = 0.007 at most.
        assert!(
            (seen[0] - expected).abs() < 0.02,
            "{waves}: {seen:?} {expected}"
        );
        assert!(seen[1].abs() < 0.02);

        // A swell of velocity u cos(kr), r down the rows: y' = y + βu, so the row decreases, dr = −βu. To first order the
        // density is 1 + d(βu cos kr)/dr = 1 − kβu sin(kr).
        let swell = 0.2 / (k * 78.0);
        let moving = Field::from_fn(&raster, |i, j| {
            (swell * crest(i).cos()) as f32 + noise.at(i, j)
        });
        let flat = Field::constant(&raster, 1.0);
        let sources = Sources {
            radial_velocity: Some(&moving),
            ..still(raster, &flat)
        };
        let seen = amplitude(&imaging.image(&sources, &image, 1e-4), waves);
        // J₁(0.2)·2 is 0.199; the rest is the same statistical error.
        assert!(
            (seen[1] + 0.199 * expected).abs() < 0.02,
            "{waves}: {seen:?}"
        );
        assert!(seen[0].abs() < 0.02);
    }
}

/// The smear by loss of coherence equals bunching by the same velocities: an image of unresolved random velocities has, on
/// average, the response of [`AzimuthResolution::of_moving_sea`].
#[test]
fn coherence_is_bunching_by_unresolved_waves() {
    let raster = Raster::image(257, 400, 2.5);
    let line = Field::from_fn(&raster, |i, _| f32::from(u8::from(i == 128)));
    let deviation = 0.3;
    let velocity = Scene::random(raster, [deviation, 0.0, 0.0]).velocity;
    let spread = |image: &Field| -> f64 {
        let sum = |power: i32| -> f64 {
            let row = |i: usize| -> f64 { (0..400).map(|j| f64::from(image.at(i, j))).sum() };
            (0..257).map(|i| row(i) * raster.y(i).powi(power)).sum()
        };
        (sum(2) / sum(0)).sqrt()
    };
    let resolved = Sources {
        radial_velocity: Some(&velocity),
        ..still(raster, &line)
    };
    let at_rest = Imaging {
        resolution: AzimuthResolution::at_rest(3.0, 4),
        ..DEFAULT
    };
    let unresolved = Imaging {
        resolution: AzimuthResolution::of_moving_sea(0.0312, 78.0, 3.0, 4, deviation),
        ..DEFAULT
    };
    let bunched = spread(&at_rest.image(&resolved, &raster, 1e-5));
    let smeared = spread(&unresolved.image(&still(raster, &line), &raster, 1e-5));
    // A standard deviation from 400 samples errs by 1/√800 = 3.5 %; the limit is two and a half times that.
    assert!(
        (bunched / smeared - 1.0).abs() < 0.09,
        "{bunched} {smeared}"
    );
}

#[test]
#[allow(clippy::float_cmp, reason = "whole numbers and exact fractions")]
fn positions_are_a_floor_and_a_rest() {
    let values = [0.0, 0.25, -0.25, 3.0, -3.0, -2.75];
    let (mut whole, mut rest) = ([0; 6], [0.0; 6]);
    split(&mut whole, &mut rest, 0.5, 1.0, Some(&values));
    assert_eq!(whole, [0, 0, 0, 3, -3, -3]);
    assert_eq!(rest, [0.5, 0.75, 0.25, 0.5, 0.5, 0.75]);
    split(&mut whole, &mut rest, -0.25, 1.0, None);
    assert_eq!((whole, rest), ([-1; 6], [0.75; 6]));
}
