use wake_physics::Raster;
use wake_physics::measure::{ShipPlace, kelvin_wedge};

use super::*;

const GRID: MapGrid = MapGrid {
    size: 128,
    spacing: 4.0,
};

/// Length of the ship in the paper's grid.
const SHIP_LENGTH: f64 = 195.0;

fn known(speed: f64, heading: f64, position: [f64; 2]) -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) =
        (GRID.size, GRID.size, GRID.spacing);
    scene.ships = vec![Ship {
        speed,
        heading,
        position,
        length: SHIP_LENGTH,
        ..Ship::default()
    }];
    scene
}

#[test]
fn no_track_no_maps() {
    let mut open = known(8.0, 0.0, [0.0, 0.0]);
    open.ships.clear();
    for scene in [known(0.0, 10.0, [0.0, 0.0]), open] {
        let maps = places(&scene, &GRID.cells());
        assert_eq!(maps.len(), PLACES * GRID.cells().len());
        assert!(maps.iter().all(|x| x.abs() < f32::MIN_POSITIVE));
    }
}

/// Doubling all distances and the side of a pixel leaves the maps unchanged; each wedge uses the frame of its own ship.
#[test]
fn maps_count_pixels_and_know_every_ship() {
    let near = known(9.0, 70.0, [40.0, -30.0]);
    let mut far = near.clone();
    far.grid.spacing *= 2.0;
    let ship = &mut far.ships[0];
    (ship.position, ship.length) = ([80.0, -60.0], 2.0 * SHIP_LENGTH);
    let [a, b] = [&near, &far].map(|scene| places(scene, &GRID.cells()));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-5));
    let [one, other] = [(30.0, [100.0, 150.0]), (30.0, [-150.0, 150.0])]
        .map(|(heading, position)| known(8.0, heading, position));
    let mut both = one.clone();
    both.ships.extend(other.ships.clone());
    let cells = GRID.cells();
    let [one, other, both] = [&one, &other, &both].map(|scene| places(scene, &cells));
    let inside = |maps: &[f32], cell: usize| maps[WEDGE * cells.len() + cell] > 0.5;
    let mut seen = [0, 0];
    for &cell in &cells {
        let of = |maps: &[f32]| -> Vec<f32> {
            (0..PLACES)
                .map(|map| maps[map * cells.len() + cell])
                .collect()
        };
        match [inside(&one, cell), inside(&other, cell)] {
            [true, false] => {
                assert_eq!(of(&both), of(&one));
                seen[0] += 1;
            }
            [false, true] => {
                assert_eq!(of(&both), of(&other));
                seen[1] += 1;
            }
            _ => {}
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}

#[test]
fn maps_are_bounded_and_move_with_the_ship() {
    // Three latent pixels to the right in range, and two toward smaller azimuth, which is down.
    let shift = [3.0, -2.0].map(|n| n * PATCH_SIZE as f64 * GRID.spacing);
    let coarse = GRID.size / PATCH_SIZE;
    let [a, b] =
        [[0.0, 0.0], shift].map(|position| places(&known(9.0, 70.0, position), &GRID.cells()));
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
    let coarse = GRID.size / PATCH_SIZE;
    for (heading, position) in [(30.0, [100.0, 150.0]), (250.0, [120.0, 10.0])] {
        let maps = places(&known(8.0, heading, position), &GRID.cells());
        let ship = ShipPlace {
            position,
            length: SHIP_LENGTH,
            depth: f64::INFINITY,
        };
        let inside = kelvin_wedge(&raster, &ship, heading, 8.0);
        for cell in GRID.cells() {
            let (row, column) = (cell / coarse * PATCH_SIZE, cell % coarse * PATCH_SIZE);
            let pixels = (0..PATCH_SIZE * PATCH_SIZE)
                .map(|p| (row + p / PATCH_SIZE, column + p % PATCH_SIZE));
            let count = pixels.filter(|(i, j)| inside[i * GRID.size + j]).count();
            let ours = maps[WEDGE * coarse * coarse + cell] > 0.5;
            // The map is evaluated at the centre of a square.
            if count == 0 || count == PATCH_SIZE * PATCH_SIZE {
                assert_eq!(ours, count > 0, "heading {heading}, square {cell}");
            }
        }
    }
}

/// The bow of a short ship is nearer to midship, and the wedge begins there.
#[test]
fn the_wedge_begins_at_the_bow_of_the_ship() {
    let middle = |length: f64| {
        let mut short = known(9.0, 0.0, [0.0, 0.0]);
        short.ships[0].length = length;
        let frame = Frame::of(&short.ships[0], &short).unwrap();
        let edge = |across: f64, astern: f64| frame.places([-astern, across])[WEDGE];
        // On the edge of the wedge |η| = tan(ψ)(L/2 − ξ), slightly inside and outside.
        let at = |astern: f64| (astern + 0.5 * length) / 8f64.sqrt();
        (edge(0.99 * at(300.0), 300.0), edge(1.01 * at(300.0), 300.0))
    };
    for length in [60.0, 195.0, 300.0] {
        assert_eq!(middle(length), (1.0, 0.0), "{length} m");
    }
}
