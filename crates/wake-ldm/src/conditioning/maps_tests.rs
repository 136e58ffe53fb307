//! The maps against the simulator, which sums the ship's waves without any stationary phase.

use wake_physics::scene::{Model, Ship, Term, Terms};
use wake_physics::{Scene, simulate};

use super::*;

const GRID: MapGrid = MapGrid {
    size: 128,
    spacing: 4.0,
};

fn known(speed: f64, heading: f64, position: [f64; 2]) -> Conditions {
    Conditions {
        ship: Some(true),
        ship_speed: Some(speed),
        ship_heading: Some(heading),
        ship_position: Some(position),
        ..Conditions::default()
    }
}

/// The simulator's elevation of the wake alone.
fn elevation(speed: f64, heading: f64, position: [f64; 2]) -> Vec<f32> {
    let mut scene = Scene {
        ship: Some(Ship {
            speed,
            heading,
            position,
            ..Ship::default()
        }),
        model: Model {
            terms: Terms::List(vec![Term::Kelvin]),
            ..Model::default()
        },
        ..Scene::default()
    };
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) =
        (GRID.size, GRID.size, GRID.spacing);
    simulate(&scene).unwrap().elevation.values
}

/// The phase maps as images, `[WAVES, size, size]`.
fn images(conditions: &Conditions) -> Vec<f32> {
    let cells = GRID.cells();
    let squares = wave_squares(conditions, GRID, &cells);
    let (coarse, pixels) = (GRID.size / PATCH, PATCH * PATCH);
    let at = |i: usize| {
        let (map, p) = (i / (GRID.size * GRID.size), i % (GRID.size * GRID.size));
        let (row, column) = (p / GRID.size, p % GRID.size);
        let cell = row / PATCH * coarse + column / PATCH;
        let pixel = row % PATCH * PATCH + column % PATCH;
        squares[(cell * WAVES + map) * pixels + pixel]
    };
    (0..WAVES * GRID.size * GRID.size).map(at).collect()
}

/// Correlation of a field with the best sum of columns, by the normal equations.
fn best_correlation(columns: &[Vec<f64>], field: &[f64]) -> f64 {
    let n = columns.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = columns.iter().map(|c| dot(&columns[i], c)).collect();
            // Keeps columns that are zero here from dividing by it.
            row[i] = row[i] * (1.0 + 1e-9) + 1e-9;
            row.push(dot(&columns[i], field));
            row
        })
        .collect();
    for i in 0..n {
        let pivot = rows[i].clone();
        for row in rows
            .iter_mut()
            .enumerate()
            .filter(|(k, _)| *k != i)
            .map(|(_, row)| row)
        {
            let factor = row[i] / pivot[i];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(x, p)| *x -= factor * p);
        }
    }
    let sum: Vec<f64> = (0..field.len())
        .map(|p| {
            (0..n)
                .map(|i| rows[i][n] / rows[i][i] * columns[i][p])
                .sum()
        })
        .collect();
    dot(&sum, field) / (dot(&sum, &sum) * dot(field, field)).sqrt()
}

/// Inside the wedge behind the stern, where the stationary phase holds.
fn wedge(conditions: &Conditions) -> Vec<usize> {
    let (_, heading, position) = conditions.track().unwrap();
    let (sin, cos) = heading.to_radians().sin_cos();
    let frame = Frame {
        forward: [sin, cos],
        position,
        wavenumber: 1.0,
    };
    let inside = |p: &usize| {
        let [along, across] = frame.seen_from_ship(GRID.place(p / GRID.size, p % GRID.size, 0.0));
        let behind = -along - 0.5 * SHIP_LENGTH;
        behind > 0.0 && 8f64.sqrt() * across.abs() < behind
    };
    (0..GRID.size * GRID.size).filter(inside).collect()
}

