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

/// The keys of the recipe `detector`, in the middle of their ranges.
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

/// Pixels above 2.5 times the median amplitude, and the number of connected groups of at least two of them.
fn bright(image: &Field) -> (usize, usize) {
    let mut sorted = image.values.clone();
    sorted.sort_by(f32::total_cmp);
    let threshold = 6.25 * sorted[sorted.len() / 2];
    let mut left: Vec<bool> = image.values.iter().map(|&v| v > threshold).collect();
    let count = left.iter().filter(|&&bright| bright).count();
    let mut groups = 0;
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
        groups += usize::from(size > 1);
    }
    (count, groups)
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

/// Twelve points are several dots, a body is one: 16 ships, with speckle.
#[test]
fn a_body_is_one_blob() {
    let (mut whole, mut dots, mut pixels) = (0, 0, Vec::new());
    for seed in 0..16 {
        let seed = format!("seed={seed}");
        let of = |more: &[&str]| {
            let image = simulate(&ship(&[&[&*seed], more].concat())).unwrap();
            bright(image.speckled())
        };
        dots += usize::from(of(&[]).1 > 1);
        let (count, groups) = of(&BODY);
        whole += usize::from(groups == 1);
        pixels.push(count);
    }
    pixels.sort_unstable();
    assert!(whole >= 10 && dots >= 8, "{whole} {dots} {pixels:?}");
    // The ship and a resolution cell around it: (150 + 20) × (26 + 20) m and the smear of two standard deviations of 12 m, in
    // pixels of 49 m², is 220; half of it to twice as much, the strongest with their halo.
    let median = pixels[8];
    assert!((110..=440).contains(&median), "{pixels:?}");
}
