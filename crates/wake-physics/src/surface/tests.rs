use super::*;
use crate::scene::{SpectrumModel, SpreadingModel};
use crate::waves::{harmonic_sum, strengths};
use crate::wind_sea::WindSea;
use std::collections::HashMap;

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

const SEA: WindSea = WindSea {
    wind_speed: 5.0,
    wind_toward: 1.1,
    fetch: 4e4,
    depth: f64::INFINITY,
    spectrum: SpectrumModel::Elfouhaily,
    spreading: SpreadingModel::Hasselmann,
};

fn transfer(depth: f64) -> Transfer {
    Transfer {
        depth,
        incidence: 0.56,
        relaxation_rate: 0.3,
        action_slope: 4.5,
    }
}

fn surface(sea: &WindSea, raster: &Raster) -> Surface {
    Surface::new(&DirectionalSpectrum::new(sea), 7, 0.0, raster)
}

/// A sea in which every amplitude has its mean modulus.
fn steady(sea: &WindSea, raster: &Raster) -> Surface {
    Surface::draw(
        &DirectionalSpectrum::new(sea),
        7,
        0.0,
        raster,
        Scatter::Phase,
        &mut Workspace::default(),
    )
}

/// Σ½|T c|² of the modes.
fn mode_variance(waves: &PlaneWaves, factor: impl Fn([f64; 2], f64) -> Complex64) -> f64 {
    (0..waves.len())
        .map(|n| {
            let t = factor([waves.kx[n], waves.ky[n]], waves.omega[n]);
            0.5 * (t * waves.amplitude[n]).norm_sqr()
        })
        .sum()
}

/// Every quantity at some pixels against the harmonic sum of the same waves, within the requested tolerance.
#[test]
fn fields_are_the_harmonic_sum() {
    let raster = Raster {
        rows: 47,
        columns: 70,
        spacing: 1.7,
        origin_row: 1003,
        origin_column: -58,
    };
    let pixels: Vec<[usize; 2]> = (0..150)
        .map(|n| [(17 * n) % 47, (29 * n + n / 47) % 70])
        .collect();
    for (depth, time) in [(f64::INFINITY, 0.0), (2.0, 77.7)] {
        let spectrum = DirectionalSpectrum::new(&WindSea { depth, ..SEA });
        let sea = Surface::new(&spectrum, 3, time, &raster);
        let exact = harmonic_sum(&sea.modes(), &transfer(depth), &ALL, &raster, &pixels);
        for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let fields = sea.fields(&transfer(depth), &ALL, tolerance);
            for ((field, exact), quantity) in fields.iter().zip(&exact).zip(ALL) {
                let rms = field.rms();
                for (&[i, j], exact) in pixels.iter().zip(exact) {
                    let error = (f64::from(field.at(i, j)) - exact).abs();
                    assert!(
                        error <= tolerance * rms,
                        "{quantity:?} {tolerance} {error} {rms}"
                    );
                }
            }
        }
    }
}

/// An odd number of quantities, repeated ones, none: each field is independent of the others requested.
#[test]
fn fields_do_not_depend_on_their_company() {
    let raster = Raster::image(30, 20, 2.0);
    let sea = surface(&SEA, &raster);
    let all = sea.fields(&transfer(SEA.depth), &ALL, 1e-3);
    let some = [
        Quantity::VelocityZ,
        Quantity::Elevation,
        Quantity::VelocityZ,
    ];
    let fields = sea.fields(&transfer(SEA.depth), &some, 1e-3);
    for (field, n) in fields.iter().zip([5, 0, 5]) {
        // Rounding of the partner in the same FFT.
        assert!(field.difference(&all[n]).0 < 1e-5 * all[n].rms());
    }
    assert!(sea.fields(&transfer(SEA.depth), &[], 1e-3).is_empty());
}

