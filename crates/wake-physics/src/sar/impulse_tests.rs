//! The impulse response against direct sums, closed forms and a measured product.

use super::*;
use crate::fft::fast_length;
use crate::sar::speckle::equivalent_looks;
use std::f64::consts::PI;

/// Sources around an image of 10 m pixels, `step` sources per pixel side.
fn rasters(response: &ImpulseResponse, size: [usize; 2], step: usize) -> (Raster, Raster) {
    let image = Raster::image(size[0], size[1], 10.0);
    let spacing = image.spacing / step as f64;
    let [rows, columns] = response.guard(spacing);
    let fine = Raster {
        rows: size[0] * step,
        columns: size[1] * step,
        spacing,
        origin_row: image.origin_row * step as i64,
        origin_column: image.origin_column * step as i64,
    };
    (fine.with_margin(rows, columns), image)
}

/// Response of Sentinel-1 ground-range products, first sub-swath: 20.3 m, Hamming 0.70, by 18.4 m, unweighted.
fn sentinel() -> ImpulseResponse {
    ImpulseResponse {
        range: Axis {
            resolution: 20.3,
            window: Window::Hamming(0.70),
        },
        azimuth: Axis {
            resolution: 18.4,
            window: Window::Uniform,
        },
    }
}

fn constant(raster: &Raster) -> Field {
    Field::constant(raster, 0.4)
}

/// Correlation of pixels `lag` apart along a row (range) or a column (azimuth).
fn correlation(image: &Field, along_range: bool, lag: usize) -> f64 {
    let mean = image.mean();
    let mut sum = 0.0;
    let mut square = 0.0;
    let mut count = 0.0;
    let [down, right] = if along_range { [0, lag] } else { [lag, 0] };
    for i in 0..image.rows - down {
        for j in 0..image.columns - right {
            let a = f64::from(image.at(i, j)) - mean;
            sum += a * (f64::from(image.at(i + down, j + right)) - mean);
            square += a * a;
            count += 1.0;
        }
    }
    assert!(count > 0.0, "no pairs");
    sum / square
}

/// Against the direct sum over the scatterers, with the closed-form response repeated at the FFT's period.
#[test]
fn single_look_is_the_sum_over_its_scatterers() {
    let response = ImpulseResponse {
        range: Axis {
            resolution: 31.0,
            window: Window::Hamming(0.6),
        },
        azimuth: Axis {
            resolution: 24.0,
            window: Window::Kaiser(2.5),
        },
    };
    let (raster, image) = rasters(&response, [7, 5], 2);
    let intensity = Field::from_fn(&raster, |i, j| 0.2 + 0.1 * ((i * j) as f32).sin());
    let points = [PointTarget {
        position: [13.7, -21.2],
        cross_section: 900.0,
    }];
    let sources = Reflectivity {
        raster: &raster,
        intensity: &intensity,
        points: &points,
    };
    let seed = 5;
    let found = response.single_look(&sources, &image, seed);
    // The sum over the period of h, as the band samples the spectrum at multiples of 1/period. W jumps at the ends of its
    // band, so the FFT's frequencies represent ∫W² only to one part in their number, hence the gain.
    let kernel = |axis: &Axis, size: usize, x: f64| {
        let band = axis.band(size, raster.spacing);
        let period = size as f64 * raster.spacing;
        let gain = f64::from(band.0[band.highest()]);
        let bandwidth = axis.bandwidth();
        let sum: f64 = (-4000i32..=4000)
            .map(|n| {
                axis.window
                    .response((x + f64::from(n) * period) * bandwidth)
            })
            .sum();
        let rule = crate::numeric::GaussLegendre::new(96);
        let mean = rule.integrate([-0.5, 0.5], |f| axis.window.weight(f));
        gain * mean * bandwidth * raster.spacing * sum
    };
    let sizes = LowPass::sizes([raster.rows, raster.columns], 2);
    let down = |y: f64, from: f64| kernel(&response.azimuth, sizes[0], y - from);
    let right = |x: f64, from: f64| kernel(&response.range, sizes[1], x - from);
    // The same random numbers, from the same generators.
    let scatterers: Vec<Vec<Complex32>> = (0..raster.rows)
        .map(|i| {
            let mut row = vec![Complex32::ZERO; raster.columns];
            let values = &intensity.values[i * raster.columns..][..raster.columns];
            rough_row(values, seed, i as u64, &mut row);
            row
        })
        .collect();
    let [cos, sin] = cos_sin((generator(seed, Stream::Points, 0).next_u64() >> 32) as u32);
    let point = Complex32::new(cos, sin) * (900f64.sqrt() / raster.spacing) as f32;
    let columns: Vec<Vec<f64>> = (0..image.columns)
        .map(|j| {
            (0..raster.columns)
                .map(|c| right(image.x(j), raster.x(c)))
                .collect()
        })
        .collect();
    let mut worst: f64 = 0.0;
    let mut square = 0.0;
    for i in 0..image.rows {
        let rows: Vec<f64> = (0..raster.rows)
            .map(|r| down(image.y(i), raster.y(r)))
            .collect();
        for j in 0..image.columns {
            let [x, y] = points[0].position;
            let h = down(image.y(i), y) * right(image.x(j), x);
            let (mut re, mut im) = (h * f64::from(point.re), h * f64::from(point.im));
            for (row, down) in scatterers.iter().zip(&rows) {
                for (v, right) in row.iter().zip(&columns[j]) {
                    re += down * right * f64::from(v.re);
                    im += down * right * f64::from(v.im);
                }
            }
            let s = found[i * image.columns + j];
            worst = worst.max((re - f64::from(s.re)).hypot(im - f64::from(s.im)));
            square += re * re + im * im;
        }
    }
    let rms = (square / image.len() as f64).sqrt();
    // The sum over periods is cut at 4000: pairs of terms fall as 1/n², leaving 1e-4 per axis.
    assert!(worst < 1e-3 * rms, "{worst} of {rms}");
}

