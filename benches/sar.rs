//! SAR imaging, impulse response and speckle, from 128 to 2048 pixels: `cargo bench --no-default-features --bench sar`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};
use rayon::prelude::*;
use std::f64::consts::{SQRT_2, TAU};
use wake_physics::sar::impulse::{Axis, Looks, Reflectivity};
use wake_physics::sar::speckle::speckle;
use wake_physics::sar::{AzimuthResolution, Imaging, ImpulseResponse, Sources};
use wake_physics::window::Window;
use wake_physics::{Field, Raster};

const SIZES: [usize; 5] = [128, 256, 512, 1024, 2048];
const SPACING: f64 = 2.5;
const LOOKS: u32 = 4;

/// Random waves of 10 to 60 m along both axes, of this root mean square.
fn waves(raster: &Raster, rms: f64, seed: u64) -> Field {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut uniform = || random.next_u64() as f64 / u64::MAX as f64;
    let modes: Vec<[f64; 3]> = (0..24)
        .map(|_| {
            let (k, direction) = (TAU / (10.0 + 50.0 * uniform()), TAU * uniform());
            [k * direction.sin(), k * direction.cos(), TAU * uniform()]
        })
        .collect();
    let amplitude = rms * SQRT_2 / (modes.len() as f64).sqrt();
    let mut field = Field::constant(raster, 0.0);
    let rows = field.values.par_chunks_mut(raster.columns).enumerate();
    rows.for_each(|(i, row)| {
        for (j, v) in row.iter_mut().enumerate() {
            let wave = |m: &[f64; 3]| (m[0] * raster.x(j) + m[1] * raster.y(i) + m[2]).cos();
            *v = (amplitude * modes.iter().map(wave).sum::<f64>()) as f32;
        }
    });
    field
}

fn imaging(c: &mut Criterion) {
    let radar = Imaging {
        range_to_velocity: 78.0,
        incidence: 32f64.to_radians(),
        resolution: AzimuthResolution::of_moving_sea(0.0312, 78.0, 3.0, LOOKS, 0.18),
    };
    let mut group = c.benchmark_group("image");
    for size in SIZES {
        let image = Raster::image(size, size, SPACING);
        let raster = image.with_margin(52, 4);
        let (velocity, acceleration, elevation) = (
            waves(&raster, 0.4, 1),
            waves(&raster, 0.8, 2),
            waves(&raster, 0.3, 3),
        );
        let sigma0 = Field::constant(&raster, 0.03);
        let none = Sources {
            raster,
            sigma0: &sigma0,
            radial_velocity: None,
            radial_acceleration: None,
            elevation: None,
        };
        let bunching = Sources {
            radial_velocity: Some(&velocity),
            ..none
        };
        let all = Sources {
            radial_acceleration: Some(&acceleration),
            elevation: Some(&elevation),
            ..bunching
        };
        group.throughput(Throughput::Elements(image.len() as u64));
        for (name, sources) in [("none", none), ("bunching", bunching), ("all", all)] {
            group.bench_with_input(BenchmarkId::new(name, size), &sources, |b, sources| {
                b.iter(|| radar.image(sources, &image, 1e-3));
            });
        }
    }
    group.finish();
}

/// Four looks through a response four sources wide, on the pixels of the image and on two a pixel.
fn responses(c: &mut Criterion) {
    let mut group = c.benchmark_group("response");
    for size in SIZES {
        for fine in [1, 2] {
            let spacing = SPACING / fine as f64;
            let axis = Axis {
                resolution: 4.0 * spacing,
                window: Window::Hamming(0.75),
            };
            let response = ImpulseResponse {
                range: axis,
                azimuth: axis,
            };
            let image = Raster::image(size, size, SPACING);
            let [rows, columns] = response.guard(spacing);
            let sources =
                Raster::image(size * fine, size * fine, spacing).with_margin(rows, columns);
            let intensity = Field::constant(&sources, 0.03);
            let sources = Reflectivity {
                raster: &sources,
                intensity: &intensity,
                points: &[],
            };
            let looks = Looks {
                equivalent: f64::from(LOOKS),
                seed: 1,
            };
            group.throughput(Throughput::Elements(image.len() as u64));
            group.bench_function(BenchmarkId::new(format!("{fine} a pixel"), size), |b| {
                b.iter(|| response.multilook(&sources, &image, &looks));
            });
        }
    }
    group.finish();
}

fn speckles(c: &mut Criterion) {
    let mut group = c.benchmark_group("speckle");
    for size in SIZES {
        let image = Field::constant(&Raster::image(size, size, SPACING), 0.03);
        group.throughput(Throughput::Elements(image.values.len() as u64));
        for looks in [1, LOOKS, 16] {
            let mut noisy = image.clone();
            group.bench_function(BenchmarkId::new(format!("{looks} looks"), size), |b| {
                b.iter(|| {
                    noisy.values.copy_from_slice(&image.values);
                    speckle(&mut noisy, looks, 1);
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = imaging, responses, speckles
}
criterion_main!(benches);
