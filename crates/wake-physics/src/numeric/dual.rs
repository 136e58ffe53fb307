//! Dual numbers: values with their derivatives by N variables.

use std::ops::{Add, Mul, Sub};

/// A value and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual<const N: usize> {
    pub(crate) value: f64,
    pub(crate) by: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant, with zero derivatives.
    #[inline(always)]
    pub(crate) fn constant(value: f64) -> Self {
        Self {
            value,
            by: [0.0; N],
        }
    }

    /// Applies a function to the number, given the function's value and slope there.
    #[inline(always)]
    pub(crate) fn map(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            by: self.by.map(|d| slope * d),
        }
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: f64) -> Self {
        self.map(factor * self.value, factor)
    }

    #[inline(always)]
    pub(crate) fn exp(self) -> Self {
        let value = self.value.exp();
        self.map(value, value)
    }

    /// Adds `slope` times the derivatives of another number.
    #[inline(always)]
    pub(crate) fn chain(&mut self, slope: f64, other: &Self) {
        for (sum, d) in self.by.iter_mut().zip(&other.by) {
            *sum += slope * d;
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        self.chain(1.0, &other);
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self.value -= other.value;
        self.chain(-1.0, &other);
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut product = self.map(self.value * other.value, other.value);
        product.chain(self.value, &other);
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked out by hand at x = 2 with dx = 3: (x² e^x − x)' = (2x + x²) e^x x' − x'.
    #[test]
    fn the_rules_of_differentiation() {
        let x = Dual {
            value: 2.0,
            by: [3.0],
        };
        let y = x * x * x.exp() - x.times(1.0) + Dual::constant(5.0);
        assert!((y.value - (4.0 * 2f64.exp() + 3.0)).abs() < 1e-12);
        assert!((y.by[0] - (24.0 * 2f64.exp() - 3.0)).abs() < 1e-12);
    }
}
