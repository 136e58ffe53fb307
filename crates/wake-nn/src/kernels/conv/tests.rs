//! Every product against its defining sum.

use super::image::{turn, turned};
use super::*;
use crate::kernels::noise;

/// Sums in f64, each with the sum of its terms' absolute values, from which the rounding error follows.
struct Oracle {
    y: Vec<[f64; 2]>,
    dx: Vec<[f64; 2]>,
    dweight: Vec<[f64; 2]>,
}

fn oracle(x: &[f32], weight: &[f32], dy: &[f32], g: &Geometry) -> Oracle {
    let zeros = |n: usize| vec![[0.0; 2]; n];
    let mut oracle = Oracle {
        y: zeros(dy.len()),
        dx: zeros(x.len()),
        dweight: zeros(weight.len()),
    };
    let ([channels_in, channels_out], [rows, columns]) = (g.channels, g.size);
    let ([rows_out, columns_out], k) = (g.size_out(), g.kernel);
    let inside = |p: usize, tap: usize, border: usize, size: usize| {
        (p * g.stride + tap)
            .checked_sub(border)
            .filter(|&q| q < size)
    };
    for i in 0..dy.len() * channels_in * k * k {
        let (tap, c) = (i % (k * k), i / (k * k) % channels_in);
        let p = i / (k * k * channels_in);
        let (column, row) = (p % columns_out, p / columns_out % rows_out);
        let (o, n) = (
            p / (columns_out * rows_out) % channels_out,
            p / dy.len().div_euclid(g.batch),
        );
        let Some(r) = inside(row, tap / k, g.border[0], rows) else {
            continue;
        };
        let Some(q) = inside(column, tap % k, g.border[1], columns) else {
            continue;
        };
        let at = ((n * channels_in + c) * rows + r) * columns + q;
        let w = (o * channels_in + c) * k * k + tap;
        let add = |sum: &mut [f64; 2], a: f32, b: f32| {
            let term = f64::from(a) * f64::from(b);
            sum[0] += term;
            sum[1] += term.abs();
        };
        add(&mut oracle.y[p], x[at], weight[w]);
        add(&mut oracle.dx[at], dy[p], weight[w]);
        add(&mut oracle.dweight[w], dy[p], x[at]);
    }
    oracle
}

/// Asserts that sums of n products in f32 are off by at most n · 2⁻²⁴ times the sum of the products' absolute values.
fn assert_near(what: &str, ours: &[f32], exact: &[[f64; 2]], terms: usize) {
    assert_eq!(ours.len(), exact.len(), "{what}");
    for (i, (ours, [exact, size])) in ours.iter().zip(exact).enumerate() {
        let error = (f64::from(*ours) - exact).abs();
        let allowed = terms as f64 * f64::from(f32::EPSILON) / 2.0 * size;
        assert!(error <= allowed, "{what}[{i}]: {ours}, exact {exact}");
    }
}

