//! The Kelvin wake: its plan, its plane waves, and their sum on rasters of 128 to 2048 pixels a side.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use wake_physics::hull::Hull;
use wake_physics::kelvin::{KelvinWake, fade_field};
use wake_physics::reference::{matrix_product, synthesize};
use wake_physics::waves::{Quantity, Transfer};
use wake_physics::{Raster, Track};

const SIX: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

const TRANSFER: Transfer = Transfer {
    depth: f64::INFINITY,
    incidence: 0.5585,
    relaxation_rate: 0.5,
    action_slope: 4.5,
};

fn wake() -> KelvinWake {
    KelvinWake {
        hull: Hull::wigley(195.0, 26.0, 10.0),
        speed: 10.0,
        track: Track::new([0.0, 0.0], 45.0, 0.0),
        depth: f64::INFINITY,
        filter_depth: 0.0,
        steepness: None,
    }
}

fn six_fields(c: &mut Criterion) {
    let mut group = c.benchmark_group("kelvin");
    group.sample_size(10);
    let wake = wake();
    for size in [128, 256, 512, 1024, 2048] {
        let raster = Raster::image(size, size, 2.5);
        let waves = wake.waves(&wake.plan(&raster, 1e-4));
        group.bench_with_input(BenchmarkId::new("nodes", size), &raster, |b, raster| {
            b.iter(|| wake.waves(&wake.plan(black_box(raster), 1e-4)));
        });
        group.bench_with_input(
            BenchmarkId::new("six_fields", size),
            &raster,
            |b, raster| {
                b.iter(|| synthesize(black_box(&waves), &TRANSFER, &SIX, raster, 1e-4));
            },
        );
        group.bench_with_input(BenchmarkId::new("fade", size), &raster, |b, raster| {
            b.iter(|| fade_field(&wake.track, 195.0, black_box(raster)));
        });
        if size <= 512 {
            group.bench_with_input(
                BenchmarkId::new("matrix_product", size),
                &raster,
                |b, raster| {
                    b.iter(|| matrix_product(black_box(&waves), &TRANSFER, &SIX, raster));
                },
            );
        }
    }
    group.finish();
}

criterion_group!(benches, six_fields);
criterion_main!(benches);
