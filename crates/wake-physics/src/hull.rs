//! Hull forms of a thin ship, and their Michell integrals.
//!
//! One family serves both hulls. With the half length h = L/2 the half-breadth is a product
//!
//! ```text
//! f(x, z) = (B/2) · g(x/h) · v(z/T)      |x| ≤ h,  0 ≤ z ≤ T (down)
//! g(s) = 1 up to |s| = m, then 1 − ((|s| − m)/(1 − m))²      parallel middle body of the length m·L
//! v(s) = 1 up to s = b,   then 1 − ((s − b)/(1 − b))²        flat side down to the depth b·T
//! ```
//!
//! m = b = 0 is Wigley's parabolic hull with block coefficient 4/9.

#[cfg(test)]
use crate::numeric::GaussLegendre;
use num_complex::Complex64;

/// A hull symmetric fore and aft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hull {
    length: f64,
    beam: f64,
    draft: f64,
    /// Fraction m of the length that is parallel middle body.
    parallel: f64,
    /// Fraction b of the draft above the turn of the bilge.
    flat: f64,
}

/// Shape and size.
impl Hull {
    /// Wigley's parabolic hull.
    ///
    /// ```text
    /// f = (B/2) (1 − (2x/L)²) (1 − (z/T)²)
    /// ```
    ///
    /// - `length` L, `beam` B, `draft` T \[m\], all above 0
    #[must_use]
    pub fn wigley(length: f64, beam: f64, draft: f64) -> Self {
        Self {
            length,
            beam,
            draft,
            parallel: 0.0,
            flat: 0.0,
        }
    }

    /// A fuller hull of a given block coefficient.
    ///
    /// The family is reduced to one parameter by b = 1 − (1 − m)³ (chosen: at `C_B` = 0.8 half of the length is parallel and the
    /// midship section has the coefficient 0.96, much like a tanker), so
    ///
    /// ```text
    /// C_B = (2 + m)/3 · (2 + b)/3
    /// ```
    ///
    /// - `block_coefficient` `C_B`, 4/9 to below 1; clamped to that range
    ///
    /// # Validity
    ///
    /// The entrance steepens as 1/(1 − m); the thin-ship theory overestimates the waves of a full bow.
    #[must_use]
    pub fn full(length: f64, beam: f64, draft: f64, block_coefficient: f64) -> Self {
        let flat = |m: f64| 1.0 - (1.0 - m).powi(3);
        let block = |m: f64| (2.0 + m) * (2.0 + flat(m)) / 9.0;
        let (mut low, mut high) = (0.0, 0.99);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if block(middle) < block_coefficient {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self {
            parallel: low,
            flat: flat(low),
            ..Self::wigley(length, beam, draft)
        }
    }

    /// Length at the waterline L \[m\].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Beam B \[m\].
    #[must_use]
    pub fn beam(&self) -> f64 {
        self.beam
    }

    /// Draft T \[m\].
    #[must_use]
    pub fn draft(&self) -> f64 {
        self.draft
    }

    /// Slopes (∂f/∂x, ∂f/∂z) of the half-breadth \[1\]; 0 off the hull.
    #[cfg(test)]
    pub(crate) fn slopes(&self, x: f64, z: f64) -> [f64; 2] {
        let (along, along_slope) = profile(2.0 * x.abs() / self.length, self.parallel);
        let (down, down_slope) = profile(z / self.draft, self.flat);
        [
            self.beam / self.length * along_slope * x.signum() * down,
            0.5 * self.beam / self.draft * along * down_slope,
        ]
    }

    /// Block coefficient ∇/(L B T) \[1\].
    #[must_use]
    pub fn block_coefficient(&self) -> f64 {
        (2.0 + self.parallel) * (2.0 + self.flat) / 9.0
    }

    /// Wetted surface S \[m²\], both sides.
    ///
    /// ```text
    /// S = 2 ∬ √(1 + f_x² + f_z²) dx dz
    /// ```
    #[cfg(test)]
    pub(crate) fn wetted_surface(&self) -> f64 {
        let rule = GaussLegendre::new(24);
        let (half, draft) = (0.5 * self.length, self.draft);
        let column = |x: f64| {
            let area = |z: f64| {
                let [fx, fz] = self.slopes(x, z);
                (1.0 + fx * fx + fz * fz).sqrt()
            };
            let turn = self.flat * draft;
            rule.integrate([0.0, turn], area) + rule.integrate([turn, draft], area)
        };
        let shoulder = self.parallel * half;
        // Two sides, bow and stern: four quarters.
        4.0 * (rule.integrate([0.0, shoulder], column) + rule.integrate([shoulder, half], column))
    }
}

/// Value and slope of 1 − ((s − start)/(1 − start))² beyond `start`, 1 before it, 0 beyond 1.
#[cfg(test)]
fn profile(s: f64, start: f64) -> (f64, f64) {
    if s <= start {
        return (1.0, 0.0);
    }
    if s > 1.0 {
        return (0.0, 0.0);
    }
    let t = (s - start) / (1.0 - start);
    (1.0 - t * t, -2.0 * t / (1.0 - start))
}

/// Source of the waves.
impl Hull {
    /// Michell's integral over the centre plane, in closed form.
    ///
    /// ```text
    /// F = ∬ (∂f/∂x) · V(z) · e^{iαx} dx dz,      V = cosh(k(h − z))/cosh(kh), in deep water e^{−kz}
    /// ```
    ///
    /// The hull is symmetric fore and aft, so F is imaginary. Every part is a sum of positive terms, or uses a series where its
    /// closed form cancels, and so keeps its digits for all arguments.
    ///
    /// - `along` α, wavenumber along the track [rad/m]
    /// - `wavenumber` k [rad/m], at least 0
    /// - `depth` h \[m\], may be infinite; a draft beyond it is cut off at the bottom
    /// - returns F \[m²\]
    ///
    /// # References
    ///
    /// Michell (1898), *Philosophical Magazine* 45, 106; in finite depth Sretensky (1936).
    #[must_use]
    pub fn michell_integral(&self, along: f64, wavenumber: f64, depth: f64) -> Complex64 {
        let amplitude =
            0.5 * self.beam * self.longitudinal(along) * self.vertical(wavenumber, depth);
        Complex64::new(0.0, amplitude)
    }