#[test]
fn a_point_keeps_its_cross_section_and_has_the_response() {
    let response = sentinel();
    let (raster, image) = rasters(&response, [96, 96], 4);
    let nothing = Field::constant(&raster, 0.0);
    let at = [35.0, -62.5];
    let points = [PointTarget {
        position: at,
        cross_section: 5e3,
    }];
    let sources = Reflectivity {
        raster: &raster,
        intensity: &nothing,
        points: &points,
    };
    let s = response.single_look(&sources, &raster_of(&image, 4), 3);
    let fine = raster_of(&image, 4);
    let area = fine.spacing * fine.spacing;
    let sum: f64 = s.iter().map(|v| f64::from(v.norm_sqr()) * area).sum();
    // For a uniform axis 1/(π² B x) lies outside 480 m on either side: 0.5 %.
    assert!((sum / 5e3 - 1.0).abs() < 8e-3, "{sum}");
    // σ B_x B_y L_x L_y at the point itself, and half of that ρ/2 away; the band is cut to whole frequencies, an error of
    // one part in their number.
    let frequencies = response.azimuth.bandwidth() * fine.rows as f64 * fine.spacing;
    let loss = |axis: &Axis| 10f64.powf(-0.1 * axis.window.loss());
    let peak = 5e3
        * response.range.bandwidth()
        * response.azimuth.bandwidth()
        * loss(&response.range)
        * loss(&response.azimuth);
    let value = |x: f64, y: f64| {
        let [column, row] = fine.pixel(x, y);
        let at = row.round() as usize * fine.columns + column.round() as usize;
        f64::from(s[at].norm_sqr())
    };
    assert!((value(at[0], at[1]) / peak - 1.0).abs() < 1.5 / frequencies);
    for (dx, dy) in [(10.0, 0.0), (0.0, 10.0), (0.0, -30.0), (42.5, 0.0)] {
        let h = response
            .range
            .window
            .response(dx * response.range.bandwidth())
            * response
                .azimuth
                .window
                .response(dy * response.azimuth.bandwidth());
        assert!(
            (value(at[0] + dx, at[1] + dy) / peak - h * h).abs() < 3.0 / frequencies,
            "{dx} {dy}"
        );
    }
    // The mean of a single point is the same.
    let mean = response.mean(&sources, &fine);
    for (m, s) in mean.values.iter().zip(&s) {
        assert!((f64::from(*m) - f64::from(s.norm_sqr())).abs() < 1e-5 * peak);
    }
}

