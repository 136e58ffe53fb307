//! What a detector learns from: boxes of the labels, in COCO and in YOLO form.

use serde::{Deserialize, Serialize};
use std::fmt::Write;
use wake_physics::labels::{Class, Labels};

/// A box (x, y, width, height) \[pixels\], from the upper left corner of the image.
pub(super) type Box2 = [f64; 4];

/// Class and box of what is seen in the image.
///
/// Labels count from the centre of the first pixel, boxes from its corner, half a pixel before. Steps of 0.01 pixels.
/// A wake has a box only where it can be seen, a ship only where its echo is drawn: what cannot be seen cannot be found.
fn boxes(labels: &Labels, echo: bool) -> Vec<(u32, Box2)> {
    let cornered = |[x, y, w, h]: Box2| [x + 0.5, y + 0.5, w, h].map(hundredths);
    labels
        .objects()
        .into_iter()
        .filter(|object| echo || object.class != Class::Ship)
        .map(|object| (object.class.number(), cornered(object.box_px)))
        .filter(|(_, [_, _, width, height])| *width > 0.0 && *height > 0.0)
        .collect()
}

fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

/// Boxes and their classes, as readers of image folders expect them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Objects {
    /// (x, y, width, height) of each box, from the corner of the image \[pixels\].
    pub(super) bbox: Vec<Box2>,
    /// Class of each: 0 wake, 1 ship.
    pub(super) categories: Vec<u32>,
}

impl Objects {
    /// What is seen of some labels; `echo`: whether the ship itself is drawn.
    pub(super) fn of(labels: &Labels, echo: bool) -> Self {
        let (categories, bbox) = boxes(labels, echo).into_iter().unzip();
        Self { bbox, categories }
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
    /// From 1: evaluation tools take 0 for "no match".
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
    /// The labels of some images, each with its number and its name, of `[rows, columns]` pixels.
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

/// The lines `class x y width height`, centre and size as shares of the image; empty without objects.
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

/// The content of `data.yaml`.
pub(super) fn data_yaml() -> String {
    let names: String = [Class::Wake, Class::Ship]
        .map(|class| format!("  {}: {}\n", class.number(), class.name()))
        .concat();
    format!(
        "# For validation name another set, made with another seed.\ntrain: images\nval: images\nnames:\n{names}"
    )
}

#[cfg(test)]
mod tests {
    use super::super::layout::image_name;
    use super::*;
    use crate::dataset::{Recipe, Simulated};
    use wake_physics::labels::{LabelledShip, ShipLabel, WakeLabel};
    use wake_physics::labels_of;
    use wake_physics::scene::{Grid, Scene};

    /// 101 × 61 pixels of 20 m; a 200 m ship heads along azimuth from the middle.
    fn northward() -> Scene {
        let changes = ["ship.length=200", "ship.heading=0", "ship.speed=10"];
        let grid = Grid {
            rows: 101,
            columns: 61,
            spacing: 20.0,
        };
        Scene {
            grid,
            ..Scene::default()
        }
        .with_assignments(&changes)
        .unwrap()
    }

    /// Labels with a wake and a ship, as of an image of 101 × 61 pixels.
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
        }
    }

    /// Labels count from the centre of the first pixel, boxes from its corner; steps of 0.01.
    #[test]
    fn boxes_are_those_of_the_labels_from_the_corner() {
        let wake = (0, [11.05, 45.5, 38.89, 55.0]);
        assert_eq!(boxes(&drawn(), false), [wake]);
        let ship = (1, [29.85, 45.5, 1.3, 10.0]);
        assert_eq!(boxes(&drawn(), true), [wake, ship]);
    }

    #[test]
    fn open_sea_and_ships_at_rest_have_no_wake() {
        let mut scene = northward();
        scene.ships[0].speed = 0.0;
        assert!(boxes(&labels_of(&scene), false).is_empty());
        scene.ships.clear();
        assert!(boxes(&labels_of(&scene), true).is_empty());
    }

    #[test]
    fn yolo_states_centres_and_sizes_as_shares() {
        let objects = Objects {
            bbox: vec![[10.0, 20.0, 30.0, 40.0], [0.0, 0.0, 200.0, 100.0]],
            categories: vec![0, 1],
        };
        let text = yolo(&objects, [100, 200]);
        assert_eq!(
            text,
            "0 0.125000 0.400000 0.150000 0.400000\n1 0.500000 0.500000 1.000000 1.000000\n"
        );
        assert_eq!(yolo(&Objects::default(), [100, 200]), "");
        assert!(data_yaml().ends_with("names:\n  0: wake\n  1: ship\n"));
    }

    #[test]
    fn coco_counts_from_one_and_points_to_images() {
        let images = [(4, drawn()), (5, Labels::default()), (6, drawn())]
            .map(|(index, labels)| (index, image_name(index), Objects::of(&labels, true)));
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

    /// Boxes of any scene lie in the image, and its YOLO line is the same box.
    #[test]
    fn boxes_lie_in_the_image() {
        let source = Simulated::new(Recipe::default(), 2).unwrap();
        let mut wakes = 0;
        for index in 0..300 {
            let objects = Objects::of(&source.pair_without_image(index).unwrap().labels, true);
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
                    // Six decimals of a share of 256, twice.
                    assert!((256.0 * a - b).abs() < 256.0 * 1e-6, "{line}");
                    assert!((0.5 - 0.01..=255.5 + 0.01).contains(&b), "{objects:?}");
                }
                assert!(*w > 0.0 && *h > 0.0);
                wakes += usize::from(v[0] < 0.5);
            }
        }
        // Four fifths have a ship; a wake is out of sight only where the ship has just left the image behind it.
        assert!(wakes > 180, "{wakes}");
    }
}
