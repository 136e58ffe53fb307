//! Labels in COCO form: `coco.json`.

use super::boxes::Box2;
use super::row::Row;
use serde::Serialize;
use wake_physics::labels::Class;

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
    /// The labels of some rows with their indices; images of `[rows, columns]` pixels.
    pub(super) fn of(rows: &[(u64, Row)], [height, width]: [usize; 2]) -> Self {
        let image = |(id, row): &(u64, Row)| Image {
            id: *id,
            file_name: row.file_name.clone(),
            width,
            height,
        };
        Self {
            images: rows.iter().map(image).collect(),
            annotations: annotations(rows),
            categories: [Class::Wake, Class::Ship].map(|class| Category {
                id: class.number(),
                name: class.name(),
            }),
        }
    }
}

fn annotations(rows: &[(u64, Row)]) -> Vec<Annotation> {
    let boxes = rows.iter().flat_map(|(id, row)| {
        let objects = row.objects.categories.iter().zip(&row.objects.bbox);
        objects.map(move |(&class, &bbox)| (*id, class, bbox))
    });
    let annotation = |(id, (image_id, category_id, bbox)): (u64, (u64, u32, Box2))| Annotation {
        id,
        image_id,
        category_id,
        bbox,
        area: bbox[2] * bbox[3],
        iscrowd: 0,
    };
    (1..).zip(boxes).map(annotation).collect()
}