/// Widths that fill tiles and widths that do not, odd sizes, strides, unequal borders, kernels of 1, 2, 3
/// and 5, more channels than one block of the product takes.
#[test]
fn products_are_the_sums_that_define_them() {
    let cases = [
        (2, [3, 5], [7, 7], 3, 1, [1, 1, 1, 1]),
        (1, [4, 20], [8, 8], 3, 1, [1, 1, 1, 1]),
        (3, [2, 3], [4, 32], 3, 1, [1, 1, 1, 1]),
        (2, [7, 9], [11, 6], 3, 2, [1, 1, 1, 1]),
        (2, [6, 6], [8, 10], 3, 2, [0, 0, 1, 1]),
        (1, [5, 40], [9, 5], 1, 1, [0; 4]),
        (2, [3, 4], [5, 7], 2, 1, [1, 0, 0, 1]),
        (1, [2, 7], [12, 9], 5, 3, [2, 1, 4, 3]),
        (2, [3, 2], [9, 10], 5, 2, [3, 4, 1, 2]),
        (1, [2, 3], [7, 8], 1, 2, [0; 4]),
        (1, [3, 2], [10, 11], 2, 3, [1, 0, 0, 1]),
        (1, [130, 7], [6, 16], 3, 1, [1, 1, 1, 1]),
        (1, [1, 1], [1, 1], 3, 1, [1, 1, 1, 1]),
        (3, [9, 200], [3, 5], 3, 1, [1, 1, 1, 1]),
        (1, [3, 2], [20, 33], 3, 2, [1, 1, 1, 1]),
    ];
    for (batch, channels, size, kernel, stride, border) in cases {
        let g = Geometry {
            batch,
            channels,
            size,
            kernel,
            stride,
            border,
        };
        let x = noise(batch * channels[0] * size[0] * size[1], 1);
        let weight = noise(channels[1] * g.patch(), 2);
        let dy = noise(batch * channels[1] * g.pixels_out(), 3);
        let exact = oracle(&x, &weight, &dy, &g);
        let y = convolve(&x, &weight, None, &g);
        assert_near(&format!("y {g:?}"), &y, &exact.y, g.patch() + 1);
        let dx = image_gradient(&dy, &weight, &g);
        let terms = channels[1] * kernel * kernel + 1;
        assert_near(&format!("dx {g:?}"), &dx, &exact.dx, terms);
        let dx = scatter::image_gradient(&dy, &weight, &g);
        assert_near(&format!("scattered {g:?}"), &dx, &exact.dx, terms);
        if stride == 1 {
            let dx = convolve(&dy, &turn(&weight, &g), None, &turned(&g));
            assert_near(&format!("turned {g:?}"), &dx, &exact.dx, terms);
        }
        let dweight = weight_gradient(&x, &dy, &g);
        let terms = batch * g.pixels_out() + 1;
        assert_near(&format!("dw {g:?}"), &dweight, &exact.dweight, terms);
    }
}

/// Absolute values of the tiles' matrices `Bᵀ` (windows), `G` (kernels) and `Aᵀ` (products).
const B: [[f64; 4]; 4] = [
    [1., 0., 1., 0.],
    [0., 1., 1., 0.],
    [0., 1., 1., 0.],
    [0., 1., 0., 1.],
];
const G: [[f64; 3]; 4] = [[1., 0., 0.], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0., 0., 1.]];
const A: [[f64; 4]; 2] = [[1., 1., 1., 0.], [0., 1., 1., 1.]];

/// Bounds of the transformed windows of an image, from absolute values: `[image, tile, channel, place]`.
fn sizes_of_windows(x: &[f32], g: &Geometry) -> Vec<[f64; 16]> {
    let ([channels, _], [rows, columns]) = (g.channels, g.size);
    let pixel = |n: usize, c: usize, row: usize, column: usize| {
        let inside =
            |at: usize, border: usize, size: usize| at.checked_sub(border).filter(|&q| q < size);
        match (
            inside(row, g.border[0], rows),
            inside(column, g.border[1], columns),
        ) {
            (Some(r), Some(q)) => f64::from(x[((n * channels + c) * rows + r) * columns + q].abs()),
            _ => 0.0,
        }
    };
    let [down, across] = g.size_out().map(|size| size.div_ceil(2));
    let mut sizes = Vec::new();
    for i in 0..g.batch * down * across * channels {
        let (c, tile) = (i % channels, i / channels);
        let (n, row, column) = (tile / (down * across), tile / across % down, tile % across);
        sizes.push(std::array::from_fn(|place| {
            let (i, j) = (place / 4, place % 4);
            let seen = |t: usize| pixel(n, c, 2 * row + t / 4, 2 * column + t % 4);
            (0..16).map(|t| B[i][t / 4] * B[j][t % 4] * seen(t)).sum()
        }));
    }
    sizes
}

