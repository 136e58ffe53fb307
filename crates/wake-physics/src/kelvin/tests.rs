use super::*;
use crate::kelvin::quadrature::direct_quadrature;
use crate::nufft::synthesize;
use crate::raster::Raster;
use crate::waves::{Quantity, Transfer, harmonic_sum};
use std::f64::consts::PI;

const DEEP: Transfer = Transfer {
    depth: f64::INFINITY,
    incidence: 0.5,
    relaxation_rate: 0.5,
    action_slope: 4.5,
};

fn wake(hull: Hull, speed: f64, heading: f64) -> KelvinWake {
    KelvinWake {
        hull,
        speed,
        track: Track::new([0.0, 0.0], heading, 0.0),
        depth: f64::INFINITY,
        filter_depth: 0.0,
        steepness: None,
    }
}

fn scene_ship(speed: f64, heading: f64) -> KelvinWake {
    wake(Hull::wigley(195.0, 26.0, 10.0), speed, heading)
}

/// Elevations at places (x, y) of a ship with heading 90 (toward +x) at the origin, from the plan's waves.
fn elevations(wake: &KelvinWake, raster: &Raster, places: &[[f64; 2]], tolerance: f64) -> Vec<f64> {
    let waves = wake.waves(&wake.plan(raster, tolerance));
    places
        .iter()
        .map(|&[x, y]| {
            (0..waves.len())
                .map(|n| {
                    let phase = waves.kx[n] * x + waves.ky[n] * y;
                    (waves.amplitude[n] * Complex64::cis(phase)).re
                })
                .sum()
        })
        .collect()
}

/// One value stands in Doctors and Beck (1987), Table 1, to within the 1e-3 by which Michell's integral itself differs from it;
/// a second implementation, `tests/reference/ship.py`, gives all values to their last digit.
#[test]
fn wave_resistance_of_the_standard_hull() {
    let hull = Hull::wigley(1.0, 0.1, 0.0625);
    let table = [
        (0.15, 0.3617),
        (0.2, 0.8876),
        (0.25, 1.0639),
        (0.3, 2.1417),
        (0.35, 1.2479),
        (0.4, 2.7339),
        (0.5, 4.5172),
        (0.8, 2.5953),
        (1.0, 1.8363),
    ];
    for (froude, expected) in table {
        let speed = froude * GRAVITY.sqrt();
        let coefficient = 1e3 * wake(hull, speed, 0.0).wave_resistance_coefficient();
        // Half a unit of the last digit, and the accuracy of 1e-4 that the table states.
        assert!(
            (coefficient - expected).abs() < 5e-5 + 1e-4 * expected,
            "{froude} {coefficient}"
        );
        if froude == 0.35 {
            assert!((coefficient / 1.2486 - 1.0).abs() < 1e-3);
        }
    }
}

/// Resistance of the scene's ship in newtons, by `tests/reference/ship.py`: four digits (truncated at λ = 60).
#[test]
fn wave_resistance_of_the_scene_ship() {
    for (speed, expected) in [
        (6.0, 3.527e4),
        (8.0, 2.016e5),
        (9.0, 3.354e5),
        (10.0, 4.546e5),
        (12.0, 7.648e5),
    ] {
        let resistance = scene_ship(speed, 0.0).wave_resistance();
        assert!(
            (resistance / expected - 1.0).abs() < 2.5e-4,
            "{speed} {resistance:e}"
        );
    }
    assert_eq!(scene_ship(0.0, 0.0).wave_resistance(), 0.0);
}