    /// ∫ (d/dx) g(x/h) sin(αx) dx \[1\].
    ///
    /// ```text
    /// −4 Im[e^{iαmh} M(αe)],    e = (1 − m)h,   M(q) = ∫₀¹ t e^{iqt} dt
    /// ```
    fn longitudinal(&self, along: f64) -> f64 {
        let half = 0.5 * self.length;
        let entrance = (1.0 - self.parallel) * half;
        let turned = Complex64::cis(along * self.parallel * half);
        -4.0 * (turned * first_moment(along * entrance)).im
    }

    /// ∫ v(z/T) V(z) dz \[m\].
    fn vertical(&self, k: f64, depth: f64) -> f64 {
        let draft = self.draft.min(depth);
        let (side, bilge) = (self.flat * draft, (1.0 - self.flat) * draft);
        let below = side * decay(k * side) + bilge * (-k * side).exp() * falling(k * bilge);
        let echo = (-2.0 * k * depth).exp();
        if echo == 0.0 || !echo.is_finite() {
            return below;
        }
        // e^{−2kh} ∫ v e^{kz} dz, counted from the keel upward so that nothing grows.
        let from_keel = bilge * rising(k * bilge) + (-k * bilge).exp() * side * decay(k * side);
        (below + (k * (draft - 2.0 * depth)).exp() * from_keel) / (1.0 + echo)
    }
}

/// ∫₀¹ t e^{iqt} dt.
fn first_moment(q: f64) -> Complex64 {
    let iq = Complex64::new(0.0, q);
    if q.abs() < 1.0 {
        return series(iq, |n| 1.0 / (n + 2.0));
    }
    (iq.exp() * (1.0 - iq) - 1.0) / (q * q)
}

/// ∫₀¹ e^{−qt} dt for q ≥ 0.
fn decay(q: f64) -> f64 {
    if q == 0.0 { 1.0 } else { -(-q).exp_m1() / q }
}

/// ∫₀¹ (1 − t²) e^{−qt} dt for q ≥ 0.
fn falling(q: f64) -> f64 {
    if q < 1.0 {
        return series((-q).into(), |n| 2.0 / ((n + 1.0) * (n + 3.0))).re;
    }
    (1.0 - 2.0 * (1.0 - (1.0 + q) * (-q).exp()) / (q * q)) / q
}

/// ∫₀¹ (2t − t²) e^{−qt} dt for q ≥ 0.
fn rising(q: f64) -> f64 {
    if q < 1.0 {
        return series((-q).into(), |n| 2.0 / (n + 2.0) - 1.0 / (n + 3.0)).re;
    }
    let e = (-q).exp();
    2.0 * (1.0 - (1.0 + q) * e) / (q * q) - (2.0 - (q * q + 2.0 * q + 2.0) * e) / q.powi(3)
}

/// Σ coefficient(n) xⁿ/n! for |x| ≤ 1: twenty terms leave less than 1/20! ≈ 4e-19.
fn series(x: Complex64, coefficient: impl Fn(f64) -> f64) -> Complex64 {
    let (mut power, mut sum) = (Complex64::ONE, Complex64::ZERO);
    for n in 0..20 {
        sum += power * coefficient(f64::from(n));
        power *= x / (f64::from(n) + 1.0);
    }
    sum
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact by construction")]
mod tests {
    use super::*;

    impl Hull {
        fn volume(&self) -> f64 {
            self.block_coefficient() * self.length * self.beam * self.draft
        }

        /// Half-breadth f \[m\] at `x` \[m\] forward of midship and depth `z` \[m\]; 0 off the hull.
        fn half_breadth(&self, x: f64, z: f64) -> f64 {
            let along = profile(2.0 * x.abs() / self.length, self.parallel).0;
            0.5 * self.beam * along * profile(z / self.draft, self.flat).0
        }
    }

    fn hulls() -> [Hull; 4] {
        [
            Hull::wigley(195.0, 26.0, 10.0),
            Hull::full(195.0, 26.0, 10.0, 0.8),
            Hull::full(195.0, 26.0, 10.0, 0.45),
            Hull::full(10.0, 1.0, 0.625, 0.9),
        ]
    }

    /// Michell's integral by Gauss panels that follow the hull's corners, without any closed form.
    fn numerical(hull: &Hull, along: f64, k: f64, depth: f64) -> Complex64 {
        let rule = GaussLegendre::new(40);
        let half = 0.5 * hull.length;
        let panels = |from: f64, to: f64, phase: f64| {
            let n = (phase * (to - from) / 20.0).ceil().max(1.0) as usize;
            let step = (to - from) / n as f64;
            (0..n)
                .map(|i| [from + i as f64 * step, from + (i + 1) as f64 * step])
                .collect::<Vec<_>>()
        };
        let weight = |z: f64| {
            if depth.is_finite() {
                (k * (depth - z)).cosh() / (k * depth).cosh()
            } else {
                (-k * z).exp()
            }
        };
        let turn = hull.flat * hull.draft;
        let mut down = panels(0.0, turn, k);
        down.extend(panels(turn, hull.draft, k));
        let mut sum = Complex64::ZERO;
        for range in panels(hull.parallel * half, half, along) {
            for (x, wx) in rule.on(range[0], range[1]) {
                for side in [x, -x] {
                    let section: f64 = down
                        .iter()
                        .map(|&r| rule.integrate(r, |z| hull.slopes(side, z)[0] * weight(z)))
                        .sum();
                    sum += wx * section * Complex64::cis(along * side);
                }
            }
        }
        sum
    }

    #[test]
    fn closed_form_is_the_integral() {
        for hull in hulls() {
            for scale in [1e-4, 0.03, 0.5, 0.999, 1.001, 3.0, 40.0] {
                let k = scale / hull.draft;
                for along in [k, 0.2 * k, 0.999 * 2.0 / hull.length] {
                    for depth in [f64::INFINITY, 1.5 * hull.draft] {
                        let exact = numerical(&hull, along, k, depth);
                        let closed = hull.michell_integral(along, k, depth);
                        // Relative to the integral without oscillation and decay: rounding of 1e3 terms.
                        let size = 4.0 * hull.beam * hull.draft * (along * hull.length).min(1.0);
                        assert!(
                            (closed - exact).norm() < 1e-13 * size,
                            "{hull:?} {k} {along}"
                        );
                    }
                }
            }
        }
    }

    /// Small arguments agree with the leading term −iα∇/2, ∇ the volume, without cancellation down to 1e-12.
    #[test]
    fn small_arguments_keep_their_digits() {
        let hull = Hull::wigley(195.0, 26.0, 10.0);
        for along in [1e-12, 1e-9, 1e-6] {
            let f = hull.michell_integral(along, 0.0, f64::INFINITY);
            // −∬ f · iα dx dz, half the volume.
            let leading = -along * 0.5 * hull.volume();
            assert!((f.im / leading - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn extreme_arguments_are_finite() {
        for hull in hulls() {
            for k in [0.0, 1e-300, 1e-8, 1.0, 1e4, 1e300] {
                for depth in [1.0, 1e3, f64::INFINITY] {
                    assert!(
                        hull.michell_integral(k, k, depth).is_finite(),
                        "{k} {depth}"
                    );
                }
            }
        }
    }

    #[test]
    fn deep_water_is_the_limit_of_depth() {
        for hull in hulls() {
            for k in [0.05, 0.3] {
                let deep = hull.michell_integral(k, k, f64::INFINITY).im;
                let finite = hull.michell_integral(k, k, 25.0 / k).im;
                assert!((finite / deep - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn block_coefficient_is_the_one_chosen() {
        for block in [0.45, 0.6, 0.8, 0.9] {
            let hull = Hull::full(195.0, 26.0, 10.0, block);
            assert!((hull.block_coefficient() - block).abs() < 1e-12);
            // Midpoint sum of the half-breadth: second order, 400 cells, twice for both sides.
            let n = 400;
            let cell = |i: usize, length: f64| (i as f64 + 0.5) / n as f64 * length;
            let sum: f64 = (0..n * n)
                .map(|c| hull.half_breadth(cell(c % n, 195.0) - 97.5, cell(c / n, 10.0)))
                .sum();
            let volume = 2.0 * sum * 195.0 * 10.0 / (n * n) as f64;
            assert!((volume / hull.volume() - 1.0).abs() < 1e-4);
        }
        let wigley = Hull::wigley(1.0, 0.1, 0.0625);
        assert!((wigley.block_coefficient() - 4.0 / 9.0).abs() < 1e-15);
        assert_eq!(Hull::full(1.0, 0.1, 0.0625, 4.0 / 9.0), wigley);
    }

    /// S/L² = 0.148791 at B/L = 0.1, T/L = 0.0625 by a plain double sum, `tests/reference/ship.py`; six digits.
    #[test]
    fn wetted_surface_of_the_standard_hull() {
        let hull = Hull::wigley(1.0, 0.1, 0.0625);
        assert!((hull.wetted_surface() - 0.148791).abs() < 5e-7);
        // A fuller hull of the same size approaches the box, 2T + B of girth along the length, and the ends.
        let full = Hull::full(1.0, 0.1, 0.0625, 0.9).wetted_surface();
        assert!(full > hull.wetted_surface() && full < 2.0 * 0.0625 + 0.1 + 2.0 * 0.1 * 0.0625);
    }

    #[test]
    fn slopes_are_derivatives() {
        for hull in hulls() {
            let (x, z, d) = (0.47 * hull.length, 0.97 * hull.draft, 1e-6);
            let along = (hull.half_breadth(x + d, z) - hull.half_breadth(x - d, z)) / (2.0 * d);
            let down = (hull.half_breadth(x, z + d) - hull.half_breadth(x, z - d)) / (2.0 * d);
            let [fx, fz] = hull.slopes(x, z);
            assert!((fx - along).abs() < 1e-8 && (fz - down).abs() < 1e-8);
        }
    }
}
