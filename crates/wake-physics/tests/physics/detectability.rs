//! Published trends of the detectability of wakes, on a grid of scenes by their labels.
//!
//! On TerraSAR-X images with ships known by AIS, wakes are detected more often behind longer and faster ships, on courses along the
//! flight, at low incidence and in weak wind (Tings and Velotto 2018, Int. J. Remote Sens. 39; Tings 2021, Remote Sens. 13, 165).

use wake_physics::labels::WakeLabel;
use wake_physics::{Scene, expected_intensity, labels_of};

/// Values of the grid, ascending.
const WIND: [f64; 4] = [3.0, 5.0, 8.0, 11.0];
const SPEED: [f64; 3] = [4.0, 7.0, 11.0];
const LENGTH: [f64; 3] = [50.0, 110.0, 230.0];
const HEADING: [f64; 3] = [0.0, 45.0, 90.0];
const INCIDENCE: [f64; 3] = [24.0, 33.0, 42.0];

/// One scene of the grid: places of its values, and how far its wake is seen \[pixels\].
struct Seen {
    places: [usize; 5],
    whole: f64,
    arms: f64,
}

fn scene(places: [usize; 5]) -> Scene {
    let [wind, speed, length, heading, incidence] = places;
    let length = LENGTH[length];
    let keys = [
        "grid.rows=400".to_owned(),
        "grid.columns=400".to_owned(),
        "radar.sensor=terrasar-x-sm".to_owned(),
        "grid.spacing=4".to_owned(),
        "radar.range_resolution=8".to_owned(),
        "radar.azimuth_resolution=8".to_owned(),
        "radar.looks=4".to_owned(),
        "radar.nesz=-24".to_owned(),
        "sea.breaking=true".to_owned(),
        format!("sea.wind_speed={}", WIND[wind]),
        // Across and along the courses, between them.
        "sea.wind_toward=60".to_owned(),
        format!("radar.incidence={}", INCIDENCE[incidence]),
        format!("ship.length={length}"),
        format!("ship.beam={}", 0.14 * length),
        format!("ship.draft={}", 0.05 * length),
        format!("ship.speed={}", SPEED[speed]),
        format!("ship.heading={}", HEADING[heading]),
        "ship.recovery=wind".to_owned(),
        "ship.steepness=0.2".to_owned(),
        "ship.edge=true".to_owned(),
        "ship.edge_time=300".to_owned(),
    ];
    Scene::default().with_assignments(&keys).expect("a scene")
}

/// How far arms are seen \[pixels\]: their longest line.
fn arms(wake: &WakeLabel) -> f64 {
    let length = |line: &Vec<[f64; 2]>| match (line.first(), line.last()) {
        (Some(a), Some(b)) => (a[0] - b[0]).hypot(a[1] - b[1]),
        _ => 0.0,
    };
    wake.arms_px.iter().map(length).fold(0.0, f64::max)
}

fn grid() -> Vec<Seen> {
    let mut all = Vec::new();
    let counts = [
        WIND.len(),
        SPEED.len(),
        LENGTH.len(),
        HEADING.len(),
        INCIDENCE.len(),
    ];
    for n in 0..counts.iter().product() {
        let mut left: usize = n;
        let places = counts.map(|count| {
            let place = left % count;
            left /= count;
            place
        });
        let labels = labels_of(&scene(places));
        let wake = &labels.ships[0].wake;
        all.push(Seen {
            places,
            whole: wake.length_px,
            arms: arms(wake),
        });
    }
    all
}

/// Means of a figure by the values of one axis of the grid.
fn means(grid: &[&Seen], axis: usize, count: usize, figure: impl Fn(&Seen) -> f64) -> Vec<f64> {
    let mean = |place: usize| {
        let chosen: Vec<f64> = grid
            .iter()
            .filter(|seen| seen.places[axis] == place)
            .map(|seen| figure(seen))
            .collect();
        chosen.iter().sum::<f64>() / chosen.len() as f64
    };
    (0..count).map(mean).collect()
}

fn falls(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] <= pair[0] + 1e-9) && values[0] > values[values.len() - 1]
}

fn rises(values: &[f64]) -> bool {
    let turned: Vec<f64> = values.iter().rev().copied().collect();
    falls(&turned)
}

