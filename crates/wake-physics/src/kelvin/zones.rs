//! The part of the curve of steady waves that reaches a raster.
//!
//! The phase of wave u at the place (ξ, η) is αξ + βη; a wave reaches a place only where the derivative of its phase along the
//! curve vanishes (stationary phase). A distant raster receives a short piece of the curve. The rest may be cut off, if the cut
//! is smooth over many periods.

use super::steady::SteadyWaves;
use crate::numeric::{GaussLegendre, root, smallest_at};

/// Number of samples of the curve between which a change of sign is searched.
const SAMPLES: usize = 400;

/// Steps of the searches for zeros and for minima.
const HALVINGS: usize = 50;
const THIRDS: usize = 40;

/// Places of interest as seen from the ship, and the rate at which phases turn there along the curve.
#[derive(Debug, Clone)]
pub(crate) struct Reach {
    waves: SteadyWaves,
    /// Corners (ξ, η) of a convex region \[m\].
    corners: Vec<[f64; 2]>,
    /// Half the length of the hull \[m\]: bow and stern are separate sources.
    half_length: f64,
    /// Depth over which the hull and the filter weaken short waves \[m\].
    decay: f64,
}

/// A piece of the curve with smooth ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Width of the smooth rise after `from`; 0 for a sharp end.
    pub(crate) rise: f64,
    /// Width of the smooth fall before `to`; 0 for a sharp end.
    pub(crate) fall: f64,
}

impl Piece {
    /// The window over the piece: 1 inside, falling to 0 at smooth ends.
    pub(crate) fn window(&self, u: f64, sharpness: f64) -> f64 {
        let end = |distance: f64, width: f64| {
            if width == 0.0 || distance >= width {
                return 1.0;
            }
            0.5 + 0.5 * libm::erf(sharpness * (2.0 * distance / width - 1.0))
        };
        end(u - self.from, self.rise) * end(self.to - u, self.fall)
    }
}

impl Reach {
    pub(crate) fn new(
        waves: SteadyWaves,
        corners: Vec<[f64; 2]>,
        half_length: f64,
        decay: f64,
    ) -> Self {
        Self {
            waves,
            corners,
            half_length,
            decay,
        }
    }

    /// Smallest and largest derivative of the phase along the curve, over the region and the hull.
    fn range(&self, u: f64) -> [f64; 2] {
        let [_, along, across] = self.waves.at(u).rates;
        let hull = self.half_length * along.abs();
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for [x, y] in &self.corners {
            let rate = x * along + y * across;
            range = [range[0].min(rate - hull), range[1].max(rate + hull)];
        }
        range
    }

    /// Smallest magnitude of the derivative; 0 where some place is stationary.
    fn slowest(&self, u: f64) -> f64 {
        let [low, high] = self.range(u);
        low.max(-high).max(0.0)
    }

    /// Bound on the rate at which the integrand turns at u: phases, window, decay and change of the amplitude.
    pub(crate) fn fastest(&self, u: f64) -> f64 {
        let [low, high] = self.range(u);
        let decay = self.decay * self.waves.at(u).rates[0].abs();
        low.abs().max(high.abs()) + self.slowest(u) + decay + 6.0
    }

    /// Pieces of [from, to] that matter. Each reaches `phase` radians beyond its stationary points before its end falls, over
    /// `phase` more. The ends of the curve are sharp and matter, too.
    pub(crate) fn pieces(&self, [from, to]: [f64; 2], phase: f64) -> Vec<Piece> {
        let mut out: Vec<Piece> = Vec::new();
        for seed in self.seeds([from, to]) {
            let piece = self.widen(seed, [from, to], phase);
            match out.last_mut() {
                Some(last) if piece.from <= last.to => {
                    if piece.to >= last.to {
                        (last.to, last.fall) = (piece.to, piece.fall);
                    }
                }
                _ => out.push(piece),
            }
        }
        out
    }

    /// Ends, runs of stationary samples, changes of sign and the slowest points between, in order.
    fn seeds(&self, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
        let at = |i: usize| from + (to - from) * i as f64 / SAMPLES as f64;
        let middle = |u: f64| {
            let [low, high] = self.range(u);
            low + high
        };
        let slow: Vec<f64> = (0..=SAMPLES).map(|i| self.slowest(at(i))).collect();
        let mut seeds = vec![[from, from]];
        for i in 0..=SAMPLES {
            let after = (i + 1).min(SAMPLES);
            if slow[i] == 0.0 {
                seeds.push([at(i); 2]);
                if slow[after] == 0.0 {
                    seeds.push([at(i), at(after)]);
                }
            } else if slow[i] <= slow[i.saturating_sub(1)] && slow[i] <= slow[after] {
                seeds.push(
                    [smallest_at(
                        |u| self.slowest(u),
                        [at(i.saturating_sub(1)), at(after)],
                        THIRDS,
                    ); 2],
                );
            }
            if middle(at(i)) * middle(at(after)) < 0.0 {
                seeds.push([root(middle, [at(i), at(after)], HALVINGS); 2]);
            }
        }
        seeds.push([to, to]);
        merged(seeds)
    }