/// Bound on the rounding error of a convolution by tiles: absolute values of all terms times their numbers of roundings.
///
/// A kernel's transform rounds at most four times, a window's twice, the product once, its sum once per channel, the
/// pixel's transform four times, and the bias once.
fn rounding_of_tiles(x: &[f32], weight: &[f32], g: &Geometry) -> Vec<f64> {
    let [channels_in, channels_out] = g.channels;
    let windows = sizes_of_windows(x, g);
    let kernels: Vec<[f64; 16]> = weight
        .chunks_exact(9)
        .map(|kernel| {
            std::array::from_fn(|place| {
                let (i, j) = (place / 4, place % 4);
                let w = |t: usize| f64::from(kernel[t].abs());
                (0..9).map(|t| G[i][t / 3] * G[j][t % 3] * w(t)).sum()
            })
        })
        .collect();
    let [rows, columns] = g.size_out();
    let [down, across] = [rows.div_ceil(2), columns.div_ceil(2)];
    let mut bounds = Vec::new();
    for i in 0..g.batch * channels_out * rows * columns {
        let (column, row) = (i % columns, i / columns % rows);
        let (o, n) = (
            i / (rows * columns) % channels_out,
            i / (rows * columns * channels_out),
        );
        let tile = (n * down + row / 2) * across + column / 2;
        let mut size = 0.0;
        for c in 0..channels_in {
            let (d, w) = (
                &windows[tile * channels_in + c],
                &kernels[o * channels_in + c],
            );
            for place in 0..16 {
                size += A[row % 2][place / 4] * A[column % 2][place % 4] * w[place] * d[place];
            }
        }
        bounds.push((channels_in + 12) as f64 * f64::from(f32::EPSILON) / 2.0 * size);
    }
    bounds
}

/// Bound on the rounding error of a weight gradient by tiles.
///
/// The transforms of a window and of a tile's gradient each round at most twice, the product once, its sum once per tile,
/// and the kernel's transform four times.
fn rounding_of_weights(x: &[f32], dy: &[f32], g: &Geometry) -> Vec<f64> {
    let [channels_in, channels_out] = g.channels;
    let windows = sizes_of_windows(x, g);
    let [rows, columns] = g.size_out();
    let [down, across] = [rows.div_ceil(2), columns.div_ceil(2)];
    let tiles = g.batch * down * across;
    let mut asked = vec![[0.0; 16]; tiles * channels_out];
    for (i, dy) in dy.iter().enumerate() {
        let (column, row) = (i % columns, i / columns % rows);
        let (o, n) = (
            i / (rows * columns) % channels_out,
            i / (rows * columns * channels_out),
        );
        let tile = (n * down + row / 2) * across + column / 2;
        for (place, sum) in asked[tile * channels_out + o].iter_mut().enumerate() {
            *sum += A[row % 2][place / 4] * A[column % 2][place % 4] * f64::from(dy.abs());
        }
    }
    let mut bounds = Vec::new();
    for i in 0..channels_out * channels_in {
        let (o, c) = (i / channels_in, i % channels_in);
        let mut places = [0.0; 16];
        for tile in 0..tiles {
            let (dy, d) = (
                &asked[tile * channels_out + o],
                &windows[tile * channels_in + c],
            );
            for (place, sum) in places.iter_mut().enumerate() {
                *sum += dy[place] * d[place];
            }
        }
        for tap in 0..9 {
            let size: f64 = (0..16)
                .map(|place| G[place / 4][tap / 3] * G[place % 4][tap % 3] * places[place])
                .sum();
            bounds.push((tiles + 12) as f64 * f64::from(f32::EPSILON) / 2.0 * size);
        }
    }
    bounds
}

