//! Training images and their wakes.

use wake_dataset::Pair;
use wake_physics::Scene;
use wake_physics::labels::{Class, Object, independent_pixel};
use wake_physics::measure::angle_between;

use super::draw::Draw;
use wake_detector::GreyImage;
use wake_detector::Wake;

/// An image with its wakes.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Rows and columns of a square image.
    pub size: usize,
    /// Grey levels from 0 to 255, row by row.
    pub pixels: Vec<f32>,
    /// All wakes, including weak ones.
    pub wakes: Vec<Wake>,
}

/// Width of a wake's line, in independent pixels.
const LINE: f64 = 16.0;
/// Length, in independent pixels, and signal-to-noise ratio assumed for a ship's wake without a label: between wakes that count and open
/// sea, so that it is ignored.
const UNSURE: (f64, f32) = (80.0, 3.0);
/// Largest turn of a ship over half of its wake's line \[rad\] (chosen).
const CHORD: f64 = 1.0;

impl Sample {
    /// Sample of a pair with a square image.
    #[must_use]
    pub fn of_pair(pair: &Pair) -> Self {
        Self {
            size: pair.image.rows,
            pixels: pair.image.levels().into_iter().map(f32::from).collect(),
            wakes: wakes(&pair.labels.objects(), &pair.scene),
        }
    }

    /// The image alone.
    #[must_use]
    pub fn image(&self) -> GreyImage {
        GreyImage::from_levels(self.size, self.size, &self.pixels)
    }

    /// Mirrors the sample, or exchanges its rows and columns, at random, as in other imaging geometries.
    pub(crate) fn turned(self, draw: &mut Draw) -> Self {
        let size = self.size;
        let [exchange, left_right] = [draw.chance(0.5), draw.chance(0.5)];
        let last = size as f32 - 1.0;
        let (mut pixels, mut wakes) = (self.pixels, self.wakes);
        if exchange {
            pixels = (0..size * size)
                .map(|i| pixels[i % size * size + i / size])
                .collect();
            for wake in &mut wakes {
                wake.tip.reverse();
                // Right becomes down, and up becomes left.
                wake.axis_deg = (270.0 - wake.axis_deg).rem_euclid(360.0);
            }
        }
        if left_right {
            pixels.chunks_exact_mut(size).for_each(<[f32]>::reverse);
            for wake in &mut wakes {
                wake.tip[0] = last - wake.tip[0];
                wake.axis_deg = (-wake.axis_deg).rem_euclid(360.0);
            }
        }
        Self {
            size,
            pixels,
            wakes,
        }
    }
}

/// The wakes of a scene: those with labels, and uncertain ones of all other ships under way.
///
/// A wake's line begins at the stern. Behind a turning ship, its axis is the chord to the middle of the visible line, at most
/// [`CHORD`] of the turn away. A scene without ships belongs to a painted image, whose wakes are the objects alone.
pub(crate) fn wakes(objects: &[Object], scene: &Scene) -> Vec<Wake> {
    let mut seen: Vec<&Object> = objects.iter().filter(|o| o.class == Class::Wake).collect();
    let grid = &scene.grid;
    // The origin lies at a pixel's centre; azimuth grows upward.
    let middle = [(grid.columns / 2) as f64, (grid.rows / 2) as f64];
    let pixel = |[x, y]: [f64; 2]| [middle[0] + x / grid.spacing, middle[1] - y / grid.spacing];
    let mut wakes = Vec::new();
    for ship in scene.ships.iter().filter(|ship| ship.speed > 0.0) {
        let track = ship.track(scene.sea.time);
        let astern = heading(track.forward.map(|x| -x));
        let hull = ship.length / grid.spacing;
        let label = seen
            .iter()
            .position(|o| angle_between(o.axis_deg, astern).abs() < 1e-6);
        let object = label.map(|at| seen.swap_remove(at));
        let half_angle = object.map_or(0.0, |o| o.half_angle_deg);
        let (length, snr) = match object {
            Some(object) => ((object.length_px - hull).max(LINE), line_snr(object, scene)),
            None => (UNSURE.0 * independent_pixel(scene), UNSURE.1),
        };
        let stern = track.at(-0.5 * ship.length);
        let half = 0.5 * length * grid.spacing;
        let there = stern.at(-half.min(CHORD / stern.curvature.abs())).position;
        let axis = heading([0, 1].map(|a| there[a] - stern.position[a]));
        wakes.push(Wake {
            tip: pixel(stern.position).map(|x| x as f32),
            axis_deg: axis as f32,
            half_angle_deg: half_angle as f32,
            length: length as f32,
            snr,
            contrast_db: object.and_then(|o| Some(o.visibility?.contrast_db as f32)),
        });
    }
    wakes.extend(seen.into_iter().map(|object| painted(object, scene)));
    wakes
}