/// R = ½πρU² ∫|A|² cos³θ dθ, by a midpoint sum in θ that shares nothing with the library's quadrature.
#[test]
fn resistance_is_the_energy_of_the_spectrum() {
    for (hull, speed) in [
        (Hull::wigley(195.0, 26.0, 10.0), 10.0),
        (Hull::full(195.0, 26.0, 10.0, 0.8), 12.0),
        (Hull::wigley(10.0, 1.0, 0.625), 3.0),
    ] {
        let ship = wake(hull, speed, 0.0);
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n);
                ship.amplitude(theta).norm_sqr() * theta.cos().powi(3)
            })
            .sum();
        let density = crate::constants::SEA_WATER_DENSITY;
        let energy = PI * density * speed * speed * sum * 0.5 * PI / f64::from(n);
        assert!((ship.wave_resistance() / energy - 1.0).abs() < 1e-7);
    }
}

/// R ∝ L³ for similar ships at one Froude number.
#[test]
fn resistance_scales_with_volume() {
    let small = wake(Hull::wigley(1.0, 0.1, 0.0625), 0.3 * GRAVITY.sqrt(), 0.0).wave_resistance();
    let large = wake(Hull::wigley(100.0, 10.0, 6.25), 3.0 * GRAVITY.sqrt(), 0.0).wave_resistance();
    assert!((large / small / 1e6 - 1.0).abs() < 1e-9);
}

/// Reference points of a large ship and a small hull, with a filter depth d so that no cut-off matters.
#[test]
fn elevations_at_the_reference_points() {
    let large = [
        ([-300.0, 0.0], -0.2035248, -0.2152469),
        ([-500.0, 0.0], -0.3374015, -0.3583433),
        ([-500.0, 100.0], -0.2529863, -0.2868763),
        ([-500.0, 150.0], 0.1829728, 0.1771364),
        ([-500.0, 176.777], 0.0782143, 0.0842910),
    ];
    // Pixels of 0.05 m: the band ends at 63 rad/m, where exp(−k d) is below 1e-13.
    let raster = Raster {
        origin_row: 4000,
        origin_column: 12000,
        ..Raster::image(8001, 12001, 0.05)
    };
    for (column, depth) in [(0, 1.0), (1, 0.5)] {
        let ship = KelvinWake {
            filter_depth: depth,
            ..scene_ship(9.0, 90.0)
        };
        let places: Vec<[f64; 2]> = large.iter().map(|p| p.0).collect();
        for (value, row) in elevations(&ship, &raster, &places, 1e-6).iter().zip(large) {
            let expected = [row.1, row.2][column];
            assert!((value - expected).abs() < 1e-7, "{row:?} {value}");
        }
    }
    let small = [
        ([-20.0, 0.0], -0.02223337),
        ([-30.0, 0.0], 0.02405421),
        ([-30.0, 5.0], 0.02072523),
        ([-30.0, 10.0], -0.00823663),
    ];
    let ship = KelvinWake {
        filter_depth: 0.05,
        ..wake(Hull::wigley(10.0, 1.0, 0.625), 3.0, 90.0)
    };
    let raster = Raster {
        origin_row: 2000,
        origin_column: 4000,
        ..Raster::image(4001, 4001, 0.01)
    };
    let places: Vec<[f64; 2]> = small.iter().map(|p| p.0).collect();
    for (value, row) in elevations(&ship, &raster, &places, 1e-6).iter().zip(small) {
        // The reference states that two quadratures agree to 1.1e-6 m at the last point.
        assert!((value - row.1).abs() < 1.2e-6, "{row:?} {value}");
    }
}

const ALL: [Quantity; 8] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
    Quantity::RadialAcceleration,
    Quantity::Hydrodynamic,
];

