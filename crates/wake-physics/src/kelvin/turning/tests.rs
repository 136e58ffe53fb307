#![allow(clippy::float_cmp, reason = "counts")]

use super::*;
use crate::hull::Hull;
use crate::track::Track;
use crate::waves::{Quantity, Transfer, harmonic_sum};

/// A boat of 5 m/s with transverse waves of 16 m; the filter leaves 0.2 % at the end of the band of 2 m pixels.
pub(super) fn boat(heading: f64, radius: f64) -> KelvinWake {
    KelvinWake {
        hull: Hull::wigley(20.0, 4.0, 1.5),
        speed: 5.0,
        track: Track::turning([20.0, 40.0], heading, 0.0, radius.recip()),
        depth: f64::INFINITY,
        filter_depth: 4.0,
        steepness: None,
    }
}

fn raster() -> Raster {
    Raster::image(91, 91, 2.0)
}

/// Every eleventh pixel of some rows.
fn pixels() -> Vec<[usize; 2]> {
    let rows = [3, 24, 43, 58, 84];
    let of_row = |i: usize| (1..8).map(move |j| [i, 11 * j]);
    rows.into_iter().flat_map(of_row).collect()
}

fn elevation(wake: &KelvinWake, pixels: &[[usize; 2]]) -> Vec<f64> {
    let transfer = Transfer {
        depth: wake.depth,
        incidence: 0.5,
        relaxation_rate: 1.0,
        action_slope: 4.5,
    };
    let waves = wake.waves(&wake.plan(&raster(), 1e-3));
    assert!(waves.len() > 100);
    let quantities = [Quantity::Elevation];
    harmonic_sum(&waves, &transfer, &quantities, &raster(), pixels).remove(0)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Largest difference over the root mean square.
fn largest(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / rms(b)
}

/// The rings agree with the sum over a moving point that sends rings J₀(kr) of all wavelengths at every step of the track,
///
/// ```text
/// ζ = Re (1/U) ∫ w(s) ∫ B(k) J₀(k|x − x(s)|) e^{−iωs/U} k dk ds
/// ```
///
/// by the midpoint rule in s and in k, both finer than the waves. Only B, w and x(s) are shared.
#[test]
fn the_rings_of_a_moving_source_add_to_the_wake() {
    for radius in [250.0, -400.0] {
        let wake = boat(20.0, radius);
        let plan = Rings::of(&wake, &raster(), 1e-6).unwrap();
        let all = pixels();
        let fast = elevation(&wake, &all);
        let steady = wake.steady_waves();
        let band = raster().nyquist_wavenumber();
        let (rings, step) = (1000, 0.5);
        let of_ring = |n: usize| {
            let k = band * (n as f64 + 0.5) / rings as f64;
            let omega = angular_frequency(k, wake.depth);
            // The source of the steady wave of this length; waves longer than the longest steady wave have none of their own.
            let u = steady.last(k).unwrap_or(0.0);
            let wave = steady.at(u);
            let along = if k > wave.wavenumber {
                wave.along
            } else {
                (omega / wake.speed).min(k)
            };
            (
                k,
                omega,
                wake.source(along, k, wake.speed / PI) * k * band / rings as f64,
            )
        };
        let waves: Vec<_> = (0..rings).map(of_ring).collect();
        let steps = ((plan.fall(0.0)[1] + 10.0) / step) as usize;
        let direct: Vec<f64> = all
            .par_iter()
            .map(|&[i, j]| {
                let mut sum = Complex64::ZERO;
                for n in 0..steps {
                    let s = -10.0 + (n as f64 + 0.5) * step;
                    let begun = rise(s / 20.0 + 0.5);
                    let there = (wake.track.position, 20.0, -s, radius.recip());
                    let from = Track::turning(there.0, there.1, there.2, there.3).position;
                    let distance = (raster().x(j) - from[0]).hypot(raster().y(i) - from[1]);
                    for (k, omega, source) in &waves {
                        let [middle, width] = plan.fall(*k);
                        let weight = begun * (1.0 - rise((s - middle) / width + 0.5));
                        if weight > 0.0 {
                            let phase = Complex64::cis(-omega * s / wake.speed);
                            sum += source * phase * (weight * libm::j0(k * distance));
                        }
                    }
                }
                sum.re * step / wake.speed
            })
            .collect();
        assert!(rms(&direct) > 1e-3);
        let far = largest(&fast, &direct);
        // The two sums treat the sharp end of the band differently; there e^{−kd} is 1 % of its value at the longest waves.
        assert!(far < 1e-2, "{radius}: {far:e}");
    }
}

/// A wide turn is nearly a straight track: the difference falls with the radius, to first order.
#[test]
fn on_a_wide_turn_the_wake_is_that_of_a_straight_track() {
    let straight = KelvinWake {
        track: Track::new([20.0, 40.0], 20.0, 0.0),
        ..boat(20.0, 1.0)
    };
    // Clear of the hull, where the two fade differently, and within the wedge.
    let astern: Vec<[usize; 2]> = pixels()
        .into_iter()
        .filter(|&[i, j]| {
            let place = [raster().x(j), raster().y(i)];
            straight.track.seen_from_ship(place)[0] < -60.0
        })
        .collect();
    assert!(astern.len() > 10);
    let expected = elevation(&straight, &astern);
    let radii = [1e4, 1e5];
    let far = radii.map(|radius| largest(&elevation(&boat(20.0, radius), &astern), &expected));
    // The waves of the cusp come from 1.5 times the distance astern, so from 350 m: they are 0.056·350²/R off to the side, with
    // 0.34 rad per metre. The two sums treat the sharp end of the band differently; there k e^{−kd} is 3.6 % of its value at the
    // longest waves. Peaks are three times the root mean square.
    for (radius, far) in radii.into_iter().zip(far) {
        let off = 0.34 * 0.056 * 350.0f64.powi(2) / radius;
        assert!(far < 3.0 * (off + 0.036), "{radius}: {far:e}");
    }
    assert!(far[0] > 3.0 * far[1], "{far:?}");
}

/// The same in shallow water, for a ship faster than its longest waves, which travel behind it at the Mach angle.
#[test]
fn on_shallow_water_the_wake_of_a_wide_turn_is_that_of_a_straight_track() {
    let shallow = |track| KelvinWake {
        track,
        depth: 1.6,
        ..boat(20.0, 1.0)
    };
    let raster = Raster::image(91, 91, 2.0);
    let all: Vec<[usize; 2]> = (0..9)
        .flat_map(|i| (0..9).map(move |j| [10 * i, 10 * j]))
        .collect();
    let transfer = Transfer {
        depth: 1.6,
        incidence: 0.5,
        relaxation_rate: 1.0,
        action_slope: 4.5,
    };
    let elevation = |wake: &KelvinWake, tolerance: f64| {
        let waves = wake.waves(&wake.plan(&raster, tolerance));
        (
            waves.len(),
            harmonic_sum(&waves, &transfer, &[Quantity::Elevation], &raster, &all).remove(0),
        )
    };
    let straight = shallow(Track::new([20.0, 40.0], 20.0, 0.0));
    let (_, expected) = elevation(&straight, 1e-4);
    let astern: Vec<usize> = (0..all.len())
        .filter(|&n| {
            let [i, j] = all[n];
            straight.track.seen_from_ship([raster.x(j), raster.y(i)])[0] < -60.0
        })
        .collect();
    // The sharp end of the band is summed differently, as in deep water; waves come from 500 m back, where the narrower turn is 1
    // m off to the side, and change by 0.15 rad per metre.
    for radius in [1e5, 1e6] {
        let turning = shallow(Track::turning([20.0, 40.0], 20.0, 0.0, f64::recip(radius)));
        let (count, found) = elevation(&turning, 1e-3);
        let pick = |values: &[f64]| -> Vec<f64> { astern.iter().map(|&n| values[n]).collect() };
        let far = largest(&pick(&found), &pick(&expected));
        let off = 0.15 * 0.5 * 500f64.powi(2) / radius;
        assert!(
            far < 3.0 * (off + 0.036) && count < 100_000,
            "{radius}: {far:e} {count}"
        );
    }
}

/// Wakes on turns to port and starboard mirror each other, and wakes turn with the heading.
#[test]
fn mirrored_and_turned_ships_have_mirrored_and_turned_wakes() {
    let at = |heading: f64, place: [f64; 2], radius: f64| KelvinWake {
        track: Track::turning(place, heading, 0.0, radius.recip()),
        ..boat(0.0, radius)
    };
    let starboard = elevation(&at(0.0, [0.0, 40.0], 300.0), &pixels());
    let mirrored: Vec<[usize; 2]> = pixels().iter().map(|&[i, j]| [i, 90 - j]).collect();
    let port = elevation(&at(0.0, [0.0, 40.0], -300.0), &mirrored);
    assert!(largest(&port, &starboard) < 1e-4);
    // A quarter turn: (x, y) to (y, −x).
    let turned: Vec<[usize; 2]> = pixels().iter().map(|&[i, j]| [j, 90 - i]).collect();
    let north = elevation(&at(0.0, [0.0, 40.0], 300.0), &pixels());
    let east = elevation(&at(90.0, [40.0, 0.0], 300.0), &turned);
    assert!(largest(&east, &north) < 1e-4);
}

#[test]
fn bessel_functions_are_those_of_the_library() {
    for z in [0.0, 1e-3, 0.7, 12.0, 235.5, 4000.0] {
        let values = bessel_functions(z);
        for m in [0, 1, 2, 5, 11, 100, 230, 3990, 4010] {
            let expected = libm::jn(m, z);
            let value = values.get(m as usize).copied().unwrap_or(0.0);
            assert!(
                (value - expected).abs() < 1e-12,
                "J{m}({z}) = {value:e}, {expected:e}"
            );
        }
    }
}

#[test]
fn the_window_is_the_transform_of_its_steps() {
    let rule = crate::numeric::GaussLegendre::new(64);
    for q in [0.0, 0.1, 0.6, 0.7, 3.0, 40.0] {
        let sum = rule.integrate([-0.5, 0.5], |t| {
            let s = t + 0.5;
            30.0 * (s * (1.0 - s)).powi(2) * (q * t).cos()
        });
        // The series of small arguments ends at z⁸/(14·36·66·104): 3e-11 at its largest.
        let found = step_spectrum(0.5 * q, Complex64::cis(0.5 * q));
        assert!((found - sum).abs() < 1e-10, "{q}");
    }
}

/// The plan counts all waves of the rings, with those beyond the cusp apart; exactly the waves weaker than their share of the
/// root mean square are left out.
#[test]
fn weak_waves_are_left_out_and_counted_before() {
    let wake = boat(20.0, 300.0);
    let cusp = 1.5 * wake.steady_waves().at(0.0).wavenumber;
    let all = Rings {
        least: 0.0,
        ..Rings::of(&wake, &raster(), 1e-3).unwrap()
    };
    let waves = all.waves(&wake);
    let beyond = |n: &usize| waves.kx[*n].hypot(waves.ky[*n]) >= cusp;
    let divergent = (0..waves.len()).filter(beyond).count();
    assert_eq!(all.nodes(cusp), [waves.len() - divergent, divergent]);
    assert!(divergent > 0 && divergent < waves.len());
    let energy = |n: usize| {
        let reach = all.sent.reach(waves.kx[n].hypot(waves.ky[n]));
        waves.amplitude[n].norm_sqr() * reach * reach
    };
    let squares: Vec<f64> = (0..waves.len()).map(energy).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    for least in [1e-3, 0.5] {
        let strong = squares
            .iter()
            .filter(|&&s| s > least * least * mean)
            .count();
        let kept = Rings { least, ..all }.waves(&wake).len();
        // Rounded wavenumbers may put a wave on the other side of the limit.
        assert!(
            kept.abs_diff(strong) <= 2 && kept < waves.len(),
            "{least}: {kept} {strong}"
        );
    }
}

/// The number of kept waves is estimated to a fifth from a few rings, and the number of all waves to 1e-3 from some of many
/// rings; where rings have too many waves to compute, all count.
#[test]
fn waves_that_are_kept_are_foreseen() {
    let wake = boat(20.0, 300.0);
    for least in [1e-5, 1e-2, 0.3] {
        let rings = Rings {
            least,
            ..Rings::of(&wake, &raster(), 1e-3).unwrap()
        };
        let work = rings.work(&wake);
        let kept = rings.waves(&wake).len() as f64;
        assert!(
            (work.kept / kept - 1.0).abs() < 0.2,
            "{least}: {} {kept}",
            work.kept
        );
        assert!(work.nodes >= work.kept && work.most_kept == work.kept && work.terms > 0.0);
    }
    let rings = Rings::of(&wake, &raster(), 1e-3).unwrap();
    let finer = |times: f64| Rings {
        sent: rings.sent.finer(times),
        ..rings
    };
    let fine = finer(10.0 * MOST_COUNTED as f64 / rings.sent.rings() as f64);
    let one_by_one: usize = (0..fine.sent.rings())
        .map(|ring| fine.directions(ring))
        .sum();
    let counted = fine.nodes(f64::INFINITY)[0] as f64;
    assert!(
        (counted / one_by_one as f64 - 1.0).abs() < 1e-3,
        "{counted} {one_by_one}"
    );
    let many = finer(1e6 / rings.sent.rings() as f64);
    let work = many.work(&wake);
    assert_eq!(work.kept, work.nodes);
}

/// Rotated phases equal sines and cosines, up to some roundings a step.
#[test]
fn spectra_at_equal_distances_are_those_of_each() {
    let wake = boat(20.0, 300.0);
    let rings = Rings::of(&wake, &raster(), 1e-3).unwrap();
    let window = Onsets::new(&rings, &wake, 0.4);
    for by in [1.0, -1.0] {
        let mut all = window.from(-7.3, by);
        for m in 0..3000 {
            let alone = window.from(-7.3 + by * f64::from(m), by).next();
            assert!((all.next() - alone).norm() < 1e-12, "{m}");
        }
    }
}

/// Terms that are left out of the sum over m are weak.
#[test]
fn the_window_is_weak_beyond_its_width() {
    let wake = boat(20.0, 300.0);
    let rings = Rings::of(&wake, &raster(), 1e-3).unwrap();
    for k in [0.02, 0.4, 1.5] {
        let window = Onsets::new(&rings, &wake, k);
        let at = |q: f64| window.from(q, 1.0).next().norm();
        for share in [1e-3, 1e-6] {
            let width = window.width(share);
            let beyond = (0..4000).map(|n| at(width * (1.0 + 1e-3 * f64::from(n))));
            let largest = beyond.fold(0.0, f64::max);
            assert!(largest <= share * at(0.0), "{k} {share}: {largest:e}");
            // The width is not much too large.
            let inside = (0..4000).map(|n| at(0.4 * width * (1.0 + 1e-4 * f64::from(n))));
            assert!(inside.fold(0.0, f64::max) > share * at(0.0), "{k} {share}");
        }
    }
}