/// The area of the image in source pixels.
fn raster_of(image: &Raster, step: usize) -> Raster {
    Raster {
        rows: image.rows * step,
        columns: image.columns * step,
        spacing: image.spacing / step as f64,
        origin_row: image.origin_row * step as i64,
        origin_column: image.origin_column * step as i64,
    }
}

/// Correlations and looks as measured on the sea in a Sentinel-1 IW GRDH product: 0.63 0.15 0.01 in range, 0.43 −0.01 in
/// azimuth, 4.9 looks; here five looks with 25 % overlap.
#[test]
fn the_sea_of_a_real_product() {
    let response = sentinel();
    let (raster, image) = rasters(&response, [400, 400], 2);
    let intensity = constant(&raster);
    let sources = Reflectivity {
        raster: &raster,
        intensity: &intensity,
        points: &[],
    };
    let equivalent = Window::Hamming(0.70).overlapping_looks(5, 0.25);
    let looks = Looks {
        equivalent,
        seed: 1,
    };
    let found = response.multilook(&sources, &image, &looks);
    // 160,000 pixels at 2.56 × 2.08 per independent sample: 30,000 samples; four standard errors of a correlation: 0.023.
    let samples = 160_000.0 / (2.56 * 2.08);
    let error = 4.0 / f64::sqrt(samples);
    for (lag, measured) in [(1, 0.63), (2, 0.15), (3, 0.01)] {
        let r = correlation(&found, true, lag);
        assert!((r - measured).abs() < error, "range {lag}: {r}");
    }
    for (lag, measured) in [(1, 0.43), (2, -0.01)] {
        let r = correlation(&found, false, lag);
        assert!((r - measured).abs() < error, "azimuth {lag}: {r}");
    }
    // Relative error of mean²/variance: √((2 + 10/N)/samples).
    let enl = equivalent_looks(&found);
    assert!(
        (enl / 4.9 - 1.0).abs() < 4.0 * (4.0 / samples).sqrt(),
        "{enl}"
    );
    assert!((found.mean() / 0.4 - 1.0).abs() < 4.0 / (4.9 * samples).sqrt());
}

/// A single look has exponential intensity and the correlations of the closed form for every window.
#[test]
fn lags_are_those_of_the_window() {
    for window in [Window::Uniform, Window::Hamming(0.75), Window::Kaiser(2.5)] {
        let axis = Axis {
            resolution: 20.0,
            window,
        };
        let response = ImpulseResponse {
            range: axis,
            azimuth: axis,
        };
        let (raster, image) = rasters(&response, [256, 300], 2);
        let intensity = constant(&raster);
        let sources = Reflectivity {
            raster: &raster,
            intensity: &intensity,
            points: &[],
        };
        let s = response.single_look(&sources, &image, 9);
        let found = Field {
            rows: image.rows,
            columns: image.columns,
            values: s.iter().map(Complex32::norm_sqr).collect(),
        };
        let samples = image.len() as f64 / 2.5f64.powi(2);
        for lag in 1..4 {
            let expected = window.correlation(lag as f64 * 0.5 * window.width());
            for along_range in [true, false] {
                let r = correlation(&found, along_range, lag);
                assert!(
                    (r - expected).abs() < 4.0 / samples.sqrt(),
                    "{window:?} {lag}: {r}"
                );
            }
        }
        // Exponential: mean²/variance is 1, with the error √(8/samples) for one look.
        assert!((equivalent_looks(&found) - 1.0).abs() < 4.0 * (8.0 / samples).sqrt());
    }
}