/// Sides that tiles fill and do not fill, unequal borders, channels that are not multiples of a product's rows, panels of
/// several rows of tiles, several panels per task, more panels or channels than the cache holds, and panels of several small images.
#[test]
fn tiles_give_the_sums_that_define_them() {
    let cases = [
        (1, [16, 16], [64, 64], [1, 1, 1, 1]),
        (3, [17, 20], [32, 30], [1, 1, 1, 1]),
        (1, [16, 23], [63, 33], [1, 1, 1, 1]),
        (1, [19, 16], [40, 65], [0, 2, 1, 0]),
        (5, [16, 18], [16, 16], [1, 1, 1, 1]),
        (16, [16, 20], [8, 8], [1, 1, 1, 1]),
        (32, [17, 16], [7, 9], [1, 1, 1, 1]),
        (85, [16, 16], [4, 6], [1, 0, 1, 2]),
        (1, [16, 16], [2, 1100], [1, 1, 1, 1]),
        (1, [650, 16], [36, 36], [1, 1, 1, 1]),
    ];
    for (batch, channels, size, border) in cases {
        let g = Geometry {
            batch,
            channels,
            size,
            kernel: 3,
            stride: 1,
            border,
        };
        let x = noise(batch * channels[0] * size[0] * size[1], 1);
        let weight = noise(channels[1] * g.patch(), 2);
        let bias = noise(channels[1], 3);
        let dy = noise(batch * channels[1] * g.pixels_out(), 4);
        let exact = oracle(&x, &weight, &dy, &g);
        let y = convolve(&x, &weight, Some(&bias), &g);
        let direct = direct::convolve(&x, &weight, Some(&bias), &g);
        assert_ne!(y, direct, "computed by tiles: {g:?}");
        let of_channels = bias.iter().flat_map(|b| vec![*b; g.pixels_out()]);
        let of_channels: Vec<f32> = of_channels.cycle().take(y.len()).collect();
        let bounds = rounding_of_tiles(&x, &weight, &g);
        assert_within(&format!("y {g:?}"), &y, &exact.y, &of_channels, &bounds);

        let (turned, back) = (turn(&weight, &g), turned(&g));
        let dx = image_gradient(&dy, &weight, &g);
        let direct = direct::convolve(&dy, &turned, None, &back);
        assert_ne!(dx, direct, "gradient by tiles: {g:?}");
        let bounds = rounding_of_tiles(&dy, &turned, &back);
        let none = vec![0.0; dx.len()];
        assert_within(&format!("dx {g:?}"), &dx, &exact.dx, &none, &bounds);

        let dweight = tiles::weight_gradient(&x, &dy, &g);
        let bounds = rounding_of_weights(&x, &dy, &g);
        let none = vec![0.0; dweight.len()];
        let what = format!("dweight {g:?}");
        assert_within(&what, &dweight, &exact.dweight, &none, &bounds);
    }
}

/// Asserts that sums plus added values are within their bounds and one rounding of the added values.
fn assert_within(what: &str, ours: &[f32], exact: &[[f64; 2]], added: &[f32], bounds: &[f64]) {
    assert_eq!(ours.len(), exact.len(), "{what}");
    for (i, ours) in ours.iter().enumerate() {
        let added = f64::from(added[i]);
        let error = (f64::from(*ours) - exact[i][0] - added).abs();
        let bound = bounds[i] + f64::from(f32::EPSILON) * added.abs();
        assert!(
            error <= bound,
            "{what}[{i}]: {ours}, off by {error:e}, {bound:e} allowed"
        );
    }
}

#[test]
fn bias_is_added_to_every_pixel_and_its_gradient_is_their_sum() {
    let g = Geometry {
        batch: 2,
        channels: [130, 7],
        size: [5, 9],
        kernel: 3,
        stride: 1,
        border: [1; 4],
    };
    let x = noise(2 * 130 * 45, 1);
    let weight = noise(7 * g.patch(), 2);
    let bias = noise(7, 3);
    let without = convolve(&x, &weight, None, &g);
    let with = convolve(&x, &weight, Some(&bias), &g);
    for (i, (with, without)) in with.iter().zip(&without).enumerate() {
        // Sums up to 30, rounded in another order: 1170 roundings of 2e-6, adding up at random.
        assert!((with - without - bias[i / 45 % 7]).abs() < 1e-4);
    }
    let gradient = bias_gradient(
        &x,
        &Geometry {
            channels: [7, 130],
            ..g
        },
    );
    for (channel, ours) in gradient.iter().enumerate() {
        let plane = |n: usize| &x[(n * 130 + channel) * 45..][..45];
        let exact: f64 = plane(0).iter().chain(plane(1)).map(|&v| f64::from(v)).sum();
        // 90 terms of at most 0.5: 90 · 2⁻²⁴ · 45.
        assert!((f64::from(*ours) - exact).abs() < 90.0 * 45.0 * 6e-8);
    }
}

