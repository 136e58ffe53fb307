use super::*;
use crate::waves::harmonic_sum;

const ALL: [Quantity; 8] = [
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
    relaxation_rate: 0.5,
    action_slope: 4.5,
};

fn summands<'a>(waves: &'a PlaneWaves, raster: &'a Raster) -> Summands<'a> {
    Summands {
        waves,
        transfer: &TRANSFER,
        quantities: &ALL,
        raster,
    }
}

/// Waves spread over the band, with deterministic, unrelated phases.
fn scattered(raster: &Raster, count: usize) -> PlaneWaves {
    let mut waves = PlaneWaves::default();
    let band = raster.nyquist_wavenumber();
    for n in 0..count {
        let (a, b) = ((0.618034 * n as f64).fract(), (0.754878 * n as f64).fract());
        let k = [band * (2.0 * a - 1.0), band * (2.0 * b - 1.0)];
        let phase = 7.3 * n as f64 * n as f64;
        waves.push(k, 3.0, Complex64::from_polar(0.2 + a, phase));
    }
    // The corners and edges of the band, the mean, and one wave twice.
    for k in [
        [band, band],
        [-band, 0.0],
        [0.0, band],
        [0.0, 0.0],
        [0.1 * band, 0.0],
    ] {
        waves.push(k, 3.0, Complex64::new(0.7, -0.4));
    }
    waves
}

/// Largest error over the field's rms for each field, on all or many pixels, minus the rounding of the result to `f32`.
fn errors(waves: &PlaneWaves, raster: &Raster, tolerance: f64) -> Vec<f64> {
    let fields = synthesize(waves, &TRANSFER, &ALL, raster, tolerance);
    let stride = raster.len().div_ceil(2000).max(1) | 1;
    let mut pixels: Vec<[usize; 2]> = (0..raster.len())
        .step_by(stride)
        .map(|n| [n / raster.columns, n % raster.columns])
        .collect();
    let (bottom, right) = (raster.rows - 1, raster.columns - 1);
    pixels.extend([[0, 0], [0, right], [bottom, 0], [bottom, right]]);
    let exact = harmonic_sum(waves, &TRANSFER, &ALL, raster, &pixels);
    fields
        .iter()
        .zip(exact)
        .map(|(field, exact)| {
            let rms = (exact.iter().map(|v| v * v).sum::<f64>() / exact.len() as f64).sqrt();
            pixels
                .iter()
                .zip(&exact)
                .map(|(&[i, j], v)| {
                    let rounding = v.abs() * f64::from(f32::EPSILON) / 2.0;
                    (f64::from(field.at(i, j)) - v).abs() - rounding
                })
                .fold(0.0, f64::max)
                / rms
        })
        .collect()
}

/// The tolerance holds at all levels on square, long, prime-sized and tiny rasters and far from the origin.
#[test]
fn tolerance_is_met_at_every_level() {
    let mut far = Raster::image(33, 70, 1.3);
    (far.origin_row, far.origin_column) = (-900, 4000);
    let rasters = [
        Raster::image(64, 64, 2.5),
        Raster::image(1, 1, 2.5),
        Raster::image(1, 300, 0.7),
        Raster::image(257, 2, 10.0),
        Raster::image(61, 53, 2.5),
        far,
    ];
    for raster in rasters {
        let waves = scattered(&raster, 150);
        for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            for (error, q) in errors(&waves, &raster, tolerance).into_iter().zip(ALL) {
                assert!(
                    error <= tolerance,
                    "{q:?} {error:e} > {tolerance:e} on {raster:?}"
                );
            }
        }
    }
}

/// The accuracy follows the tolerance, rather than always being the best.
#[test]
fn work_follows_the_tolerance() {
    let raster = Raster::image(128, 128, 2.5);
    let waves = scattered(&raster, 500);
    let sums = CentredSums::new(summands(&waves, &raster), WAVES_AT_ONCE);
    let plan = |tolerance| {
        let sizes = sums.sizes.iter().map(|&s| (s, s.expected_rms()));
        let demand = Demand::strictest(sizes, tolerance);
        Gridding::fastest(&demand, &raster, [waves.len(), ALL.len()])
    };
    assert!(plan(1e-1).kernel.width < plan(1e-4).kernel.width);
    assert!(!plan(1e-3).double_precision && plan(1e-6).double_precision);
    assert!(errors(&waves, &raster, 1e-1).iter().any(|&e| e > 1e-6));
}

