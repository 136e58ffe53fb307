//! Roots and extrema of functions of one variable.

/// Zero of `f` between two points of opposite sign, by bisecting the interval `steps` times.
pub(crate) fn root(f: impl Fn(f64) -> f64, [mut from, mut to]: [f64; 2], steps: usize) -> f64 {
    let sign = f(from) > 0.0;
    for _ in 0..steps {
        let middle = 0.5 * (from + to);
        if (f(middle) > 0.0) == sign {
            from = middle;
        } else {
            to = middle;
        }
    }
    0.5 * (from + to)
}

/// Position of the minimum of a unimodal function, by ternary search.
pub(crate) fn smallest_at(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], steps: usize) -> f64 {
    for _ in 0..steps {
        let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if f(p) < f(q) {
            b = q;
        } else {
            a = p;
        }
    }
    0.5 * (a + b)
}

/// Maximum of a unimodal function on an interval, by golden-section search: one evaluation per step.
pub(crate) fn largest(f: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2], steps: usize) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let inner = |low: f64, high: f64| [high - golden * (high - low), low + golden * (high - low)];
    let mut at = inner(low, high);
    let mut values = at.map(&f);
    for _ in 0..steps {
        if values[0] < values[1] {
            low = at[0];
            (at[0], values[0]) = (at[1], values[1]);
            at[1] = inner(low, high)[1];
            values[1] = f(at[1]);
        } else {
            high = at[1];
            (at[1], values[1]) = (at[0], values[0]);
            at[0] = inner(low, high)[0];
            values[0] = f(at[0]);
        }
    }
    values[0].max(values[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 50 bisections of a unit interval leave 2⁻⁵¹, 40 ternary steps (2/3)⁴⁰ = 9e-8; the value near an extremum errs by its
    /// square.
    #[test]
    fn roots_and_extrema_of_a_parabola() {
        for at in [0.2, 0.5, 0.7] {
            let parabola = |x: f64| (x - at).powi(2);
            assert!((root(|x| x - at, [0.0, 1.0], 50) - at).abs() < 1e-15);
            assert!((root(|x| at - x, [0.0, 1.0], 50) - at).abs() < 1e-15);
            assert!((smallest_at(parabola, [0.0, 1.0], 40) - at).abs() < 1e-7);
            assert!((largest(|x| 3.0 - parabola(x), [0.0, 1.0], 40) - 3.0).abs() < 1e-14);
        }
    }
}
