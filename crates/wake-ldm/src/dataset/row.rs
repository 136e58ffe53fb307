//! One line of `metadata.jsonl`.

use super::boxes::{Box2, boxes};
use super::layout::image_name;
use super::pair::Pair;
use super::parameters::Parameters;
use serde::{Deserialize, Serialize};

/// One pair as a line of `metadata.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Path of the image, below the folder.
    pub(super) file_name: String,
    /// The prompt.
    pub(super) text: String,
    #[serde(flatten)]
    pub(super) parameters: Parameters,
    pub(super) objects: Objects,
}

/// Boxes and their classes, as readers of image folders expect them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Objects {
    /// (x, y, width, height) of each box, from the corner of the image \[pixels\].
    pub(super) bbox: Vec<Box2>,
    /// Class of each: 0 wake, 1 ship.
    pub(super) categories: Vec<u32>,
}

impl Row {
    /// The line of a pair; `echo`: whether the ship itself is drawn.
    pub(super) fn of(pair: &Pair, echo: bool) -> Self {
        let (categories, bbox) = boxes(&pair.labels, echo).into_iter().unzip();
        Self {
            file_name: image_name(pair.index),
            text: pair.prompt.clone(),
            parameters: pair.parameters,
            objects: Objects { bbox, categories },
        }
    }
}