/// The variances of the waves and of those left out sum to the integral of the spectrum, wherever the peak lies: from far
/// below the lattice's first wave to beyond the shortest wave of a pixel.
#[test]
fn variance_is_that_of_the_spectrum() {
    for model in [
        SpectrumModel::Elfouhaily,
        SpectrumModel::Jonswap,
        SpectrumModel::PiersonMoskowitz,
    ] {
        for (rows, columns) in [(1, 1), (9, 200), (128, 128)] {
            for (spacing, wind_speed) in [
                (2.5, 3.0),
                (2.5, 5.0),
                (2.5, 12.0),
                (2.5, 30.0),
                (10.0, 7.0),
                (0.5, 4.0),
            ] {
                let sea = WindSea {
                    wind_speed,
                    fetch: 1e5,
                    spectrum: model,
                    ..SEA
                };
                let raster = Raster::image(rows, columns, spacing);
                let surface = steady(&sea, &raster);
                let band = DirectionalSpectrum::new(&sea)
                    .moments(0.0, raster.nyquist_wavenumber(), 0.0)
                    .elevation;
                let modes = mode_variance(&surface.modes(), |_, _| Complex64::ONE);
                assert!((modes / surface.variance() - 1.0).abs() < 1e-5);
                assert!((modes / band - 1.0).abs() < 0.01);
            }
        }
    }
}

/// Second moments of the modes against the integrals over the resolved band.
#[test]
fn slopes_and_velocities_have_the_variance_of_the_band() {
    for depth in [f64::INFINITY, 3.0] {
        for spreading in [SpreadingModel::Hasselmann, SpreadingModel::Elfouhaily] {
            let sea = WindSea {
                depth,
                spreading,
                ..SEA
            };
            let raster = Raster::image(200, 150, 2.0);
            let spectrum = DirectionalSpectrum::new(&sea);
            let band = spectrum.moments(0.0, raster.nyquist_wavenumber(), 0.56);
            let modes = steady(&sea, &raster).modes();
            let t = transfer(depth);
            let of = |quantity| mode_variance(&modes, |k, omega| t.factor(quantity, k, omega));
            for (sum, integral) in [
                (of(Quantity::SlopeX), band.slope_xx),
                (of(Quantity::SlopeY), band.slope_yy),
                (of(Quantity::RadialAcceleration), band.radial_acceleration),
                (
                    mode_variance(&modes, |k, omega| t.radial(k, omega)),
                    band.radial_velocity,
                ),
            ] {
                assert!((sum / integral - 1.0).abs() < 5e-3);
            }
            // ⟨u_z²⟩ = ∫ω²S: viewed from directly above.
            let vertical = spectrum
                .moments(0.0, raster.nyquist_wavenumber(), 0.0)
                .radial_velocity;
            assert!((of(Quantity::VelocityZ) / vertical - 1.0).abs() < 5e-3);
        }
    }
}

/// Key of a wavenumber for hashing.
fn key(kx: f64, ky: f64) -> (i64, i64) {
    ((kx * 1e6).round() as i64, (ky * 1e6).round() as i64)
}

/// A field's mean square over a whole period is ¼Σ|c(k) + c*(−k)|² of its waves (Parseval).
#[test]
fn mean_square_is_the_sum_over_waves() {
    let raster = Raster::image(24, 24, 2.5);
    let sea = surface(&SEA, &raster);
    let [rows, columns] = [sea.lattice.rows, sea.lattice.columns];
    let whole = Surface {
        raster: Raster::image(rows, columns, 2.5),
        ..sea
    };
    let t = transfer(SEA.depth);
    let modes = whole.modes();
    for (field, quantity) in whole.fields(&t, &ALL, 1e-6).iter().zip(ALL) {
        let waves: HashMap<_, _> = strengths(&modes, &t, &[quantity])[0]
            .iter()
            .enumerate()
            .map(|(n, &c)| (key(modes.kx[n], modes.ky[n]), c))
            .collect();
        let sum: f64 = waves
            .iter()
            .map(|(&(x, y), c)| match waves.get(&(-x, -y)) {
                Some(opposite) => 0.25 * (c + opposite.conj()).norm_sqr(),
                None => 0.5 * c.norm_sqr(),
            })
            .sum();
        assert!(
            (field.rms().powi(2) / sum - 1.0).abs() < 1e-6,
            "{quantity:?}"
        );
    }
}