/// Direction of a vector (x, y) [deg clockwise from +y], 0 up to 360.
fn heading([x, y]: [f64; 2]) -> f64 {
    x.atan2(y).to_degrees().rem_euclid(360.0)
}

/// Wake without a ship in the scene; its box begins at its tip.
fn painted(object: &Object, scene: &Scene) -> Wake {
    let [port, starboard, ..] = object.oriented_box_px;
    let tip = [0, 1].map(|a| 0.5 * (port[a] + starboard[a]));
    Wake {
        tip: object.tip.unwrap_or(tip).map(|x| x as f32),
        axis_deg: object.axis_deg as f32,
        half_angle_deg: object.half_angle_deg as f32,
        length: object.length_px as f32,
        snr: line_snr(object, scene),
        contrast_db: None,
    }
}

/// Signal-to-noise ratio of the whole line, from a pixel's.
///
/// ```text
/// snr √(length · width),   both in independent pixels
/// ```
fn line_snr(object: &Object, scene: &Scene) -> f32 {
    let length = object.length_px / independent_pixel(scene);
    let snr = object.visibility.map_or(f64::INFINITY, |v| v.snr);
    (snr * (length * LINE).sqrt()) as f32
}

/// Signal-to-noise ratio of a pixel from the line's, the inverse of [`line_snr`] for uncorrelated pixels.
pub(crate) fn pixel_snr(line: f32, length: f32) -> f64 {
    f64::from(line) / (f64::from(length) * LINE).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turned images keep their labels: the pixel of a tip is the same one.
    #[test]
    fn a_turned_image_has_turned_labels() {
        let size = 32;
        for seed in 0..8 {
            let mut pixels = vec![0.0; size * size];
            (pixels[5 * size + 9], pixels[5 * size + 12]) = (200.0, 100.0);
            let wake = Wake {
                tip: [9.0, 5.0],
                axis_deg: 90.0,
                half_angle_deg: 1.0,
                length: 3.0,
                snr: 9.0,
                contrast_db: None,
            };
            let sample = Sample {
                size,
                pixels,
                wakes: vec![wake],
            };
            let turned = sample.turned(&mut Draw::new(seed, 1));
            let grey =
                |[x, y]: [f32; 2]| turned.pixels[y.round() as usize * size + x.round() as usize];
            let wake = turned.wakes[0];
            assert!(
                grey(wake.tip) > 150.0 && (grey(wake.at(3.0)) - 100.0).abs() < 1.0,
                "{wake:?}"
            );
        }
    }

    /// A scene's wake begins at the stern and runs astern, with a label or without; the signal-to-noise ratio of a labelled one
    /// grows with its length, and is lower for correlated pixels.
    #[test]
    fn wakes_of_a_scene_begin_at_the_stern() {
        let changes = [
            "ship.heading=90",
            "ship.length=200",
            "ship.position=[100, -50]",
            "ship.speed=8",
            "grid.spacing=10",
            "radar.looks=50",
        ];
        let scene = Scene::default()
            .with_assignments(&changes)
            .expect("a scene");
        let seen = wakes(&wake_physics::labels_of(&scene).objects(), &scene);
        let [wake] = seen[..] else {
            panic!("{seen:?}");
        };
        // 512 pixels around pixel 256; the stern lies 100 m left of midship, azimuth grows upward.
        assert!((wake.tip[0] - 256.0).abs() < 1e-3 && (wake.tip[1] - 261.0).abs() < 1e-3);
        assert!(
            (wake.axis_deg - 270.0).abs() < 1e-4 && wake.snr > 5.0,
            "{wake:?}"
        );
        assert!(wake.contrast_db.is_some_and(|db| db > 0.1));
        let unseen = wakes(&[], &scene)[0];
        assert_eq!((unseen.tip, unseen.axis_deg), (wake.tip, wake.axis_deg));
        assert_eq!((f64::from(unseen.length), unseen.snr), UNSURE);
        let object = wake_physics::labels_of(&scene).objects()[0];
        let mut correlated = scene.clone();
        correlated.radar.range_resolution = Some(40.0);
        correlated.radar.azimuth_resolution = 20.0;
        // Eight pixels of ten metres count as one: the line is √8 times shorter in independent pixels.
        let ratio = line_snr(&object, &scene) / line_snr(&object, &correlated);
        assert!((ratio - 8f32.powf(0.25)).abs() < 1e-4, "{ratio}");
        // The same image with twice as many pixels has the same line.
        let mut finer = correlated.clone();
        finer.grid.spacing = 5.0;
        let twice = Object {
            length_px: 2.0 * object.length_px,
            ..object
        };
        let ratio = line_snr(&twice, &finer) / line_snr(&object, &correlated);
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        let longer = wakes(&[], &finer)[0].length / wakes(&[], &correlated)[0].length;
        assert!((longer - 2.0).abs() < 1e-6, "{longer}");
    }

    /// A ship is followed back along its circle in small steps, from its place after a while: its wake begins at the stern, and
    /// its axis passes where the line is half as long, or where the ship has turned by the largest angle. A label is found by the
    /// direction at the ship.
    #[test]
    fn the_axis_behind_a_turning_ship_is_a_chord() {
        for (rate, speed, half_m) in [(0.05, 8.0, 400.0), (-0.1, 6.0, 400.0), (1.0, 5.0, 286.479)] {
            let (start, heading, time) = ([30.0, 40.0], 70.0, 20.0);
            let changes = [
                format!("ship.speed={speed}"),
                format!("ship.turn_rate={rate}"),
                format!("ship.heading={heading}"),
                "ship.position=[30, 40]".to_owned(),
                "ship.length=90".to_owned(),
                "radar.looks=50".to_owned(),
                format!("sea.time={time}"),
                "radar.range_resolution=10".to_owned(),
                "radar.azimuth_resolution=10".to_owned(),
                "grid.spacing=10".to_owned(),
            ];
            let scene = Scene::default()
                .with_assignments(&changes)
                .expect("a scene");
            let objects = wake_physics::labels_of(&scene).objects();
            assert!(objects.iter().any(|one| one.class == Class::Wake));
            assert_eq!(wakes(&objects, &scene).len(), 1, "{objects:?}");
            let walked = |seconds: f64| {
                const STEPS: usize = 1000;
                let step = seconds / STEPS as f64;
                (0..STEPS).fold(start, |[x, y]: [f64; 2], k| {
                    let along = f64::to_radians(heading + rate * (k as f64 + 0.5) * step);
                    [
                        x + speed * step * along.sin(),
                        y + speed * step * along.cos(),
                    ]
                })
            };
            let [wake] = wakes(&[], &scene)[..] else {
                panic!("one wake");
            };
            assert!(
                (f64::from(wake.length) - 80.0).abs() < 1e-4,
                "{}",
                wake.length
            );
            let pixel = |[x, y]: [f64; 2]| [256.0 + x / 10.0, 256.0 - y / 10.0];
            let stern = pixel(walked(time - 45.0 / speed));
            let there = pixel(walked(time - (45.0 + half_m) / speed));
            let off = |found: [f32; 2], [x, y]: [f64; 2]| {
                (f64::from(found[0]) - x).hypot(f64::from(found[1]) - y)
            };
            assert!(off(wake.tip, stern) < 1e-3, "{wake:?}");
            let chord = (there[0] - stern[0]).hypot(there[1] - stern[1]);
            assert!(off(wake.at(chord as f32), there) < 0.02, "{rate} {wake:?}");
        }
    }
}
