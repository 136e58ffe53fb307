//! Backscatter: the table over slopes, and fields of σ⁰ by table and by quadrature, 128 to 2048 pixels a side.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::f64::consts::PI;
use std::hint::black_box;
use wake_physics::constants::SPEED_OF_LIGHT;
use wake_physics::permittivity::sea_water;
use wake_physics::scattering::{
    Backscatter, BackscatterTable, FacetFields, Polarization, SlopeCovariance, Specular, TwoScale,
};
use wake_physics::spectrum::Elfouhaily;
use wake_physics::{Field, Raster};

const SPACING: f64 = 2.5;

/// The default scene's radar and wind, at an incidence in degrees.
fn backscatter(degrees: f64) -> Backscatter {
    let (incidence, k) = (degrees.to_radians(), 2.0 * PI * 9.6e9 / SPEED_OF_LIGHT);
    let permittivity = sea_water(9.6e9, 20.0, 35.0);
    let two_scale = TwoScale::new(
        incidence,
        k,
        Polarization::VV,
        permittivity,
        Elfouhaily::new(5.0, 4e4),
        [1.0, 0.0],
    );
    let tilt = two_scale.slopes_from(PI / SPACING);
    let lobe = Specular::mirror_lobe(k, SPACING);
    Backscatter {
        specular: Specular::new(permittivity, incidence, &tilt, lobe),
        two_scale,
        tilt,
    }
}

/// Slopes as steep as those that pixels of 2.5 m resolve in 5 m/s wind.
fn slopes(size: usize) -> [Field; 2] {
    let raster = Raster::image(size, size, SPACING);
    let wave = |a: f64, b: f64| {
        Field::from_fn(&raster, move |i, j| {
            let (x, y) = (a * i as f64, b * j as f64);
            (0.07 * (x.sin() + y.sin() + (0.7 * x + 1.3 * y).sin())) as f32
        })
    };
    [wave(1.732, 0.577), wave(0.43, 2.236)]
}

fn resolved() -> SlopeCovariance {
    SlopeCovariance::isotropic(0.003)
}

/// The table alone, by tolerance, and the figures for the plan.
fn table(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("backscatter_table");
    let [x, y] = slopes(512);
    for degrees in [16.0, 32.0] {
        let model = backscatter(degrees);
        let mean: f64 = model.mean_over(&resolved()).iter().sum();
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-6] {
            let name = BenchmarkId::new(format!("{degrees}_degrees"), tolerance);
            group.bench_function(name, |b| {
                b.iter(|| {
                    BackscatterTable::covering(
                        model.clone(),
                        &FacetFields::of_slopes(&x, &y),
                        tolerance * mean,
                    )
                });
            });
        }
        group.bench_function(format!("sensitivity/{degrees}_degrees"), |b| {
            b.iter(|| black_box(&model).sensitivity(&resolved()));
        });
    }
    group.finish();
}

/// σ⁰ of whole fields from a ready table, and of 16 pixels by quadrature.
fn field(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sigma0");
    for degrees in [16.0, 32.0] {
        let model = backscatter(degrees);
        let mean: f64 = model.mean_over(&resolved()).iter().sum();
        for size in [128, 512, 2048] {
            let [x, y] = slopes(size);
            let fields = FacetFields {
                modulation: Some(&y),
                ..FacetFields::of_slopes(&x, &y)
            };
            let table = BackscatterTable::covering(
                model.clone(),
                &FacetFields::of_slopes(&x, &y),
                1e-3 * mean,
            );
            let name = BenchmarkId::new(format!("table/{degrees}_degrees"), size);
            group.bench_function(name, |b| b.iter(|| table.sigma0_field(&fields)));
        }
        let [x, y] = slopes(4);
        let fields = FacetFields::of_slopes(&x, &y);
        group.bench_function(format!("quadrature_16_pixels/{degrees}_degrees"), |b| {
            b.iter(|| model.sigma0_field(&fields));
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = table, field
}
criterion_main!(benches);