/// The mean over many looks of a varying surface is the mean intensity.
#[test]
fn the_mean_of_looks_is_the_smeared_intensity() {
    let response = sentinel();
    let (raster, image) = rasters(&response, [24, 20], 2);
    let bright = |i: usize, j: usize| {
        if (i / 9 + j / 7).is_multiple_of(2) {
            1.0
        } else {
            0.1
        }
    };
    let intensity = Field::from_fn(&raster, bright);
    let points = [PointTarget {
        position: [-20.0, 30.0],
        cross_section: 4e3,
    }];
    let sources = Reflectivity {
        raster: &raster,
        intensity: &intensity,
        points: &points,
    };
    let mean = response.mean(&sources, &image);
    let count = 600;
    let looks = Looks {
        equivalent: f64::from(count),
        seed: 4,
    };
    let found = response.multilook(&sources, &image, &looks);
    for (found, mean) in found.values.iter().zip(&mean.values) {
        // Each look is exponential or narrower; five standard errors.
        let error = (found / mean - 1.0).abs();
        assert!(
            error < 5.0 / f64::from(count).sqrt() as f32,
            "{found} {mean}"
        );
    }
    // A uniform surface stays uniform up to rounding.
    let flat = constant(&raster);
    let sources = Reflectivity {
        raster: &raster,
        intensity: &flat,
        points: &[],
    };
    let mean = response.mean(&sources, &image);
    // The zeros beyond the sources and the tails that reach them: 1/(π²·8·0.886) per axis and side.
    for v in &mean.values {
        assert!((v / 0.4 - 1.0).abs() < 0.03, "{v}");
    }
}

#[test]
fn looks_need_not_be_whole() {
    for equivalent in [1.0, 1.3, 2.0, 2.75, 4.89, 10.7] {
        let weights = look_weights(equivalent);
        let sum: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        assert!((sum - 1.0).abs() < 1e-12);
        assert!((1.0 / squares - equivalent).abs() < 1e-9, "{equivalent}");
        assert!(weights.len() as f64 >= equivalent && (weights.len() as f64) < equivalent + 1.0);
    }
}

#[test]
fn seed_decides_and_threads_do_not() {
    let response = sentinel();
    let (raster, image) = rasters(&response, [40, 33], 2);
    let intensity = constant(&raster);
    let sources = Reflectivity {
        raster: &raster,
        intensity: &intensity,
        points: &[],
    };
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let looks = Looks {
            equivalent: 2.5,
            seed,
        };
        pool.build()
            .unwrap()
            .install(|| response.multilook(&sources, &image, &looks))
    };
    assert_eq!(run(1, 3), run(3, 3));
    assert_ne!(run(1, 3), run(1, 4));
}

/// The sources may begin anywhere: the filter's window locates the image.
#[test]
fn an_image_inside_a_larger_one_is_its_middle() {
    let response = sentinel();
    let (raster, image) = rasters(&response, [30, 30], 2);
    let intensity = constant(&raster);
    let points = [PointTarget {
        position: [0.0, 0.0],
        cross_section: 1e5,
    }];
    let sources = Reflectivity {
        raster: &raster,
        intensity: &intensity,
        points: &points,
    };
    let whole = response.mean(&sources, &image);
    let inner = Raster {
        rows: 20,
        columns: 16,
        origin_row: image.origin_row - 4,
        origin_column: image.origin_column - 9,
        ..image
    };
    let part = response.mean(&sources, &inner);
    for i in 0..20 {
        for j in 0..16 {
            let (a, b) = (part.at(i, j), whole.at(i + 4, j + 9));
            assert!((a - b).abs() < 1e-4 * b, "{i} {j}");
        }
    }
    assert!(fast_length(raster.rows) >= raster.rows);
}

#[test]
fn a_fine_enough_grid_is_fine_enough() {
    let response = sentinel();
    // ρ/4 of the coarser axis, and twice the bandwidth of both: 20.3 m/4 is below 18.4 m/(2 · 0.886).
    assert!((response.largest_spacing() - 20.3 / 4.0).abs() < 1e-12);
    let mut narrow = response;
    narrow.azimuth.resolution = 5.0;
    assert!((narrow.largest_spacing() - 2.5 / Window::Uniform.width()).abs() < 1e-12);
    assert!((response.pixel_correlation(10.0) - 0.625).abs() < 2e-3);
    // The guard is eight resolutions.
    assert_eq!(response.guard(5.0), [30, 33]);
    // Energy beyond the guard for the uniform axis: 1/(π² B x) on either side.
    let beyond = 1.0 / (PI * PI * 8.0 * response.azimuth.window.width());
    assert!(beyond < 0.02);
}
