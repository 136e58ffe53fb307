//! Where the sources of one row of a raster are imaged, between steps and between columns.

/// Where the sources of a row are imaged.
#[derive(Default)]
pub(super) struct Places {
    /// Step at or before each source, and how far beyond it the source is, 0 to 1.
    pub(super) steps: Vec<i32>,
    pub(super) fractions: Vec<f32>,
    /// Columns that each source leans by, rounded down, and the share of the next column.
    pub(super) columns: Vec<i32>,
    pub(super) shares: Vec<f32>,
}

impl Places {
    pub(super) fn resize(&mut self, sources: usize) {
        self.steps.resize(sources, 0);
        self.fractions.resize(sources, 0.0);
        self.columns.resize(sources, 0);
        self.shares.resize(sources, 0.0);
    }
}

/// Takes positions `start + factor·value` apart: largest integers not above them, and the rest.
#[inline(always)]
pub(super) fn split(
    whole: &mut [i32],
    rest: &mut [f32],
    start: f32,
    (factor, values): (f32, Option<&[f32]>),
) {
    let apart = |at: f32| (floor(at), at - floor(at) as f32);
    match values {
        None => {
            whole.fill(apart(start).0);
            rest.fill(apart(start).1);
        }
        Some(values) => {
            for ((whole, rest), &value) in whole.iter_mut().zip(rest).zip(values) {
                (*whole, *rest) = apart(start + factor * value);
            }
        }
    }
}

/// Largest integer not above x: [`f32::floor`] is a call without SSE 4.1.
#[inline(always)]
fn floor(x: f32) -> i32 {
    let cut = x as i32;
    cut - i32::from(x < cut as f32)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "whole numbers and exact fractions")]
mod tests {
    use super::*;

    #[test]
    fn positions_are_a_floor_and_a_rest() {
        let values = [0.0, 0.25, -0.25, 3.0, -3.0, -2.75];
        let (mut whole, mut rest) = ([0; 6], [0.0; 6]);
        split(&mut whole, &mut rest, 0.5, (1.0, Some(&values)));
        assert_eq!(whole, [0, 0, 0, 3, -3, -3]);
        assert_eq!(rest, [0.5, 0.75, 0.25, 0.5, 0.5, 0.75]);
        split(&mut whole, &mut rest, -0.25, (1.0, None));
        assert_eq!((whole, rest), ([-1; 6], [0.75; 6]));
    }
}