/// Some pixels of a raster, corners and middle included.
fn some_pixels(raster: &Raster, count: usize) -> Vec<[usize; 2]> {
    let (bottom, right) = (raster.rows - 1, raster.columns - 1);
    let mut pixels = vec![
        [0, 0],
        [0, right],
        [bottom, 0],
        [bottom, right],
        [bottom / 2, right / 2],
    ];
    for n in 0..count.saturating_sub(5) {
        let part = |step: f64| ((n + 1) as f64 * step).fract();
        pixels.push([
            (part(0.618034) * raster.rows as f64) as usize,
            (part(0.754878) * raster.columns as f64) as usize,
        ]);
    }
    pixels
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Asserts that the plan's waves meet each tolerance against direct quadrature, in units of the field's rms.
fn assert_plan_is_right(wake: &KelvinWake, raster: &Raster, tolerances: &[f64]) {
    let transfer = Transfer {
        depth: wake.depth,
        ..DEEP
    };
    let pixels = some_pixels(raster, 9);
    let exact = direct_quadrature(wake, &transfer, &ALL, raster, &pixels, 1e-9);
    for &tolerance in tolerances {
        let waves = wake.waves(&wake.plan(raster, tolerance));
        let fast = harmonic_sum(&waves, &transfer, &ALL, raster, &pixels);
        for (fast, exact) in fast.iter().zip(&exact) {
            let worst = fast
                .iter()
                .zip(exact)
                .map(|(f, e)| (f - e).abs())
                .fold(0.0, f64::max);
            // Not as a ratio: where all waves are too short to modulate, the modulation is 0.
            let rms = rms(exact);
            assert!(
                worst <= tolerance * rms,
                "{worst:e} > {tolerance:e} of {rms:e} for {wake:?}"
            );
        }
    }
}

/// The plan meets its tolerance for ships in and off the raster, slow and fast (Froude 0.05 to 1.5), in deep and in shallow water
/// (below, near and above the critical speed).
#[test]
fn plan_is_the_integral() {
    let at = |x, y, ship: KelvinWake| KelvinWake {
        track: Track::new([x, y], 60.0, 0.0),
        ..ship
    };
    let full = wake(Hull::full(195.0, 26.0, 10.0, 0.8), 12.0, 60.0);
    let slow = wake(
        Hull::wigley(195.0, 26.0, 10.0),
        0.05 * (GRAVITY * 195.0).sqrt(),
        60.0,
    );
    let fast = wake(
        Hull::wigley(30.0, 4.0, 1.0),
        1.5 * (GRAVITY * 30.0).sqrt(),
        60.0,
    );
    let shallow = |depth| KelvinWake { depth, ..fast };
    let cases = [
        at(0.0, 0.0, scene_ship(10.0, 0.0)),
        at(700.0, 400.0, full),
        at(
            40.0,
            90.0,
            KelvinWake {
                filter_depth: 3.0,
                ..full
            },
        ),
        at(60.0, 20.0, slow),
        at(100.0, 50.0, fast),
        at(100.0, 50.0, shallow(300.0)),
        at(
            100.0,
            50.0,
            shallow(1.001 * fast.speed * fast.speed / GRAVITY),
        ),
        at(100.0, 50.0, shallow(20.0)),
    ];
    for ship in cases {
        // Waves of the slow ship are 3 m long.
        let spacing = if ship.speed < 3.0 { 1.0 } else { 8.0 };
        let raster = Raster::image(40, 32, spacing);
        assert_plan_is_right(&ship, &raster, &[1e-1, 1e-3, 1e-6]);
    }
}

/// A ship far away gets a bounded number of waves, and they are correct.
#[test]
fn distant_ship_is_bounded_and_right() {
    let raster = Raster::image(40, 40, 12.0);
    for distance in [5e3, 2e4] {
        let behind = |aside: f64| KelvinWake {
            track: Track::new([distance, aside * distance], 90.0, 0.0),
            ..scene_ship(10.0, 0.0)
        };
        // On the track, inside the wedge, on the cusp line (tan 19.47° = 0.3536).
        for aside in [0.0, 0.2, 0.3536] {
            assert_plan_is_right(&behind(aside), &raster, &[1e-3]);
        }
    }
    for distance in [1e6, 1e9, 1e15, 1e300] {
        for aside in [0.0, 0.2, 0.3536, 2.0] {
            let ship = KelvinWake {
                track: Track::new([distance, aside * distance], 90.0, 0.0),
                ..scene_ship(10.0, 0.0)
            };
            let plan = ship.plan(&raster, 1e-3);
            // Beyond 1e9 m phases are lost in rounding: bounded all the same.
            let most = if distance <= 1e9 { 4000 } else { 20_000 };
            assert!(plan.nodes() < most, "{distance} {aside} {}", plan.nodes());
            assert!(ship.waves(&plan).amplitude.iter().all(|a| a.is_finite()));
        }
    }
}

/// There are no waves where none can be seen: ahead of the bow, at rest, and where all are shorter than pixels carry.
#[test]
fn plan_is_empty_where_nothing_can_be_seen() {
    let raster = Raster::image(64, 64, 2.5);
    let ahead = KelvinWake {
        track: Track::new([-500.0, 0.0], 90.0, 0.0),
        ..scene_ship(10.0, 90.0)
    };
    let still = scene_ship(0.0, 0.0);
    let crawling = scene_ship(2.0, 0.0); // shortest waves U²·2π/g = 2.6 m long, pixels carry 5 m
    for ship in [ahead, still, crawling] {
        assert_eq!(ship.plan(&raster, 1e-3).nodes(), 0);
    }
}

/// Tolerance of the whole fast path at the default scene: fields agree with the sum of the same waves, apart from the rounding of
/// the result to f32.
#[test]
fn fields_meet_their_tolerance() {
    let raster = Raster::image(512, 512, 2.5);
    let pixels = some_pixels(&raster, 200);
    for (tolerance, heading) in [
        (1e-1, 45.0),
        (1e-2, 0.0),
        (1e-3, 45.0),
        (1e-4, 90.0),
        (1e-5, 200.0),
        (1e-6, 45.0),
    ] {
        let ship = scene_ship(10.0, heading);
        let waves = ship.waves(&ship.plan(&raster, tolerance));
        let fields = synthesize(&waves, &DEEP, &ALL, &raster, tolerance);
        let exact = harmonic_sum(&waves, &DEEP, &ALL, &raster, &pixels);
        for ((field, exact), quantity) in fields.iter().zip(&exact).zip(ALL) {
            for (&[i, j], v) in pixels.iter().zip(exact) {
                let rounding = 0.5 * f64::from(f32::EPSILON) * v.abs();
                let error = (f64::from(field.at(i, j)) - v).abs() - rounding;
                assert!(
                    error <= tolerance * field.rms(),
                    "{quantity:?} {tolerance:e} {error:e}"
                );
            }
        }
    }
}

/// ∫ cos(X cosh u) du = −π Y₀(X) and ∫ sin(X cosh u) du = π J₀(X): waves of unit strength on the track, cut off smoothly where
/// the exact integral adds nothing more.
#[test]
fn waves_on_the_track_are_bessel_functions() {
    let steady = SteadyWaves::new(GRAVITY.sqrt(), f64::INFINITY); // ν = 1 m⁻¹
    let reach = zones::Reach::new(steady, vec![[-10.0, 0.0]], 0.0, 0.0);
    let piece = zones::Piece {
        from: -5.0,
        to: 5.0,
        rise: 3.0,
        fall: 3.0,
    };
    let nodes = panels::nodes_of(&reach, piece, 1e-12);
    let sum = |f: fn(f64) -> f64| {
        nodes
            .iter()
            .map(|(u, w)| w * f(10.0 * u.cosh()))
            .sum::<f64>()
    };
    assert!((sum(f64::cos) + 0.174896130).abs() < 1e-9);
    assert!((sum(f64::sin) + 0.772629991).abs() < 1e-9);
}

/// Crests on the track are 2πU²/g apart: mean distance of zero crossings, 2 % as the phase still settles.
#[test]
fn transverse_waves_have_their_length() {
    for speed in [8.0, 10.0, 12.0] {
        let ship = KelvinWake {
            filter_depth: 5.0,
            ..scene_ship(speed, 90.0)
        };
        let raster = Raster {
            origin_column: 2000,
            ..Raster::image(3, 2001, 1.0)
        };
        let row: Vec<f64> = {
            let waves = ship.waves(&ship.plan(&raster, 1e-4));
            let fields = synthesize(&waves, &DEEP, &[Quantity::Elevation], &raster, 1e-4);
            (0..1500).map(|j| f64::from(fields[0].at(1, j))).collect()
        };
        let crossings: Vec<f64> = row
            .windows(2)
            .enumerate()
            .filter(|(_, w)| w[0] * w[1] < 0.0)
            .map(|(j, w)| j as f64 + w[0] / (w[0] - w[1]))
            .collect();
        let halves = (crossings.len() - 1) as f64;
        let length = 2.0 * (crossings[crossings.len() - 1] - crossings[0]) / halves;
        assert!(
            (length / ship.transverse_wavelength() - 1.0).abs() < 0.02,
            "{length}"
        );
    }
}

/// The steady pattern moves with the ship, so w = −U ∂ζ/∂ξ: velocities against differences of the elevation.
#[test]
fn vertical_velocity_is_that_of_a_moving_pattern() {
    let ship = KelvinWake {
        filter_depth: 1.0,
        ..scene_ship(10.0, 90.0)
    };
    let waves = ship.waves(&ship.plan(&Raster::image(300, 300, 2.5), 1e-4));
    let fine = Raster {
        origin_row: 5000,
        origin_column: 20000,
        ..Raster::image(1, 3, 0.01)
    };
    let pixels = [[0, 0], [0, 1], [0, 2]];
    let sums = harmonic_sum(
        &waves,
        &DEEP,
        &[Quantity::Elevation, Quantity::VelocityZ],
        &fine,
        &pixels,
    );
    let slope = (sums[0][2] - sums[0][0]) / 0.02;
    // Central difference: (k d)²/6 with k below 1.3 rad/m, 3e-5 of the velocity's scale.
    assert!((sums[1][1] + 10.0 * slope).abs() < 1e-4 * sums[1][1].abs().max(0.1));
}

/// Port and starboard are alike.
#[test]
fn wake_is_symmetric() {
    let ship = scene_ship(10.0, 90.0);
    let raster = Raster::image(301, 301, 2.5);
    let port = elevations(
        &ship,
        &raster,
        &[[-300.0, 80.0], [-200.0, 33.0], [-350.0, 160.0]],
        1e-3,
    );
    let starboard = elevations(
        &ship,
        &raster,
        &[[-300.0, -80.0], [-200.0, -33.0], [-350.0, -160.0]],
        1e-3,
    );
    for (p, s) in port.iter().zip(starboard) {
        assert!((p - s).abs() < 1e-12);
    }
}

/// Seen from the ship, the wake is the same wherever the ship is and whatever its course.
#[test]
fn wake_goes_with_the_ship() {
    let reference = KelvinWake {
        filter_depth: 0.5,
        ..scene_ship(10.0, 90.0)
    };
    let raster = Raster::image(401, 401, 2.5);
    let seen = [[-300.0, 80.0], [-150.0, -20.0], [-420.0, 0.0]];
    let expected = elevations(&reference, &raster, &seen, 1e-6);
    for (heading, place) in [
        (0.0, [0.0, 0.0]),
        (37.0, [120.0, -60.0]),
        (225.0, [-200.0, 200.0]),
        (-70.0, [3e4, 1e4]),
    ] {
        let ship = KelvinWake {
            track: Track::new(place, heading, 0.0),
            ..reference
        };
        // A raster around the ship: the waves of a distant ship are limited to those that reach it.
        let around = Raster {
            origin_row: 200 + (place[1] / 2.5) as i64,
            origin_column: 200 - (place[0] / 2.5) as i64,
            ..raster
        };
        let places = seen.map(|s| ship.track.on_sea(s));
        for (value, e) in elevations(&ship, &around, &places, 1e-6)
            .iter()
            .zip(&expected)
        {
            assert!((value - e).abs() < 2e-7, "{heading} {value} {e}");
        }
    }
}

/// Time moves the pattern by U t along the heading.
#[test]
fn wake_moves_with_time() {
    let later = Track::new([5.0, 6.0], 30.0, 10.0 * 7.0);
    let expected = [5.0 + 35.0, 6.0 + 70.0 * 30f64.to_radians().cos()];
    assert!((later.position[0] - expected[0]).abs() < 1e-12);
    assert!((later.position[1] - expected[1]).abs() < 1e-12);
}

/// Aft of the bow the surface first rises: the bow wave begins with a crest. The ship is forty wavelengths long, so that the
/// stern's waves are weak at the bow.
#[test]
fn bow_wave_begins_with_a_crest() {
    let ship = KelvinWake {
        filter_depth: 0.3,
        ..wake(Hull::wigley(400.0, 40.0, 10.0), 4.0, 90.0)
    };
    let raster = Raster {
        origin_row: 0,
        origin_column: 400,
        ..Raster::image(1, 801, 0.5)
    };
    let places: Vec<[f64; 2]> = (0..20).map(|i| [200.0 - 0.5 * f64::from(i), 0.0]).collect();
    let values = elevations(&ship, &raster, &places, 1e-4);
    let first = (1..19).find(|&i| (values[i] - values[i - 1]) * (values[i + 1] - values[i]) <= 0.0);
    let crest = values[first.unwrap()];
    assert!(
        crest > 0.0 && crest > 0.3 * values.iter().copied().fold(0.0, f64::max),
        "{values:?}"
    );
}

/// The arms open at Kelvin's angle. Estimator: at each distance astern, the outermost place off the track
/// where the amplitude (rms along one transverse wavelength) is half of its largest; then the slope of a
/// line through these places. The edge lies a distance ∝ astern^⅓ outside the cusp line (an Airy function),
/// which tilts the slope by less than a degree here.
#[test]
fn arms_open_at_the_kelvin_angle() {
    for speed in [6.0, 8.0, 10.0, 12.0] {
        let ship = scene_ship(speed, 90.0);
        let raster = Raster {
            origin_row: 699,
            origin_column: 1600,
            ..Raster::image(700, 1400, 5.0)
        };
        let waves = ship.waves(&ship.plan(&raster, 1e-2));
        let field = &synthesize(&waves, &DEEP, &[Quantity::Elevation], &raster, 1e-2)[0];
        let window = (ship.transverse_wavelength() / raster.spacing).round() as usize;
        let mut edges = Vec::new();
        for start in (100..1000).step_by(50) {
            let amplitude = |i: usize| -> f64 {
                (start..start + window)
                    .map(|j| f64::from(field.at(i, j)).powi(2))
                    .sum()
            };
            let profile: Vec<f64> = (0..raster.rows).map(amplitude).collect();
            let peak = profile.iter().copied().fold(0.0, f64::max);
            let edge = profile.iter().position(|&p| p > 0.25 * peak).unwrap();
            edges.push([-raster.x(start + window / 2), raster.y(edge)]);
        }
        let n = edges.len() as f64;
        let mean = [0, 1].map(|axis| edges.iter().map(|e| e[axis]).sum::<f64>() / n);
        let covariance: f64 = edges
            .iter()
            .map(|e| (e[0] - mean[0]) * (e[1] - mean[1]))
            .sum();
        let variance: f64 = edges.iter().map(|e| (e[0] - mean[0]).powi(2)).sum();
        let angle = (covariance / variance).atan().to_degrees();
        assert!(
            (angle - KELVIN_ANGLE.to_degrees()).abs() < 1.0,
            "{speed} {angle}"
        );
    }
}

/// The plan states the longest and the shortest of its waves: around the ship, below and above the critical speed of 14 m/s, and
/// far astern at the cusp, where only waves of some 35° arrive.
#[test]
fn the_plan_names_its_longest_and_shortest_wave() {
    let raster = Raster::image(24, 24, 2.0);
    for (speed, depth, astern, port) in [
        (8.0, f64::INFINITY, 0.0, 0.0),
        (10.0, 20.0, 0.0, 0.0),
        (20.0, 20.0, 0.0, 0.0),
        (4.0, f64::INFINITY, 6000.0, 2120.0),
    ] {
        let wake = KelvinWake {
            depth,
            track: Track::new([astern, -port], 90.0, 0.0),
            ..scene_ship(speed, 90.0)
        };
        let plan = wake.plan(&raster, 1e-3);
        let waves = wake.waves(&plan);
        let [mut smallest, mut largest] = [f64::INFINITY, 0.0];
        for (x, y) in waves.kx.iter().zip(&waves.ky) {
            let k = x.hypot(*y);
            (smallest, largest) = (k.min(smallest), k.max(largest));
        }
        // Where the curve begins off the axis, with k = 0, the rounding of u shows.
        let allowed = if speed > 14.0 {
            1e-6 * largest
        } else {
            1e-12 * smallest
        };
        assert!((plan.wavenumbers[0] - smallest).abs() <= allowed, "{speed}");
        assert!(
            (plan.wavenumbers[1] / largest - 1.0).abs() < 1e-12,
            "{speed}"
        );
        assert!(largest <= raster.nyquist_wavenumber() * (1.0 + 1e-12));
        // λ² is 3/2 at the cusp, less where phases turn by some tens of radians.
        if astern > 0.0 {
            let longest = wake.steady_waves().at(0.0).wavenumber;
            assert!(
                (1.01..1.5).contains(&(smallest / longest)),
                "{}",
                smallest / longest
            );
        }
    }
}

/// Steepness k a of the envelope 500 m astern by another programme, for 195 × 26 × 10 m at 10 m/s; at one ship length it is
/// √(500/195) times that, apart from the factor |1 − 4 sinh²u/cosh 2u| that the limit omits. The amplitude that is left follows;
/// the long waves of the cusp keep most of theirs.
#[test]
fn steep_waves_break_and_long_ones_stay() {
    let limited = KelvinWake {
        steepness: Some(0.2),
        ..scene_ship(10.0, 0.0)
    };
    let shortest = GRAVITY / 100.0;
    let left = |length: f64| {
        let k = std::f64::consts::TAU / length;
        // α = ν cosh u of the steady wave of wavenumber ν cosh² u.
        limited.unbroken((shortest * k).sqrt(), k)
    };
    for (length, steepness) in [(2.0, 0.207), (1.0, 0.245), (0.2, 0.364)] {
        let squared = (std::f64::consts::TAU / length) / shortest;
        let factor = (4.0 * (squared - 1.0) / (2.0 * squared - 1.0) - 1.0f64).abs();
        let slope = steepness * (500.0f64 / 195.0).sqrt() * factor.sqrt();
        let expected = (1.0 + (slope / 0.2f64).powi(2)).powf(-0.5);
        // Three digits of the steepness.
        assert!(
            (left(length) / expected - 1.0).abs() < 0.01,
            "{length}: {} {expected}",
            left(length)
        );
    }
    // Two thirds of the transverse wavelength of 64 m.
    assert!(left(42.7) > 0.7, "{}", left(42.7));
    let free = scene_ship(10.0, 0.0);
    assert_eq!(free.unbroken(0.3, 1.0), 1.0);
    let direction = CUSP_ANGLE + 0.3;
    let ratio = limited.amplitude(direction).norm() / free.amplitude(direction).norm();
    let u = direction.tan().asinh();
    let k = shortest * u.cosh().powi(2);
    assert!((ratio - limited.unbroken(shortest * u.cosh(), k)).abs() < 1e-12);
}
