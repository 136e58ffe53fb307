use wake_physics::Raster;
use wake_physics::measure::{ShipPlace, kelvin_wedge};

use super::*;

const GRID: MapGrid = MapGrid {
    size: 128,
    spacing: 4.0,
};

/// The ship of the paper's grid.
const SHIP_LENGTH: f64 = 195.0;

fn known(speed: f64, heading: f64, position: [f64; 2]) -> Conditions {
    Conditions {
        ship: Some(true),
        ship_speed: Some(speed),
        ship_heading: Some(heading),
        ship_position: Some(position),
        ship_length: Some(SHIP_LENGTH),
        ..Conditions::default()
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
        let maps = places(&conditions, GRID, &GRID.cells());
        assert!(maps.iter().all(|x| x.abs() < f32::MIN_POSITIVE));
    }
}

#[test]
fn maps_are_bounded_and_move_with_the_ship() {
    // Three latent pixels to the right in range and two toward smaller azimuth, so down.
    let shift = [3.0, -2.0].map(|n| n * PATCH as f64 * GRID.spacing);
    let coarse = GRID.size / PATCH;
    let [a, b] = [[0.0, 0.0], shift]
        .map(|position| places(&known(9.0, 70.0, position), GRID, &GRID.cells()));
    assert!(a.iter().chain(&b).all(|x| x.abs() <= 1.5));
    for map in 0..PLACES {
        for (row, column) in [(8, 5), (9, 7), (7, 2), (11, 1)] {
            let at = |maps: &[f32], row: usize, column: usize| {
                maps[(map * coarse + row) * coarse + column]
            };
            let difference = at(&a, row, column) - at(&b, row + 2, column + 3);
            assert!(difference.abs() < 1e-6, "map {map}: {difference}");
        }
    }
}

#[test]
fn the_wedge_is_that_of_the_simulators_measurements() {
    let raster = Raster::image(GRID.size, GRID.size, GRID.spacing);
    let coarse = GRID.size / PATCH;
    for (heading, position) in [(30.0, [100.0, 150.0]), (250.0, [120.0, 10.0])] {
        let maps = places(&known(8.0, heading, position), GRID, &GRID.cells());
        let ship = ShipPlace {
            position,
            length: SHIP_LENGTH,
            depth: f64::INFINITY,
        };
        let inside = kelvin_wedge(&raster, &ship, heading, 8.0);
        for cell in GRID.cells() {
            let (row, column) = (cell / coarse * PATCH, cell % coarse * PATCH);
            let pixels = (0..PATCH * PATCH).map(|p| (row + p / PATCH, column + p % PATCH));
            let count = pixels.filter(|(i, j)| inside[i * GRID.size + j]).count();
            let ours = maps[WEDGE * coarse * coarse + cell] > 0.5;
            // The map says where the middle of a square lies.
            if count == 0 || count == PATCH * PATCH {
                assert_eq!(ours, count > 0, "heading {heading}, square {cell}");
            }
        }
    }
}

/// The bow of a short ship lies nearer, and the wedge begins there.
#[test]
fn the_wedge_begins_at_the_bow_of_the_ship() {
    let middle = |length: f64| {
        let short = Conditions {
            ship_length: Some(length),
            ..known(9.0, 0.0, [0.0, 0.0])
        };
        let frame = Frame::of(&short).unwrap();
        let edge = |across: f64, astern: f64| frame.places([-astern, across])[WEDGE];
        // On the edge of the wedge |η| = tan(ψ)(L/2 − ξ), a little inside and outside.
        let at = |astern: f64| (astern + 0.5 * length) / 8f64.sqrt();
        (edge(0.99 * at(300.0), 300.0), edge(1.01 * at(300.0), 300.0))
    };
    for length in [60.0, 195.0, 300.0] {
        assert_eq!(middle(length), (1.0, 0.0), "{length} m");
    }
}
