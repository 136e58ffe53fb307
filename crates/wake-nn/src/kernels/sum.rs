//! Sums in 16 parts, which are as fast as memory allows and round less than a running sum.

/// `Σ_i of(values[i])`
#[inline(always)]
pub(super) fn sum(values: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let (chunks, rest) = values.as_chunks::<16>();
    let mut parts = [0.0; 16];
    for chunk in chunks {
        for (part, &value) in parts.iter_mut().zip(chunk) {
            *part += of(value);
        }
    }
    parts.iter().sum::<f32>() + rest.iter().map(|&v| of(v)).sum::<f32>()
}

/// `Σ_i a[i] · of(b[i])`
#[inline(always)]
pub(super) fn product_sum(a: &[f32], b: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let (a_chunks, a_rest) = a.as_chunks::<16>();
    let (b_chunks, b_rest) = b.as_chunks::<16>();
    let mut parts = [0.0; 16];
    for (a, b) in a_chunks.iter().zip(b_chunks) {
        for ((part, a), &b) in parts.iter_mut().zip(a).zip(b) {
            *part += a * of(b);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, &b)| a * of(b)).sum();
    parts.iter().sum::<f32>() + rest
}
