//! Training labels of a detector: boxes in COCO, YOLO and DOTA formats.

use serde::{Deserialize, Serialize};
use std::fmt::Write;
use wake_physics::labels::{Class, Labels};

/// A box (x, y, width, height) \[pixels\], from the upper left corner of the image.
pub(super) type Box2 = [f64; 4];

/// Corners (x, y) \[pixels\], from the upper left corner of the image; they may lie outside it.
pub(super) type Corners = [[f64; 2]; 4];

fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

/// Boxes and their classes, in the form that readers of image folders expect.
///
/// Labels count from the centre of the first pixel, boxes from its corner, half a pixel before, in steps of 0.01 pixels.
/// Only visible wakes and ships with an echo have a box, because nothing else can be detected.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Objects {
    /// (x, y, width, height) of each box \[pixels\].
    pub(super) bbox: Vec<Box2>,
    /// Corners of each box along the track: port ahead, starboard ahead, starboard astern, port astern.
    pub(super) oriented: Vec<Corners>,
    /// Class of each box: 0 wake, 1 ship.
    pub(super) categories: Vec<u32>,
}

impl Objects {
    /// Boxes of the visible objects of an image's labels.
    pub(super) fn of(labels: &Labels) -> Self {
        let mut objects = Self::default();
        for object in labels.objects() {
            let [x, y, w, h] = object.box_px;
            let bbox = [x + 0.5, y + 0.5, w, h].map(hundredths);
            // A sliver at the edge may be less than a hundredth of a pixel wide.
            if bbox[2] > 0.0 && bbox[3] > 0.0 {
                objects.bbox.push(bbox);
                let corners = object.oriented_box_px;
                objects
                    .oriented
                    .push(corners.map(|corner| corner.map(|v| hundredths(v + 0.5))));
                objects.categories.push(object.class.number());
            }
        }
        objects
    }
}

// COCO: `coco.json`.

/// The content of `coco.json`.
#[derive(Serialize)]
pub(super) struct Coco {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: [Category; 2],
}

#[derive(Serialize)]
struct Image {
    id: u64,
    file_name: String,
    width: usize,
    height: usize,
}

#[derive(Serialize)]
struct Annotation {
    /// Counted from 1: evaluation tools read 0 as "no match".
    id: u64,
    image_id: u64,
    category_id: u32,
    bbox: Box2,
    area: f64,
    iscrowd: u8,
}

#[derive(Serialize)]
struct Category {
    id: u32,
    name: &'static str,
}

impl Coco {
    /// Collects the labels of images of `[rows, columns]` pixels, each with its number and name.
    pub(super) fn of<'a>(
        images: impl Iterator<Item = (u64, &'a str, &'a Objects)>,
        [height, width]: [usize; 2],
    ) -> Self {
        let mut coco = Self {
            images: Vec::new(),
            annotations: Vec::new(),
            categories: [Class::Wake, Class::Ship].map(|class| Category {
                id: class.number(),
                name: class.name(),
            }),
        };
        for (image_id, file_name, objects) in images {
            coco.images.push(Image {
                id: image_id,
                file_name: file_name.to_owned(),
                width,
                height,
            });
            for (&category_id, &bbox) in objects.categories.iter().zip(&objects.bbox) {
                coco.annotations.push(Annotation {
                    id: coco.annotations.len() as u64 + 1,
                    image_id,
                    category_id,
                    bbox,
                    area: bbox[2] * bbox[3],
                    iscrowd: 0,
                });
            }
        }
        coco
    }
}

// YOLO: `labels/NAME.txt` beside `images/NAME.png`, and `data.yaml`.

/// Lines `class x y width height`, with centre and size as fractions of the image; empty without objects.
pub(super) fn yolo(objects: &Objects, [rows, columns]: [usize; 2]) -> String {
    let (height, width) = (rows as f64, columns as f64);
    let mut text = String::new();
    for (class, [x, y, w, h]) in objects.categories.iter().zip(&objects.bbox) {
        let (centre_x, centre_y) = ((x + 0.5 * w) / width, (y + 0.5 * h) / height);
        let (w, h) = (w / width, h / height);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{class} {centre_x:.6} {centre_y:.6} {w:.6} {h:.6}");
    }
    text
}

