//! Median of values.

/// Median, for an even number of values the upper of the two in the middle; 0 without values.
#[must_use]
pub fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    match sorted.is_empty() {
        true => 0.0,
        false => *sorted.select_nth_unstable_by(middle, f32::total_cmp).1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_values_lie_below_it() {
        for (values, expected) in [
            (&[][..], 0.0),
            (&[3.0], 3.0),
            (&[5.0, -1.0, 4.0], 4.0),
            (&[1.0, 4.0, 3.0, 2.0], 3.0),
        ] {
            assert!(
                (median(values) - expected).abs() < f32::EPSILON,
                "{values:?}"
            );
        }
    }
}
