//! Echoes of many points with halo, cross and defocus.

use crate::small;
use wake_physics::{Field, Scene, expected_intensity, simulate};

/// A ship of 150 m at rest under Sentinel-1, 120 × 120 pixels of 7 m.
fn ship(more: &[&str]) -> Scene {
    let keys = [
        "radar.sensor=sentinel-1-iw",
        "grid.spacing=7",
        "ship.echo=true",
        "ship.length=150",
        "ship.speed=0",
        "ship.heading=20",
        "ship.roll=0.1",
    ];
    small(120, 120, &[&keys[..], more].concat())
}

/// The keys that make an echo one body, as the recipe `detector` draws them, with fewer points.
const BODY: [&str; 4] = [
    "ship.scatterers=100",
    "ship.roll_period=12",
    "ship.halo=-9",
    "radar.paired_echoes=-12",
];

/// Cross section of what the echo adds to the mean image \[m²\].
fn cross_section(scene: &Scene) -> f64 {
    let mut silent = scene.clone();
    silent.ships.clear();
    let [with, without] = [scene, &silent].map(|s| expected_intensity(s).unwrap());
    let pairs = with.values.iter().zip(&without.values);
    let sum: f64 = pairs.map(|(a, b)| f64::from(*a) - f64::from(*b)).sum();
    49.0 * sum
}

/// Pixels above 2.5 times the median amplitude, and those of the largest connected group of them.
fn bright(image: &Field) -> (usize, usize) {
    let mut sorted = image.values.clone();
    sorted.sort_by(f32::total_cmp);
    let threshold = 6.25 * sorted[sorted.len() / 2];
    let mut left: Vec<bool> = image.values.iter().map(|&v| v > threshold).collect();
    let count = left.iter().filter(|&&bright| bright).count();
    let mut largest = 0;
    while let Some(first) = left.iter().position(|&bright| bright) {
        let (mut waiting, mut size) = (vec![first], 0);
        left[first] = false;
        while let Some(at) = waiting.pop() {
            size += 1;
            let (i, j) = (at / image.columns, at % image.columns);
            for i in i.saturating_sub(1)..(i + 2).min(image.rows) {
                for j in j.saturating_sub(1)..(j + 2).min(image.columns) {
                    let at = i * image.columns + j;
                    if std::mem::take(&mut left[at]) {
                        waiting.push(at);
                    }
                }
            }
        }
        largest = largest.max(size);
    }
    (count, largest)
}

/// The same ship has the same cross section, whatever its echo is made of: less the halo beyond the image and the ends of the cross.
#[test]
fn a_body_has_the_cross_section_of_its_points() {
    for seed in 0..4 {
        let seed = format!("seed={seed}");
        let plain = cross_section(&ship(&[&seed]));
        let body = cross_section(&ship(&[&BODY[..], &[&seed]].concat()));
        // 420 m from the middle are 8 of the halo's larger scale, 44 m along and (R/V) 0.1 m/s: at most 1/8 of −9 dB lies beyond, 1.6 %.
        // The cross reaches 40 cells, 800 m: the half beyond has at most ln 2/ln 40 of −12 dB, 1.2 %.
        let lost = 1.0 - body / plain;
        assert!((-1e-3..0.028).contains(&lost), "{seed}: {lost}");
    }
}

/// Twelve points of a ship of 200 m are dots where a cell has 8 m, a body of as many cells is one blob: the share of the bright pixels
/// in the largest group, median of 8 ships with speckle.
#[test]
fn a_body_is_one_blob() {
    let fine = [
        "radar.sensor=terrasar-x-sm",
        "radar.range_resolution=8",
        "radar.azimuth_resolution=8",
        "radar.looks=6",
        "grid.spacing=3",
        "ship.length=200",
        "grid.oversampling=2",
        "model.tolerance=0.05",
    ];
    let medians = |more: &[&str]| {
        let mut found: Vec<(usize, f64)> = (0..8)
            .map(|seed| {
                let seed = format!("seed={seed}");
                let keys = [&fine[..], &[&*seed], more].concat();
                let mut scene = ship(&keys);
                (scene.grid.rows, scene.grid.columns) = (160, 160);
                let image = simulate(&scene).unwrap();
                let (count, largest) = bright(&image.speckled);
                (count, largest as f64 / count.max(1) as f64)
            })
            .collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let share = found[4].1;
        found.sort_by_key(|ship| ship.0);
        (found[4].0, share)
    };
    let ((few, dots), (pixels, body)) = (medians(&[]), medians(&BODY));
    // The hull and a cell around it, (200 + 8) × (26 + 8) m in pixels of 9 m²: 786. Speckle and unequal points leave a third of it, halo
    // and smear make twice as much.
    assert!(
        body > 0.75 && dots < 0.65 && (260..=1570).contains(&pixels),
        "{dots} of {few}, {body} of {pixels}"
    );
}