/// Complex Gaussian amplitudes: mean |g|² is 1, mean |g|⁴ is 2 and phases are uniform, within 5 standard errors.
#[test]
fn amplitudes_are_gaussian() {
    let raster = Raster::image(200, 200, 2.5);
    let (random, mean) = (
        surface(&SEA, &raster).modes(),
        steady(&SEA, &raster).modes(),
    );
    // Waves so weak that they are lost in the rounding of the opposite wave are skipped.
    let means: HashMap<_, _> = (0..mean.len())
        .map(|n| (key(mean.kx[n], mean.ky[n]), mean.amplitude[n].norm()))
        .collect();
    let largest = means.values().fold(0.0, |a: f64, &b| a.max(b));
    let g: Vec<Complex64> = (0..random.len())
        .filter_map(|n| {
            let level = *means.get(&key(random.kx[n], random.ky[n]))?;
            (level > 1e-4 * largest).then(|| random.amplitude[n] / level)
        })
        .collect();
    assert!(g.len() > 20_000);
    let n = g.len() as f64;
    let moment = |f: &dyn Fn(Complex64) -> f64| g.iter().map(|&g| f(g)).sum::<f64>() / n;
    // Standard deviations of one sample: 1, √20, √½, √½.
    for (value, expected, deviation) in [
        (moment(&|g| g.norm_sqr()), 1.0, 1.0),
        (moment(&|g| g.norm_sqr().powi(2)), 2.0, 20f64.sqrt()),
        (moment(&|g| g.re), 0.0, 0.5f64.sqrt()),
        (moment(&|g| g.re * g.im), 0.0, 0.5),
        (moment(&|g| g.re * g.re), 0.5, 0.5f64.sqrt()),
    ] {
        assert!(
            (value - expected).abs() < 5.0 * deviation / n.sqrt(),
            "{value} {expected}"
        );
    }
}

/// The wave height is that of the band for any number of pixels.
#[test]
fn height_does_not_depend_on_the_size() {
    let heights: Vec<f64> = [16, 64, 250, 512]
        .map(|n| 4.0 * steady(&SEA, &Raster::image(n, n, 2.5)).variance().sqrt())
        .into();
    for h in &heights {
        assert!((h / heights[0] - 1.0).abs() < 5e-3, "{heights:?}");
    }
}

/// After a time t each wave has the additional phase −ωt, a motion along +k; accurate to 10⁻⁶ after a day.
#[test]
fn waves_travel_along_their_wavenumber() {
    let (raster, spectrum) = (Raster::image(40, 40, 1.0), DirectionalSpectrum::new(&SEA));
    let start = Surface::new(&spectrum, 5, 0.0, &raster).modes();
    let largest = start
        .amplitude
        .iter()
        .fold(0.0, |a: f64, c| a.max(c.norm()));
    for time in [0.3, 1234.5, 1e5] {
        let later = Surface::new(&spectrum, 5, time, &raster).modes();
        let amplitudes: HashMap<_, _> = (0..later.len())
            .map(|n| (key(later.kx[n], later.ky[n]), later.amplitude[n]))
            .collect();
        for n in 0..start.len() {
            let expected = start.amplitude[n] * Complex64::cis(-start.omega[n] * time);
            let wave = amplitudes
                .get(&key(start.kx[n], start.ky[n]))
                .copied()
                .unwrap_or_default();
            let error = (wave - expected).norm();
            // Even and odd parts are rounded to 6e-8 of the larger of the waves k and −k.
            assert!(
                error < 1e-6 * expected.norm() + 1.2e-7 * largest,
                "{time} {error}"
            );
        }
    }
    // A single wave, the strongest: its field moves by the phase speed along k.
    let one = Surface::new(&spectrum, 5, 0.0, &raster).strongest(1);
    let wave = one.modes();
    assert_eq!(wave.len(), 1);
    let [kx, ky, omega] = [wave.kx[0], wave.ky[0], wave.omega[0]];
    let time = 2.0;
    let moved = Surface::new(&spectrum, 5, time, &raster)
        .strongest(1)
        .modes();
    let shift = omega * time / (kx * kx + ky * ky);
    let value =
        |w: &PlaneWaves, x: f64, y: f64| (w.amplitude[0] * Complex64::cis(kx * x + ky * y)).re;
    for (x, y) in [(0.0, 0.0), (3.0, -8.0)] {
        let difference = value(&moved, x + kx * shift, y + ky * shift) - value(&wave, x, y);
        assert!(difference.abs() < 1e-5 * wave.amplitude[0].norm());
    }
}