/// Lines `class x1 y1 x2 y2 x3 y3 x4 y4` of oriented boxes for YOLO, as fractions of the image. YOLO readers drop images
/// with corners outside, so such corners are moved to the nearest place in the image.
pub(super) fn yolo_oriented(objects: &Objects, [rows, columns]: [usize; 2]) -> String {
    let mut text = String::new();
    for (class, corners) in objects.categories.iter().zip(&objects.oriented) {
        let share = |value: f64, size: usize| (value / size as f64).clamp(0.0, 1.0);
        let _ = write!(text, "{class}");
        for [x, y] in corners {
            let _ = write!(text, " {:.6} {:.6}", share(*x, columns), share(*y, rows));
        }
        text.push('\n');
    }
    text
}

/// Lines `x1 y1 x2 y2 x3 y3 x4 y4 class difficult` of oriented boxes in the format of the DOTA data set, in pixels.
pub(super) fn dota(objects: &Objects) -> String {
    let mut text = String::new();
    for (&class, corners) in objects.categories.iter().zip(&objects.oriented) {
        for [x, y] in corners {
            let _ = write!(text, "{x:.2} {y:.2} ");
        }
        let name = match class == Class::Ship.number() {
            true => Class::Ship.name(),
            false => Class::Wake.name(),
        };
        let _ = writeln!(text, "{name} 0");
    }
    text
}

/// The content of `data.yaml`.
pub(super) fn data_yaml() -> String {
    let names: String = [Class::Wake, Class::Ship]
        .map(|class| format!("  {}: {}\n", class.number(), class.name()))
        .concat();
    format!(
        "# Lists of images beside this file; no scene is in both.\ntrain: trainset.txt\nval: valset.txt\nnames:\n{names}"
    )
}

#[cfg(test)]
mod tests {
    use super::super::layout::image_name;
    use super::*;
    use crate::{Recipe, Simulated};
    use wake_physics::labels::{LabelledShip, ShipLabel, WakeLabel};
    use wake_physics::labels_of;
    use wake_physics::scene::{Grid, Scene};

    /// 101 × 61 pixels of 20 m; a 200 m ship in the middle heads along azimuth.
    fn northward() -> Scene {
        let changes = ["ship.length=200", "ship.heading=0", "ship.speed=10"];
        let grid = Grid {
            rows: 101,
            columns: 61,
            spacing: 20.0,
            oversampling: None,
        };
        Scene {
            grid,
            ..Scene::default()
        }
        .with_assignments(&changes)
        .unwrap()
    }

    /// Labels with a wake and a ship, for an image of 101 × 61 pixels.
    fn drawn() -> Labels {
        let corners = [[29.35, 45.0], [30.65, 45.0], [30.65, 55.0], [29.35, 55.0]];
        Labels {
            ships: vec![LabelledShip {
                ship: ShipLabel {
                    echo_box_px: Some([29.35, 45.0, 1.3, 10.0]),
                    echo_oriented_box_px: Some(corners),
                    ..ShipLabel::default()
                },
                wake: WakeLabel {
                    axis_deg: Some(180.0),
                    half_angle_deg: Some(19.47),
                    box_px: Some([10.554_44, 45.0, 38.891_12, 55.0]),
                    oriented_box_px: Some(corners),
                    ..WakeLabel::default()
                },
            }],
            ..Labels::default()
        }
    }

    /// Labels count from the centre of the first pixel, boxes from its corner; steps of 0.01.
    #[test]
    fn boxes_are_those_of_the_labels_from_the_corner() {
        let objects = Objects::of(&drawn());
        assert_eq!(objects.categories, [0, 1]);
        let (wake, ship) = ([11.05, 45.5, 38.89, 55.0], [29.85, 45.5, 1.3, 10.0]);
        assert_eq!(objects.bbox, [wake, ship]);
        let corners = [[29.85, 45.5], [31.15, 45.5], [31.15, 55.5], [29.85, 55.5]];
        assert_eq!(objects.oriented, [corners; 2]);
        let mut sliver = drawn();
        sliver.ships[0].wake.box_px = Some([3.0, 4.0, 0.004, 9.0]);
        assert_eq!(Objects::of(&sliver).categories, [1]);
    }

    #[test]
    fn open_sea_and_ships_at_rest_have_no_wake() {
        let mut scene = northward();
        scene.ships[0].speed = 0.0;
        assert_eq!(Objects::of(&labels_of(&scene)), Objects::default());
        scene.ships.clear();
        assert_eq!(Objects::of(&labels_of(&scene)), Objects::default());
    }

