//! Every product against the sum that defines it.

use super::*;
use crate::nn::kernels::noise;

/// Sums in f64 and the sums of their terms' sizes, from which the rounding follows.
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

/// A sum of n products in f32 is off by at most n · 2⁻²⁴ times the sum of their sizes.
fn assert_near(what: &str, ours: &[f32], exact: &[[f64; 2]], terms: usize) {
    assert_eq!(ours.len(), exact.len(), "{what}");
    for (i, (ours, [exact, size])) in ours.iter().zip(exact).enumerate() {
        let error = (f64::from(*ours) - exact).abs();
        let allowed = terms as f64 * f64::from(f32::EPSILON) / 2.0 * size;
        assert!(error <= allowed, "{what}[{i}]: {ours}, exact {exact}");
    }
}

/// Widths that fill tiles and that do not, odd sizes, strides, lopsided borders, kernels of 1, 2, 3
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
        (1, [130, 7], [6, 16], 3, 1, [1, 1, 1, 1]),
        (1, [1, 1], [1, 1], 3, 1, [1, 1, 1, 1]),
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
        let dweight = weight_gradient(&x, &dy, &g);
        let terms = batch * g.pixels_out() + 1;
        assert_near(&format!("dw {g:?}"), &dweight, &exact.dweight, terms);
    }
}

/// The most that rounding can change of a convolution by tiles: every number that is summed, and how many roundings it sees.
///
/// A kernel's transform rounds at most four times, a window's two, the product once, its sum once a channel, the pixel's
/// four times, the bias once.
fn rounding_of_tiles(x: &[f32], weight: &[f32], g: &Geometry) -> Vec<f64> {
    let absolute = |values: &[f32]| values.iter().map(|v| v.abs()).collect::<Vec<_>>();
    let (x, weight) = (absolute(x), absolute(weight));
    let ([channels_in, channels_out], [rows, columns]) = (g.channels, g.size);
    let [rows_out, columns_out] = g.size_out();
    let pixel = |n: usize, c: usize, row: usize, column: usize| {
        let inside =
            |at: usize, border: usize, size: usize| at.checked_sub(border).filter(|&q| q < size);
        match (
            inside(row, g.border[0], rows),
            inside(column, g.border[1], columns),
        ) {
            (Some(r), Some(q)) => f64::from(x[((n * channels_in + c) * rows + r) * columns + q]),
            _ => 0.0,
        }
    };
    // Which windows' places, kernels' rows and products add up, signs left out.
    const B: [[f64; 4]; 4] = [
        [1., 0., 1., 0.],
        [0., 1., 1., 0.],
        [0., 1., 1., 0.],
        [0., 1., 0., 1.],
    ];
    const G: [[f64; 3]; 4] = [[1., 0., 0.], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0., 0., 1.]];
    const A: [[f64; 4]; 2] = [[1., 1., 1., 0.], [0., 1., 1., 1.]];
    let mut bounds = Vec::new();
    for (n, o) in (0..g.batch).flat_map(|n| (0..channels_out).map(move |o| (n, o))) {
        for (row, column) in (0..rows_out).flat_map(|r| (0..columns_out).map(move |c| (r, c))) {
            let (tile, within) = ([row / 2 * 2, column / 2 * 2], [row % 2, column % 2]);
            let mut size = 0.0;
            for c in 0..channels_in {
                let kernel = &weight[(o * channels_in + c) * 9..][..9];
                for place in 0..16 {
                    let (i, j) = (place / 4, place % 4);
                    let w: f64 = (0..9)
                        .map(|t| G[i][t / 3] * G[j][t % 3] * f64::from(kernel[t]))
                        .sum();
                    let d: f64 = (0..16)
                        .map(|t| {
                            B[i][t / 4]
                                * B[j][t % 4]
                                * pixel(n, c, tile[0] + t / 4, tile[1] + t % 4)
                        })
                        .sum();
                    size += A[within[0]][i] * A[within[1]][j] * w * d;
                }
            }
            bounds.push((channels_in + 12) as f64 * f64::from(f32::EPSILON) / 2.0 * size);
        }
    }
    bounds
}

/// Sides that tiles fill and do not, lopsided borders, channels that rows of a product do not divide, panels of several rows
/// of tiles and several panels a task.
#[test]
fn tiles_give_the_sums_that_define_them() {
    let cases = [
        (1, [16, 16], [64, 64], [1, 1, 1, 1]),
        (3, [17, 20], [32, 30], [1, 1, 1, 1]),
        (1, [16, 23], [63, 33], [1, 1, 1, 1]),
        (1, [19, 16], [40, 65], [0, 2, 1, 0]),
        (5, [16, 18], [16, 16], [1, 1, 1, 1]),
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
        let y = convolve_by_tiles(&x, &weight, Some(&bias), &g);
        let direct = convolve(&x, &weight, Some(&bias), &g);
        assert_ne!(y, direct, "computed by tiles: {g:?}");
        let exact = oracle(&x, &weight, &vec![0.0; y.len()], &g).y;
        let bounds = rounding_of_tiles(&x, &weight, &g);
        let bias = bias
            .iter()
            .flat_map(|b| vec![f64::from(*b); g.pixels_out()]);
        for (i, (((ours, exact), bound), bias)) in y
            .iter()
            .zip(exact)
            .zip(bounds)
            .zip(bias.cycle())
            .enumerate()
        {
            let error = (f64::from(*ours) - exact[0] - bias).abs();
            let bound = bound + f64::from(f32::EPSILON) * bias.abs();
            assert!(
                error <= bound,
                "y[{i}] of {g:?}: {ours}, off by {error:e}, {bound:e} allowed"
            );
        }
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