/// Wind mirrored in the y-axis: every wave has the amplitude of its mirror image.
#[test]
fn mirrored_wind_makes_mirrored_waves() {
    let raster = Raster::image(40, 40, 2.0);
    let mirrored = WindSea {
        wind_toward: -SEA.wind_toward,
        ..SEA
    };
    let (one, two) = (
        steady(&SEA, &raster).modes(),
        steady(&mirrored, &raster).modes(),
    );
    let amplitudes: HashMap<_, _> = (0..two.len())
        .map(|n| (key(two.kx[n], two.ky[n]), two.amplitude[n].norm()))
        .collect();
    let largest = amplitudes.values().fold(0.0, |a: f64, &b| a.max(b));
    for n in 0..one.len() {
        let mirror = amplitudes
            .get(&key(-one.kx[n], one.ky[n]))
            .copied()
            .unwrap_or(0.0);
        assert!((one.amplitude[n].norm() - mirror).abs() < 1e-5 * largest);
    }
    // A wind direction with additional whole turns is the same wind.
    let turned = WindSea {
        wind_toward: SEA.wind_toward + 3.0 * TAU,
        ..SEA
    };
    let fields = [SEA, turned]
        .map(|sea| surface(&sea, &raster).fields(&transfer(SEA.depth), &[Quantity::SlopeX], 1e-3));
    assert!(fields[0][0].difference(&fields[1][0]).0 < 1e-5 * fields[0][0].rms());
}

/// A pixel has the same sea wherever the origin of the raster lies.
#[test]
fn the_sea_belongs_to_the_plane() {
    let raster = Raster::image(40, 60, 2.0);
    let shifted = Raster {
        origin_row: raster.origin_row + 7,
        origin_column: raster.origin_column - 11,
        ..raster
    };
    let field =
        |raster| surface(&SEA, raster).fields(&transfer(SEA.depth), &[Quantity::Elevation], 1e-3);
    let (one, two) = (field(&raster), field(&shifted));
    for (i, j) in [(0, 11), (20, 30), (32, 59)] {
        let [column, row] = shifted.pixel(raster.x(j), raster.y(i));
        let difference = one[0].at(i, j) - two[0].at(row as usize, column as usize);
        assert!(f64::from(difference).abs() < 1e-5 * one[0].rms());
    }
}

/// Nothing wraps around: the covariance across the raster is that of an infinite sea, not of a periodic one.
#[test]
fn opposite_edges_are_strangers() {
    for (wind_speed, size) in [(5.0, 256), (9.0, 512)] {
        let sea = WindSea { wind_speed, ..SEA };
        let raster = Raster::image(size, size, 2.5);
        let modes = steady(&sea, &raster).modes();
        let width = (size - 1) as f64 * 2.5;
        for [x, y] in [[width, 0.0], [0.0, width]] {
            let covariance: f64 = (0..modes.len())
                .map(|n| {
                    let phase = modes.kx[n] * x + modes.ky[n] * y;
                    0.5 * modes.amplitude[n].norm_sqr() * phase.cos()
                })
                .sum();
            let correlation = covariance / mode_variance(&modes, |_, _| Complex64::ONE);
            assert!(correlation.abs() < 0.05);
        }
    }
}