    #[test]
    fn yolo_states_centres_and_sizes_as_shares() {
        let objects = Objects {
            bbox: vec![[10.0, 20.0, 30.0, 40.0], [0.0, 0.0, 200.0, 100.0]],
            oriented: vec![
                [[10.0, 20.0], [40.0, 20.0], [40.0, 60.0], [10.0, 60.0]],
                [[-20.0, 50.0], [100.0, -10.0], [220.0, 50.0], [100.0, 110.0]],
            ],
            categories: vec![0, 1],
        };
        let text = yolo(&objects, [100, 200]);
        assert_eq!(
            text,
            "0 0.125000 0.400000 0.150000 0.400000\n1 0.500000 0.500000 1.000000 1.000000\n"
        );
        assert_eq!(yolo(&Objects::default(), [100, 200]), "");
        let text = yolo_oriented(&objects, [100, 200]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "0 0.050000 0.200000 0.200000 0.200000 0.200000 0.600000 0.050000 0.600000"
        );
        assert_eq!(
            lines[1],
            "1 0.000000 0.500000 0.500000 0.000000 1.000000 0.500000 0.500000 1.000000"
        );
        assert_eq!(
            dota(&objects),
            "10.00 20.00 40.00 20.00 40.00 60.00 10.00 60.00 wake 0\n\
             -20.00 50.00 100.00 -10.00 220.00 50.00 100.00 110.00 ship 0\n"
        );
        assert!(data_yaml().ends_with("names:\n  0: wake\n  1: ship\n"));
    }

    #[test]
    fn coco_counts_from_one_and_points_to_images() {
        let images = [(4, drawn()), (5, Labels::default()), (6, drawn())]
            .map(|(index, labels)| (index, image_name(index), Objects::of(&labels)));
        let images = images
            .iter()
            .map(|(index, name, objects)| (*index, name.as_str(), objects));
        let coco = serde_json::to_value(Coco::of(images, [101, 61])).unwrap();
        for (at, index) in [(0, 4), (1, 5), (2, 6)] {
            let expected = serde_json::json!({
                "id": index, "file_name": image_name(index), "width": 61, "height": 101
            });
            assert_eq!(coco["images"][at], expected);
        }
        let annotations = coco["annotations"].as_array().unwrap();
        let of = |key: &str| -> Vec<u64> {
            annotations
                .iter()
                .map(|a| a[key].as_u64().unwrap())
                .collect()
        };
        assert_eq!(of("id"), [1, 2, 3, 4]);
        assert_eq!(of("image_id"), [4, 4, 6, 6]);
        assert_eq!(of("category_id"), [0, 1, 0, 1]);
        assert_eq!(of("iscrowd"), [0; 4]);
        for annotation in annotations {
            let number = |v: &serde_json::Value| v.as_f64().unwrap();
            let area = number(&annotation["bbox"][2]) * number(&annotation["bbox"][3]);
            assert!((number(&annotation["area"]) - area).abs() < 1e-9);
        }
        assert_eq!(
            coco["categories"],
            serde_json::json!([{"id": 0, "name": "wake"}, {"id": 1, "name": "ship"}])
        );
    }

    /// The boxes of any scene lie in the image, and the YOLO lines describe the same boxes.
    #[test]
    fn boxes_lie_in_the_image() {
        let source = Simulated::new(Recipe::default(), 2).unwrap();
        let mut wakes = 0;
        for index in 0..300 {
            let objects = Objects::of(&source.pair_without_image(index).unwrap().labels);
            let text = yolo(&objects, [256, 256]);
            assert_eq!(text.lines().count(), objects.bbox.len());
            for (line, [x, y, w, h]) in text.lines().zip(&objects.bbox) {
                let v: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
                let corners = [
                    v[1] - v[3] / 2.0,
                    v[2] - v[4] / 2.0,
                    v[1] + v[3] / 2.0,
                    v[2] + v[4] / 2.0,
                ];
                for (a, b) in corners.iter().zip([*x, *y, x + w, y + h]) {
                    // Six decimals of a fraction of 256, twice.
                    assert!((256.0 * a - b).abs() < 256.0 * 1e-6, "{line}");
                    assert!((0.5 - 0.01..=255.5 + 0.01).contains(&b), "{objects:?}");
                }
                assert!(*w > 0.0 && *h > 0.0);
                wakes += usize::from(v[0] < 0.5);
            }
        }
        // Four fifths have a ship; a wake has no box only where the ship is at the edge and the wake trails out of the image.
        assert!(wakes > 180, "{wakes}");
    }
}