    fn widen(&self, [low, high]: [f64; 2], [from, to]: [f64; 2], phase: f64) -> Piece {
        let ([left, left_start], [right, right_start]) =
            (self.end_of(low, from, phase), self.end_of(high, to, phase));
        Piece {
            from: left,
            to: right,
            rise: left_start - left,
            fall: right - right_start,
        }
    }

    /// Points from `start` toward `limit` where the phase has turned by 2·`phase`, and by `phase`; both are `limit` if it comes
    /// first.
    fn end_of(&self, start: f64, limit: f64, phase: f64) -> [f64; 2] {
        let rule = GaussLegendre::new(4);
        let (mut turned, mut begin, span) = (0.0, start, limit - start);
        let mut step = span * 1e-9;
        let mut fall = None;
        while (limit - begin).abs() > span.abs() * 1e-12 {
            let end = if (limit - begin).abs() <= step.abs() {
                limit
            } else {
                begin + step
            };
            if (end - begin).abs() <= f64::EPSILON * begin.abs() {
                // Phases turn within the rounding of u: the ship is too far away to be resolved.
                return [begin, fall.unwrap_or(begin)];
            }
            let more = rule.integrate([begin, end], |u| self.slowest(u)).abs();
            if more > 0.5 * phase {
                step *= 0.5;
                continue;
            }
            turned += more;
            begin = end;
            if turned >= phase && fall.is_none() {
                fall = Some(begin);
            }
            if turned >= 2.0 * phase {
                return [begin, fall.unwrap_or(begin)];
            }
            step *= 1.3;
        }
        [limit, limit]
    }
}

/// Joins intervals that touch.
fn merged(mut seeds: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    seeds.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut out: Vec<[f64; 2]> = Vec::new();
    for seed in seeds {
        match out.last_mut() {
            Some(last) if seed[0] <= last[1] => last[1] = last[1].max(seed[1]),
            _ => out.push(seed),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// At one place (ξ, 0) of deep water only α = ν cosh u matters: its phase turns by |ξ| ν sinh u. Twice that and 6 more bound
    /// the integrand, with further terms for hull and decay.
    #[test]
    fn how_fast_waves_turn_on_the_track() {
        let nu = crate::constants::GRAVITY / 25.0;
        let waves = SteadyWaves::new(5.0, f64::INFINITY);
        for (half_length, decay) in [(0.0, 0.0), (10.0, 3.0)] {
            let reach = Reach::new(waves, vec![[-300.0, 0.0]], half_length, decay);
            for u in [-1.5f64, 0.4, 2.0] {
                let rate = nu * u.sinh().abs();
                let [slow, fast] = [300.0 - half_length, 300.0 + half_length].map(|x| x * rate);
                assert!((reach.slowest(u) / slow - 1.0).abs() < 1e-12, "{u}");
                // k = ν cosh² u.
                let bound = fast + slow + decay * 2.0 * nu * u.cosh() * u.sinh().abs() + 6.0;
                assert!((reach.fastest(u) / bound - 1.0).abs() < 1e-12, "{u}");
            }
            assert!(reach.slowest(0.0) == 0.0 && (reach.fastest(0.0) - 6.0).abs() < 1e-12);
        }
    }

    /// A smooth end is ½ erfc(s(1 − 2x)) at its fraction x, compared with a continued fraction: the tail keeps its relative
    /// digits, where ½ + ½ erf leaves the rounding of 1.
    #[test]
    fn smooth_ends_are_error_functions() {
        let piece = Piece {
            from: 2.0,
            to: 3.0,
            rise: 0.2,
            fall: 0.0,
        };
        for sharpness in [2.0f64, 4.0, 6.0] {
            let z = 0.9 * sharpness;
            // erfc z = e^{−z²}/√π · 1/(z + ½/(z + 1/(z + 3⁄2/(z + …)))).
            let fraction = (1..400).rev().fold(z, |f, n| z + 0.5 * f64::from(n) / f);
            let tail = 0.5 * (-z * z).exp() / (PI.sqrt() * fraction);
            let found = [0.05, 0.95].map(|x| piece.window(2.0 + 0.2 * x, sharpness));
            // Two roundings of numbers near 1, and the rounding of u.
            assert!(
                (found[0] - tail).abs() < 5e-16 + 1e-12 * tail,
                "{sharpness}"
            );
            assert!((found[1] - (1.0 - tail)).abs() < 5e-16 + 1e-12 * tail);
        }
        assert!((piece.window(2.5, 6.0) - 1.0).abs() < f64::EPSILON);
    }

    #[test]
    fn zeros_and_valleys_are_found() {
        assert!((root(|x| x.cos(), [1.0, 2.0], HALVINGS) - PI / 2.0).abs() < 1e-14);
        assert!((root(|x| -x.cos(), [1.0, 2.0], HALVINGS) - PI / 2.0).abs() < 1e-14);
        // Forty thirds of the interval.
        let found = smallest_at(|x| (x - 0.3).abs(), [-1.0, 2.0], THIRDS);
        assert!((found - 0.3).abs() < 3.0 * (2f64 / 3.0).powi(40));
    }
}
