//! Multi-head attention, forward and backward, one block of queries at a time: the full matrix of scores is never stored.

use rayon::prelude::*;

use super::product::Rows;

mod backward;
mod forward;

pub(crate) use backward::{Attended, gradients};
pub(crate) use forward::{Softmax, attend};

/// Sizes of an attention.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    /// Sequences.
    pub(crate) batch: usize,
    /// Heads; each has an equal share of the channels.
    pub(crate) heads: usize,
    /// Channels of all heads.
    pub(crate) channels: usize,
    /// Number of query tokens, and of tokens that they attend to.
    pub(crate) tokens: [usize; 2],
    /// Whether token i attends only to tokens 0…i.
    pub(crate) causal: bool,
}

impl Shape {
    fn depth(&self) -> usize {
        self.channels / self.heads
    }

    fn scale(&self) -> f32 {
        1.0 / (self.depth() as f32).sqrt()
    }

    /// The tokens of one head in one sequence.
    fn head<'a>(&self, x: &'a [f32], tokens: usize, sequence: usize, head: usize) -> Rows<'a> {
        Rows {
            values: &x[sequence * tokens * self.channels + head * self.depth()..],
            step: self.channels,
            count: tokens,
        }
    }

    fn heads_of_batch(&self) -> impl IndexedParallelIterator<Item = [usize; 2]> {
        let heads = self.heads;
        (0..self.batch * heads)
            .into_par_iter()
            .map(move |i| [i / heads, i % heads])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    /// The formula in f64.
    fn exact([q, k, v]: [&[f64]; 3], shape: &Shape) -> Vec<f64> {
        let ([asking, seen], channels, depth) = (shape.tokens, shape.channels, shape.depth());
        let mut out = vec![0.0; q.len()];
        for n in 0..shape.batch {
            for (i, head) in (0..asking).flat_map(|i| (0..shape.heads).map(move |h| (i, h))) {
                let row = |x: &[f64], tokens: usize, i: usize| {
                    x[(n * tokens + i) * channels + head * depth..][..depth].to_vec()
                };
                let query = row(q, asking, i);
                let visible = if shape.causal { seen.min(i + 1) } else { seen };
                let score = |j: usize| {
                    let products = query.iter().zip(row(k, seen, j)).map(|(a, b)| a * b);
                    products.sum::<f64>() / (depth as f64).sqrt()
                };
                let scores: Vec<f64> = (0..visible).map(score).collect();
                let max = scores.iter().copied().fold(f64::MIN, f64::max);
                let total: f64 = scores.iter().map(|s| (s - max).exp()).sum();
                for (j, s) in scores.iter().enumerate() {
                    let at = (n * asking + i) * channels + head * depth;
                    for (out, v) in out[at..].iter_mut().zip(row(v, seen, j)) {
                        *out += (s - max).exp() / total * v;
                    }
                }
            }
        }
        out
    }

    fn wide(values: &[f32]) -> Vec<f64> {
        values.iter().map(|&v| f64::from(v)).collect()
    }

    fn inputs(shape: &Shape, size: f32) -> [Vec<f32>; 3] {
        let [asking, seen] = shape.tokens.map(|t| shape.batch * t * shape.channels);
        [(asking, 1), (seen, 2), (seen, 3)]
            .map(|(count, seed)| noise(count, seed).iter().map(|v| size * v).collect())
    }

    const SHAPES: [(usize, usize, usize, [usize; 2], bool); 6] = [
        (2, 3, 15, [7, 11], false),
        (1, 2, 34, [65, 77], false),
        (2, 1, 8, [9, 9], true),
        (1, 4, 4, [1, 1], false),
        (1, 2, 68, [230, 230], true),
        (1, 1, 3, [13, 4100], false),
    ];

    fn shape(
        (batch, heads, channels, tokens, causal): (usize, usize, usize, [usize; 2], bool),
    ) -> Shape {
        Shape {
            batch,
            heads,
            channels,
            tokens,
            causal,
        }
    }

    #[test]
    fn values_are_those_of_the_formula() {
        for shape in SHAPES.map(shape) {
            let [q, k, v] = inputs(&shape, 4.0);
            let (ours, _) = attend(&q, &k, &v, &shape);
            let exact = exact([&wide(&q), &wide(&k), &wide(&v)], &shape);
            for (ours, exact) in ours.iter().zip(exact) {
                // Scores below 16 are off by at most 16 · 34 · 2⁻²⁴, and so are the weights, relatively.
                assert!(
                    (f64::from(*ours) - exact).abs() < 2.0 * 16.0 * 34.0 * 6e-8,
                    "{shape:?}"
                );
            }
        }
    }

    /// With scores of ±10⁴ the largest wins, and nothing overflows.
    #[test]
    fn the_largest_score_wins() {
        let shape = shape((1, 1, 1, [2, 2], false));
        let (ours, _) = attend(&[100.0, -100.0], &[100.0, -100.0], &[3.0, 5.0], &shape);
        assert!((ours[0] - 3.0).abs() < 1e-6 && (ours[1] - 5.0).abs() < 1e-6);
    }

    /// Gradients against central differences of the formula in f64.
    #[test]
    fn gradients_are_differences() {
        for shape in SHAPES[..5].iter().copied().map(shape) {
            let inputs = inputs(&shape, 2.0);
            let dy = noise(inputs[0].len(), 4);
            let [q, k, v] = inputs.each_ref().map(Vec::as_slice);
            let (values, softmax) = attend(q, k, v, &shape);
            let attended = Attended {
                values: &values,
                softmax: &softmax,
            };
            let ours = gradients([q, k, v], attended, &dy, &shape);
            for (input, ours) in ours.iter().enumerate() {
                for i in (0..ours.len()).step_by(1 + ours.len() / 40) {
                    let at = |step: f64| {
                        let mut moved = inputs.each_ref().map(|v| wide(v));
                        moved[input][i] += step;
                        let y = exact(moved.each_ref().map(Vec::as_slice), &shape);
                        y.iter()
                            .zip(&dy)
                            .map(|(y, dy)| y * f64::from(*dy))
                            .sum::<f64>()
                    };
                    let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                    // Gradients are of order 1, and sums of some hundred terms in f32.
                    let error = (f64::from(ours[i]) - slope).abs();
                    assert!(error < 1e-5, "{shape:?} {input} {i}: {} {slope}", ours[i]);
                }
            }
        }
    }
}