/// Bit-identical with one thread and with two.
#[test]
fn threads_do_not_change_the_sea() {
    let raster = Raster::image(90, 70, 2.5);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let sea = Surface::new(&DirectionalSpectrum::new(&SEA), 11, 5.0, &raster);
            let fields = sea.fields(&transfer(SEA.depth), &ALL, 1e-3);
            (sea, fields)
        })
    };
    assert_eq!(run(1), run(2));
    let other = Surface::new(&DirectionalSpectrum::new(&SEA), 12, 5.0, &raster);
    assert_ne!(run(1).0, other);
}

#[test]
fn strongest_waves_are_the_strongest() {
    let raster = Raster::image(40, 50, 2.0);
    let sea = surface(&SEA, &raster);
    let all = sea.modes();
    let some = sea.strongest(100);
    let expected = all.strongest(100);
    let modes = some.modes();
    assert_eq!(modes.len(), 100);
    for n in 0..100 {
        assert_eq!((modes.kx[n], modes.ky[n]), (expected.kx[n], expected.ky[n]));
        assert!(
            (modes.amplitude[n] - expected.amplitude[n]).norm()
                < 1e-6 * expected.amplitude[n].norm()
        );
    }
    let pixels = [[0, 0], [13, 41], [39, 49]];
    let exact = harmonic_sum(&modes, &transfer(SEA.depth), &ALL, &raster, &pixels);
    for (field, exact) in some
        .fields(&transfer(SEA.depth), &ALL, 1e-6)
        .iter()
        .zip(exact)
    {
        for ([i, j], exact) in pixels.into_iter().zip(exact) {
            assert!((f64::from(field.at(i, j)) - exact).abs() < 1e-6 * field.rms());
        }
    }
    assert_eq!(sea.strongest(usize::MAX), sea);
    assert!(sea.strongest(0).modes().is_empty());
}

/// The extremes of the allowed scenes give finite values, and a flat sea without wind.
#[test]
fn corners_are_finite() {
    for (wind_speed, fetch, depth) in [
        (0.0, 4e4, f64::INFINITY),
        (2.0, 100.0, 1.0),
        (2.0, 1e7, f64::INFINITY),
        (30.0, 100.0, 1.0),
        (30.0, 1e7, 1.0),
        (30.0, 1e7, f64::INFINITY),
    ] {
        for spectrum in [SpectrumModel::Elfouhaily, SpectrumModel::Jonswap] {
            for (rows, columns, spacing) in
                [(1, 1, 0.1), (7, 19, 0.1), (16, 3, 100.0), (31, 37, 2.5)]
            {
                let sea = WindSea {
                    wind_speed,
                    fetch,
                    depth,
                    spectrum,
                    spreading: SpreadingModel::Mitsuyasu,
                    ..SEA
                };
                let raster = Raster::image(rows, columns, spacing);
                let surface = Surface::new(&DirectionalSpectrum::new(&sea), 1, 1e5, &raster);
                assert!((0.0..=1.0).contains(&surface.left_out()));
                for field in surface.fields(&transfer(depth), &ALL, 1e-3) {
                    assert!(field.values.iter().all(|v| v.is_finite()));
                    assert!(wind_speed > 0.0 || field.rms() == 0.0);
                }
            }
        }
    }
    let flat = surface(
        &WindSea {
            wind_speed: 0.0,
            ..SEA
        },
        &Raster::image(8, 8, 1.0),
    );
    assert!(flat.is_flat() && flat.modes().is_empty() && flat.strongest(5).modes().is_empty());
}