#[test]
fn a_sum_of_the_maps_is_nearly_the_simulators_wake() {
    for (speed, heading, position) in [
        (8.0, 30.0, [100.0, 150.0]),
        (10.0, 225.0, [-150.0, -100.0]),
        (11.5, 110.0, [180.0, 0.0]),
        (7.0, 300.0, [-180.0, 60.0]),
    ] {
        let conditions = known(speed, heading, position);
        let pixels = wedge(&conditions);
        assert!(pixels.len() > 500, "{} pixels", pixels.len());
        let chosen =
            |values: &[f32]| -> Vec<f64> { pixels.iter().map(|&p| f64::from(values[p])).collect() };
        let field = chosen(&elevation(speed, heading, position));
        let columns = |conditions: &Conditions| -> Vec<Vec<f64>> {
            images(conditions)
                .chunks(GRID.size * GRID.size)
                .take(OSCILLATING)
                .map(chosen)
                .collect()
        };
        // The wake of a hull is the sum of waves from bow and stern, each with an amplitude that varies slowly
        // over the wedge: a sum with constant factors misses little.
        assert!(field.iter().all(|x| x.is_finite()));
        let correlation = best_correlation(&columns(&conditions), &field);
        assert!(
            correlation > 0.9,
            "{speed} m/s toward {heading}: {correlation}"
        );
        // Crests of another speed stand elsewhere.
        let other = best_correlation(&columns(&known(1.2 * speed, heading, position)), &field);
        assert!(other < 0.6, "{speed} m/s toward {heading}: {other}");
    }
}

#[test]
fn no_track_no_maps() {
    let unknown = [
        Conditions::default(),
        known(0.0, 10.0, [0.0, 0.0]),
        Conditions {
            ship_heading: None,
            ..known(8.0, 0.0, [0.0, 0.0])
        },
        Conditions {
            ship: Some(false),
            ..known(8.0, 0.0, [0.0, 0.0])
        },
    ];
    for conditions in unknown {
        let mut maps = images(&conditions);
        maps.extend(places(&conditions, GRID, &GRID.cells()));
        assert!(maps.iter().all(|x| x.abs() < f32::MIN_POSITIVE));
    }
}

#[test]
fn maps_are_finite_and_move_with_the_ship() {
    let shift = [8.0 * GRID.spacing, -16.0 * GRID.spacing];
    let (here, there) = (known(9.0, 70.0, [0.0, 0.0]), known(9.0, 70.0, shift));
    let [a, b] = [&here, &there].map(images);
    let places = places(&here, GRID, &GRID.cells());
    // The largest numbers are ten times the largest wavenumber shown, one wave on two pixels.
    let largest = 10.0 * 2.0 * std::f64::consts::FRAC_PI_2 / GRID.spacing;
    let bounded = |x: &f32| f64::from(x.abs()) <= largest;
    assert!(a.iter().chain(&places).all(bounded));
    for map in 0..WAVES {
        for (row, column) in [(64, 40), (70, 50), (60, 20), (90, 10)] {
            let at = |maps: &[f32], row: usize, column: usize| {
                maps[(map * GRID.size + row) * GRID.size + column]
            };
            // Eight pixels away in range and sixteen toward smaller azimuth, so further down.
            let difference = at(&a, row, column) - at(&b, row + 16, column + 8);
            assert!(difference.abs() < 1e-4, "map {map}: {difference}");
        }
    }
}

#[test]
fn the_cusp_wave_is_smooth_across_the_edge_of_the_wedge_and_fades_outside() {
    let frame = Frame {
        forward: [0.0, 1.0],
        position: [0.0, 0.0],
        wavenumber: 0.1,
    };
    let (x, edge) = (400.0, 400.0 / 8f64.sqrt());
    let envelope = |across: f64| {
        let cusp = frame.cusp([-x, across], 4.0).unwrap();
        cusp.envelope * airy(-cusp.zeta)
    };
    let value = |across: f64| {
        let cusp = frame.cusp([-x, across], 4.0).unwrap();
        envelope(across) * cusp.phase.cos()
    };
    // Value and slope agree on both sides: differences over h on the left and on the right differ by O(h).
    let h = 0.5;
    let (left, right) = (value(edge) - value(edge - h), value(edge + h) - value(edge));
    assert!(
        (left - right).abs() < 0.1 * left.abs().max(right.abs()),
        "{left} {right}"
    );
    assert!(
        envelope(edge + 60.0) < 0.1 * envelope(edge),
        "{}",
        envelope(edge + 60.0)
    );
    assert!(value(-edge) - value(edge) < 1e-12);
}
