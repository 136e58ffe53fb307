//! The random sea: drawing it, and all eight fields of it by FFT, over the size of the raster.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use wake_physics::Raster;
use wake_physics::scene::{SpectrumModel, SpreadingModel};
use wake_physics::surface::Surface;
use wake_physics::waves::{Quantity, Transfer};
use wake_physics::wind_sea::{DirectionalSpectrum, WindSea};

const FIELDS: [Quantity; 8] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
    Quantity::RadialAcceleration,
    Quantity::Hydrodynamic,
];

const TRANSFER: Transfer = Transfer {
    depth: f64::INFINITY,
    incidence: 0.56,
    relaxation_rate: 0.3,
    action_slope: 4.5,
};

fn spectrum() -> DirectionalSpectrum {
    DirectionalSpectrum::new(&WindSea {
        wind_speed: 5.0,
        wind_toward: 1.57,
        fetch: 4e4,
        depth: TRANSFER.depth,
        spectrum: SpectrumModel::Elfouhaily,
        spreading: SpreadingModel::Hasselmann,
    })
}

fn surface(c: &mut Criterion) {
    let spectrum = spectrum();
    c.bench_function("surface/moments", |b| {
        b.iter(|| spectrum.moments(0.0, 1.26, TRANSFER.incidence));
    });
    let mut group = c.benchmark_group("surface");
    group.sample_size(10);
    for size in [128, 256, 512, 1024, 2048] {
        let raster = Raster::image(size, size, 2.5);
        group.throughput(Throughput::Elements((size * size) as u64));
        group.bench_with_input(BenchmarkId::new("draw", size), &raster, |b, raster| {
            b.iter(|| Surface::new(&spectrum, 7, 0.0, raster));
        });
        let sea = Surface::new(&spectrum, 7, 0.0, &raster);
        for (name, tolerance) in [("fields_single", 1e-3), ("fields_double", 1e-6)] {
            group.bench_with_input(BenchmarkId::new(name, size), &sea, |b, sea| {
                b.iter(|| sea.fields(&TRANSFER, &FIELDS, tolerance));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, surface);
criterion_main!(benches);