/// The whole wake and the Kelvin arms, each by every value of the grid, means over all others. A share is that of scenes in which
/// anything is seen.
#[test]
fn visibility_follows_the_published_trends() {
    let grid = grid();
    let all: Vec<&Seen> = grid.iter().collect();
    let of = |axis: usize, count: usize| {
        let share = means(&all, axis, count, |seen| {
            f64::from(u8::from(seen.whole > 0.0))
        });
        let whole = means(&all, axis, count, |seen| seen.whole);
        let arms = means(&all, axis, count, |seen| seen.arms);
        (share, whole, arms)
    };
    let (share, whole, arms) = of(0, WIND.len());
    assert!(
        falls(&share) && falls(&whole) && falls(&arms),
        "wind: {share:?} {whole:?} {arms:?}"
    );
    let (share, whole, arms) = of(1, SPEED.len());
    assert!(
        rises(&share) && rises(&whole) && rises(&arms),
        "speed: {share:?} {whole:?} {arms:?}"
    );
    // The share of scenes in which anything is seen does not rise with the length of the ship: a known difference.
    let (share, whole, arms) = of(2, LENGTH.len());
    println!("share of visible wakes by length of the ship: {share:.2?}");
    assert!(rises(&whole) && rises(&arms), "length: {whole:?} {arms:?}");
}

/// Largest ratio of the expected intensity to the sea on the arms, 12 to 21° off the track, and in the middle, within 6°, means over
/// 300 to 1200 m astern of midship.
fn arms_and_centre(keys: &[&str], heading: f64) -> [f64; 2] {
    const STEPS: i32 = 48;
    let common = [
        "grid.rows=320",
        "grid.columns=320",
        "radar.sensor=sentinel-1-iw",
        "grid.spacing=8",
        "radar.incidence=35",
        "sea.wind_speed=5",
        "ship.length=150",
        "ship.beam=22",
        "ship.draft=8",
        "ship.speed=9",
        "ship.damping=0",
    ];
    let (sin, cos) = heading.to_radians().sin_cos();
    let mut scene = Scene::default()
        .with_assignments(&[&common[..], keys].concat())
        .expect("a scene");
    scene.ships[0].heading = heading;
    scene.ships[0].position = [900.0 * sin, 900.0 * cos];
    let image = expected_intensity(&scene).expect("an image");
    let mut open = scene.clone();
    open.ships.clear();
    let level = expected_intensity(&open).expect("an image").mean();
    let ratio = |degrees: f64| {
        let tangent = degrees.to_radians().tan();
        let places: Vec<f64> = (0..=90)
            .map(|n| {
                let (astern, aside) = (300.0 + 10.0 * f64::from(n), 0.0);
                let aside = aside + tangent * astern;
                let x = 900.0 * sin - astern * sin + aside * cos;
                let y = 900.0 * cos - astern * cos - aside * sin;
                let (row, column) = (160.0 - y / 8.0, 160.0 + x / 8.0);
                f64::from(image.at(row.round() as usize, column.round() as usize)) / level
            })
            .collect();
        places.iter().sum::<f64>() / places.len() as f64
    };
    let mut found = [0.0f64; 2];
    for n in -STEPS..=STEPS {
        let degrees = 0.5 * f64::from(n);
        let place = match degrees.abs() {
            at if (12.0..=21.0).contains(&at) => 0,
            at if at <= 6.0 => 1,
            _ => continue,
        };
        found[place] = found[place].max(ratio(degrees));
    }
    found
}

/// A thin ship's short waves make the middle of the wedge brighter than any that was measured. A limit of their slopes lowers the
/// middle as a filter of their lengths does, and keeps more of the arms.
#[test]
fn breaking_lowers_the_middle_and_keeps_the_arms() {
    for heading in [0.0, 40.0] {
        let free = arms_and_centre(&[], heading);
        let filtered = arms_and_centre(&["ship.filter_depth=2"], heading);
        let broken = arms_and_centre(&["ship.steepness=0.2"], heading);
        let more = arms_and_centre(&["ship.steepness=0.1"], heading);
        println!(
            "{heading}: free {free:.2?}, filtered {filtered:.2?}, slopes 0.2 {broken:.2?}, 0.1 {more:.2?}"
        );
        assert!(broken[1] < free[1] && more[1] < broken[1], "{heading}");
        assert!(
            broken[0] > filtered[0],
            "{heading}: {broken:?} {filtered:?}"
        );
    }
}