/// Strong waves that cancel on the raster: the weak remaining field is still accurate relative to its own rms.
#[test]
fn cancelling_waves_keep_their_tolerance() {
    let raster = Raster::image(40, 40, 1.0);
    let mut waves = PlaneWaves::default();
    for n in 0..50 {
        let k = 0.5 + 0.01 * f64::from(n);
        waves.push([k, 0.2], 1.0, Complex64::new(1.0, 0.0));
        waves.push([k + 1e-6, 0.2], 1.0, Complex64::new(-1.0, 0.0));
    }
    for error in errors(&waves, &raster, 1e-4) {
        assert!(error <= 1e-4, "{error:e}");
    }
}

#[test]
fn no_wave_is_a_flat_sea() {
    let raster = Raster::image(5, 4, 1.0);
    let fields = synthesize(&PlaneWaves::default(), &TRANSFER, &ALL, &raster, 1e-3);
    assert!(fields.iter().all(|f| f.values == vec![0.0; 20]));
    assert!(synthesize(&scattered(&raster, 3), &TRANSFER, &[], &raster, 1e-3).is_empty());
}

/// Rounding of the `f32` transform against `f64` stays below its stated bound, which is tight within a factor of 20.
#[test]
fn rounding_is_bounded() {
    for (rows, columns) in [(64, 64), (300, 250), (45, 700)] {
        let raster = Raster::image(rows, columns, 2.5);
        let waves = scattered(&raster, 400);
        let sums = CentredSums::new(summands(&waves, &raster), WAVES_AT_ONCE);
        for oversampling in [1.25, 1.5, 2.0] {
            for error in [1e-3, 1e-5, 1e-7] {
                let single = Gridding::new(error, oversampling, &raster, false);
                let double = Gridding {
                    double_precision: true,
                    ..single
                };
                let todo: Vec<usize> = (0..ALL.len()).collect();
                let mut fields = [(); 2].map(|()| vec![Field::constant(&raster, 0.0); ALL.len()]);
                let [by_single, by_double] = &mut fields;
                sums.run::<f32>(&mut Workspace::default(), &single, &todo, |q, field| {
                    std::mem::swap(&mut by_single[q], field);
                });
                sums.run::<f64>(&mut Workspace::default(), &double, &todo, |q, field| {
                    std::mem::swap(&mut by_double[q], field);
                });
                for &q in &todo {
                    let (max, _) = fields[0][q].difference(&fields[1][q]);
                    let bound = single.rounding() * sums.sizes[q].root;
                    assert!(
                        max <= bound && bound <= 20.0 * max,
                        "{max:e} {bound:e} {single:?}"
                    );
                }
            }
        }
    }
}

/// Waves spread in parts give the same fields as all at once, within rounding; sizes are bit-identical.
#[test]
fn parts_of_the_waves_make_the_same_fields() {
    let raster = Raster::image(40, 56, 2.0);
    let waves = scattered(&raster, 300);
    let summands = summands(&waves, &raster);
    let fields = |at_once: usize| {
        let sums = CentredSums::new(summands, at_once);
        assert_eq!(sums.whole.is_some(), at_once >= waves.len());
        let gridding = Gridding::new(1e-9, 2.0, &raster, true);
        let mut fields = vec![Field::default(); ALL.len()];
        let todo: Vec<usize> = (0..ALL.len()).rev().collect();
        sums.run::<f64>(&mut Workspace::default(), &gridding, &todo, |q, field| {
            fields[q] = field.clone();
        });
        (
            fields,
            sums.sizes
                .iter()
                .map(|s| [s.sum, s.root])
                .collect::<Vec<_>>(),
        )
    };
    let (whole, sizes) = fields(1000);
    for at_once in [1, 100, 304] {
        let (parts, same) = fields(at_once);
        assert_eq!(sizes, same, "{at_once}");
        for (a, b) in whole.iter().zip(&parts) {
            // Rounded to f32, 6e-8 of a value; the largest value is about three times the rms.
            assert!(
                a.rms() > 0.0 && a.difference(b).0 <= 4e-7 * a.rms(),
                "{at_once}"
            );
        }
    }
}