/// Root mean square error of a forward convolution at some pixels, in units in the last place of the root mean square of the
/// exact results.
fn ulps(y: &[f32], x: &[f32], weight: &[f32], g: &Geometry) -> f64 {
    let ([channels, out], [rows, columns]) = (g.channels, g.size);
    let (mut errors, mut squares) = (0.0, 0.0);
    for i in (0..y.len()).step_by(y.len() / 1009 + 1) {
        let (column, row) = (i % columns, i / columns % rows);
        let (o, n) = (i / (rows * columns) % out, i / (rows * columns * out));
        let term = |k: usize| {
            let (tap, c) = (k % 9, k / 9);
            let [r, q] = [row + tap / 3, column + tap % 3].map(|p| p.checked_sub(1));
            let (r, q) = (r.filter(|r| *r < rows)?, q.filter(|q| *q < columns)?);
            let pixel = x[((n * channels + c) * rows + r) * columns + q];
            Some(f64::from(pixel) * f64::from(weight[(o * channels + c) * 9 + tap]))
        };
        let exact: f64 = (0..channels * 9).filter_map(term).sum();
        errors += (f64::from(y[i]) - exact).powi(2);
        squares += exact.powi(2);
    }
    (errors / squares).sqrt() / f64::from(f32::EPSILON)
}

/// Prints times in milliseconds on one core, and errors. Run with
/// `cargo test --release -p wake-nn --features autodiff --lib conv::tests::times -- --ignored --nocapture`.
#[test]
#[ignore = "prints the milliseconds of docs/reports/performance.md, wants an idle machine, and has nothing to check"]
#[expect(clippy::print_stdout, reason = "what it is for")]
fn times() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let time = |f: &(dyn Fn() -> Vec<f32> + Sync)| {
        let once = |_| {
            let begin = std::time::Instant::now();
            std::hint::black_box(f());
            begin.elapsed().as_secs_f64() * 1e3
        };
        (0..15).map(once).fold(f64::MAX, f64::min)
    };
    one.unwrap().install(|| {
        for ([batch, width, side], narrow) in [
            [16, 64, 32],
            [16, 96, 16],
            [16, 128, 16],
            [16, 192, 8],
            [1, 320, 64],
        ]
        .into_iter()
        .flat_map(|shape| [(shape, false), (shape, true)])
        {
            #[cfg(target_arch = "x86_64")]
            crate::kernels::arch::narrow::hold(narrow);
            let g = Geometry {
                batch,
                channels: [width; 2],
                size: [side; 2],
                kernel: 3,
                stride: 1,
                border: [1; 4],
            };
            let x = noise(batch * width * side * side, 1);
            let weight = noise(width * g.patch(), 2);
            let forward: [&(dyn Fn() -> Vec<f32> + Sync); 2] = [
                &|| direct::convolve(&x, &weight, None, &g),
                &|| tiles::convolve(&x, &weight, None, &g),
            ];
            let (y, error) = (
                forward.map(time),
                forward.map(|f| ulps(&f(), &x, &weight, &g)),
            );
            let dweight = [
                time(&|| weights::weight_gradient(&x, &x, &g)),
                time(&|| tiles::weight_gradient(&x, &x, &g)),
            ];
            let wide = if narrow { "AVX2" } else { "widest" };
            println!(
                "{batch} x {width} x {side}², {wide}: forward {y:.2?} ms, {error:.2?} ulp, weights {dweight:.2?} ms"
            );
        }
    });
}
